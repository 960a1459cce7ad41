// SPDX-License-Identifier: MIT
#include "shared.hpp"

double height_above(const trephine::VoxelGrid<float>& bone, const trephine::TickInput& input) {
  return (bone.X_WG().inverse() * input.X_WT.translation()).z();
}
