// SPDX-License-Identifier: MIT
#include "text.hpp"

#include <cstdarg>
#include <cstdio>

namespace pick {

std::string text(const char* format, ...) {
  std::va_list arguments, again;
  va_start(arguments, format);
  va_copy(again, arguments);
  const int length = std::vsnprintf(nullptr, 0, format, arguments);
  va_end(arguments);
  std::string out(length > 0 ? static_cast<std::size_t>(length) : 0, '\0');
  // Its last character is already a zero, and vsnprintf writes one there.
  std::vsnprintf(out.data(), out.size() + 1, format, again);
  va_end(again);
  return out;
}

}  // namespace pick
