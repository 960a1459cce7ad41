// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace drill {

/// Whether this build can write PNG files (libpng).
[[nodiscard]] bool can_write_png() noexcept;
/// Writes rows of 8-bit sRGB triples, top row first. Throws std::runtime_error with path and reason where the file
/// cannot be written, and std::invalid_argument where `rgb` holds another number of bytes.
void write_png(int width, int height, std::span<const std::uint8_t> rgb, const std::string& path);

}  // namespace drill
