// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/friction.hpp>
#include <trephine/core/lane_sum.hpp>
#include <trephine/core/spatial.hpp>
#include <trephine/core/square_roots.hpp>
#include <trephine/render/coupled/coupled_constants.hpp>
#include <trephine/render/coupled/foundation.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// Friction of all contact after a small motion (δp, δθ) of the tool about T's origin, in G axes.
struct FrictionSum {
  Vec6d wrench = Vec6d::Zero();     ///< force [N] and torque about T's origin [N·m] on the tool
  Mat6d stiffness = Mat6d::Zero();  ///< −∂wrench by the motion; not symmetric, as the slip limit follows the pressure
};

/// Friction as a brush: every contact point has a bristle that deflects along the surface and slips at Coulomb's limit.
///
/// A bristle is as stiff as the foundation at its point. It deflects from the place where its point came into contact.
/// The law bounds its deflection by μ times the point's depth; the rest slips. So an area of contact sticks, slides,
/// spins and rolls by one law at a point. Friction only dissipates: a bristle starts undeflected, and its energy is
/// lost when its point leaves.
///
/// Deflections belong to points of the bone (`NearBlock::key` and sample). So they last from tick to tick, whatever
/// list holds the points. A law without friction (`Coulomb{0, 0}`) is evaluated once, and then costs nothing.
template <Friction Law>
class Bristles {
 public:
  explicit Bristles(const Law& law)
      : law_(law), has_friction_(!(law.slip(std::numeric_limits<double>::min(), 1.0, true) > 0)) {}

  /// Returns false for a law that slips at any force.
  [[nodiscard]] bool has_friction() const noexcept { return has_friction_; }

  /// Allocates bristles for `points` points in contact at once, on `elements` elements.
  void reserve(std::size_t elements, std::size_t points) {
    if (!has_friction_) return;
    rows_.clear();
    rows_.reserve(elements);
    table_.assign(std::bit_ceil(4 * elements), kNone);
    groups_.resize((points + kProfileLanes - 1) / kProfileLanes);
    deflections_.reserve(groups_.size() * kProfileLanes);
  }

  /// Takes the deflections of others with the same room.
  void take(const Bristles& other) {
    law_ = other.law_;
    has_friction_ = other.has_friction_;
    X_start_ = other.X_start_;
    rows_ = other.rows_;
    deflections_ = other.deflections_;
    table_ = other.table_;
    count_ = 0;
  }
  /// Removes all deflections.
  void reset() noexcept {
    for (const ElementRow& r : rows_) table_[r.slot] = kNone;
    rows_.clear();
    deflections_.clear();
    count_ = 0;
  }

  /// Starts a tick with the tool at X, in G. Later motion in the tick deflects bristles.
  void begin_tick(const Posed& X) noexcept { X_start_ = X; }

