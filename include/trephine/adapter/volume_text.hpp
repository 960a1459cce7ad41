// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/adapter/volume_options.hpp>

#include <algorithm>
#include <initializer_list>
#include <locale>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

/// Text of volume files and of messages about them, written and read alike under any locale of the host program.
namespace trephine::inline TREPHINE_ALIGNED::itk_detail {

/// Returns a text without control characters, which damaged headers bring into messages.
inline std::string one_line(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < ' ') c = '?';
  return text;
}

/// Throws VolumeError with a file and a reason.
[[noreturn]] inline void refuse_volume(const std::string& where, const std::string& what) {
  throw VolumeError(one_line("trephine::read_volume: " + where + ": " + what));
}

/// A text that numbers are written into, with a decimal point and without grouping.
class Text : public std::ostringstream {
 public:
  Text() { imbue(std::locale::classic()); }
};

/// Returns a text without spaces and control characters at its ends.
inline std::string trimmed(std::string_view text) {
  constexpr std::string_view kBlank(" \t\r\n\v\f\0", 7);
  const auto first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return "";
  return std::string(text.substr(first, text.find_last_not_of(kBlank) - first + 1));
}

inline std::string lower_case(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

/// Returns the words of a text, which blanks separate.
inline std::vector<std::string> words_of(const std::string& text) {
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

/// Returns the number that is the whole text, or nothing.
template <class Number = double>
std::optional<Number> number_of(const std::string& text) {
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  Number v{};
  if (!(in >> v) || !(in >> std::ws).eof()) return std::nullopt;
  if (std::is_unsigned_v<Number> && text.find('-') != std::string::npos) return std::nullopt;
  return v;
}

/// Returns the numbers of a text, which `separators` separate; nothing if one of them is no number.
inline std::optional<std::vector<double>> numbers_of(std::string text, std::string_view separators = " ") {
  for (char& c : text)
    if (separators.find(c) != std::string_view::npos) c = ' ';
  std::vector<double> numbers;
  for (const std::string& word : words_of(text)) {
    const auto v = number_of(word);
    if (!v) return std::nullopt;
    numbers.push_back(*v);
  }
  return numbers;
}

/// Returns the millimetres of a unit of length by its name in a header; nothing for an unknown one. A header without a
/// unit has millimetres, as all programs take it.
inline std::optional<double> millimetres_of(const std::string& unit) {
  const std::string u = lower_case(trimmed(unit));
  const auto is = [&u](std::initializer_list<std::string_view> names) {
    return std::find(names.begin(), names.end(), u) != names.end();
  };
  if (is({"", "?", "mm", "millimeter", "millimeters", "millimetre", "millimetres"})) return 1.0;
  if (is({"um", "\xC2\xB5m", "\xCE\xBCm", "\xB5m", "micron", "microns", "micrometer", "micrometers", "micrometre",
          "micrometres"}))
    return 1e-3;
  if (is({"nm", "nanometer", "nanometers", "nanometre", "nanometres"})) return 1e-6;
  if (is({"cm", "centimeter", "centimeters", "centimetre", "centimetres"})) return 10.0;
  if (is({"m", "meter", "meters", "metre", "metres"})) return 1e3;
  return std::nullopt;
}

}  // namespace trephine::itk_detail
