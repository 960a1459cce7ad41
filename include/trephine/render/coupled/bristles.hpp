// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/friction.hpp>
#include <trephine/render/coupled/foundation.hpp>

#include <bit>
#include <limits>
#include <span>
#include <vector>

namespace trephine {

/// Friction as a brush: every point of the foundation has a bristle that bends along the surface, as stiff as the
/// foundation there, from where it began to touch. Coulomb's law bounds its bend by μ times the point's depth; what is
/// beyond slips. So a patch of contact sticks, slides, spins and rolls by one law at a point, and friction only takes
/// energy: a bristle is unbent where it comes into contact, and what it holds when it leaves is lost.
///
/// Bends belong to points of the bone (voxel edge and sample), so that they last from tick to tick whatever list the
/// points are in. A law that holds nothing (`Coulomb{0, 0}`) is asked once, and is as none.
template <Friction Law>
class Bristles {
 public:
  explicit Bristles(const Law& law)
      : law_(law), holds_(!(law.slip(std::numeric_limits<double>::min(), 1.0, true) > 0)) {}

  /// Whether there is any friction.
  [[nodiscard]] bool holds() const noexcept { return holds_; }

  /// Takes memory for bristles on `patches` patches at once, with as many points each.
  void reserve(std::size_t near_patches, std::size_t patches, std::size_t points) {
    if (!holds_) return;
    points_ = points;
    row_of_.assign(near_patches, kNone);
    rows_.clear();
    for (auto* rows : {&rows_, &next_}) rows->reserve(patches);
    for (auto* bristles : {&bristles_, &next_bristles_}) bristles->assign(patches * points, {});
    table_.assign(std::bit_ceil(4 * patches), kNone);
  }

  void reset() noexcept {
    for (const Row& r : rows_)
      if (r.patch != kGone) row_of_[r.patch] = kNone;
    rows_.clear();
  }

  /// A tick begins with the tool at X.
  void begin(const Posed& X) noexcept { X_begin_ = X; }

  /// Finds the bristles' patches in a list that was made anew.
  void follow(const NearPatches& near) noexcept {
    if (!holds_ || generation_ == near.generation()) return;
    generation_ = near.generation();
    std::fill(row_of_.begin(), row_of_.end(), kNone);
    if (rows_.empty()) return;
    for (Row& r : rows_) r.patch = kGone;
    const std::size_t mask = table_.size() - 1;
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      std::size_t t = hash(rows_[r].key) & mask;
      while (table_[t] != kNone) t = (t + 1) & mask;
      table_[t] = static_cast<std::int32_t>(r);
    }
    for (std::size_t i = 0; i < near.size(); ++i)
      for (std::size_t t = hash(near.key(i)) & mask; table_[t] != kNone; t = (t + 1) & mask)
        if (Row& row = rows_[static_cast<std::size_t>(table_[t])]; row.key == near.key(i)) {
          row_of_[i] = table_[t];
          row.patch = i;
          break;
        }
    std::fill(table_.begin(), table_.end(), kNone);
  }

  /// Adds the bristles of the foundation's points to its sum at pose X; k its stiffness [N/m³].
  void add_to(FoundationSum& s, std::span<const FoundationPoint> points, const Posed& X, double k) const noexcept {
    if (!holds_) return;
    const Mat3d R_since = X.linear() * X_begin_.linear().transpose();
    for (const FoundationPoint& q : points) {
      const Bend b = bend(q, X, R_since);
      if (!(b.length > 0)) {
        add_stuck(q, k, s);
        continue;
      }
      const double kw = k * q.weight, left = b.length - b.slip;
      const Vec6d force = with_moment(-kw * left * b.direction, q.arm);
      s.wrench += force;
      s.energy += kw * (b.slip > 0 ? left * (b.length - left / 2) : b.length * b.length / 2);
      const Vec6d T = with_moment(b.direction, q.arm);
      const Vec6d B = with_moment(q.normal.cross(b.direction), q.arm);
      // Newton's derivative at the limit is that of the side where the bristle was last.
      if (!(b.slip > 0) && b.sticking) add_square(s.stiffness, kw, T);
      add_square(s.stiffness, kw * left / b.length, B);
    }
  }

