// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <string>

namespace trephine::bench {

/// Text as a CSV file may hold it.
[[nodiscard]] inline std::string without_commas(std::string text) {
  std::replace(text.begin(), text.end(), ',', ';');
  return text;
}

/// A CSV file in the making: `Table t(path, "a,b"); t.row(1, "x");`
class Table {
 public:
  /// `append`: after the rows of a file that has the header already.
  Table(const std::string& path, const std::string& header, bool append = false)
      : out_(path, append ? std::ios::app : std::ios::out), path_(path) {
    if (!append) row(header);
  }
  template <class First, class... Rest>
  void row(const First& first, const Rest&... rest) {
    out_ << first;
    ((out_ << ',' << rest), ...);
    out_ << '\n';
    if (!out_) throw std::runtime_error("cannot write " + path_);
  }

 private:
  std::ofstream out_;
  std::string path_;
};

}  // namespace trephine::bench
