// SPDX-License-Identifier: MIT
#include "stability/places.hpp"
#include "stability/tool_scene.hpp"

#include <cmath>
#include <sstream>
#include <stdexcept>

namespace trephine::bench {
namespace {

constexpr int kSteps = 2000;

template <class Weights>
std::vector<double> press(const Setup& setup, const Vec3d& n) {
  const ToolDiscretization<SurfaceCounts, double> tool(setup.burr, counts_of(setup));
  const SurfaceApproxRenderer<double, Weights> renderer(tool, {.stiffness = setup.stiffness});
  std::vector<double> force;
  for (int i = 0; i <= kSteps; ++i)
    force.push_back(renderer.thesis_stiffness() *
                    plane_law<Weights>(tool, 0, setup.burr.tip_radius * i / kSteps, n).dot(n));
  return force;
}

std::unique_ptr<AnyTool> make_coupled_tool(const Setup& setup, Bone& bone, double isovalue) {
  if (setup.options != "default")
    throw std::invalid_argument("make_tool: coupled has no options '" + setup.options + "'");
  CoupledOptions options = setup.coupled;
  options.stiffness = setup.stiffness;
  const Coulomb friction(setup.friction, setup.friction);
  if (setup.friction > 0) return wrapped(CoupledToolRenderer{setup.burr, options, friction}, setup, bone, isovalue);
  return wrapped(CoupledToolRenderer{setup.burr, options}, setup, bone, isovalue);
}

}  // namespace

std::string label(const Setup& setup) {
  std::ostringstream s;
  s << setup.options;
  if (setup.budget) s << " + budget";
  if (setup.friction > 0) s << " + friction " << setup.friction;
  if (setup.mill_speed > 0) s << " + advancing cut";
  if (setup.stack.rate) s << " + rate limit " << setup.stack.rate->force << " N/s";
  return s.str();
}

std::unique_ptr<AnyTool> make_tool(const Setup& setup, Bone& bone, double isovalue) {
  if (setup.renderer == "line") return make_line_tool(setup, bone, isovalue);
  if (setup.renderer == "surface") return make_surface_tool(setup, bone, isovalue);
  if (setup.renderer == "coupled") return make_coupled_tool(setup, bone, isovalue);
  throw std::invalid_argument("make_tool: no renderer '" + setup.renderer + "'");
}

std::vector<std::string> thesis_choices(const std::string& renderer) {
  if (renderer == "line")
    return {"torque without force", "stored gradient", "projected tracking", "thesis' trigger", "most active vertex"};
  if (renderer == "surface") return {"Eq. 16", "held force", "torque without force", "thesis' counts"};
  return {};
}

PlaneLaw::PlaneLaw(const Setup& setup, const Vec3d& n) : radius_(setup.burr.tip_radius) {
  if (setup.renderer == "line" || setup.renderer == "coupled") {
    k_ = setup.stiffness;
    return;
  }
  const bool ratio = setup.options == "thesis" || setup.options == "Eq. 16";
  table_ = ratio                             ? press<CollisionRatio>(setup, n)
           : setup.options == "area weights" ? press<AreaWeights>(setup, n)
                                             : press<PatchWeights>(setup, n);
  edge_ = table_.back();
}

double PlaneLaw::force(double depth) const {
  if (!(depth > 0)) return 0;
  if (table_.empty()) return k_ * depth;
  if (depth >= radius_) return edge_ * depth / radius_;
  const double at = depth / radius_ * kSteps;
  const auto i = std::min(static_cast<std::size_t>(at), table_.size() - 2);
  return table_[i] + (at - static_cast<double>(i)) * (table_[i + 1] - table_[i]);
}

double PlaneLaw::depth_at(double newton) const {
  double low = 0, high = 1;
  for (int i = 0; i < 60; ++i) (force(0.5 * (low + high)) < newton ? low : high) = 0.5 * (low + high);
  return 0.5 * (low + high);
}

double PlaneLaw::tangent_at(double newton) const {
  const double depth = depth_at(newton), h = radius_ / kSteps;
  return (force(depth + h) - force(std::max(0.0, depth - h))) / (h + std::min(depth, h));
}

Setup with_tangent(Setup setup, const Vec3d& n, double K, double newton) {
  if (setup.renderer == "line" || setup.renderer == "coupled") {
    setup.stiffness = K;
    return setup;
  }
  // Forces are proportional to the stiffness: F = s g(δ) where s g' = K, so g'/g = K/F.
  setup.stiffness = 1;
  const PlaneLaw law(setup, n);
  double low = 0, high = 0.999 * setup.burr.tip_radius;
  const double h = setup.burr.tip_radius / kSteps;
  for (int i = 0; i < 60; ++i) {
    const double depth = 0.5 * (low + high);
    const double slope = (law.force(depth + h) - law.force(std::max(0.0, depth - h))) / (h + std::min(depth, h));
    (slope * newton > K * law.force(depth) || !(law.force(depth) > 0) ? low : high) = depth;
  }
  setup.stiffness = newton / law.force(high);
  return setup;
}

Wrenchd lead_tool(AnyTool& tool, const Posed& from, const Posed& to, int ticks) {
  Wrenchd w;
  const Vec3d turn = turn_between(from, to);
  for (int i = 0; i <= ticks; ++i) {
    const double t = static_cast<double>(i) / ticks;
    const Vec3d part = t * turn;
    w = tool.tick({make_pose<double>(rotation_from_vector<double>(part) * from.linear(),
                                     (1 - t) * from.translation() + t * to.translation()),
                   false},
                  1e-3)
            .wrench;
  }
  return w;
}

}  // namespace trephine::bench
