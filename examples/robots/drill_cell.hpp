// SPDX-License-Identifier: MIT
#pragma once

#include "admittance.hpp"
#include "crtk.hpp"

#include <trephine/core/units.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/device_limits.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/stage/veto.hpp>
#include <trephine/structure/labelled_field.hpp>
#include <trephine/structure/motion_barrier.hpp>
#include <trephine/structure/structure_veto.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace robots {

inline constexpr double kIsovalue = 300;
using Bone = VoxelGrid<std::int16_t>;

[[nodiscard]] inline Burr burr() { return {.tip_radius = 1e-3, .shaft_radius = 0.6e-3, .shaft_length = 25e-3}; }

/// Returns a block of 24 mm by 24 mm, up to z = 17.5 mm.
[[nodiscard]] inline Bone bone_block() {
  std::vector<std::int16_t> hounsfield(48 * 48 * 36, 1200);  // x fastest
  hounsfield.resize(48 * 48 * 44, -1000);
  return {{.size = {48, 48, 44}, .spacing = {0.5e-3, 0.5e-3, 0.5e-3}}, hounsfield};
}
/// Signed distance from the nerve's formula: a tube along x with round ends [m].
[[nodiscard]] inline double nerve_distance(const Vec3d& p) {
  return Vec3d(p.x() - std::clamp(p.x(), 3e-3, 21e-3), p.y() - 12e-3, p.z() - 9e-3).norm() - 1e-3;
}
/// Returns the distances to the nerve, from labels of voxels that are not the bone's.
[[nodiscard]] inline std::shared_ptr<const StructureField> nerve_field() {
  std::vector<std::uint8_t> voxels;
  for (int k = 0; k < 44; ++k)
    for (int j = 0; j < 60; ++j)
      for (int i = 0; i < 60; ++i) voxels.push_back(nerve_distance(0.4e-3 * Vec3d(i, j, k)) < 0 ? 1 : 0);
  const LabelGrid<std::uint8_t> labels({.size = {60, 60, 44}, .spacing = {0.4e-3, 0.4e-3, 0.4e-3}}, voxels,
                                       {{.label = 1, .name = "nerve"}});
  return build_structure_field(labels, {.reach = 4e-3});
}
/// A robot is stiff, so its tool cuts where it is: Surface carves at the device's pose.
[[nodiscard]] inline auto make_scene(Bone& bone, const Veto<std::int16_t>& veto) {
  return HapticScene{
      bone,
      kIsovalue,
      SurfaceApproxRenderer{ToolDiscretization{burr(), SurfaceCounts{.sphere = 26, .slices = 10, .per_slice = 6}},
                            SurfaceOptions{.stiffness = 500}},
      Cutting{RateLimitedCut<>{.rate = 3e4}},
      veto,
      DeviceLimits{.force = 20, .torque = 1}};
}

/// Options of a `DrillCell`.
struct CellOptions {
  AdmittanceOptions admittance{};
  MotionBarrierOptions barrier{};
  bool has_barrier = true;                                                      ///< false shows what happens without it
  StructureVeto veto{.mode = StructureVeto::Mode::kProtect, .margin = 0.3e-3};  ///< of the simulated cuts
};

/// A robot's place of work: a block of bone with a nerve in it, which a hand drills through the robot. The bone resists
/// (its force adds to the hand's), the force moves the tool by an admittance, and a barrier keeps it from the nerve.
class DrillCell {
 public:
  static constexpr double kLongestStep = 2e-3;  ///< [s] of a tick; part of the barrier's lag

  explicit DrillCell(const CellOptions& options = {})
      : options_(options),
        bone_(bone_block()),
        field_(nerve_field()),
        veto_(make_cut_floor(*field_, Posed::Identity(), bone_, kIsovalue, std::vector{options.veto})),
        scene_(make_scene(bone_, veto_)),
        admittance_(options.admittance),
        barrier_(field_, Posed::Identity(), burr(), options.barrier),
        X_WT_(start()) {}

  /// Returns a pose over the bone, upright.
  [[nodiscard]] static Posed start() {
    Posed X_WT = Posed::Identity();
    X_WT.translation() = Vec3d(12e-3, 12e-3, 22e-3);
    return X_WT;
  }

  [[nodiscard]] const MotionBarrier& barrier() const noexcept { return barrier_; }
  [[nodiscard]] const CutFloor<std::int16_t>& floor() const noexcept { return *veto_.cut_floor(); }
  [[nodiscard]] double removed_mm3() const noexcept { return removed_mm3_; }
  /// Returns the commanded pose.
  [[nodiscard]] const Posed& X_WT() const noexcept { return X_WT_; }

  /// Starts from rest where the robot is.
  void restart(const Report& r) noexcept {
    X_WT_ = pose(r.measured_cp);
    admittance_.restart();
  }

  /// Returns the command for a report that came dt [s] after the last one.
  [[nodiscard]] Command tick(const Report& r, double dt) noexcept {
    dt = std::min(dt, kLongestStep);
    const Posed X_measured = pose(r.measured_cp);
    const TickResult result = scene_.tick({.X_WT = X_measured, .spindle_on = r.spindle}, dt);
    removed_mm3_ += result.removed_mm3;
    trail_ = largest_displacement(burr(), X_WT_, X_measured);
    const Twist wanted = admittance_.twist(wrench(r.measured_cf) + result.wrench, dt);
    AllowedMotion motion{.twist = wanted, .X_WT = pose_after(X_WT_, wanted, dt)};
    if (options_.has_barrier) motion = barrier_.limit(X_WT_, wanted, dt);
    X_WT_ = motion.X_WT;
    return {.answers = r.sequence,
            .operating_state = OperatingState::kEnabled,
            .servo_cp = position(X_WT_),
            .servo_cv = velocity(motion.twist),
            .servo_cf = force(admittance_.share() * result.wrench),
            .distance = motion.distance,
            .limited = motion.limited,
            .reason = {}};
  }

  /// True if the robot is farther from its command than the barrier allows for.
  [[nodiscard]] bool lost() const noexcept { return trail_ > options_.barrier.speed * options_.barrier.lag; }
  [[nodiscard]] double trail() const noexcept { return trail_; }

 private:
  CellOptions options_;
  Bone bone_;
  std::shared_ptr<const StructureField> field_;
  Veto<std::int16_t> veto_;
  decltype(make_scene(std::declval<Bone&>(), std::declval<const Veto<std::int16_t>&>())) scene_;
  Admittance admittance_;
  MotionBarrier barrier_;
  Posed X_WT_;
  double trail_ = 0;
  double removed_mm3_ = 0;
};

}  // namespace robots
