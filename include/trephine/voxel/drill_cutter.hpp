// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/core/tolerances.hpp>
#include <trephine/voxel/cutter.hpp>

namespace trephine {

/// Shape of a drill's end; a round drill has it at both ends.
enum class DrillEnd : unsigned char { kFlat, kCone, kRound };

/// A drill bit: a cylinder about T's z axis, from its cutting end to `length` behind T's origin. The foremost point of
/// every end is one radius ahead of T's origin, as with the ball of a burr.
struct DrillBit {
  double radius = 0.001;
  double length = 0.010;  ///< of the cutting flutes, from T's origin toward the handle
  DrillEnd end = DrillEnd::kCone;
  double half_angle = 1.0297;  ///< of the cone, from the axis [rad], in (0, π/2); 59° as twist drills have

  /// Throws std::invalid_argument.
  void validate() const {
    if (!(radius > 0) || !std::isfinite(radius)) refuse("DrillBit", "radius must be > 0 m", radius);
    if (!(length > 0) || !std::isfinite(length)) refuse("DrillBit", "length must be > 0 m", length);
    refuse_beyond("DrillBit", "radius", kLargestRadius, radius);
    refuse_beyond("DrillBit", "length", kLongestShaft, length);
    if (end == DrillEnd::kRound && !(length > radius))
      refuse("DrillBit", "a round bit's length must exceed its radius", length);
    if (end != DrillEnd::kCone) return;
    if (!(half_angle > 0) || !(half_angle < 1.5707963))
      refuse("DrillBit", "half_angle must be in (0, pi/2) rad", half_angle);
    if (!(shoulder() < length)) refuse("DrillBit", "length must exceed the cone's", length);
  }

  /// z of T at which the end has reached the full radius [m].
  [[nodiscard]] double shoulder() const noexcept {
    if (end == DrillEnd::kRound) return 0;
    return end == DrillEnd::kFlat ? -radius : -radius + radius / std::tan(half_angle);
  }
};

/// A drill bit swept between two poses, as a sequence of still poses. Neighbours lie at most half a voxel apart
/// anywhere on the bit; paths beyond 16 voxels have 33 poses, farther apart. A surface along the path has scallops of
/// (half voxel)²/(8 radius). A sharp rim that moves askew is exact within a quarter voxel.
class DrillCutter {
 public:
  static constexpr int kMostPoses = 33;

  /// `step` [m]: largest motion of any point of the bit between two of the poses.
  DrillCutter(const DrillBit& bit, const Posed& X_GT_previous, const Posed& X_GT, double step) noexcept
      : origin_(X_GT.translation()), profile_(bit) {
    const double motion = way(bit, X_GT_previous, X_GT);
    const int steps = motion > 0 ? static_cast<int>(std::min(std::ceil(motion / step), double{kMostPoses - 1})) : 0;
    const Quatd q0(X_GT_previous.linear());
    const Quatd q1(X_GT.linear());
    for (count_ = 0; count_ <= steps; ++count_) {
      const double t = steps > 0 ? static_cast<double>(count_) / steps : 1.0;
      const Vec3d p = (1 - t) * X_GT_previous.translation() + t * X_GT.translation();
      add(p - origin_, count_ == steps ? Mat3d(X_GT.linear()) : q0.slerp(t, q1).toRotationMatrix(), bit);
    }
  }

  /// Returns an upper bound of the motion of the bit's points between two poses [m].
  [[nodiscard]] static double way(const DrillBit& bit, const Posed& a, const Posed& b) noexcept {
    const double far_point = std::hypot(std::max(bit.length, bit.radius), bit.radius);
    const Mat3d turn = a.linear().transpose() * b.linear();
    return (b.translation() - a.translation()).norm() + far_point * rotation_vector<double>(turn).norm();
  }

