// SPDX-License-Identifier: MIT
// Maps of tissues from labels: each voxel against the label at its place.
#include "structure/phantom.hpp"
#include "support/random.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/core/units.hpp>
#include <trephine/structure/tissues.hpp>

#include <doctest/doctest.h>

#include <array>
#include <vector>

using namespace trephine;
using namespace trephine::test;
using namespace trephine::literals;

namespace {

LabelGrid<std::uint16_t> layers(const Posed& X_WS) {
  std::vector<std::uint16_t> voxels;
  for (int k = 0; k < 20; ++k)
    for (int j = 0; j < 24; ++j)
      for (int i = 0; i < 28; ++i) voxels.push_back(k < 8 ? 0 : (i + j < 20 ? 300 : 7));
  return {{.size = {28, 24, 20}, .spacing = Vec3d(0.5_mm, 0.4_mm, 0.6_mm), .X_WG = X_WS},
          voxels,
          {{.label = 300, .name = "enamel"}, {.label = 7, .name = "dentine"}}};
}

VoxelGrid<std::int16_t> block() {
  const std::vector<std::int16_t> voxels(30 * 31 * 32, 1200);
  return {{.size = {30, 31, 32},
           .spacing = Vec3d::Constant(0.3_mm),
           .X_WG = make_pose<double>(rotation_from_vector<double>(Vec3d(0.3, 0.1, -0.2)), Vec3d(0.01, 0, 0))},
          voxels};
}

}  // namespace

TEST_CASE("each voxel of the bone has the rate of the label at its place") {
  const auto bone = block();
  const auto labels =
      layers(make_pose<double>(rotation_from_vector<double>(Vec3d(-0.2, 0.4, 0.1)), Vec3d(0.009, 0, 0)));
  const std::array<Tissue, 3> tissues{Tissue{300, 0.125}, Tissue{0, 3}, Tissue{7, 0.5}};
  const auto map = make_tissue_map(labels, bone, tissues);
  int wrong = 0;
  std::array<int, 3> found{};
  for (int k = 0; k < 32; ++k)
    for (int j = 0; j < 31; ++j)
      for (int i = 0; i < 30; ++i) {
        const Vec3d p_W = bone.X_WG() * Vec3d(0.3_mm * i, 0.3_mm * j, 0.3_mm * k);
        const int label = labels.label_at(labels.X_WS().inverse() * p_W);
        const std::size_t n = label == 300 ? 0 : label == 0 ? 1 : 2;
        ++found[n];
        wrong += map->rate_at(i, j, k) != tissues[n].rate;
      }
  CHECK(wrong == 0);
  for (const int n : found) CHECK(n > 1000);
  CHECK(make_tissue_map(labels, bone, std::array{Tissue{300, 0.5}})->rate_at(0, 0, 0) == 1);
}

TEST_CASE("tissues that labels do not list are refused") {
  const auto bone = block();
  const auto labels = layers(Posed::Identity());
  CHECK_THROWS_AS((void)make_tissue_map(labels, bone, std::array{Tissue{8, 1}}), std::invalid_argument);
  CHECK_THROWS_AS((void)make_tissue_map(labels, bone, std::array{Tissue{7, 1}, Tissue{7, 2}}), std::invalid_argument);
  CHECK_THROWS_AS((void)make_tissue_map(labels, bone, std::array{Tissue{7, 0}}), std::invalid_argument);
}
