// SPDX-License-Identifier: MIT
#pragma once

#include "sweep/row.hpp"

#include <vector>

namespace trephine::bench {

/// One setting in one image of one scenario.
struct Job {
  std::string scenario;
  Image image;
  Setting setting;
  [[nodiscard]] std::string name() const;
};

/// What is measured: every factor one at a time round the default, every image at the defaults, and seeded random
/// combinations. Ordered so that jobs in the same image follow each other. `quick`: the factors' ends and middle.
[[nodiscard]] std::vector<Job> make_plan(bool quick);

}  // namespace trephine::bench
