// SPDX-License-Identifier: MIT
#pragma once
#include <vector>
struct Length {
  std::vector<double> metres;
};
