// SPDX-License-Identifier: MIT
#pragma once

#include "../drill/bone.hpp"

#include <trephine/core/math.hpp>
#include <trephine/stage/motion.hpp>
#include <trephine/tool/revolved_tool.hpp>
#include <trephine/voxel/density_field.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace live {

using trephine::Posed;
using trephine::Vec3d;

/// Points that fill a tool, head and shaft, so that a session can ask whether bone is in it. Immutable.
class ToolBody {
 public:
  static constexpr std::size_t kMax = 4000;  ///< points: some 0.1 ms to look all of them up

  /// Fills the tool to half a voxel below its surface, because a tool that rests on bone lies in it by less. `voxel` is
  /// the bone's shortest spacing [m].
  ToolBody(const trephine::Burr& burr, double voxel) {
    const auto distance = [&](double rho, double z) {
      const double shaft = std::max({rho - burr.shaft_radius, z - burr.shaft_length, -z});
      return std::min(std::hypot(rho, z) - burr.tip_radius, shaft);
    };
    fill(distance, -burr.tip_radius, std::max(burr.tip_radius, burr.shaft_length), burr.tip_radius, voxel);
  }
  ToolBody(const trephine::RevolvedTool& tool, double voxel) {
    const trephine::ToolBounds bounds = tool.bounds();
    const auto distance = [&](double rho, double z) { return tool.outline().signed_distance(rho, z); };
    fill(distance, bounds.z_low, bounds.z_high, bounds.radius, voxel);
  }

  /// True if none of the points is in bone where the tool has the pose X_WT. Haptic thread; no allocation.
  [[nodiscard]] bool is_free(const drill::Grid& bone, double isovalue, const Posed& X_WT) const noexcept {
    const trephine::DensityField<std::int16_t, double> field(bone, isovalue);
    const Posed X_GT = trephine::relative_pose(bone.X_WG(), X_WT);
    return std::none_of(points_.begin(), points_.end(), [&](const Vec3d& p_T) {
      const Vec3d p_G = X_GT * p_T;
      return field.value(p_G) >= 0;
    });
  }
  [[nodiscard]] const std::vector<Vec3d>& points() const { return points_; }

 private:
  /// Rings of points about the axis, on a lattice as fine as their number allows.
  template <class Distance>
  void fill(const Distance& distance, double z_low, double z_high, double radius, double voxel) {
    double step = voxel;
    while (!add_rings(distance, z_low, z_high, radius, voxel, step)) step *= 1.25;
  }
  /// Rings on lines along the axis and lines away from it, `step` apart, and where these leave the tool's inside. A
  /// part thinner than a voxel has them where it is thickest. Returns false where there are more points than kMax.
  template <class Distance>
  bool add_rings(const Distance& distance, double z_low, double z_high, double radius, double voxel, double step) {
    const double inside = -0.5 * voxel, fine = voxel / 8, rim = std::max(radius - 0.5 * voxel, 0.0);
    points_.clear();
    for (int line = 0; line <= static_cast<int>(rim / step) + 1; ++line) {
      if (points_.size() > kMax) return false;
      const double rho = std::min(line * step, rim);
      double here = distance(rho, z_low), thickest = here, deepest = z_low, next = z_low;
      for (double z = z_low; z <= z_high; z += fine) {
        const double above = distance(rho, z + fine);
        if (here <= inside) {
          const bool is_last = above > inside;
          if (z >= next || is_last) {
            add_ring(rho, z, step);
            next = is_last ? z_low : z + step;  // where the line comes inside again, it has a ring at once
          }
        }
        if (here < thickest) {
          thickest = here;
          deepest = z;
        }
        here = above;
      }
      if (thickest <= -0.4 * voxel) add_ring(rho, deepest, step);
    }
    for (double z = z_low; z <= z_high && points_.size() <= kMax; z += step) {
      double here = distance(0, z);
      for (double rho = 0; rho <= radius; rho += fine) {
        const double beside = distance(rho + fine, z);
        if (here <= inside && beside > inside) add_ring(rho, z, step);
        here = beside;
      }
    }
    return points_.size() <= kMax;
  }
  void add_ring(double rho, double z, double step) {
    const int count = std::max(1, static_cast<int>(std::ceil(2 * std::numbers::pi * rho / step)));
    for (int i = 0; i < count; ++i) {
      const double a = 2 * std::numbers::pi * i / count;
      points_.emplace_back(rho * std::cos(a), rho * std::sin(a), z);
    }
  }

  std::vector<Vec3d> points_;
};

}  // namespace live