  /// Lets the bristles slip as far as their law says with the tool at X, where the last step brought it after the
  /// points were found, and forgets those that touch no more. Calls visit(i, f) with the force on the tool of point i's
  /// bristle [N].
  template <class Visit>
  void settle(std::span<const FoundationPoint> points, const Vec6d& step, const NearPatches& near, const Posed& X,
              double k, Visit&& visit) noexcept {
    if (!holds_) return;
    const Mat3d R_since = X.linear() * X_begin_.linear().transpose();
    next_.clear();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const FoundationPoint q = after(points[i], step);
      const Bend b = bend(q, X, R_since);
      const Vec3d left = (b.length - b.slip) * b.direction;
      visit(i, Vec3d(-k * q.weight * left));
      if (next_.empty() || next_.back().patch != q.patch) {
        if (next_.size() == next_.capacity()) continue;
        std::fill_n(&next_bristles_[next_.size() * points_], points_, Bristle{});
        next_.push_back({.key = near.key(q.patch), .patch = q.patch});
      }
      Bristle& bristle = next_bristles_[(next_.size() - 1) * points_ + q.sample];
      bristle.bend = left;
      bristle.slid = b.slip > 0;
    }
    for (const Row& r : rows_)
      if (r.patch != kGone) row_of_[r.patch] = kNone;
    rows_.swap(next_);
    bristles_.swap(next_bristles_);
    for (std::size_t r = 0; r < rows_.size(); ++r) row_of_[rows_[r].patch] = static_cast<std::int32_t>(r);
  }

 private:
  static constexpr std::int32_t kNone = -1;
  static constexpr std::size_t kGone = std::numeric_limits<std::size_t>::max();
  struct Bristle {
    Vec3d bend = Vec3d::Zero();  // of the tool against the bone, in G [m]
    bool slid = false;           // at the last tick
  };
  struct Row {  // of bristles, those of a patch
    std::uint64_t key = 0;
    std::size_t patch = 0;  // of the near patches
  };
  struct Bend {
    Vec3d direction;  // unit
    double length;
    double slip;
    bool sticking;  // at the last tick, or new
  };

  [[nodiscard]] static std::size_t hash(std::uint64_t key) noexcept {
    return static_cast<std::size_t>((key * 0x9E3779B97F4A7C15ULL) >> 32);
  }

  [[nodiscard]] Bend bend(const FoundationPoint& q, const Posed& X, const Mat3d& R_since) const noexcept {
    // The tool's material at q has come from where it was when the tick began.
    Vec3d along = X.translation() - X_begin_.translation() + q.arm - R_since.transpose() * q.arm;
    bool sticking = true;
    if (const std::int32_t r = row_of_[q.patch]; r != kNone) {
      const Bristle& b = bristles_[static_cast<std::size_t>(r) * points_ + q.sample];
      along += b.bend;
      sticking = !b.slid;
    }
    along -= along.dot(q.normal) * q.normal;
    Bend out;
    out.sticking = sticking;
    out.length = along.norm();
    out.direction = out.length > 0 ? Vec3d(along / out.length) : Vec3d(Vec3d::Zero());
    out.slip = std::clamp(law_.slip(out.length, q.depth, sticking), 0.0, out.length);
    return out;
  }

  static void add_stuck(const FoundationPoint& q, double k, FoundationSum& s) noexcept {
    const Vec3d t = q.normal.unitOrthogonal();
    const Vec6d T = with_moment(t, q.arm), B = with_moment(q.normal.cross(t), q.arm);
    add_square(s.stiffness, k * q.weight, T);
    add_square(s.stiffness, k * q.weight, B);
  }

  Law law_;
  bool holds_;
  Posed X_begin_ = Posed::Identity();
  std::uint64_t generation_ = 0;
  std::vector<std::int32_t> row_of_;  // of each near patch
  std::size_t points_ = 0;            // of a patch
  std::vector<Row> rows_, next_;
  std::vector<Bristle> bristles_, next_bristles_;
  std::vector<std::int32_t> table_;
};

template <>
class Bristles<Frictionless> {
 public:
  explicit Bristles(const Frictionless&) noexcept {}
  [[nodiscard]] static constexpr bool holds() noexcept { return false; }
  void reserve(std::size_t, std::size_t, std::size_t) noexcept {}
  void reset() noexcept {}
  void begin(const Posed&) noexcept {}
  void follow(const NearPatches&) noexcept {}
  void add_to(FoundationSum&, std::span<const FoundationPoint>, const Posed&, double) const noexcept {}
  template <class Visit>
  void settle(std::span<const FoundationPoint>, const Vec6d&, const NearPatches&, const Posed&, double,
              Visit&&) noexcept {}
};

}  // namespace trephine
