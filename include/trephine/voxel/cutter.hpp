// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/square_roots.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <limits>

/// Bodies that remove bone: the space that a cutting tool sweeps in a tick, in G [m].
namespace trephine::inline TREPHINE_ALIGNED {

/// Number of voxels that are cut together, or half of it for shorter ranges, so that plain loops are vectorised.
inline constexpr int kCutLanes = 16;
using CutLanes = std::array<float, kCutLanes>;
using HalfCutLanes = std::array<float, kCutLanes / 2>;

/// Number of rows that are tested together.
inline constexpr int kCutRows = 16;
using RowLanes = std::array<double, kCutRows>;

/// Ranges of rows along x; a range with hi < lo is empty.
struct RowSpans {
  RowLanes lo;
  RowLanes hi;
};

/// A body given by its signed distance [m] (negative inside, exact outside). Rows are in coordinates relative to
/// `origin()`, so that single precision serves wherever the grid lies:
/// - `bounds()`: a box in G that holds the body;
/// - `rows(y, z, reach, spans)`: span l holds every x of row (y[l], z) that is nearer than `reach` to the body (more is
///   allowed);
/// - `distances(x, step, y, z, out)`: out[l] = distance at (x + l step, y, z), the same bits whatever the lanes;
/// - `shares(x, step, y, z, reach, farthest, out)`: out[l] = how much the tool covers that place on the mean over
///   its way, from 1 at `reach` inside it over 1/2 at its surface to 0 at `reach` outside; 0 from farthest[l] on.
template <class C>
concept Cutter = requires(const C& c, const Vec3d& p_G, double d, float f, CutLanes& out, HalfCutLanes& half,
                          const RowLanes& y, RowSpans& spans) {
  { c.signed_distance(p_G) } noexcept -> std::same_as<double>;
  { c.bounds() } noexcept -> std::same_as<Eigen::AlignedBox3d>;
  { c.origin() } noexcept -> std::same_as<Vec3d>;
  { c.rows(y, d, d, spans) } noexcept;
  { c.distances(f, f, f, f, out) } noexcept;
  { c.distances(f, f, f, f, half) } noexcept;
  { c.shares(f, f, f, f, f, out, out) } noexcept;
  { c.shares(f, f, f, f, f, half, half) } noexcept;
};

namespace detail {

/// Adds `weight` times the share that a tool at these distances covers, where they are below `farthest`.
template <std::size_t kLanes>
void add_shares(const std::array<float, kLanes>& distance, float reach, float weight,
                const std::array<float, kLanes>& farthest, std::array<float, kLanes>& out) noexcept {
  const float per_reach = -0.5F / reach;
  // Eigen, because compilers make jumps of clamps with constant bounds; 32 bytes, as for the roots.
  constexpr std::size_t kPart = 8;
  static_assert(kLanes % kPart == 0);
  using Part = Eigen::Array<float, kPart, 1>;
  for (std::size_t i = 0; i < kLanes; i += kPart) {
    const Eigen::Map<const Part> d(distance.data() + i), most(farthest.data() + i);
    const Part share = weight * (0.5F + d * per_reach).max(0.0F).min(1.0F);
    Eigen::Map<Part>(out.data() + i) += (d < most).select(share, Part::Zero());
  }
}

/// A cylinder along a segment, which bounds the rows of slender bodies. `along` is zero for a point.
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

