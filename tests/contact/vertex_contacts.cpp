// SPDX-License-Identifier: MIT
#include "support/raster.hpp"

#include <trephine/contact/depth_field.hpp>
#include <trephine/contact/vertex_contacts.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

// What passes over vertices that are known to be far, against one that knows nothing at any pose: to the bit, along
// walks small and large, while the bone is cut away and put back.
TEST_CASE_TEMPLATE("passing over far vertices changes no contact", Vertices, GlidingVertices, FixedVertices) {
  using Contacts = VertexContacts<float, Vertices>;
  const RasterOptions o{.size = {40, 40, 40}};
  const Ball ball{o.middle(), 0.0035};
  const auto bone = rasterise<std::uint8_t>(ball, o);
  const Burr burr{.tip_radius = 0.0012, .shaft_radius = 0.0006, .shaft_length = 0.012};
  Random random(91);
  std::size_t found = 0, near = 0;
  int differ = 0, shortened = 0;
  for (const SurfaceCounts counts :
       {SurfaceCounts::thesis(), SurfaceCounts{.sphere = 5, .slices = 1, .per_slice = 3}}) {
    DepthMap map(bone, o.isovalue(), {.keep_original = true});
    const DepthField<float> field(map);
    const ToolDiscretization<SurfaceCounts, float> tool(burr, counts);
    Contacts knows(tool), knows_not(tool);
    Posed X = Posed::Identity();
    for (int i = 0; i < 30000; ++i) {
      if (i % 50 == 0) {
        const Vec3d out = random.unit();
        X = make_pose<double>(random.rotation(),
                              o.middle() + (ball.radius + random.uniform(-0.5, 3) * burr.tip_radius) * out);
      }
      const double step = i % 100 < 50 ? 3e-5 : 5e-4;
      X = make_pose<double>(rotation_from_vector(Vec3d(step / 0.001 * random.unit())) * X.linear(),
                            X.translation() + step * random.unit());
      if (i % 300 == 5) map.cut(SphereCutter(X.translation(), X.translation(), 2 * burr.tip_radius));
      if (i % 300 == 20) map.restore();
      knows.look(field, tool, X);
      knows_not.forget();
      knows_not.look(field, tool, X);
      const auto same = [](const VertexContact& a, const VertexContact& b) {
        return a.vertex == b.vertex && a.depth == b.depth && a.out == b.out && a.lever == b.lever;
      };
      differ += std::ranges::equal(knows.near(), knows_not.near(), same) ? 0 : 1;
      differ += knows.found().size() == knows_not.found().size() ? 0 : 1;
      // What it holds for free is. Asked for more than it remembers it looks, and knows as much as who never passes
      // over any; what touches stays.
      Contacts asked = knows;
      const double way = random.uniform(0, 2e-3), turn = random.uniform(0, 0.02);
      const double share = asked.free_share(field, tool, way, turn, 5e-5);
      const double whole = knows_not.free_share(field, tool, way, turn, 5e-5);
      differ += share < 1 ? (share == whole ? 0 : 1) : (whole == 1 ? 0 : 1);
      differ += std::ranges::equal(asked.near(), knows.near(), same) ? 0 : 1;
      shortened += share < 1 ? 1 : 0;
      found += knows.found().empty() ? 0 : 1;
      near += knows.near().size();
    }
  }
  MESSAGE(found, " of 60000 poses in contact, ", near, " places near");
  CHECK(differ == 0);
  CHECK(shortened > 1000);
  CHECK(found > 10000);
  CHECK(found < 50000);
}

// In a pit rough as voxels are, a patch has several deepest places, found by where gradients lead; and one that was
// deepest may come to lie on the slope to a deeper one. Depth changes by no more than the tool moves, here .033 voxels
// at a time and tick; and places nearer to each other than a tenth of a voxel are the same, one as good as the other,
// so what is found may be less deep by that much. What is lost is lost by more: by the depth of the place.
TEST_CASE("a place once found stays found as the tool moves on") {
  const RasterOptions o{.size = {40, 40, 40}};
  const auto bone = rasterise<std::uint8_t>(HalfSpace{o.middle(), Vec3d::UnitZ()}, o);
  DepthMap map(bone, o.isovalue());
  const DepthField<float> field(map);
  const Burr burr{.tip_radius = 0.0009, .shaft_radius = 0.0004, .shaft_length = 0.01};  // three voxels
  const Vec3d bottom = o.middle() - Vec3d(0, 0, 0.0008);
  for (const Vec3d& beside : {Vec3d(0, 0, 0), Vec3d(3e-4, 1e-4, 1e-4), Vec3d(-2e-4, 3e-4, 0)})
    map.cut(SphereCutter(o.middle() + Vec3d(0, 0, 0.003) + beside, bottom + beside, burr.tip_radius));
  const ToolDiscretization<SurfaceCounts, float> tool(burr, SurfaceCounts::thesis());
  VertexContacts<float> contacts(tool);
  Random random(7);
  const double kClose = 0.5 * o.spacing.x();
  std::vector<VertexContact> before;
  std::vector<double> lost;
  for (int walk = 0; walk < 40; ++walk) {
    Vec3d p = bottom + 3e-4 * random.unit();
    Vec3d way = Vec3d::UnitX();
    contacts.reset();
    before.clear();
    for (int i = 0; i < 100; ++i) {
      if (i % 10 == 0) way = random.unit();
      p += 1e-5 * way;
      contacts.begin();
      contacts.look(field, tool, make_pose<double>(Mat3d::Identity(), p));
      for (const VertexContact& old : before) {
        double deepest = 0;
        for (const VertexContact& c : contacts.found())
          if ((c.lever - old.lever).norm() < kClose) deepest = std::max(deepest, c.depth);
        lost.push_back(std::min(1.0, old.weight) * (old.depth - deepest) / o.spacing.x());
      }
      before.assign(contacts.found().begin(), contacts.found().end());
    }
  }
  std::ranges::sort(lost);
  MESSAGE(lost.size(), " places, less deep by ", lost[lost.size() * 99 / 100], " (p99), ", lost.back(),
          " voxels at most");
  CHECK(lost.size() > 10000);
  CHECK(lost[lost.size() * 99 / 100] < 0.034);
  CHECK(lost.back() < 0.034 + 0.1);
}

}  // namespace
