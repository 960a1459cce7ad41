// SPDX-License-Identifier: MIT
#include "render/render_helpers.hpp"
#include "support/near.hpp"

#include <trephine/render/surface/vertex_samples.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>

/// The broad phase of the Surface approximation against brute force over all vertices and patches.
namespace {

using namespace trephine;
using namespace trephine::test;

template <class Scalar>
using Tool = ToolDiscretization<SurfaceCounts, Scalar>;

/// A shape's field that gives a fraction of its signed distance as clearance.
template <class Base>
struct ClearField : CountingField<Base> {
  using Scalar = typename Base::Scalar;
  using CountingField<Base>::CountingField;
  Scalar fraction = 1;
  [[nodiscard]] Scalar clearance_at(const Vec3<Scalar>& p) const noexcept {
    return fraction * std::max(Scalar(0), -this->value(p) * this->voxel());
  }
};

template <class Scalar, bool kPatches>
void check_samples() {
  const Tool<Scalar> tool(Burr{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.02},
                          {.sphere = 60, .slices = 40, .per_slice = 8});
  const Ball bone{Vec3d(0.001, -0.002, 0.003), 0.006};
  const ShapeField<Scalar, Ball> field(bone, kVoxel);
  ClearField<ShapeField<Scalar, Ball>> clear(field);
  VertexSamples<Scalar, kPatches> samples(tool);
  const auto reach = [&](int i) {
    return kPatches && i < tool.periphery() ? static_cast<double>(tool.patch(i).reach()) : 0.0;
  };
  Random random(5);
  int skipped = 0, partly = 0, touching = 0;
  for (int n = 0; n < 2000; ++n) {
    clear.fraction = static_cast<Scalar>(random.uniform(0.3, 1));
    const Vec3d tip = bone.centre + random.arrow(0.002, 0.016);
    const Pose<Scalar> X(tool_at(tip, random.unit()).template cast<Scalar>());
    // Smallest distance of bone beyond the reach of vertices or their patches.
    double gap = 1;
    bool in_bone = false;
    for (int i = 0; i < tool.count(); ++i) {
      const double distance = bone((X * tool.points()[i]).template cast<double>());
      in_bone = in_bone || distance <= 0;
      gap = std::min(gap, distance - reach(i));
    }
    const bool may_touch = samples.update(clear, tool, X);
    if (!may_touch) REQUIRE(gap > 0);
    touching += in_bone ? 1 : 0;
    skipped += may_touch ? 0 : 1;
    if (!may_touch) continue;
    int unsampled = 0;
    for (int i = 0; i < tool.count(); ++i) {
      const Vec3<Scalar> p = X * tool.points()[i];
      if (samples[i] == std::numeric_limits<Scalar>::lowest()) {
        ++unsampled;
        // A vertex without a sample is outside bone, and bone is out of its patch's reach.
        REQUIRE(bone(p.template cast<double>()) > reach(i));
      } else {
        REQUIRE(static_cast<double>(samples[i]) == within(static_cast<double>(field.value(p)), 1e-5));
      }
    }
    partly += unsampled > 0 ? 1 : 0;
  }
  // All cases occur.
  CHECK(touching > 200);
  CHECK(skipped > 200);
  CHECK(partly > 200);
}

TEST_CASE_TEMPLATE("a group without samples has no bone in its reach", Scalar, float, double) {
  check_samples<Scalar, false>();
  check_samples<Scalar, true>();
}

}  // namespace
