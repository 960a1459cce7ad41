// SPDX-License-Identifier: MIT
#include "shared.hpp"

#include <vector>

int main() {
  using namespace trephine;
  const VoxelGrid<float> bone({.size = {4, 4, 4}, .spacing = {1e-3, 1e-3, 1e-3}}, std::vector<float>(64));
  TickInput input;
  input.X_WT.translation().z() = 2;
  return height_above(bone, input) == 2 ? 0 : 1;
}
