// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <limits>

/// Bodies that remove bone. Each is the space that a cutting tool sweeps in one tick, in G, in metres.
namespace trephine {

/// Voxels are cut this many at a time, so that plain loops vectorise.
inline constexpr int kCutLanes = 16;
using CutLanes = std::array<float, kCutLanes>;

/// Part of a row along x; empty where hi < lo.
struct RowSpan {
  double lo = 0;
  double hi = -1;
};

/// A body given by its signed distance [m] (negative inside, exact outside). Rows are in coordinates relative to
/// `origin()`, so that single precision serves wherever the grid lies:
/// - `bounds()`: a box in G that holds the body;
/// - `row(y, z, reach)`: holds every x of the row that is nearer than `reach` to the body (more is allowed);
/// - `distances(x, step, y, z, out)`: out[l] = distance at (x + l step, y, z).
template <class C>
concept Cutter = requires(const C& c, const Vec3d& p_G, double d, float f, CutLanes& out) {
  { c.signed_distance(p_G) }
  noexcept->std::same_as<double>;
  { c.bounds() }
  noexcept->std::same_as<Eigen::AlignedBox3d>;
  { c.origin() }
  noexcept->std::same_as<Vec3d>;
  { c.row(d, d, d) }
  noexcept->std::same_as<RowSpan>;
  { c.distances(f, f, f, f, out) }
  noexcept;
};

namespace detail {

/// Square roots of all lanes. By Eigen, because std::sqrt may set errno, which keeps loops from being vectorised.
inline void take_roots(CutLanes& x) noexcept {
  Eigen::Map<Eigen::Array<float, kCutLanes, 1>> lanes(x.data());
  lanes = lanes.sqrt();
}

/// A cylinder along a segment: what the rows of slender bodies are cut down to. `along` is zero for a point.
class Rod {
 public:
  Rod() = default;
  Rod(const Vec3d& start, const Vec3d& end, double radius) noexcept : start_(start), radius_(radius) {
    length_ = (end - start).norm();
    if (length_ > kShortest)
      along_ = (end - start) / length_;
    else
      length_ = 0;
    across_ = 1 - along_.x() * along_.x();
    per_across_ = across_ > kParallel ? 1 / across_ : 0;
    per_along_x_ = std::abs(along_.x()) > kParallel ? 1 / along_.x() : 0;
  }

  [[nodiscard]] const Vec3d& along() const noexcept { return along_; }
  [[nodiscard]] double length() const noexcept { return length_; }

  /// The x of row (y, z) that lie within radius + reach of the segment's line and, along it, of its ends; with
  /// `beyond_start` none before the start.
  [[nodiscard]] RowSpan row(double y, double z, double reach, bool beyond_start = false) const noexcept {
    constexpr double kAll = std::numeric_limits<double>::max();
    const double r = radius_ + reach;
    const double first = beyond_start ? 0 : -r;
    const double dy = y - start_.y();
    const double dz = z - start_.z();
    const double q = dy * along_.y() + dz * along_.z();
    const double b = along_.x() * q;
    const double c = dy * dy + dz * dz - q * q - r * r;
    RowSpan span{-kAll, kAll};
    if (per_across_ > 0) {
      const double root = b * b - across_ * c;
      if (!(root >= 0)) return {};
      const double half = std::sqrt(root) * per_across_;
      span = {b * per_across_ - half, b * per_across_ + half};
    } else if (c > r * r * kParallel) {
      return {};
    }
    if (per_along_x_ != 0) {
      const double s0 = (first - q) * per_along_x_;
      const double s1 = (length_ + r - q) * per_along_x_;
      span.lo = std::max(span.lo, std::min(s0, s1));
      span.hi = std::min(span.hi, std::max(s0, s1));
    } else if (q < first || q > length_ + r) {
      return {};
    }
    return {span.lo + start_.x(), span.hi + start_.x()};
  }

 private:
  static constexpr double kParallel = 1e-6;
  static constexpr double kShortest = 1e-9;  // [m]: no device resolves it, and its direction would be noise
  Vec3d start_ = Vec3d::Zero();
  Vec3d along_ = Vec3d::Zero();
  double radius_ = 0;
  double length_ = 0;
  double across_ = 1;
  double per_across_ = 1;
  double per_along_x_ = 0;
};

}  // namespace detail

/// A ball, swept in a straight line from where its centre was to where it is: a capsule, exact for any length, so that
/// what a tick leaves out the next one does not have to make up for. A still ball has equal centres. Where the ball at
/// the start is cut already (`start_is_cut`), the rows leave out what is nearest to it: half the work of a short way.
class SphereCutter {
 public:
  SphereCutter(const Vec3d& p_GC_previous, const Vec3d& p_GC, double radius, bool start_is_cut = false) noexcept
      : start_(p_GC_previous),
        end_(p_GC),
        radius_(radius),
        start_is_cut_(start_is_cut),
        rod_(Vec3d::Zero(), p_GC - p_GC_previous, radius) {
    along_ = rod_.along().cast<float>();
    length_ = static_cast<float>(rod_.length());
  }

  [[nodiscard]] double signed_distance(const Vec3d& p_G) const noexcept {
    const Vec3d p = p_G - start_;
    const double t = std::clamp(p.dot(rod_.along()), 0.0, rod_.length());
    return (p - t * rod_.along()).norm() - radius_;
  }

  [[nodiscard]] Eigen::AlignedBox3d bounds() const noexcept {
    // Written so that a NaN in either end shows: min and max drop it.
    const Vec3d centre = (start_ + end_) / 2;
    const Vec3d half = (end_ - start_).cwiseAbs() / 2 + Vec3d::Constant(radius_);
    return {centre - half, centre + half};
  }

  [[nodiscard]] Vec3d origin() const noexcept { return start_; }
  [[nodiscard]] RowSpan row(double y, double z, double reach) const noexcept {
    return rod_.row(y, z, reach, start_is_cut_);
  }

  void distances(float x, float step, float y, float z, CutLanes& out) const noexcept {
    const float ax = along_.x(), ay = along_.y(), az = along_.z();
    // Bounds in variables: known ones make compilers turn the clamp into jumps, and the loop stays scalar.
    const float start = start_at_, length = length_;
    const float t0 = y * ay + z * az;
    for (std::size_t l = 0; l < kCutLanes; ++l) {
      const float px = x + step * static_cast<float>(static_cast<int>(l));
      float t = t0 + px * ax;
      t = t < length ? t : length;
      t = t > start ? t : start;
      const float dx = px - t * ax;
      const float dy = y - t * ay;
      const float dz = z - t * az;
      out[l] = dx * dx + dy * dy + dz * dz;
    }
    detail::take_roots(out);
    const auto radius = static_cast<float>(radius_);
    for (std::size_t l = 0; l < kCutLanes; ++l) out[l] -= radius;
  }

 private:
  Vec3d start_;
  Vec3d end_;
  double radius_;
  bool start_is_cut_;
  detail::Rod rod_;
  Vec3<float> along_;
  float start_at_ = 0;
  float length_ = 0;
};

static_assert(Cutter<SphereCutter>);

}  // namespace trephine
