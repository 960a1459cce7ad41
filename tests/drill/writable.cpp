// SPDX-License-Identifier: MIT
#include "writable.hpp"

#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace {

namespace fs = std::filesystem;

/// A folder of its own, gone at the end.
struct Scratch {
  fs::path path = fs::temp_directory_path() / "trephine_writable";
  Scratch() {
    fs::remove_all(path);
    fs::create_directories(path);
  }
  ~Scratch() { fs::remove_all(path); }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
};

std::string refusal(const fs::path& folder) {
  try {
    drill::require_writable_folder("--out", folder);
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "";
}

}  // namespace

TEST_CASE("a folder for results is made and left empty, a file as it was") {
  const Scratch scratch;
  const fs::path folder = scratch.path / "a" / "b";
  CHECK(refusal(folder) == "");
  CHECK(fs::is_empty(folder));
  CHECK(refusal(folder) == "");

  const fs::path file = scratch.path / "file";
  drill::require_writable_file("--record", file);
  CHECK_FALSE(fs::exists(file));
  std::ofstream(file) << "here";
  drill::require_writable_file("--record", file);
  std::ifstream in(file);
  CHECK(std::string(std::istreambuf_iterator<char>(in), {}) == "here");
}

TEST_CASE("what cannot be written is refused with option, path and reason, also for root") {
  const Scratch scratch;
  const fs::path file = scratch.path / "file";
  std::ofstream(file) << "here";
  CHECK(refusal(file).starts_with("--out " + file.string() + ": cannot be made ("));
  CHECK(refusal(file / "below").starts_with("--out " + (file / "below").string() + ": cannot be made ("));
  CHECK_THROWS_AS(drill::require_writable_file("--record", file / "below"), std::runtime_error);
  CHECK_THROWS_AS(drill::require_writable_file("--record", scratch.path), std::runtime_error);
  if (fs::exists("/proc/self")) CHECK(refusal("/proc").starts_with("--out /proc"));
}
