// SPDX-License-Identifier: MIT
// Structures keep their order from the segmentation to the distances, whatever their labels.
#include "structure/phantom.hpp"
#include "support/near.hpp"

#include <trephine/core/units.hpp>
#include <trephine/structure/labelled_field.hpp>

#include <doctest/doctest.h>

#include <cstdint>
#include <vector>

using namespace trephine;
using namespace trephine::test;
using namespace trephine::literals;

TEST_CASE_TEMPLATE("a field's structures are those of its segmentation, in order", Label, std::uint8_t, std::uint16_t) {
  const LabelledTubes balls{.tubes = {{Vec3d::Constant(3_mm), Vec3d::Constant(3_mm), 1.5_mm},
                                      {Vec3d::Constant(8_mm), Vec3d::Constant(8_mm), 2_mm}},
                            .structure = {0, 1},
                            .size = {40, 40, 40}};
  // The second ball is listed first.
  const auto second = static_cast<Label>(7), first = static_cast<Label>(sizeof(Label) == 2 ? 60000 : 250);
  std::vector<Label> voxels;
  for (const std::uint8_t s : balls.labels()) voxels.push_back(s == 0 ? Label{0} : s == 1 ? first : second);
  const LabelGrid<Label> labels({.size = balls.size, .spacing = Vec3d::Constant(balls.voxel)}, voxels,
                                {{second, "far", {1, 0, 0}}, {first, "near", {0, 1, 0}}});
  const auto field = build_structure_field(labels, {.reach = 3_mm});
  REQUIRE(field != nullptr);
  CHECK(field->structures() == 2);
  const Vec3d p = Vec3d::Constant(3_mm) + Vec3d(2_mm, 0, 0);
  CHECK(field->nearest(p).structure == 1);
  CHECK(field->distance(1, p) == near(0.5_mm, 0.025));
  CHECK(field->nearest(Vec3d::Constant(8_mm)).structure == 0);
  BuildProgress cancelled;
  cancelled.cancel = true;
  CHECK(build_structure_field(labels, {}, &cancelled) == nullptr);
}
