// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/rotation.hpp>
#include <trephine/core/square_roots.hpp>
#include <trephine/tool/cutting_head.hpp>
#include <trephine/tool/head_sweep.hpp>
#include <trephine/tool/rims_in_voxels.hpp>
#include <trephine/voxel/cutter.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// A tool's cutting head swept between two poses, as a sequence of still poses. Neighbours lie at most half a voxel
/// apart anywhere on the head; paths beyond 16 voxels have 33 poses, farther apart. A surface along the path has
/// scallops of (half voxel)²/(8 radius). A sharp rim that moves askew is exact within a quarter voxel.
///
/// The trilinear surface of a cut lies inside a bulge of radius r by chord/r, chord = `sag_square`(spacing, 1/24). With
/// a `chord` [m²] the cutter makes the head's rims thicker by what they lack more than the head's largest radius.
class RevolvedCutter {
 public:
  static constexpr int kMaxPoses = 33;

  /// `step` [m]: largest motion of any point of the head between two of the poses. With `start_is_cut` the first pose
  /// is left out, unless it is the only one.
  RevolvedCutter(const CuttingHead& head, const Posed& X_GT_previous, const Posed& X_GT, double step, double chord = 0,
                 bool start_is_cut = false) noexcept
      : origin_(X_GT.translation()), head_(head), chord_(chord) {
    const double more = head.allowance + thickest_rim(head.outline, chord);
    low_ = head.outline.z_low() - more;
    high_ = head.outline.z_high() + more;
    radius_ = head.outline.largest_radius() + more;
    const double motion = travel(head, X_GT_previous, X_GT);
    const int steps = motion > 0 ? static_cast<int>(std::min(std::ceil(motion / step), double{kMaxPoses - 1})) : 0;
    const Quatd q0(X_GT_previous.linear());
    const Quatd q1(X_GT.linear());
    has_start_ = steps > 0 && !start_is_cut;
    for (int i = has_start_ || steps == 0 ? 0 : 1; i <= steps; ++i) {
      const double t = steps > 0 ? static_cast<double>(i) / steps : 1.0;
      const Vec3d p = (1 - t) * X_GT_previous.translation() + t * X_GT.translation();
      add(p - origin_, i == steps ? Mat3d(X_GT.linear()) : q0.slerp(t, q1).toRotationMatrix());
    }
  }

  /// Returns an upper bound of the motion of the head's points between two poses [m].
  [[nodiscard]] static double travel(const CuttingHead& head, const Posed& a, const Posed& b) noexcept {
    const ToolOutline& o = head.outline;
    const double far_point = std::hypot(std::max(o.z_high(), -o.z_low()), o.largest_radius());
    const Mat3d turn = a.linear().transpose() * b.linear();
    return (b.translation() - a.translation()).norm() + far_point * rotation_vector<double>(turn).norm();
  }

  [[nodiscard]] double signed_distance(const Vec3d& p_G) const noexcept {
    double d = std::numeric_limits<double>::max();
    for (int i = 0; i < count_; ++i) {
      const auto& at = poses_[static_cast<std::size_t>(i)];
      const Vec3d p_O = p_G - origin_ - at.origin;
      const double z = at.axis.dot(p_O);
      const std::array<double, 1> rho{(p_O - z * at.axis).norm()}, height{z};
      std::array<double, 1> one;
      enlarged_distances(head_.outline, rho, height, chord_, one);
      d = std::min(d, one[0] - head_.allowance);
    }
    return d;
  }

  [[nodiscard]] Eigen::AlignedBox3d bounds() const noexcept { return box_; }
  [[nodiscard]] Vec3d origin() const noexcept { return origin_; }

  void rows(const RowLanes& y, double z, double reach, RowSpans& out) const noexcept {
    constexpr double kFar = std::numeric_limits<double>::max();
    out.lo.fill(kFar);
    out.hi.fill(-kFar);
    for (int i = 0; i < count_; ++i) {
      RowSpans one;
      poses_[static_cast<std::size_t>(i)].rod.rows(y, z, reach, one);
      for (std::size_t l = 0; l < kCutRows; ++l) {
        const bool some = one.lo[l] <= one.hi[l];
        const double lo = some ? one.lo[l] : kFar;
        const double hi = some ? one.hi[l] : -kFar;
        out.lo[l] = out.lo[l] < lo ? out.lo[l] : lo;
        out.hi[l] = out.hi[l] > hi ? out.hi[l] : hi;
      }
    }
  }

  template <std::size_t kLanes>
  void distances(float x, float step, float y, float z, std::array<float, kLanes>& out) const noexcept {
    out.fill(std::numeric_limits<float>::max());
    for (int i = 0; i < count_; ++i) {
      std::array<float, kLanes> d;
      distances_at(i, x, step, y, z, d);
      for (std::size_t l = 0; l < kLanes; ++l) out[l] = d[l] < out[l] ? d[l] : out[l];
    }
  }

