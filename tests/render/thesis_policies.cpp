// SPDX-License-Identifier: MIT
#include "render/render_helpers.hpp"

#include <trephine/render/thesis/line.hpp>
#include <trephine/render/thesis/surface.hpp>

#include <doctest/doctest.h>

#include <limits>

/// The thesis' algorithms, written out, beside the main renderers with the thesis' policies.
namespace {

using namespace trephine;
using namespace trephine::test;

const Burr kBurr{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.012};

auto block_with_hole_and_rib(const RasterOptions& o) {
  const Vec3d m = o.middle();
  return Either{Both{HalfSpace{m - Vec3d(0, 0, 0.001), Vec3d::UnitZ()},
                     Hollow{Rod{m + Vec3d(0.001, 0, 0), Vec3d::UnitZ(), 0.0022}}},
                Plate{m - Vec3d(0.005, 0, 0), Vec3d::UnitX(), 2 * kVoxel}};
}

// In and out of the bone and along it; every now and then both start anew.
template <class Policies, class Thesis, class Field>
void compare(Policies policies, Thesis thesis, const Field& field, const Vec3d& middle, double tolerance) {
  Random random(11);
  Posed X = tool_at(middle + Vec3d(0, 0, 0.004), Vec3d::UnitZ());
  int touching = 0, shaft = 0, differ = 0;
  double off = 0;
  for (int motion = 0; motion < 80; ++motion) {
    const Posed from = X;
    const Vec3d place = middle + 0.004 * Vec3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1.5, 1));
    const Posed to = tool_at(place, (random.unit() + 1.5 * Vec3d::UnitZ()).normalized());
    if (motion % 20 == 19) {
      policies.reset();
      thesis.reset();
    }
    for (int i = 0; i < 50; ++i) {
      X = between(from, to, std::min(1.0, i / 45.0));
      const auto a = render_at(policies, field, X), b = render_at(thesis, field, X);
      touching += a.contact.count > 0 ? 1 : 0;
      shaft += a.contact.shaft ? 1 : 0;
      differ += a.status == b.status && a.contact.count == b.contact.count && a.contact.tip == b.contact.tip &&
                        a.contact.shaft == b.contact.shaft
                    ? 0
                    : 1;
      off = std::max({off, static_cast<double>((a.wrench.force - b.wrench.force).norm()),
                      static_cast<double>((a.wrench.torque - b.wrench.torque).norm()),
                      static_cast<double>((policies.visual_pose().matrix() - thesis.visual_pose().matrix()).norm()),
                      static_cast<double>((policies.proxy_pose().matrix() - thesis.proxy_pose().matrix()).norm()),
                      static_cast<double>((policies.cutting_pose().matrix() - thesis.cutting_pose().matrix()).norm()),
                      std::abs(a.contact.depth - b.contact.depth)});
    }
  }
  CHECK(touching > 500);
  CHECK(shaft > 200);
  CHECK(differ == 0);
  CHECK(off <= tolerance);
}

TEST_CASE_TEMPLATE("the thesis' Line is the main one with the thesis' policies", Scalar, float, double) {
  const RasterOptions o{.size = {56, 56, 56}};
  const auto grid = rasterise<std::uint8_t>(block_with_hole_and_rib(o), o);
  const auto field = field_of<Scalar, CentralGradient>(grid, o);
  const ToolDiscretization<LineCounts, Scalar> tool(kBurr, {.shaft = 30});
  const LineOptions options{.stiffness = 700,
                            .proxy = {.trigger = Trigger::kThesis},
                            .recheck_at_rest = false,
                            .refine = false,
                            .drawn_rate = std::numeric_limits<double>::infinity()};
  constexpr double kRounding = std::is_same_v<Scalar, float> ? 3e-6 : 4e-15;  // of drawn rotations
  for (const double friction : {0.0, 0.3}) {
    const Coulomb law(friction, friction);
    const TranslateRotate counts{.translation_steps = 8, .rotation_steps = 8};
    compare(LineApproxRenderer<Scalar, TranslateRotate, ProjectedTracking, Coulomb, TorqueOnly, CentralGradient>(
                tool, options, counts, law),
            ThesisLine<Scalar>(tool, {.stiffness = 700, .friction = friction}), field, o.middle(), kRounding);
    compare(LineApproxRenderer<Scalar, RayCast, ProjectedTracking, Coulomb, TorqueOnly, CentralGradient>(
                tool, options, RayCast{.steps = 16}, law),
            ThesisLine<Scalar>(tool, {.stiffness = 700, .friction = friction, .ray_casting = true}), field, o.middle(),
            kRounding);
  }
}

TEST_CASE_TEMPLATE("the thesis' Surface is the main one with the thesis' policies", Scalar, float, double) {
  const RasterOptions o{.size = {56, 56, 56}};
  const auto grid = rasterise<std::uint8_t>(block_with_hole_and_rib(o), o);
  const auto field = field_of<Scalar>(grid, o);
  constexpr double kRounding = std::is_same_v<Scalar, float> ? 1e-6 : 4e-15;
  for (const SurfaceCounts& counts : {SurfaceCounts::thesis(), SurfaceCounts{.sphere = 100, .slices = 10}}) {
    const ToolDiscretization<SurfaceCounts, Scalar> tool(kBurr, counts);
    compare(SurfaceApproxRenderer<Scalar, CollisionRatio, HoldForce, TorqueOnly>(tool, {.stiffness = 700}),
            ThesisSurface<Scalar>(tool, {.stiffness = 700}), field, o.middle(), kRounding);
  }
}

}  // namespace
