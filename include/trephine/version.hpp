// SPDX-License-Identifier: MIT
#pragma once

namespace trephine {

inline constexpr int kVersionMajor = 0;
inline constexpr int kVersionMinor = 2;
inline constexpr int kVersionPatch = 0;

}  // namespace trephine
