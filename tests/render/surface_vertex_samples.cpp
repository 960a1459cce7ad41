// SPDX-License-Identifier: MIT
#include "render/render_helpers.hpp"
#include "support/near.hpp"

#include <trephine/render/surface/vertex_samples.hpp>

#include <doctest/doctest.h>

/// The broad phase of the Surface approximation against brute force over all vertices.
namespace {

using namespace trephine;
using namespace trephine::test;

template <class Scalar>
using Tool = ToolDiscretization<SurfaceCounts, Scalar>;

TEST_CASE_TEMPLATE("a tool that is passed over has no vertex in bone", Scalar, float, double) {
  const Tool<Scalar> tool(Burr{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.02},
                          {.sphere = 60, .slices = 40, .per_slice = 8});
  // Bone that the volume's side cuts off.
  const RasterOptions o{.size = {40, 40, 40}};
  const Ball bone{Vec3d(0.001, 0.006, 0.006), 0.004};
  const auto grid = rasterise<std::uint8_t>(bone, o);
  const auto field = field_of<Scalar>(grid, o);
  VertexSamples<Scalar> samples(tool);
  Random random(5);
  int skipped = 0, touching = 0;
  for (int n = 0; n < 2000; ++n) {
    const Pose<Scalar> X(random_pose(random, bone.centre, 0.03).template cast<Scalar>());
    bool in_bone = false;
    for (int i = 0; i < tool.count(); ++i) in_bone = in_bone || field.value(X * tool.points()[i]) >= Scalar(0);
    touching += in_bone ? 1 : 0;
    if (!samples.update(field, tool, X)) {
      ++skipped;
      REQUIRE_FALSE(in_bone);
      continue;
    }
    for (int i = 0; i < tool.count(); ++i)
      REQUIRE(static_cast<double>(samples[i]) ==
              within(static_cast<double>(field.value(X * tool.points()[i])), 2e-3));  // of 255 densities
  }
  CHECK(touching > 100);
  CHECK(skipped > 200);
}

}  // namespace
