// SPDX-License-Identifier: MIT
#pragma once

#include <sstream>
#include <stdexcept>
#include <string_view>

namespace trephine {

/// Throws std::invalid_argument "trephine::Type: rule, got value". For construction and editing; never called in a
/// tick.
template <class Value>
[[noreturn]] void refuse(std::string_view type, std::string_view rule, const Value& got) {
  std::ostringstream s;
  s << "trephine::" << type << ": " << rule << ", got " << got;
  throw std::invalid_argument(s.str());
}

/// The same for a length [m] that is more than `most`, as one is that was meant in millimetres.
inline void refuse_beyond(std::string_view type, std::string_view name, double most, double got) {
  if (got <= most) return;
  std::ostringstream rule;
  rule << name << " must be at most " << most << " m (did you mean " << got << "_mm?)";
  refuse(type, rule.str(), got);
}

}  // namespace trephine
