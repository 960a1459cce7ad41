// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/session/recorded_tick.hpp>
#include <trephine/session/session_file.hpp>
#include <trephine/session/session_log.hpp>

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <stdexcept>
#include <string>
#include <string_view>

namespace trephine::test {

/// The i-th tick of a session: each says which it is.
inline RecordedTick numbered(int i) {
  RecordedTick tick;
  const double t = 1e-3 * i;
  tick.dt = 1e-3;
  tick.input.spindle_on = i % 7 != 0;
  tick.input.X_WT.translation() = Vec3d(0.01 * std::sin(3 * t), 0.02 * std::cos(t), -1e-3 * t);
  tick.result.wrench.force = Vec3d(std::sin(40 * t), 0, 1.0 / 3.0 * i);
  tick.result.contact.count = i;
  return tick;
}

/// Where a log goes that stays in memory.
struct MemorySink {
  std::string& bytes;
  bool operator()(std::string_view more) const {
    bytes += more;
    return true;
  }
};

/// A file in the temporary directory, gone with the test. Its name is this process' own: the same tests may run beside
/// it, under another sanitizer.
struct SessionFile {
  std::filesystem::path path;
  explicit SessionFile(const std::string& name) {
    static const unsigned own = std::random_device()();
    path = std::filesystem::temp_directory_path() / (name + "_" + std::to_string(own));
  }
  ~SessionFile() { std::remove(path.string().c_str()); }
  SessionFile(const SessionFile&) = delete;
  SessionFile& operator=(const SessionFile&) = delete;

  [[nodiscard]] std::string bytes() const {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }
  void write(const std::string& bytes) const {
    std::ofstream out(path, std::ios::binary | std::ios::trunc);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
  [[nodiscard]] Session load_of(const std::string& bytes) const {
    write(bytes);
    return load_session(path);
  }
  /// Why the file is refused; "none" if it is read.
  [[nodiscard]] std::string complaint(const std::string& bytes) const {
    write(bytes);
    try {
      (void)load_session(path);
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "none";
  }
};

}  // namespace trephine::test