  /// Returns the ranges of rows (y[l], z) within radius + reach of the segment's line and, along the line, of its ends.
  /// With `beyond_start` a range holds nothing before the start. Plain loops, as for all work per row or voxel.
  void rows(const RowLanes& y, double z, double reach, RowSpans& out, bool beyond_start = false) const noexcept {
    const double ax = along_.x(), ay = along_.y(), az = along_.z();
    const double y0 = start_.y(), dz = z - start_.z();
    const double r = radius_ + reach;
    const double first = beyond_start ? 0 : -r, last = length_ + r;
    const double across = across_, per_across = per_across_, per_along_x = per_along_x_;
    RowLanes q, c, root;
    for (std::size_t l = 0; l < kCutRows; ++l) {
      const double dy = y[l] - y0;
      q[l] = dy * ay + dz * az;
      c[l] = dy * dy + dz * dz - q[l] * q[l] - r * r;
    }
    // A row's depth inside the line's reach, negative outside; then the rows beside the ends.
    RowLanes in;
    if (per_across > 0) {
      for (std::size_t l = 0; l < kCutRows; ++l) {
        const double b = ax * q[l];
        in[l] = b * b - across * c[l];
        root[l] = in[l] > 0 ? in[l] : 0;
      }
      square_roots(root);
      for (std::size_t l = 0; l < kCutRows; ++l) {
        const double b = ax * q[l];
        const double half = root[l] * per_across;
        out.lo[l] = b * per_across - half;
        out.hi[l] = b * per_across + half;
      }
    } else {
      out.lo.fill(-std::numeric_limits<double>::max());
      out.hi.fill(std::numeric_limits<double>::max());
      for (std::size_t l = 0; l < kCutRows; ++l) in[l] = r * r * kParallel - c[l];
    }
    if (per_along_x != 0) {
      for (std::size_t l = 0; l < kCutRows; ++l) {
        const double s0 = (first - q[l]) * per_along_x;
        const double s1 = (last - q[l]) * per_along_x;
        const double lo = s0 < s1 ? s0 : s1;
        const double hi = s0 < s1 ? s1 : s0;
        out.lo[l] = out.lo[l] > lo ? out.lo[l] : lo;
        out.hi[l] = out.hi[l] < hi ? out.hi[l] : hi;
      }
    } else {
      for (std::size_t l = 0; l < kCutRows; ++l) {
        const double before = q[l] - first;
        const double beyond = last - q[l];
        const double along = before < beyond ? before : beyond;
        in[l] = in[l] < along ? in[l] : along;
      }
    }
    const double x0 = start_.x();
    for (std::size_t l = 0; l < kCutRows; ++l) {
      out.lo[l] += x0;
      out.hi[l] += x0;
    }
    for (std::size_t l = 0; l < kCutRows; ++l) {
      const double lo = out.lo[l], hi = out.hi[l];
      out.lo[l] = in[l] >= 0 ? lo : 1.0;
      out.hi[l] = in[l] >= 0 ? hi : -1.0;
    }
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

/// A ball swept in a straight line between two centres: a capsule, exact for any length, so that no tick leaves bone
/// for the next one. A still ball has equal centres. If the ball at the start is cut already (`start_is_cut`), the rows
/// leave out the part nearest to it, which is half the work of a short path.
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
  void rows(const RowLanes& y, double z, double reach, RowSpans& out) const noexcept {
    rod_.rows(y, z, reach, out, start_is_cut_);
  }

  template <std::size_t kLanes>
  void distances(float x, float step, float y, float z, std::array<float, kLanes>& out) const noexcept {
    const float ax = along_.x(), ay = along_.y(), az = along_.z();
    // Variable bounds: compilers turn clamps with constant bounds into jumps, and the loop stays scalar.
    const float start = start_at_, length = length_;
    const float t0 = y * ay + z * az;
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float px = x + step * static_cast<float>(static_cast<int>(l));
      float t = t0 + px * ax;
      t = t < length ? t : length;
      t = t > start ? t : start;
      const float dx = px - t * ax;
      const float dy = y - t * ay;
      const float dz = z - t * az;
      out[l] = dx * dx + dy * dy + dz * dz;
    }
    square_roots(out);
    const auto radius = static_cast<float>(radius_);
    for (std::size_t l = 0; l < kLanes; ++l) out[l] -= radius;
  }

  /// Integrates the share over the path with three Gauss points; over a short path with its middle, which is within
  /// .008 of the mean. Consecutive ticks cover a path's whole duration.
  template <std::size_t kLanes>
  void shares(float x, float step, float y, float z, float reach, const std::array<float, kLanes>& farthest,
              std::array<float, kLanes>& out) const noexcept {
    out.fill(0);
    if (!(length_ > kShortWay * reach)) return add_shares_at(length_ / 2, 1, x, step, y, z, reach, farthest, out);
    constexpr std::array<float, 3> kPlace{0.112701665F, 0.5F, 0.887298335F}, kWeight{5 / 18.0F, 8 / 18.0F, 5 / 18.0F};
    for (std::size_t i = 0; i < 3; ++i)
      add_shares_at(kPlace[i] * length_, kWeight[i], x, step, y, z, reach, farthest, out);
  }

 private:
  /// [reaches]
  static constexpr float kShortWay = 0.125F;

  /// Adds the shares with the ball's centre at this fraction of the path.
  template <std::size_t kLanes>
  void add_shares_at(float t, float weight, float x, float step, float y, float z, float reach,
                     const std::array<float, kLanes>& farthest, std::array<float, kLanes>& out) const noexcept {
    const float px = x - t * along_.x(), dy = y - t * along_.y(), dz = z - t * along_.z();
    std::array<float, kLanes> d;
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float dx = px + step * static_cast<float>(static_cast<int>(l));
      d[l] = dx * dx + dy * dy + dz * dz;
    }
    square_roots(d);
    const auto radius = static_cast<float>(radius_);
    for (std::size_t l = 0; l < kLanes; ++l) d[l] -= radius;
    detail::add_shares(d, reach, weight, farthest, out);
  }

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
