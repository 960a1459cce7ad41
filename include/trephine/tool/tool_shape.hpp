// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/shape.hpp>

#include <concepts>

namespace trephine {

/// What a coupled tool asks of the body that it is: the burr that carving takes it for.
// clang-format off
template <class T>
concept ToolShape = requires(const T& shape) {
  { shape.burr() } noexcept -> std::same_as<const Burr&>;
};
// clang-format on

}  // namespace trephine
