// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <fstream>
#include <ostream>
#include <string>
#include <vector>

namespace trephine::test {

/// Figures of many cases, printed as their median and worst (greatest).
class Figures {
 public:
  void add(double v) { all_.push_back(v); }
  [[nodiscard]] std::size_t count() const { return all_.size(); }
  [[nodiscard]] const std::vector<double>& all() const { return all_; }
  [[nodiscard]] double share(double s) const {
    if (all_.empty()) return 0;
    std::vector<double> sorted = all_;
    std::sort(sorted.begin(), sorted.end());
    return sorted[std::min(sorted.size() - 1, static_cast<std::size_t>(s * static_cast<double>(sorted.size())))];
  }
  [[nodiscard]] double median() const { return share(0.5); }
  [[nodiscard]] double worst() const { return share(1); }
  [[nodiscard]] double least() const { return share(0); }
  friend std::ostream& operator<<(std::ostream& out, const Figures& f) {
    return out << "median " << f.median() << ", worst " << f.worst() << " of " << f.count();
  }

 private:
  std::vector<double> all_;
};

/// Tells a figure of bench/figures/TABLE.csv, whole in the row's unit, to the file that the environment's
/// TREPHINE_FIGURES names, if it does; `bench/report/figures.py` reads it.
inline void documented(const std::string& table, const std::string& row, double value) {
  static std::ofstream file = [] {
    const char* const path = std::getenv("TREPHINE_FIGURES");
    return path != nullptr ? std::ofstream(path) : std::ofstream();
  }();
  if (file.is_open()) file << table << '\t' << row << '\t' << value << std::endl;
}
inline void documented(const std::string& table, const std::string& row, const Figures& f, double factor = 1) {
  documented(table, row + " / Median", factor * f.median());
  documented(table, row + " / Worst", factor * f.worst());
}

}  // namespace trephine::test
