// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace pick {

/// What printf prints, as a string.
#if defined(__GNUC__)
[[gnu::format(printf, 1, 2)]]
#endif
std::string
text(const char* format, ...);

}  // namespace pick
