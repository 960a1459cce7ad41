// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <ostream>
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

}  // namespace trephine::test
