// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <vector>

/// A single-stroke font, for labels in pictures: capitals 8 units high, x-height 5, descenders to -2.
namespace drill {

inline constexpr float kCapitalHeight = 8;

using Stroke = std::vector<Eigen::Vector2f>;

/// The strokes of a printable ASCII character, y up from the baseline; none for a space or a character it lacks.
[[nodiscard]] std::vector<Stroke> glyph(char c);
/// How far the next character is, in the same units.
[[nodiscard]] float glyph_advance(char c);

}  // namespace drill
