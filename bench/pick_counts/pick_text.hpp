// SPDX-License-Identifier: MIT
#pragma once

#include <cstdio>
#include <string>

namespace pick {

/// What printf prints, as a string.
#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-security"
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
#endif
template <class... Values>
[[nodiscard]] std::string text(const char* format, const Values&... values) {
  std::string out(static_cast<std::size_t>(std::snprintf(nullptr, 0, format, values...)), '\0');
  std::snprintf(out.data(), out.size() + 1, format, values...);
  return out;
}
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

}  // namespace pick
