// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>

namespace drill {

/// A file of comma-separated values with a header line. Numbers are written so that reading them gives the same float.
class Csv {
 public:
  /// Throws std::runtime_error with path and reason where the file cannot be opened.
  Csv(const std::string& path, const std::string& header);
  /// Writes what is left. Throws std::runtime_error where the disk did not take it all.
  void close();

  /// One line; a vector is three values.
  template <class First, class... Rest>
  void row(const First& first, const Rest&... rest) {
    value(first);
    ((put(","), value(rest)), ...);
    put("\n");
  }

 private:
  struct Closer {
    void operator()(std::FILE* f) const { std::fclose(f); }
  };

  void put(const char* text) { std::fputs(text, file_.get()); }
  void value(double v) { std::fprintf(file_.get(), "%.9g", v); }
  void value(int v) { std::fprintf(file_.get(), "%d", v); }
  void value(std::int64_t v) { std::fprintf(file_.get(), "%lld", static_cast<long long>(v)); }
  void value(const char* v) { put(v); }
  void value(const trephine::Vec3d& v) {
    value(v.x());
    put(",");
    value(v.y());
    put(",");
    value(v.z());
  }

  std::string path_;
  std::unique_ptr<std::FILE, Closer> file_;
};

}  // namespace drill