  /// Takes the contact points found with the tool at X; k is the foundation's stiffness [N/m³].
  void attach(std::span<const FoundationPoint> points, const Posed& X, double k) noexcept {
    if (!has_friction_) return;
    // Displacement of the tool's material at a point since the start of the tick: moved − back · arm.
    const Mat3d from = inverse_rotation(X), to = X_start_.linear();
    const Mat3d back = product(to, from) - Mat3d::Identity();
    const Vec3d moved = X.translation() - X_start_.translation();
    count_ = std::min(points.size(), groups_.size() * kProfileLanes);
    // Deflections of the point's element that are not of earlier points.
    std::span<const Deflection> row;
    for (std::size_t i = 0; i < count_; ++i) {
      const FoundationPoint& q = points[i];
      if (i == 0 || points[i - 1].element != q.element) row = deflections_of(q.element);
      while (!row.empty() && row.front().sample < q.sample) row = row.subspan(1);
      const bool is_bent = !row.empty() && row.front().sample == q.sample;
      PointGroup& g = groups_[i / kProfileLanes];
      const std::size_t l = i % kProfileLanes;
      const Vec3d deflection =
          moved - product(back, q.arm) + (is_bent ? row.front().displacement : Vec3d(Vec3d::Zero()));
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto e = static_cast<Eigen::Index>(axis);
        g.arm[axis][l] = q.arm[e];
        g.normal[axis][l] = q.normal[e];
        g.deflection[axis][l] = deflection[e];
      }
      g.depth[l] = q.depth;
      g.depth_slope[l] = q.depth_slope;
      g.stiffness[l] = k * q.weight;
      g.slipped[l] = is_bent && row.front().slipped ? 1.0 : 0.0;
    }
    for (std::size_t i = count_; i % kProfileLanes != 0; ++i) groups_[i / kProfileLanes].clear(i % kProfileLanes);
  }

  /// Returns friction and its derivative after a small motion of the tool since `attach`. The points' depths follow the
  /// motion to first order.
  [[nodiscard]] FrictionSum linearise(const Vec6d& motion) const noexcept {
    // 6 of the wrench, 36 of the stiffness by rows. Few lanes: sums across lanes cost as much as the points.
    constexpr std::size_t kSumLanes = 4;
    std::array<std::array<double, kSumLanes>, 42> sums{};
    for (std::size_t group = 0; group < group_count(); ++group) {
      const PointGroup& g = groups_[group];
      const Trial b = trial(g, motion);
      // −∂f by the point's displacement: c1 (1 − n nᵀ) + (c2 − c1) t tᵀ + c3 t nᵀ, t along the deflection.
      Lanes c1, c2, c3, divisor, is_pressed, per_length;
      for (std::size_t l = 0; l < kProfileLanes; ++l) {
        divisor[l] = b.depth[l] > 0 ? b.depth[l] : 1.0;
        is_pressed[l] = b.depth[l] > 0 ? 1.0 : 0.0;
      }
      for (std::size_t l = 0; l < kProfileLanes; ++l) {
        c1[l] = g.stiffness[l] * b.kept[l];
        c2[l] = g.stiffness[l] * (1 - b.slips_on[l]);
        c3[l] = b.slips_on[l] * is_pressed[l] * (c1[l] * b.length[l] / divisor[l] * g.depth_slope[l]);
      }
      // A deflection of length 0 is 0, and any factor gives it no direction.
      for (std::size_t l = 0; l < kProfileLanes; ++l) divisor[l] = b.length[l] > 0 ? b.length[l] : 1.0;
      for (std::size_t l = 0; l < kProfileLanes; ++l) per_length[l] = 1 / divisor[l];
      for (std::size_t first = 0; first < kProfileLanes; first += kSumLanes)
        for (std::size_t i = 0; i < kSumLanes; ++i) {
          const std::size_t l = first + i;
          const double n[3] = {g.normal[0][l], g.normal[1][l], g.normal[2][l]};
          const double a[3] = {g.arm[0][l], g.arm[1][l], g.arm[2][l]};
          const double v[3] = {b.tangential[0][l], b.tangential[1][l], b.tangential[2][l]};
          const double t[3] = {v[0] * per_length[l], v[1] * per_length[l], v[2] * per_length[l]};
          // M = (C, −C [a]×): derivatives by translation and by rotation.
          double M[3][6], f[3], turned[3];
          for (int c = 0; c < 3; ++c) turned[c] = (c2[l] - c1[l]) * t[c] + c3[l] * n[c];
          for (int r = 0; r < 3; ++r) {
            f[r] = -c1[l] * v[r];
            const double across = c1[l] * n[r];
            double C[3];
            for (int c = 0; c < 3; ++c) C[c] = (r == c ? c1[l] : 0.0) - across * n[c] + t[r] * turned[c];
            for (int c = 0; c < 3; ++c) M[r][c] = C[c];
            M[r][3] = a[1] * C[2] - a[2] * C[1];
            M[r][4] = a[2] * C[0] - a[0] * C[2];
            M[r][5] = a[0] * C[1] - a[1] * C[0];
          }
          for (std::size_t r = 0; r < 3; ++r) {
            const std::size_t s = (r + 1) % 3, q = (r + 2) % 3;
            sums[r][i] += f[r];
            sums[r + 3][i] += a[s] * f[q] - a[q] * f[s];
            for (std::size_t c = 0; c < 6; ++c) {
              sums[6 + 6 * r + c][i] += M[r][c];
              sums[24 + 6 * r + c][i] += a[s] * M[q][c] - a[q] * M[s][c];
            }
          }
        }
    }
    FrictionSum friction;
    for (std::size_t r = 0; r < 6; ++r) {
      friction.wrench[static_cast<Eigen::Index>(r)] = lane_sum(sums[r]);
      for (std::size_t c = 0; c < 6; ++c)
        friction.stiffness(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) = lane_sum(sums[6 + 6 * r + c]);
    }
    return friction;
  }

  /// Ends a tick after a small motion of the tool since `attach(points, …)`: stores the deflections that remain after
  /// slip, and removes those of points out of contact. Calls visit(i, f) with the force of point i's bristle on the
  /// tool [N].
  template <class Visit>
  void commit(std::span<const FoundationPoint> points, const Vec6d& motion, Visit&& visit) noexcept {
    if (!has_friction_) return;
    const std::size_t count = count_;
    reset();
    for (std::size_t first = 0; first < count; first += kProfileLanes) {
      const PointGroup& g = groups_[first / kProfileLanes];
      const Trial b = trial(g, motion);
      for (std::size_t l = 0; l < std::min(kProfileLanes, count - first); ++l) {
        const FoundationPoint& q = points[first + l];
        const Vec3d kept = b.kept[l] * Vec3d(b.tangential[0][l], b.tangential[1][l], b.tangential[2][l]);
        visit(first + l, Vec3d(-g.stiffness[l] * kept));
        if (rows_.empty() || rows_.back().element != q.element) {
          if (rows_.size() == rows_.capacity()) continue;
          const std::size_t slot = find(q.element);
          table_[slot] = static_cast<std::int32_t>(rows_.size());
          rows_.push_back({q.element, slot, deflections_.size(), 0});
        }
        deflections_.push_back({q.sample, kept, b.slips[l] > 0});
        ++rows_.back().count;
      }
    }
  }

 private:
  using Lanes = ProfileLanes<double>;
  static constexpr std::int32_t kNone = -1;

  /// An element in contact, whose points have a row of deflections.
  struct ElementRow {
    std::uint64_t element;
    std::size_t slot;          // index in table_
    std::size_t first, count;  // of its deflections
  };
  /// A point in contact. Points of an element are in their order.
  struct Deflection {
    std::size_t sample;  // `FoundationPoint::sample`
    Vec3d displacement;  // of the tool against the bone, in G [m]
    bool slipped;        // at the last tick
  };
  /// Contact points in lanes: arms, normals and deflections in G [m], depths [m], stiffnesses [N/m].
  struct PointGroup {
    std::array<Lanes, 3> arm, normal, deflection;
    Lanes depth, depth_slope, stiffness, slipped;

    void clear(std::size_t l) noexcept {
      for (auto* v : {&arm, &normal, &deflection})
        for (Lanes& lanes : *v) lanes[l] = 0;
      depth[l] = depth_slope[l] = stiffness[l] = slipped[l] = 0;
    }
  };
  /// Trial deflections after a motion, and their return to Coulomb's cone.
  struct Trial {
    std::array<Lanes, 3> tangential;  // trial deflection in the tangent plane, before slip [m]
    Lanes length;                     // of the trial deflection [m]
    Lanes kept;                       // fraction of it that remains after slip
    Lanes depth;                      // [m]
    Lanes slips, slips_on;            // slips; would slip at a slightly larger deflection
  };

  [[nodiscard]] std::size_t group_count() const noexcept { return (count_ + kProfileLanes - 1) / kProfileLanes; }

  /// Returns an element's slot in the hash table, or the free slot where it would be stored.
  [[nodiscard]] std::size_t find(std::uint64_t key) const noexcept {
    const std::size_t mask = table_.size() - 1;
    std::size_t t = static_cast<std::size_t>((key * 0x9E3779B97F4A7C15ULL) >> 32) & mask;
    while (table_[t] != kNone && rows_[static_cast<std::size_t>(table_[t])].element != key) t = (t + 1) & mask;
    return t;
  }

  [[nodiscard]] std::span<const Deflection> deflections_of(std::uint64_t element) const noexcept {
    const std::int32_t r = table_[find(element)];
    if (r == kNone) return {};
    const ElementRow& row = rows_[static_cast<std::size_t>(r)];
    return {&deflections_[row.first], row.count};
  }

  [[nodiscard]] Trial trial(const PointGroup& g, const Vec6d& motion) const noexcept {
    Trial b;
    const double px = motion[0], py = motion[1], pz = motion[2], tx = motion[3], ty = motion[4], tz = motion[5];
    for (std::size_t l = 0; l < kProfileLanes; ++l) {
      const double ax = g.arm[0][l], ay = g.arm[1][l], az = g.arm[2][l];
      const double nx = g.normal[0][l], ny = g.normal[1][l], nz = g.normal[2][l];
      const double sx = px + ty * az - tz * ay, sy = py + tz * ax - tx * az, sz = pz + tx * ay - ty * ax;
      const double depth = g.depth[l] + g.depth_slope[l] * (sx * nx + sy * ny + sz * nz);
      b.depth[l] = depth > 0 ? depth : 0.0;
      const double wx = g.deflection[0][l] + sx, wy = g.deflection[1][l] + sy, wz = g.deflection[2][l] + sz;
      const double normal = wx * nx + wy * ny + wz * nz;
      b.tangential[0][l] = wx - normal * nx;
      b.tangential[1][l] = wy - normal * ny;
      b.tangential[2][l] = wz - normal * nz;
    }
    for (std::size_t l = 0; l < kProfileLanes; ++l)
      b.length[l] = b.tangential[0][l] * b.tangential[0][l] + b.tangential[1][l] * b.tangential[1][l] +
                    b.tangential[2][l] * b.tangential[2][l];
    square_roots(b.length);
    Lanes slip, slip_on, divisor;
    for (std::size_t l = 0; l < kProfileLanes; ++l) {
      const bool sticking = !(g.slipped[l] > 0);
      slip[l] = law_.slip(b.length[l], b.depth[l], sticking);
      slip_on[l] = law_.slip(b.length[l] * (1 + CoupledConstants::kSlipMargin), b.depth[l], sticking);
    }
    for (std::size_t l = 0; l < kProfileLanes; ++l) {
      const double length = b.length[l], bounded = slip[l] < length ? slip[l] : length;
      b.slips[l] = bounded > 0 ? 1.0 : 0.0;
      b.slips_on[l] = slip_on[l] > 0 ? 1.0 : 0.0;
      slip[l] = bounded > 0 ? bounded : 0.0;
      divisor[l] = length > 0 ? length : 1.0;
    }
    for (std::size_t l = 0; l < kProfileLanes; ++l) b.kept[l] = (divisor[l] - slip[l]) / divisor[l];
    return b;
  }

  Law law_;
  bool has_friction_;
  Posed X_start_ = Posed::Identity();  // of the tick
  std::vector<ElementRow> rows_;
  std::vector<Deflection> deflections_;  // row by row
  std::vector<std::int32_t> table_;      // hash table: row by element
  std::vector<PointGroup> groups_;       // the attached points
  std::size_t count_ = 0;                // of the attached points
};

/// Without friction: empty, and free of cost.
template <>
class Bristles<Frictionless> {
 public:
  explicit Bristles(const Frictionless&) noexcept {}
  [[nodiscard]] static constexpr bool has_friction() noexcept { return false; }
  void reserve(std::size_t, std::size_t) noexcept {}
  void take(const Bristles&) noexcept {}
  void reset() noexcept {}
  void begin_tick(const Posed&) noexcept {}
  void attach(std::span<const FoundationPoint>, const Posed&, double) noexcept {}
  [[nodiscard]] static FrictionSum linearise(const Vec6d&) noexcept { return {}; }
  template <class Visit>
  void commit(std::span<const FoundationPoint>, const Vec6d&, Visit&&) noexcept {}
};

}  // namespace trephine
