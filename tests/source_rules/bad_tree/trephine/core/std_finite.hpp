// SPDX-License-Identifier: MIT
#pragma once
inline bool good(double v) { return std::isfinite(v); }
