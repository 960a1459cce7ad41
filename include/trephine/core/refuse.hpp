// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/throwing.hpp>

#include <locale>
#include <sstream>
#include <stdexcept>
#include <string_view>

namespace trephine::inline TREPHINE_ALIGNED {

/// Throws std::invalid_argument "trephine::Type: rule, got value". Construction and editing call it; a tick never does.
template <class Value>
[[noreturn]] void refuse(std::string_view type, std::string_view rule, const Value& got) {
  std::ostringstream s;
  s.imbue(std::locale::classic());
  s << "trephine::" << type << ": " << rule << ", got " << got;
  throw_error<std::invalid_argument>(s.str());
}

/// Throws the same exception if a length [m] exceeds `max`, as a length meant in millimetres does.
inline void refuse_beyond(std::string_view type, std::string_view name, double max, double got) {
  if (got <= max) return;
  std::ostringstream rule;
  rule.imbue(std::locale::classic());
  rule << name << " must be at most " << max << " m (did you mean " << got << "_mm?)";
  refuse(type, rule.str(), got);
}

}  // namespace trephine