  [[nodiscard]] double signed_distance(const Vec3d& p_G) const noexcept {
    double d = std::numeric_limits<double>::max();
    for (int i = 0; i < count_; ++i) {
      const auto& at = poses_[static_cast<std::size_t>(i)];
      const Vec3d p_O = p_G - origin_ - at.origin;
      const double z = at.axis.dot(p_O);
      const double q = profile_.signed_square((p_O - z * at.axis).norm(), z);
      d = std::min(d, std::copysign(std::sqrt(std::abs(q)), q) - profile_.inflate);
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

  /// Integrates over the poses with the trapezoidal rule.
  template <std::size_t kLanes>
  void shares(float x, float step, float y, float z, float reach, std::array<float, kLanes>& out) const noexcept {
    out.fill(0);
    const float weight = count_ > 1 ? 1 / static_cast<float>(count_ - 1) : 1;
    for (int i = 0; i < count_; ++i) {
      std::array<float, kLanes> d;
      distances_at(i, x, step, y, z, d);
      const bool is_end = count_ > 1 && (i == 0 || i == count_ - 1);
      detail::add_shares(d, reach, is_end ? weight / 2 : weight, out);
    }
  }

 private:
  /// Distances from the bit in one of its poses.
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
    detail::square_roots(r);
    for (std::size_t l = 0; l < kLanes; ++l) w[l] = profile_.signed_square(r[l], w[l]);
    for (std::size_t l = 0; l < kLanes; ++l) r[l] = w[l] < 0.0F ? -w[l] : w[l];
    detail::square_roots(r);
    const auto inflate = static_cast<float>(profile_.inflate);
    for (std::size_t l = 0; l < kLanes; ++l) out[l] = (w[l] < 0.0F ? -r[l] : r[l]) - inflate;
  }

  /// The bit's outline in the half plane (r from the axis, z along it): a convex polygon, or a segment of the axis
  /// that is inflated by the radius (round ends).
  struct Profile {
    explicit Profile(const DrillBit& bit) noexcept
        : radius(bit.radius),
          inflate(bit.end == DrillEnd::kRound ? bit.radius : 0.0),
          shoulder(bit.shoulder()),
          top(bit.length - inflate),
          edge_length(std::hypot(radius, shoulder + radius)),
          edge_r(radius / edge_length),
          edge_z((shoulder + radius) / edge_length) {}

    /// Squared distance from the polygon or segment, negative inside; exact.
    template <RealScalar Scalar>
    [[nodiscard]] Scalar signed_square(Scalar r, Scalar z) const noexcept {
      const auto R = static_cast<Scalar>(radius), s = static_cast<Scalar>(shoulder), t = static_cast<Scalar>(top);
      const Scalar along = z - clamped(z, s, t);
      if (inflate > 0) return r * r + along * along;
      const Scalar out = r - R;
      const Scalar over = z - t;
      const Scalar beside = out > Scalar(0) ? out : Scalar(0);
      const Scalar to_side = out * out + along * along;
      const Scalar to_top = over * over + beside * beside;
      // The cutting edge: from the tip on the axis to the shoulder.
      const auto er = static_cast<Scalar>(edge_r), ez = static_cast<Scalar>(edge_z);
      const Scalar h = z + R;
      const Scalar on = clamped(r * er + h * ez, Scalar(0), static_cast<Scalar>(edge_length));
      const Scalar dr = r - on * er, dz = h - on * ez;
      const Scalar to_edge = dr * dr + dz * dz;
      const Scalar nearer = to_side < to_top ? to_side : to_top;
      const Scalar nearest = to_edge < nearer ? to_edge : nearer;
      const Scalar before = r * ez - h * er;
      const Scalar outermost = out > over ? out : over;
      return (outermost > before ? outermost : before) < Scalar(0) ? -nearest : nearest;
    }

    double radius, inflate, shoulder, top;
    double edge_length, edge_r, edge_z;

   private:
    template <RealScalar Scalar>
    [[nodiscard]] static Scalar clamped(Scalar v, Scalar lo, Scalar hi) noexcept {
      v = v > lo ? v : lo;
      return v < hi ? v : hi;
    }
  };

  struct Pose {
    Vec3d origin;  // of T, from origin()
    Vec3d axis;    // +z of T in G
    Vec3<float> origin_f;
    Vec3<float> axis_f;
    detail::Rod rod;
  };

  void add(const Vec3d& p_OT, const Mat3d& R_GT, const DrillBit& bit) noexcept {
    const Vec3d axis = R_GT.col(2);
    const Vec3d front = p_OT - bit.radius * axis;
    const Vec3d back = p_OT + bit.length * axis;
    poses_[static_cast<std::size_t>(count_)] =
        Pose{p_OT, axis, p_OT.cast<float>(), axis.cast<float>(), detail::Rod(front, back, bit.radius)};
    for (const Vec3d& end : {front, back}) {
      // A disc of the bit's radius at either end holds the bit.
      const Vec3d half = bit.radius * (Vec3d::Ones() - axis.cwiseProduct(axis)).cwiseMax(0.0).cwiseSqrt();
      box_.extend(Vec3d(origin_ + end - half));
      box_.extend(Vec3d(origin_ + end + half));
    }
  }

  Vec3d origin_;
  Profile profile_;
  int count_ = 0;
  std::array<Pose, kMostPoses> poses_;
  Eigen::AlignedBox3d box_;
};

static_assert(Cutter<DrillCutter>);

}  // namespace trephine
