// SPDX-License-Identifier: MIT
#pragma once

#include <cstdio>
#include <string>

namespace drill {

/// Prints what must hold, a line each, and counts what does not.
class Checks {
 public:
  Checks() { std::printf("\nchecks\n"); }
  void expect(bool holds, const std::string& what) {
    std::printf("  %-6s %s\n", holds ? "ok" : "FAILED", what.c_str());
    failed_ += holds ? 0 : 1;
  }
  [[nodiscard]] int failed() const noexcept { return failed_; }

 private:
  int failed_ = 0;
};

}  // namespace drill
