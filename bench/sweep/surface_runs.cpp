// SPDX-License-Identifier: MIT
#include "sweep/measure.hpp"

#include <numbers>

namespace trephine::bench {
namespace {

// The law of `Weights` with infinitely many vertices. AreaWeights and PatchWeights at the stated stiffness: K the
// secant at R/2 of k π R δ². CollisionRatio at the literal k of Eq. 15 in use; it sums slice by slice, so that its
// shaft has the renderer's slices, each with infinitely many vertices.
template <class Weights, class Shaft, class Renderer>
Truth continuum(const Scenario& scenario, const Case& c, const Renderer& renderer) {
  Truth truth;
  const Posed& X = c.surface_path.back();
  const Burr& burr = scenario.burr;
  double weight = 0;
  Vec3d point = Vec3d::Zero();
  const auto add = [&](const Vec3d& force, const Vec3d& torque, const ContactIntegral& I, double w) {
    truth.wrench.force += force;
    truth.wrench.torque += torque;
    if (I.weight > 0) point += w * I.point / I.weight;
    weight += w;
  };
  if constexpr (!std::is_same_v<Weights, CollisionRatio>) {
    const double k = 2 * kStiffness / (std::numbers::pi * burr.tip_radius * burr.tip_radius);
    if (c.ball.area > 0) add(k * c.ball.spring, Vec3d::Zero(), c.ball, c.ball.weight);
    if (c.shaft.area > 0)
      add(Shaft::kForce ? Vec3d(k * c.shaft.spring) : Vec3d::Zero(), k * c.shaft.moment, c.shaft, c.shaft.weight);
  } else {
    const auto law = [&](const ContactIntegral& I, int vertices) -> Vec3d {
      return renderer.thesis_stiffness() * vertices / I.area * I.spring;
    };
    const auto& groups = renderer.tool().groups();
    if (c.ball.area > 0) {
      const Vec3d force = law(c.ball, groups[0].count);
      add(force, Vec3d::Zero(), c.ball, force.norm());
    }
    if (c.shaft.area > 0)
      for (std::size_t g = 1; g < groups.size(); ++g) {
        const double z = static_cast<double>(groups[g].height);
        const auto deepest = deepest_on_ring(scenario.bones[c.bone], X, z, burr.shaft_radius);
        if (!(deepest.depth > 0)) continue;
        const ContactIntegral ring = ring_integral(scenario.bones[c.bone], X, z, burr.shaft_radius, deepest.azimuth);
        if (!(ring.area > 0)) continue;
        const Vec3d force = law(ring, groups[g].count);
        add(Shaft::kForce ? force : Vec3d::Zero(), Vec3d(z * X.linear().col(2)).cross(force), ring, force.norm());
      }
  }
  if (weight > 0) truth.point = point / weight;
  return truth;
}

template <class Weights, class Deep, class Shaft, class Gradient = AnalyticGradient>
std::vector<Row> run_one(const Imaged& imaged, const Setting& s) {
  using Renderer = SurfaceApproxRenderer<float, Weights, Deep, Shaft, Gradient>;
  const Scenario& scenario = *imaged.scenario;
  const typename Renderer::Tool tool(scenario.burr, {.sphere = s.sphere, .slices = s.slices, .per_slice = s.per_slice});
  Renderer renderer(tool, {.stiffness = kStiffness, .search_step = s.step, .jump = 1});
  constexpr bool kLinear = std::is_same_v<Weights, CollisionRatio>;
  return measure(renderer, imaged, s, kLinear && !scenario.shaft,
                 [&](const Case& c, const Renderer& r) { return continuum<Weights, Shaft>(scenario, c, r); });
}

}  // namespace

void add_surface_runs(Runs& runs) {
  using Extend = ExtendAlongSurface;
  const auto add = [&](const char* variant, Run run) { runs[{"surface", variant}] = run; };
  add(kSurfaceThesis, run_one<CollisionRatio, HoldForce, TorqueOnly>);
  add("ratio-extend-full-analytic", run_one<CollisionRatio, Extend, FullWrench>);
  add(kSurfaceArea, run_one<AreaWeights, Extend, FullWrench>);
  add("area-extend-torque-analytic", run_one<AreaWeights, Extend, TorqueOnly>);
  add("area-hold-full-analytic", run_one<AreaWeights, HoldForce, FullWrench>);
  add(kSurfaceDefault, run_one<PatchWeights, Extend, FullWrench>);
  add("patch-extend-full-central", run_one<PatchWeights, Extend, FullWrench, CentralGradient>);
  add("patch-extend-full-stored", run_one<PatchWeights, Extend, FullWrench, StoredGradient>);
  add("patch-extend-full-spline", run_one<PatchWeights, Extend, FullWrench, SplineGradient>);
}

}  // namespace trephine::bench
