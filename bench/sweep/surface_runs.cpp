// SPDX-License-Identifier: MIT
#include "sweep/measure.hpp"

#include <trephine/render/thesis/surface.hpp>

#include <numbers>

namespace trephine::bench {
namespace {

/// A force at a mean point, in parts.
struct Sum {
  Truth truth;
  double weight = 0;
  Vec3d point = Vec3d::Zero();

  void add(const Vec3d& force, const Vec3d& torque, const ContactIntegral& I, double w) {
    truth.wrench.force += force;
    truth.wrench.torque += torque;
    if (I.weight > 0) point += w * I.point / I.weight;
    weight += w;
  }
  [[nodiscard]] Truth result() {
    if (weight > 0) truth.point = point / weight;
    return truth;
  }
};

ToolDiscretization<SurfaceCounts, float> tool_of(const Imaged& imaged, const Setting& s) {
  return {imaged.scenario->burr, {.sphere = s.sphere, .slices = s.slices, .per_slice = s.per_slice}};
}

// Against infinitely many vertices at the stated stiffness: K is the secant at R/2 of k π R δ².
std::vector<Row> run_surface(const Imaged& imaged, const Setting& s) {
  const Burr& burr = imaged.scenario->burr;
  SurfaceApproxRenderer<float> renderer(tool_of(imaged, s),
                                        {.stiffness = kStiffness, .search_step = s.step, .jump = 1});
  return measure(renderer, imaged, s, false, [&](const Case& c, const auto&) {
    Sum sum;
    const double k = 2 * kStiffness / (std::numbers::pi * burr.tip_radius * burr.tip_radius);
    if (c.ball.area > 0) sum.add(k * c.ball.spring, Vec3d::Zero(), c.ball, c.ball.weight);
    if (c.shaft.area > 0) sum.add(k * c.shaft.spring, k * c.shaft.moment, c.shaft, c.shaft.weight);
    return sum.result();
  });
}

// Against infinitely many vertices at the k of Eq. 15 in use. Eq. 16 sums slice by slice, so that the shaft has the
// renderer's slices, each with infinitely many vertices. Slices give torque alone.
std::vector<Row> run_thesis(const Imaged& imaged, const Setting& s) {
  const Scenario& scenario = *imaged.scenario;
  ThesisSurface<float> renderer(tool_of(imaged, s), {.stiffness = kStiffness, .search_step = s.step, .jump = 1});
  return measure(renderer, imaged, s, !scenario.shaft, [&](const Case& c, const auto&) {
    Sum sum;
    const Posed& X = c.surface_path.back();
    const auto law = [&](const ContactIntegral& I, int vertices) -> Vec3d {
      return renderer.k() * vertices / I.area * I.spring;
    };
    const auto& groups = renderer.tool().groups();
    if (c.ball.area > 0) {
      const Vec3d force = law(c.ball, groups[0].count);
      sum.add(force, Vec3d::Zero(), c.ball, force.norm());
    }
    if (c.shaft.area > 0)
      for (std::size_t g = 1; g < groups.size(); ++g) {
        const double z = static_cast<double>(groups[g].height), radius = scenario.burr.shaft_radius;
        const auto deepest = deepest_on_ring(scenario.bones[c.bone], X, z, radius);
        if (!(deepest.depth > 0)) continue;
        const ContactIntegral ring = ring_integral(scenario.bones[c.bone], X, z, radius, deepest.azimuth);
        if (!(ring.area > 0)) continue;
        const Vec3d force = law(ring, groups[g].count);
        sum.add(Vec3d::Zero(), Vec3d(z * X.linear().col(2)).cross(force), ring, force.norm());
      }
    return sum.result();
  });
}

}  // namespace

void add_surface_runs(Runs& runs) {
  runs[{"surface", kSurfaceThesis}] = run_thesis;
  runs[{"surface", kSurfaceDefault}] = run_surface;
}

}  // namespace trephine::bench
