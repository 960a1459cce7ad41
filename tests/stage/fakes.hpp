// SPDX-License-Identifier: MIT
#pragma once

#include "support/check_refused.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/stage/cutting_pose.hpp>
#include <trephine/stage/haptic_scene.hpp>

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

/// Laws simple enough to be known in closed form, in place of the real renderers and cuts.
namespace trephine::test {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInf = std::numeric_limits<double>::infinity();
inline constexpr double kTick = 1e-3;  // [s]

/// Bone fills z < 0 of G: a spring along +z at the tip, and a torque of twice the force about x. Remembers its last
/// pose, so that a test sees whether it was called.
template <RealScalar S = double, class GradientChoice = AnalyticGradient>
struct Floor {
  using Scalar = S;
  using Gradient = GradientChoice;
  S k = S(1000);  // [N/m]
  Burr burr{};
  Pose<S> X_GT = Pose<S>::Identity();
  Pose<S> X_GP = Pose<S>::Identity();
  std::array<ContactPoint<S>, 1> point{};
  std::size_t points = 0;
  int renders = 0;
  int resets = 0;
  Status status = Status::kOk;
  S overflow = S(0);         // added to the force
  S torque_overflow = S(0);  // added to the torque
  S cut_aside = S(0);        // moves the cutting pose along x
  double depth_error = 0;
  bool evaluated = true;

  template <class Field>
  Rendered<S> render(const Field&, const Pose<S>& X) noexcept {
    ++renders;
    X_GT = X;
    X_GP = X;
    Rendered<S> out;
    out.status = status;
    out.evaluated = evaluated;
    const S depth = -X.translation().z();
    points = 0;
    if (depth > S(0)) {
      X_GP.translation().z() = S(0);
      out.wrench.force.z() = k * depth;
      out.wrench.torque.x() = S(2) * k * depth;
      out.contact = {1, true, false, static_cast<double>(depth) + depth_error};
      point[0] = {X_GP.translation(), Vec3<S>::UnitZ(), out.wrench.force};
      points = 1;
    }
    out.wrench.force.x() += overflow;
    out.wrench.torque.y() += torque_overflow;
    return out;
  }
  void reset() noexcept { ++resets; }
  Pose<S> proxy_pose() const noexcept { return X_GP; }
  Pose<S> cutting_pose() const noexcept {
    Pose<S> X = X_GP;
    X.translation().x() += cut_aside;
    return X;
  }
  Pose<S> visual_pose() const noexcept { return X_GP; }
  std::span<const ContactPoint<S>> contacts() const noexcept { return {point.data(), points}; }
  const Burr& shape() const noexcept { return burr; }
  double stiffness() const noexcept { return static_cast<double>(k); }
};

/// Writes down where and how a scene would cut.
struct Witness {
  bool probe = false;
  double answer_mm3 = 0;
  int calls = 0;
  int resets = 0;
  Posed before = Posed::Identity();
  Posed now = Posed::Identity();
  CutTick context{};
  double isovalue = 0;
  trephine::detail::CuttingPose<false, false> at{};

  void reset() noexcept { ++resets; }
  template <class Grid, class R>
  double cut(Grid&, double iso, const R& renderer, const CutTick& tick, std::nullptr_t) noexcept {
    const trephine::detail::CutStroke way = at.next(renderer, CutKind::kAtRate, 0, tick, probe);
    if (!is_finite(way.to)) return kNaN;
    ++calls;
    before = way.from;
    now = way.to;
    context = tick;
    isovalue = iso;
    return answer_mm3;
  }
  template <class R>
  [[nodiscard]] Posed pose(const R& renderer) const noexcept {
    return at.current(renderer, CutKind::kAtRate);
  }
};

/// Stages that show order and context.
struct Add {
  double newton = 0;
  void apply(const TickContext&, Wrenchd& w) const noexcept { w.force.x() += newton; }
};
struct Times {
  double factor = 1;
  void apply(const TickContext&, Wrenchd& w) const noexcept { w *= factor; }
};
struct Look {
  Twist twist{};
  Twist twist_to_bone{};
  double dt = 0;
  double removed_mm3 = 0;
  Posed X_WG = Posed::Identity();
  int ticks = 0;
  int resets = 0;
  void reset() noexcept { ++resets; }
  void apply(const TickContext& c, Wrenchd&) noexcept {
    ++ticks;
    twist = c.twist;
    twist_to_bone = c.twist_to_bone;
    dt = c.dt;
    removed_mm3 = c.removed_mm3;
    X_WG = c.X_WG;
  }
};

inline VoxelGrid<std::int16_t> small_grid(const Posed& X_WG = Posed::Identity()) {
  const std::vector<std::int16_t> voxels(64, 0);
  return VoxelGrid<std::int16_t>({.size = {4, 4, 4}, .spacing = Vec3d::Constant(1e-3), .X_WG = X_WG}, voxels);
}

inline Posed at(double x, double y, double z) { return make_pose<double>(Mat3d::Identity(), Vec3d(x, y, z)); }
inline Posed turned(const Vec3d& w, const Vec3d& p) { return make_pose<double>(rotation_from_vector<double>(w), p); }

/// A context in contact with the spindle on, with the bone in the world's frame unless given.
inline const Posed kBoneInWorld = Posed::Identity();
inline TickContext touching(const TickInput& input, double dt = kTick, const Posed& X_WG = kBoneInWorld) {
  TickContext c{input, X_WG};
  c.dt = dt;
  c.contact = {1, true, false, 1e-3};
  return c;
}

}  // namespace trephine::test
