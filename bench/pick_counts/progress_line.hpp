// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <string>

namespace pick {

/// Says on standard error how far a part of the work is and how long it will still take: a line that is written over on
/// a terminal, one every few seconds elsewhere.
class ProgressLine {
 public:
  ProgressLine();
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  /// `share` of `part` is done, 0 to 1.
  void operator()(const std::string& part, double share);

 private:
  using Clock = std::chrono::steady_clock;
  void end_line();

  bool terminal_;
  bool open_ = false;
  std::string part_;
  Clock::time_point start_{}, written_{};
};

}  // namespace pick