  /// Integrates over the poses: with the trapezoidal rule, or without the first pose with the rectangles that end at
  /// the others.
  template <std::size_t kLanes>
  void shares(float x, float step, float y, float z, float reach, const std::array<float, kLanes>& farthest,
              std::array<float, kLanes>& out) const noexcept {
    out.fill(0);
    const float weight = 1 / static_cast<float>(has_start_ ? count_ - 1 : count_);
    for (int i = 0; i < count_; ++i) {
      std::array<float, kLanes> d;
      distances_at(i, x, step, y, z, d);
      const bool is_end = has_start_ && (i == 0 || i == count_ - 1);
      detail::add_shares(d, reach, is_end ? weight / 2 : weight, farthest, out);
    }
  }

 private:
  /// Distances from the head in one of its poses.
  template <std::size_t kLanes>
  void distances_at(int pose, float x, float step, float y, float z, std::array<float, kLanes>& out) const noexcept {
    const auto& at = poses_[static_cast<std::size_t>(pose)];
    const float ax = at.axis_f.x(), ay = at.axis_f.y(), az = at.axis_f.z();
    const float px = x - at.origin_f.x(), py = y - at.origin_f.y(), pz = z - at.origin_f.z();
    std::array<float, kLanes> r, w;
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float qx = px + step * static_cast<float>(static_cast<int>(l));
      w[l] = qx * ax + py * ay + pz * az;
      const float rx = qx - w[l] * ax, ry = py - w[l] * ay, rz = pz - w[l] * az;
      r[l] = rx * rx + ry * ry + rz * rz;
    }
    square_roots(r);
    std::array<float, kLanes> d;
    enlarged_distances(head_.outline, r, w, chord_, d);
    const auto allowance = static_cast<float>(head_.allowance);
    for (std::size_t l = 0; l < kLanes; ++l) out[l] = d[l] - allowance;
  }

  struct Pose {
    Vec3d origin;  // of T, from origin()
    Vec3d axis;    // +z of T in G
    Vec3<float> origin_f;
    Vec3<float> axis_f;
    detail::Rod rod;
  };

  void add(const Vec3d& p_OT, const Mat3d& R_GT) noexcept {
    const Vec3d axis = R_GT.col(2);
    const Vec3d front = p_OT + low_ * axis;
    const Vec3d back = p_OT + high_ * axis;
    poses_[static_cast<std::size_t>(count_++)] =
        Pose{p_OT, axis, p_OT.cast<float>(), axis.cast<float>(), detail::Rod(front, back, radius_)};
    for (const Vec3d& end : {front, back}) {
      // A disc of the head's radius at either end holds the head.
      const Vec3d half = radius_ * (Vec3d::Ones() - axis.cwiseProduct(axis)).cwiseMax(0.0).cwiseSqrt();
      box_.extend(Vec3d(origin_ + end - half));
      box_.extend(Vec3d(origin_ + end + half));
    }
  }

  Vec3d origin_;
  CuttingHead head_;
  double chord_;
  double low_, high_, radius_;  // of the enlarged head
  bool has_start_ = false;      // of several poses the first is where the path starts
  int count_ = 0;
  std::array<Pose, kMaxPoses> poses_;
  Eigen::AlignedBox3d box_;
};

static_assert(Cutter<RevolvedCutter>);

/// A cut in time counts each pose of a path once, in the tick that ends there. A cut that makes room where the tool is
/// needs thicker rims, in which voxels leave bone.
template <>
struct HeadSweep<CuttingHead> {
  [[nodiscard]] static double travel(const CuttingHead& head, const Posed& a, const Posed& b) noexcept {
    return RevolvedCutter::travel(head, a, b);
  }
  [[nodiscard]] static double size(const CuttingHead& head) noexcept {
    return head.outline.largest_radius() + head.allowance;
  }
  [[nodiscard]] static double length(const CuttingHead& head) noexcept {
    return head.outline.z_high() - head.outline.z_low() + 2 * head.allowance;
  }
  template <CutKind kKind>
  [[nodiscard]] static RevolvedCutter cutter(const CuttingHead& head, const Posed& from, const Posed& to,
                                             bool start_is_cut, const Vec3d& spacing) noexcept {
    const double step = spacing.minCoeff() / 2;
    if constexpr (kKind == CutKind::kByPressure)
      return {pressed(head, spacing), from, to, step, 0, true};
    else
      return {head, from, to, step, sag_square(spacing, 1.0 / 24), start_is_cut || kKind != CutKind::kAtOnce};
  }

 private:
  /// The head that cuts by pressure in voxels of this spacing [m]. Such a cut goes ahead until the tool is free, so
  /// rims are sharper and the hole keeps its width. Where a drill's edge makes the wall, flutes finish it: an edge cuts
  /// voxels of the wall as deep as a long side would only with some side behind it.
  [[nodiscard]] static CuttingHead pressed(const CuttingHead& head, const Vec3d& spacing) noexcept {
    // [cell's diagonals]. Voxels that make the wall lie within half a diagonal of it. Of a longer guide a side under
    // load reams the hole, of a shorter one bone in it holds the edge.
    constexpr double kGuide = 0.5;
    const ToolOutline outline = head.with_guide(kGuide * spacing.norm());
    return {with_sharper_rims(outline, std::sqrt(spacing.squaredNorm() / 3)),
            pressed_allowance(head.allowance, outline.largest_radius(), spacing)};
  }
};

}  // namespace trephine
