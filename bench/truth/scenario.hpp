// SPDX-License-Identifier: MIT
#pragma once

#include "truth/contact_integral.hpp"

#include <memory>
#include <string>
#include <vector>

/// Places where a tool touches bone whose surface is known exactly.
namespace trephine::bench {

/// Where a rigid tool touches rigid bone: the place on the bone and the outward normal there.
struct RigidContact {
  Vec3d point = Vec3d::Zero();
  Vec3d normal = Vec3d::UnitZ();
};

/// One way into contact. Surface's and Line's differ by the ball's radius: Line's tip is a point.
struct Case {
  std::size_t bone = 0;             ///< index in Scenario::bones
  std::vector<Posed> surface_path;  ///< poses a tick apart, from free into contact; the last one is judged
  std::vector<Posed> line_path;     ///< the same for Line; empty where Line has no exact answer
  RigidContact surface, line;       ///< what a rigid tool would touch
  Vec3d deepest = Vec3d::UnitZ();   ///< from the ball's centre to its deepest place (unit)
  double depth = 0;                 ///< δ: of the ball's or the shaft's deepest place (Surface), of the tip (Line) [m]
  ContactIntegral ball, shaft;      ///< Surface's continuum at the last pose
  Wrenchd line_truth;               ///< Line's exact wrench at the last pose, stiffness 1 N/m
  Vec3d line_contact = Vec3d::Zero();  ///< exact proxy (tip) or IntP (shaft)
};

/// A kind of contact in several placements: the shape turned and shifted by parts of a voxel, with a fixed seed.
struct Scenario {
  std::string name;
  bool shaft = false;  ///< the shaft touches, not the tip
  bool smooth = true;  ///< without edges: what the goals are for
  Burr burr{};
  std::vector<Shape> bones;
  std::vector<Case> cases;
};

/// Side of the bone's cube, around its middle [m]; shapes are placed so that contact is near the middle.
inline constexpr double kSide = 0.0192;

/// All of them. `per_bone` cases in each of `bones` placements; seeded by name, so that the same case is the same case
/// whatever else is asked for.
[[nodiscard]] std::vector<std::string> scenario_names();
[[nodiscard]] Scenario make_scenario(const std::string& name, int bones, int per_bone);

}  // namespace trephine::bench
