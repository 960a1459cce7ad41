// SPDX-License-Identifier: MIT
#pragma once

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>

/// Whether results can be kept, asked before the work: nobody waits for those that cannot.
namespace drill {

namespace detail {

/// The reason why the file cannot be written, or nothing. What it holds stays; one that was not there is not left.
inline std::string why_not_written(const std::filesystem::path& file) {
  std::error_code unknown;
  const bool was_there = std::filesystem::exists(file, unknown);
  errno = 0;
  if (!std::ofstream(file, std::ios::app).is_open()) return std::strerror(errno);
  if (!was_there) std::filesystem::remove(file, unknown);
  return {};
}

}  // namespace detail

/// Tries the file, and leaves it as it was. Throws std::runtime_error in one line: the option that names it, the path,
/// the reason.
inline void require_writable_file(const std::string& option, const std::filesystem::path& file) {
  const std::string reason = detail::why_not_written(file);
  if (!reason.empty()) throw std::runtime_error(option + " " + file.string() + ": cannot be written (" + reason + ")");
}

/// Makes the folder, and those above it, where they are missing, and tries a file in it. Throws likewise.
inline void require_writable_folder(const std::string& option, const std::filesystem::path& folder) {
  std::error_code error, unknown;
  std::filesystem::create_directories(folder, error);
  const std::string failed = option + " " + folder.string() + ": cannot be ";
  if (!std::filesystem::is_directory(folder, unknown))
    throw std::runtime_error(failed + "made (" + (error ? error.message() : "a file has that name") + ")");
  const std::string reason = detail::why_not_written(folder / "trephine_tries_to_write");
  if (!reason.empty()) throw std::runtime_error(failed + "written (" + reason + ")");
}

}  // namespace drill
