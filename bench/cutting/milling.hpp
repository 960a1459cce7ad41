// SPDX-License-Identifier: MIT
#pragma once

#include "stage/cutting_runs.hpp"

#include <trephine/everything.hpp>
#include <trephine/stage/cutting_sound.hpp>
#include <trephine/tool/named_tools.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

/// Cuts as papers report them, in a whole scene: a tool fed by a machine along bone or into it, or pressed by a load.
namespace trephine::bench {

/// How a tool cuts. The bone is flat, of one strength, in voxels of a tenth of the tool's diameter. With a depth it
/// mills a slot, with a load it is pressed on the bone while it moves along it, or into it where the feed is 0. Without
/// both it plunges at the feed.
struct Milling {
  double feed = 1e-3;   ///< of the machine [m/s]
  double depth = 0;     ///< of a slot [m]
  double load = 0;      ///< along the bone's normal [N]
  double tilt = 0;      ///< of the tool's axis against the bone's normal, across the feed [rad]
  double strength = 1;  ///< of the bone, by cortical bone's
};

/// Means over the last half of the way. Forces are true ones, in newtons.
struct Milled {
  double thrust = 0;      ///< contact's force on the head
  double normal = 0;      ///< part of it along the bone's normal
  double tangential = 0;  ///< force of the edges, in the bone's plane
  double torque = 0;      ///< about the spindle [N·m]
  double spindle = 0;     ///< [rad/s]
  double rate = 0;        ///< bone removed [mm³/s]
  double sound = 0;       ///< root mean square of a CuttingSound
  /// Work of the spindle by volume [J/mm³].
  [[nodiscard]] double energy() const { return torque * spindle / rate; }
};

/// Returns the sound of ticks of 1 ms from one on, which fades in before.
[[nodiscard]] inline double heard(const std::vector<Milled>& ticks, std::size_t first, const CuttingEdges& edges) {
  constexpr std::size_t kFade = 50;
  Mailbox<CuttingSoundState> box;
  CuttingSound sound({}, box);
  std::array<float, 48> out{};
  double power = 0;
  for (std::size_t i = first; i < ticks.size(); ++i) {
    box.post({.spindle = ticks[i].spindle, .load = ticks[i].torque, .teeth = ToothLines::teeth_of(edges)});
    sound.fill(out, 48e3);
    if (i < first + kFade) continue;
    for (const float v : out) power += static_cast<double>(v) * static_cast<double>(v);
  }
  const double samples = static_cast<double>(out.size()) * (static_cast<double>(ticks.size() - first) - kFade);
  return samples > 0 ? std::sqrt(power / samples) : 0;
}

/// Runs a cut with these edges, this spindle and this law.
[[nodiscard]] inline Milled mill(const RevolvedTool& tool, CuttingForce::Options options, const Milling& how) {
  const double R = tool.burr().tip_radius, h = R / 5, dt = 1e-3, top = 4.5 * R, deepest = 2.5 * R;
  const bool slot = how.depth > 0, pressed = how.load > 0, along = slot || (pressed && how.feed > 0);
  const double way = along ? 4 * R : 0;
  const auto voxels = [&](double edge) { return static_cast<int>(edge / h); };
  VoxelGrid<std::int16_t> bone = test::rasterise<std::int16_t>(
      test::HalfSpace{Vec3d(0, 0, top), Vec3d::UnitZ()}, {.size = {voxels(way + 5 * R), voxels(6 * R), voxels(7 * R)},
                                                          .spacing = Vec3d::Constant(h),
                                                          .blur = 0.7,
                                                          .contrast = 2700,
                                                          .air = -1000});
  options.strength = {.soft = 0, .cortical = 1700 / std::sqrt(how.strength), .most = std::max(4.0, how.strength)};
  // A stiff coupling that feels little: as steady as a machine, within the coupling's largest force.
  const double plunge = options.law.thrust(how.feed / options.speed, test::cutting::whole(tool), options.edges, R);
  options.force_scale = std::min(1.0, 1.5 / std::max(how.load, how.strength * plunge));
  HapticScene scene{bone, 350, CoupledToolRenderer{tool, CoupledOptions{.stiffness = 2000}},
                    Cutting{PressureCut{}, CuttingForce(options)}};

  const Vec3d axis(0, std::sin(how.tilt), std::cos(how.tilt)), on_bone(2 * R, 2.94 * R, top + R);
  Vec3d at = on_bone;
  if (slot) at += Vec3d(-3.5 * R, 0, -how.depth);
  std::vector<Milled> ticks;
  const double length = slot ? way + 3.5 * R : along ? way : deepest, longest = along || !pressed ? 60 : 4;
  for (double gone = 0; gone < length && static_cast<double>(ticks.size()) * dt < longest;) {
    const TickResult r = scene.tick({.X_WT = test::tool_at(at, axis), .spindle_on = true}, dt);
    const CuttingReport& now = scene.cutting().law().report();
    const Vec3d contact = r.wrench.force / options.force_scale - now.edges.force;
    ticks.push_back(
        {now.thrust, contact.z(), now.edges.force.head<2>().norm(), now.torque, now.spindle, r.removed_mm3 / dt});
    // A load is held as a hand holds it, which gives way where it is exceeded.
    const double sinks = pressed ? (1 - contact.z() / how.load) * 3e-5 : 0;
    at -= sinks * Vec3d::UnitZ();
    if (along) at.x() += how.feed * dt;
    if (!along && !pressed) at -= how.feed * dt * axis;
    gone = along ? gone + how.feed * dt : (on_bone - at).norm();
  }
  Milled mean;
  const std::size_t half = ticks.size() / 2;
  for (std::size_t i = half; i < ticks.size(); ++i)
    for (double Milled::*of :
         {&Milled::thrust, &Milled::normal, &Milled::tangential, &Milled::torque, &Milled::spindle, &Milled::rate})
      mean.*of += ticks[i].*of / static_cast<double>(ticks.size() - half);
  mean.sound = heard(ticks, half, options.edges);
  return mean;
}

}  // namespace trephine::bench
