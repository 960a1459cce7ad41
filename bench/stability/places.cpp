// SPDX-License-Identifier: MIT
#include "stability/places.hpp"
#include "stability/tool_scene.hpp"

#include "support/fields.hpp"

#include <trephine/render/thesis/surface.hpp>

#include <cmath>
#include <sstream>
#include <stdexcept>

namespace trephine::bench {

namespace {

constexpr int kSteps = 2000;

std::vector<double> press(const Setup& setup, const Vec3d& n) {
  const ToolDiscretization<SurfaceCounts, double> tool(setup.burr, counts_of(setup));
  const SurfaceApproxRenderer<double> renderer(tool, {.stiffness = setup.stiffness});
  std::vector<double> force;
  for (int i = 0; i <= kSteps; ++i)
    force.push_back(renderer.foundation_stiffness() * plane_law(tool, 0, setup.burr.tip_radius * i / kSteps, n).dot(n));
  return force;
}

std::vector<double> press_thesis(const Setup& setup, const Vec3d& n) {
  Burr ball = setup.burr;
  ball.shaft_length = 0;
  ThesisSurface<double> renderer(ToolDiscretization<SurfaceCounts, double>(ball, counts_of(setup)),
                                 {.stiffness = setup.stiffness});
  const test::ShapeField<double, test::HalfSpace> plane({Vec3d::Zero(), n}, kPlaceVoxel);
  std::vector<double> force;
  for (int i = 0; i <= kSteps; ++i) {
    const Vec3d tip = ball.tip_radius * (1 - static_cast<double>(i) / kSteps) * n;
    force.push_back(renderer.render(plane, make_pose<double>(Mat3d::Identity(), tip)).wrench.force.dot(n));
  }
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

std::vector<Setup> usual_setups(const std::vector<Setup>& more) {
  std::vector<Setup> all = {{.renderer = "line"},    {.renderer = "line", .options = "thesis"},
                            {.renderer = "surface"}, {.renderer = "surface", .options = "thesis"},
                            {.renderer = "coupled"}, {.renderer = "coupled", .friction = 0.3}};
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

std::string label(const Setup& setup) {
  std::ostringstream s;
  s << setup.options;
  if (setup.budget) s << " + budget";
  if (setup.friction > 0) s << " + friction " << setup.friction;
  if (setup.cut == Cut::kAtOnce) s << " + cut at once";
  if (setup.cut == Cut::kAdvancing) s << " + advancing cut";
  if (setup.stack.release) s << " + release limit " << setup.stack.release->release << " N/s";
  if (setup.stack.rate) s << " + rate limit " << setup.stack.rate->force << " N/s";
  return s.str();
}

std::unique_ptr<AnyTool> make_tool(const Setup& setup, Bone& bone, double isovalue) {
  if (setup.renderer == "line") return make_line_tool(setup, bone, isovalue);
  if (setup.renderer == "surface") return make_surface_tool(setup, bone, isovalue);
  if (setup.renderer == "coupled") return make_coupled_tool(setup, bone, isovalue);
  throw std::invalid_argument("make_tool: no renderer '" + setup.renderer + "'");
}

PlaneLaw::PlaneLaw(const Setup& setup, const Vec3d& n) : radius_(setup.burr.tip_radius) {
  if (setup.renderer == "line" || setup.renderer == "coupled") {
    k_ = setup.stiffness;
    return;
  }
  table_ = setup.options == "thesis" ? press_thesis(setup, n) : press(setup, n);
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

using namespace trephine::test;

namespace {

constexpr double kBall = 1.5e-3, kShaft = 0.8e-3;
constexpr double kInside = 0.1e-3;  // places lie off the voxels' planes

Burr ball() { return {.tip_radius = kBall, .shaft_radius = kShaft, .shaft_length = 0}; }
Burr drill(double length) { return {.tip_radius = kBall, .shaft_radius = kShaft, .shaft_length = length}; }

}  // namespace

Posed tool_pose(const Vec3d& p, const Vec3d& shaft) {
  const Vec3d z = shaft.normalized(), x = z.unitOrthogonal();
  Mat3d R;
  R << x, z.cross(x), z;
  return make_pose<double>(R, p);
}

std::shared_ptr<Bone> make_bone(const std::function<double(const Vec3d&)>& shape, int n) {
  RasterOptions o{.size = {n, n, n}, .spacing = Vec3d::Constant(kPlaceVoxel)};
  o.grid.keep_original = false;
  const Vec3d middle = o.middle();
  o.X_WG.translation() = -middle;
  return std::make_shared<Bone>(rasterise<std::int16_t>([&](const Vec3d& p) { return shape(p - middle); }, o));
}

std::unique_ptr<Bone> round(const Place& place, double half) {
  const Bone& bone = *place.bone;
  const Vec3d middle = (bone.X_WG().inverse() * place.touching.translation()).cwiseQuotient(bone.spacing());
  VoxelBox box;
  for (int a = 0; a < 3; ++a) {
    const int reach = static_cast<int>(std::ceil(half / bone.spacing()[a]));
    const int at = static_cast<int>(std::lround(middle[a]));
    box.lo[static_cast<std::size_t>(a)] = at - reach;
    box.hi[static_cast<std::size_t>(a)] = at + reach;
  }
  return std::make_unique<Bone>(bone.cropped(box));
}

std::shared_ptr<Bone> copy_of(const Bone& bone) {
  const auto& n = bone.size();
  std::vector<std::int16_t> voxels(static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) *
                                   static_cast<std::size_t>(n[2]));
  bone.copy_voxels(voxels);
  return std::make_shared<Bone>(
      GridGeometry{
          .size = n, .spacing = bone.spacing(), .X_WG = bone.X_WG(), .outside = static_cast<double>(bone.outside())},
      std::span<const std::int16_t>(voxels));
}

std::vector<std::string> place_names() {
  return {"flat wall",  "tilted wall",     "edge 90",
          "edge 30",    "corner",          "concave corner",
          "slot",       "shaft in a hole", "one bar under the shaft",
          "shaft flush"};
}

std::vector<std::string> pressed_place_names() {
  return {"flat wall", "tilted wall",           "thin wall",       "edge 90",    "edge 30", "corner", "concave corner",
          "groove",    "slot's floor and side", "shaft in a hole", "shaft flush"};
}

Place make_place(const std::string& name) {
  Place p;
  p.name = name;
  p.isovalue = kPlaceIsovalue;
  p.burr = ball();
  const Vec3d up = Vec3d::UnitZ();
  // Bone below z = kInside unless said otherwise; the tool stands on top, its handle up.
  const HalfSpace floor{Vec3d(0, 0, kInside), up};
  const auto stand = [&](double top, const Vec3d& n) {
    p.outward = n;
    p.touching = tool_pose((top + kBall) * n, up);
    p.touching_line = tool_pose(top * n, up);
  };
  if (name == "flat wall") {
    p.bone = make_bone(floor);
    stand(kInside, up);
  } else if (name == "tilted wall") {
    const Vec3d n = Vec3d(0.3, 0.5, 0.8).normalized();
    p.bone = make_bone(HalfSpace{kInside * n, n});
    stand(kInside, n);
    p.across = n.unitOrthogonal();
  } else if (name == "edge 90" || name == "edge 30") {
    const double half = (name == "edge 90" ? 45 : 15) * 0.017453292519943295;
    const Vec3d a(std::cos(half), 0, std::sin(half)), b(-std::cos(half), 0, std::sin(half));
    p.bone = make_bone(Both<HalfSpace, HalfSpace>{{Vec3d(kInside, 0, kInside), a}, {Vec3d(kInside, 0, kInside), b}});
    stand(kInside, up);
    p.touching.translation().x() = p.touching_line.translation().x() = kInside;
    p.rolls = true;
  } else if (name == "corner") {
    p.rolls = true;
    p.bone = make_bone([](const Vec3d& q) {  // a cube's corner, its diagonal up
      const Vec3d d = Quatd::FromTwoVectors(Vec3d::UnitZ(), Vec3d::Ones()) * (q - Vec3d(0, 0, kInside));
      return d.maxCoeff();
    });
    stand(kInside, up);
  } else if (name == "concave corner") {
    p.bone = make_bone([](const Vec3d& q) { return std::min({q.x(), q.y(), q.z()}) - kInside; });
    const Vec3d n = Vec3d::Ones().normalized();
    p.outward = n;
    p.touching = tool_pose(Vec3d::Constant(kInside + kBall), up);
    p.touching_line = tool_pose(Vec3d::Constant(kInside), up);
    p.across = -Vec3d::UnitX();  // along the groove of two walls against the third
  } else if (name == "slot") {   // a voxel of room on either side of the ball, and a floor
    p.bone = make_bone([](const Vec3d& q) {
      return std::min(kBall + kPlaceVoxel - std::abs(q.x() - kInside), q.z() + 3e-3 - kInside);
    });
    p.touching = tool_pose(Vec3d(kInside, 0, kInside - 3e-3 + kBall), up);
    p.touching_line = tool_pose(Vec3d(kInside, 0, kInside - 3e-3), up);
    p.across = Vec3d::UnitY();
  } else if (name == "slot's floor and side") {
    p = make_place("slot");
    p.name = name;
    p.outward = Vec3d(-1, 0, 1).normalized();
    p.touching.translation().x() += kPlaceVoxel;
    p.touching_line.translation().x() += kBall + kPlaceVoxel;
    p.room = 4e-4;
  } else if (name == "groove") {  // of 90 degrees
    p.bone = make_bone([](const Vec3d& q) { return std::sqrt(0.5) * (q.z() - std::abs(q.x() - kInside)) - kInside; });
    p.touching = tool_pose(Vec3d(kInside, 0, std::sqrt(2.0) * (kInside + kBall)), up);
    p.touching_line = tool_pose(Vec3d(kInside, 0, std::sqrt(2.0) * kInside), up);
    p.across = Vec3d::UnitY();
  } else if (name == "thin wall") {  // of one voxel
    p.bone = make_bone([](const Vec3d& q) { return std::abs(q.z() - kInside) - 0.5 * kPlaceVoxel; });
    stand(kInside + 0.5 * kPlaceVoxel, up);
  } else if (name == "shaft in a hole") {  // a plate with a hole half a voxel wider than the shaft, the tip below it
    p.burr = drill(10e-3);
    p.burr.tip_radius = kShaft;
    p.bone = make_bone([](const Vec3d& q) {
      const double hole = kShaft + 0.5 * kPlaceVoxel - std::hypot(q.x() - kInside, q.y());
      return std::max(std::abs(q.z()) - 1.2e-3, hole);
    });
    p.touching = p.touching_line = tool_pose(Vec3d(kInside, 0, -4e-3), up);
    p.outward = Vec3d::UnitX();
    p.across = up;
    p.room = 0;
    p.by_shaft = true;
  } else if (name == "one bar under the shaft" || name == "shaft flush") {
    // The tool lies along x from its tip at -8 mm on.
    p.burr = drill(20e-3);
    const bool flush = name == "shaft flush";
    if (flush)
      p.bone = make_bone([](const Vec3d& q) { return std::max(q.z() - kInside, -6e-3 - q.x()); });
    else
      p.bone = make_bone(Rod{Vec3d(4e-3, 0, kInside - 1e-3), Vec3d::UnitY(), 1e-3});
    p.by_shaft = true;
    p.touching = tool_pose(Vec3d(-8e-3, 0, kInside + kShaft), Vec3d::UnitX());
    p.touching_line = tool_pose(Vec3d(-8e-3, 0, kInside), Vec3d::UnitX());
    p.across = Vec3d::UnitX();
  } else {
    throw std::invalid_argument("make_place: no place '" + name + "'");
  }
  return p;
}

}  // namespace trephine::bench
