// SPDX-License-Identifier: MIT
#pragma once

#include "render/coupled_helpers.hpp"

#include <trephine/stage/cutting.hpp>
#include <trephine/stage/cutting_force.hpp>
#include <trephine/tool/named_tools.hpp>
#include <trephine/voxel/pressure_cut.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>
#include <type_traits>
#include <vector>

/// Steady cuts in whole scenes whose forces have closed forms: plunges, slots and breakthroughs.
namespace trephine::test::cutting {

using namespace trephine::test::coupled;

/// Bone from `air` to `air` + `contrast`, of strength 1 where it is whole.
template <VoxelDensity Density>
struct BoneBlock {
  double h = 3e-4, sigma = 0.7;
  double air = std::is_same_v<Density, std::uint8_t> ? 0 : -1000;
  double contrast = std::is_same_v<Density, std::uint8_t> ? 255 : 2700;
  double length = 14e-3;  // of an edge of the volume [m]
  [[nodiscard]] double isovalue() const { return air + contrast / 2; }
  [[nodiscard]] BoneStrength strength() const { return {.soft = air, .cortical = air + contrast}; }
  template <class Shape>
  [[nodiscard]] VoxelGrid<Density> image(const Shape& shape) const {
    const int n = static_cast<int>(length / h);
    return rasterise<Density>(
        shape, {.size = {n, n, n}, .spacing = Vec3d::Constant(h), .blur = sigma, .contrast = contrast, .air = air});
  }
  [[nodiscard]] Vec3d middle() const { return Vec3d::Constant(h * (static_cast<int>(length / h) - 1) / 2); }
};

/// Sums over a head whose every element cuts bone of strength 1, fed along its axis.
[[nodiscard]] inline Engagement whole(const RevolvedTool& tool) {
  HeadElements::Numbers one;
  one.fill(1);
  return engagement_of(HeadElements(tool.cutting_head(0).outline), -Vec3d::UnitZ(), one, one);
}

/// What the law says of a whole head that is fed along its axis.
struct Plunge {
  double thrust, torque;
};
[[nodiscard]] inline Plunge plunge_of(const RevolvedTool& tool, const CuttingForce::Options& o, double speed) {
  const Engagement e = whole(tool);
  const double x = speed / o.speed;
  return {o.law.thrust(x, e, o.edges, tool.burr().tip_radius), o.law.torque(x, e, o.edges)};
}

/// A steady feed along the tool's axis.
struct Feed {
  double speed = 1e-3, dt = 1e-3, deep = 0.004;  // [m/s], [s], [m] at the end
  double stiffness = 2000;
};
struct Fed {
  double thrust = 0, torque = 0, feed = 0;  // means over the last fifth
  double pull = 0;                          // largest mean component sideways
  double removed_mm3 = 0, chip_work = 0, edge_work = 0;
  std::vector<double> forces;  // forces over the last fifth [N]
  Status status = Status::kOk;
};

/// Feeds a tool along −`up` into the block's half space through its middle, moved by `offset`.
template <VoxelDensity Density>
[[nodiscard]] Fed feed(const BoneBlock<Density>& block, const NamedTool& tool, CuttingForce::Options options,
                       const Feed& f, const Vec3d& up, const Vec3d& offset) {
  const Vec3d top = block.middle() + 0.2 * block.length * up + offset;
  VoxelGrid<Density> bone = block.image(HalfSpace{top, up});
  options.edges = tool.edges;
  options.strength = block.strength();
  HapticScene scene{bone, block.isovalue(), CoupledToolRenderer{tool.tool, CoupledOptions{.stiffness = f.stiffness}},
                    Cutting{PressureCut{}, CuttingForce(options)}};
  const Mat3d R = tool_at(Vec3d::Zero(), up).linear();
  const double start = tool.tool.burr().tip_radius + 1e-4;
  const int ticks = static_cast<int>((f.deep + 1e-4) / (f.speed * f.dt));
  Fed out;
  Vec3d pull = Vec3d::Zero();
  int count = 0;
  for (int i = 0; i < ticks; ++i) {
    const double height = start - i * f.speed * f.dt;
    const TickResult r = scene.tick({.X_WT = make_pose<double>(R, top + height * up), .spindle_on = true}, f.dt);
    out.status = worse(out.status, r.status);
    out.removed_mm3 += r.removed_mm3;
    const CuttingReport& now = scene.cutting().law().report();
    if (i < ticks * 4 / 5) continue;
    ++count;
    out.forces.push_back(r.wrench.force.norm());
    out.thrust += now.thrust;
    out.torque += now.torque;
    out.feed += now.feed;
    pull += R.transpose() * now.edges.force;
  }
  out.thrust /= count;
  out.torque /= count;
  out.feed /= count;
  out.pull = (pull / count).head<2>().norm();
  const CuttingReport& end = scene.cutting().law().report();
  out.chip_work = end.chip_work;
  out.edge_work = end.edge_work;
  return out;
}

[[nodiscard]] inline CuttingForce::Options drill_options() { return {.speed = rpm(1000), .force_scale = 0.01}; }

/// A plunge beside the law.
struct Plunged {
  double thrust, torque;  // off the law, relative
  double work;            // of chips off u by volume, relative: what the last deposit still holds
  double pull;            // sideways over thrust
  Fed fed;
};
/// Feeds a tool by name at its usual speed along −`up`: drills at 2 mm/s and 1000 rpm, burrs at 1 mm/s.
template <VoxelDensity Density>
[[nodiscard]] Plunged plunge(const BoneBlock<Density>& block, double dt, std::string_view name, const Vec3d& up,
                             const Vec3d& offset) {
  const NamedTool tool = tool_by_name(name);
  const bool drill = name.starts_with("twist");
  CuttingForce::Options o = drill ? drill_options() : CuttingForce::Options{.force_scale = 0.25};
  o.edges = tool.edges;
  const double speed = drill ? 2e-3 : 1e-3;
  const Fed fed = feed(block, tool, o, {.speed = speed, .dt = dt}, up, offset);
  const Plunge law = plunge_of(tool.tool, o, speed);
  return {std::abs(fed.thrust / law.thrust - 1), std::abs(fed.torque / law.torque - 1),
          std::abs(fed.chip_work / (o.law.energy * fed.removed_mm3 * 1e-9) - 1), fed.pull / fed.thrust, fed};
}

/// Mills a slot with a cylinder along x, `width_share` of whose width is bone, `deep` under the surface [m].
struct Slot {
  Vec3d pull = Vec3d::Zero();   // mean, true [N]
  double torque = 0, rate = 0;  // means [N m], [mm3/s]
  double power = 0;             // of the chips by the volume and the strength where it was cut [W]
  Status status = Status::kOk;
};
[[nodiscard]] inline Slot mill(bool clockwise, double width_share, double speed, double deep = 2e-3) {
  const BoneBlock<std::int16_t> block{.length = 16e-3};
  const NamedTool tool = tool_by_name("cylinder-3");
  // Bone is where y is below the edge: the slot's width counts from −R.
  const Vec3d middle = block.middle();
  const double R = tool.tool.burr().tip_radius;
  const Vec3d edge = middle + Vec3d(0, (2 * width_share - 1) * R, 0);
  const auto shape = [&](const Vec3d& p) { return std::max(p.z() - middle.z(), (p - edge).y()); };
  VoxelGrid<std::int16_t> bone = block.image(shape);
  CuttingForce::Options o{.edges = tool.edges, .clockwise = clockwise, .force_scale = 0.05};
  o.strength = block.strength();
  o.law.edge_force = o.law.edge_thrust = 0;  // chips alone, so that the work is u V
  o.law.thrust_ratio = 1;
  HapticScene scene{bone, block.isovalue(), CoupledToolRenderer{tool.tool, CoupledOptions{.stiffness = 2000}},
                    Cutting{PressureCut{}, CuttingForce(o)}};
  Slot out;
  const int ticks = static_cast<int>(12e-3 / (speed * 1e-3));
  int count = 0;
  for (int i = 0; i < ticks; ++i) {
    const Vec3d at(-2e-3 + i * speed * 1e-3, middle.y(), middle.z() + R - deep);
    const TickResult r = scene.tick({.X_WT = tool_at(at, Vec3d::UnitZ()), .spindle_on = true}, 1e-3);
    out.status = worse(out.status, r.status);
    if (at.x() < 5e-3) continue;
    const CuttingReport& now = scene.cutting().law().report();
    ++count;
    out.pull += now.edges.force;
    out.torque += now.torque;
    out.rate += r.removed_mm3 / 1e-3;
    const Engagement& on = scene.cutting().law().engagement();
    if (on.area > 0) out.power += o.law.energy * r.removed_mm3 * 1e-6 * on.hard_area / on.area;
  }
  out.pull /= count;
  out.torque /= count;
  out.rate /= count;
  out.power /= count;
  return out;
}

/// Feeds a flat head along −`up` through a plate, moved by `offset`; returns the time from four fifths of the greatest
/// thrust to a fifth [s]. Infinity if it does not fall, or a tick's status is not ok.
[[nodiscard]] inline double breakthrough(const BoneBlock<std::int16_t>& block, const Vec3d& up, const Vec3d& offset,
                                         double dt) {
  const NamedTool tool = tool_by_name("cylinder-2.3");
  const Vec3d top = block.middle() + offset;
  const double thick = 1.2e-3, speed = 1e-3;
  VoxelGrid<std::int16_t> bone =
      block.image([&](const Vec3d& p) { return std::max((p - top).dot(up), -(p - top).dot(up) - thick); });
  CuttingForce::Options o{.edges = tool.edges, .force_scale = 0.1};
  o.strength = block.strength();
  HapticScene scene{bone, block.isovalue(), CoupledToolRenderer{tool.tool, CoupledOptions{.stiffness = 800}},
                    Cutting{PressureCut{}, CuttingForce(o)}};
  double most = 0, before = -1, after = -1, height = 1.2e-3;
  Status status = Status::kOk;
  for (int i = 0; height > -1.2e-3; ++i) {
    height -= speed * dt;
    const TickResult r = scene.tick({.X_WT = tool_at(top + height * up, up), .spindle_on = true}, dt);
    status = worse(status, r.status);
    const double thrust = scene.cutting().law().report().thrust;
    most = std::max(most, thrust);
    if (thrust > 0.8 * most) before = i, after = -1;
    if (after < 0 && thrust < 0.2 * most) after = i;
  }
  return after > before && status == Status::kOk ? (after - before) * dt : std::numeric_limits<double>::infinity();
}

}  // namespace trephine::test::cutting
