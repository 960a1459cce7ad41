// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

#include <locale>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>

/// Numbers as text with a decimal point, whatever locale the host has set: Qt sets the user's in C, others in C++. Not
/// std::from_chars, which libc++ lacks for floating point. They allocate.
namespace trephine::inline TREPHINE_ALIGNED {

/// The number that `text` is as a whole, without spaces; none if it is no decimal number or out of a double's range.
[[nodiscard]] inline std::optional<double> parse_number(std::string_view text) {
  // libc++'s streams also read hexadecimal numbers, nan and inf.
  if (text.find_first_not_of("+-.0123456789eE") != std::string_view::npos) return std::nullopt;
  std::istringstream in{std::string(text)};
  in.imbue(std::locale::classic());
  double value = 0;
  in >> std::noskipws >> value;
  if (in.fail() || in.peek() != std::istringstream::traits_type::eof()) return std::nullopt;
  return value;
}

/// A number in up to `digits` significant digits, without zeros at its end.
[[nodiscard]] inline std::string number_text(double value, int digits = 6) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(digits);
  out << value;
  return out.str();
}

}  // namespace trephine
