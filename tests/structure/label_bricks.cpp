// SPDX-License-Identifier: MIT
#include "support/random.hpp"

#include <trephine/structure/label_bricks.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;
using trephine::detail::LabelBricks;
using trephine::detail::LatticeBox;

TEST_CASE("label bricks: boxes and labels are those that voxels have, one by one") {
  Random random(416);
  for (int n = 0; n < 20; ++n) {
    const std::array<int, 3> size{1 + random.below(30), 1 + random.below(30), 1 + random.below(30)};
    std::vector<std::uint8_t> labels(static_cast<std::size_t>(size[0] * size[1] * size[2]));
    // Labels of all four words of a brick's bits, some absent.
    for (int i = 0; i < 6; ++i)
      labels[static_cast<std::size_t>(random.below(static_cast<int>(labels.size())))] =
          static_cast<std::uint8_t>(std::array{1, 3, 64, 127, 130, 255}[static_cast<std::size_t>(i)]);
    const LabelVolume volume{size, Vec3d::Ones(), labels};
    const LabelBricks bricks(volume);
    CHECK(bricks.structures() == *std::max_element(labels.begin(), labels.end()));
    for (std::size_t s = 0; s < bricks.structures(); ++s) {
      LatticeBox box{size, {-1, -1, -1}};
      for (int k = 0; k < size[2]; ++k)
        for (int j = 0; j < size[1]; ++j)
          for (int i = 0; i < size[0]; ++i) {
            if (volume.at(i, j, k) != s + 1) continue;
            const std::array<int, 3> at{i, j, k};
            for (std::size_t a = 0; a < 3; ++a) {
              box.lo[a] = std::min(box.lo[a], at[a]);
              box.hi[a] = std::max(box.hi[a], at[a]);
            }
          }
      CHECK(bricks.box(s).lo == box.lo);
      CHECK(bricks.box(s).hi == box.hi);
    }
    for (int query = 0; query < 200; ++query) {
      LatticeBox box;
      for (std::size_t a = 0; a < 3; ++a) {
        box.lo[a] = random.below(size[a] + 20) - 10;
        box.hi[a] = box.lo[a] + random.below(20);
      }
      const auto label = static_cast<std::uint8_t>(random.below(4) == 0 ? 0 : random.below(256));
      // Whole bricks of the volume that meet the box, and for label 0 what lies beyond the volume.
      bool has = false;
      const auto in_bricks = [](int from, int to, int at) { return from >> 3 <= at >> 3 && at >> 3 <= to >> 3; };
      for (int k = 0; k < size[2]; ++k)
        for (int j = 0; j < size[1]; ++j)
          for (int i = 0; i < size[0]; ++i)
            has = has || (volume.at(i, j, k) == label && in_bricks(box.lo[0], box.hi[0], i) &&
                          in_bricks(box.lo[1], box.hi[1], j) && in_bricks(box.lo[2], box.hi[2], k) &&
                          box.lo[0] < size[0] && box.lo[1] < size[1] && box.lo[2] < size[2]);
      for (std::size_t a = 0; a < 3; ++a) has = has || (label == 0 && (box.lo[a] < 0 || box.hi[a] >= size[a]));
      CHECK(bricks.has(box, label) == has);
    }
  }
}

}  // namespace
