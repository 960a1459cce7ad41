// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/throwing.hpp>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

/// Binary files that are made in memory and written at once. Not for the haptic thread.
namespace trephine::inline TREPHINE_ALIGNED {

/// A path in a message: as UTF-8, which every path has.
[[nodiscard]] inline std::string path_text(const std::filesystem::path& path) {
  const std::u8string text = path.u8string();
  return {text.begin(), text.end()};
}

/// Appends a number as it lies in memory, in this machine's byte order.
template <class Number>
void append_number(std::string& bytes, const Number& number) {
  static_assert(std::is_arithmetic_v<Number>);
  char raw[sizeof(Number)];
  std::memcpy(raw, &number, sizeof(Number));
  bytes.append(raw, sizeof(Number));
}

/// Writes a file and replaces it if it exists. Throws std::runtime_error "trephine::FUNCTION: cannot write PATH".
inline void write_file(const std::filesystem::path& path, std::string_view function, const std::string& bytes) {
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out) throw_error<std::runtime_error>("trephine::" + std::string(function) + ": cannot write " + path_text(path));
}

}  // namespace trephine
