// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/friction.hpp>
#include <trephine/render/coupled/foundation.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace trephine {

/// Friction of all contact after a small motion (δp, δθ) of the tool about T's origin, G axes.
struct FrictionSum {
  Vec6d wrench = Vec6d::Zero();     ///< force [N] and torque about T's origin [N·m] on the tool
  Mat6d stiffness = Mat6d::Zero();  ///< −∂wrench by the motion; not symmetric, as slipping follows the pressure
};

/// Friction as a brush: every point of the foundation has a bristle that bends along the surface, as stiff as the
/// foundation there, from where it began to touch. Coulomb's law bounds its bend by μ times the point's depth; the rest
/// slips. So a element of contact sticks, slides, spins and rolls by one law at a point, and friction only takes
/// energy: a bristle is unbent where it comes into contact, and its energy is lost when it leaves.
///
/// Bends belong to points of the bone (`NearBlock::key` and sample), so that they last from tick to tick whatever list
/// the points are in. A law that holds nothing (`Coulomb{0, 0}`) is asked once, and is as none.
template <Friction Law>
class Bristles {
 public:
  explicit Bristles(const Law& law)
      : law_(law), holds_(!(law.slip(std::numeric_limits<double>::min(), 1.0, true) > 0)) {}

  /// Whether there is any friction.
  [[nodiscard]] bool holds() const noexcept { return holds_; }

  /// Takes memory for bristles on `elements` elements at once, with as many points each, and for `points` points in
  /// all.
  void reserve(std::size_t elements, std::size_t per_element, std::size_t points) {
    if (!holds_) return;
    per_element_ = per_element;
    rows_.clear();
    rows_.reserve(elements);
    bends_.assign(elements * per_element, {});
    table_.assign(std::bit_ceil(4 * elements), kNone);
    lanes_.resize((points + kProfileLanes - 1) / kProfileLanes);
  }

  /// Unbends all bristles.
  void reset() noexcept {
    for (const Row& r : rows_) table_[r.slot] = kNone;
    rows_.clear();
    count_ = 0;
  }

  /// A tick begins with the tool at X.
  void begin(const Posed& X) noexcept { X_begin_ = X; }

  /// Takes the points that the foundation found with the tool at X, k its stiffness [N/m³].
  void attach(std::span<const FoundationPoint> points, const Posed& X, double k) noexcept {
    if (!holds_) return;
    // The tool's material at a point has come from where it was when the tick began.
    const Mat3d from = inverse_rotation(X), to = X_begin_.linear();
    const Mat3d back = to * from - Mat3d::Identity();
    const Vec3d moved = X.translation() - X_begin_.translation();
    count_ = std::min(points.size(), lanes_.size() * kProfileLanes);
    const Bend* row = nullptr;
    for (std::size_t i = 0; i < count_; ++i) {
      const FoundationPoint& q = points[i];
      if (i == 0 || points[i - 1].element != q.element) {
        const std::int32_t r = table_[find(q.element)];
        row = r == kNone ? nullptr : &bends_[static_cast<std::size_t>(r) * per_element_];
      }
      Group& g = lanes_[i / kProfileLanes];
      const std::size_t l = i % kProfileLanes;
      const Vec3d bend = moved - back * q.arm + (row ? row[q.sample].way : Vec3d(Vec3d::Zero()));
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto e = static_cast<Eigen::Index>(axis);
        g.arm[axis][l] = q.arm[e];
        g.normal[axis][l] = q.normal[e];
        g.bend[axis][l] = bend[e];
      }
      g.depth[l] = q.depth;
      g.active[l] = q.active;
      g.stiffness[l] = k * q.weight;
      g.slid[l] = row && row[q.sample].slid ? 1.0 : 0.0;
    }
    for (std::size_t i = count_; i % kProfileLanes != 0; ++i) lanes_[i / kProfileLanes].clear(i % kProfileLanes);
  }

  /// The bristles' forces where the tool has moved on by a small motion, to first order in the points' depths.
  [[nodiscard]] FrictionSum at(const Vec6d& motion) const noexcept {
    std::array<Lanes, 42> sums{};
    for (std::size_t i = 0; i < groups(); ++i) {
      const Group& g = lanes_[i];
      const Bent b = bent(g, motion);
      // −∂f by the point's way: c1 (1 − n nᵀ) + (c2 − c1) t tᵀ + c3 t nᵀ, t along the bend.
      Lanes c1, c2, c3;
      for (std::size_t l = 0; l < kProfileLanes; ++l) {
        const bool slides = b.slides[l] > 0;
        c1[l] = g.stiffness[l] * b.share[l];
        c2[l] = slides ? 0.0 : g.stiffness[l];
        c3[l] = slides && b.depth[l] > 0 ? c1[l] * b.length[l] / b.depth[l] * g.active[l] : 0.0;
      }
      for (std::size_t l = 0; l < kProfileLanes; ++l) {
        const double n[3] = {g.normal[0][l], g.normal[1][l], g.normal[2][l]};
        const double a[3] = {g.arm[0][l], g.arm[1][l], g.arm[2][l]};
        const double v[3] = {b.way[0][l], b.way[1][l], b.way[2][l]};
        const double inverse = b.length[l] > 0 ? 1 / b.length[l] : 0.0;
        const double t[3] = {v[0] * inverse, v[1] * inverse, v[2] * inverse};
        // Rows of 3 by the six motions: C and what turns do.
        double M[3][6], f[3];
        for (int r = 0; r < 3; ++r) {
          f[r] = -c1[l] * v[r];
          const double along = (c2[l] - c1[l]) * t[r];
          double C[3];
          for (int c = 0; c < 3; ++c)
            C[c] = (r == c ? c1[l] : 0.0) - c1[l] * n[r] * n[c] + along * t[c] + c3[l] * t[r] * n[c];
          for (int c = 0; c < 3; ++c) M[r][c] = C[c];
          M[r][3] = a[1] * C[2] - a[2] * C[1];
          M[r][4] = a[2] * C[0] - a[0] * C[2];
          M[r][5] = a[0] * C[1] - a[1] * C[0];
        }
        for (std::size_t r = 0; r < 3; ++r) {
          const std::size_t s = (r + 1) % 3, q = (r + 2) % 3;
          sums[r][l] += f[r];
          sums[r + 3][l] += a[s] * f[q] - a[q] * f[s];
          for (std::size_t c = 0; c < 6; ++c) {
            sums[6 + 6 * r + c][l] += M[r][c];
            sums[24 + 6 * r + c][l] += a[s] * M[q][c] - a[q] * M[s][c];
          }
        }
      }
    }
    FrictionSum out;
    const auto total = [&](std::size_t i) {
      return Eigen::Map<const Eigen::Array<double, static_cast<int>(kProfileLanes), 1>>(sums[i].data()).sum();
    };
    for (std::size_t r = 0; r < 6; ++r) {
      out.wrench[static_cast<Eigen::Index>(r)] = total(r);
      for (std::size_t c = 0; c < 6; ++c)
        out.stiffness(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) = total(6 + 6 * r + c);
    }
    return out;
  }

  /// Ends a tick with the tool moved on by `motion` since `attach(points, …)`: bristles slip as far as their law says,
  /// and those that touch no more are gone. Calls visit(i, f) with the force on the tool of point i's bristle [N].
  template <class Visit>
  void settle(std::span<const FoundationPoint> points, const Vec6d& motion, Visit&& visit) noexcept {
    if (!holds_) return;
    const std::size_t count = count_;
    reset();
    for (std::size_t first = 0; first < count; first += kProfileLanes) {
      const Group& g = lanes_[first / kProfileLanes];
      const Bent b = bent(g, motion);
      for (std::size_t l = 0; l < std::min(kProfileLanes, count - first); ++l) {
        const FoundationPoint& q = points[first + l];
        const Vec3d left = b.share[l] * Vec3d(b.way[0][l], b.way[1][l], b.way[2][l]);
        visit(first + l, Vec3d(-g.stiffness[l] * left));
        if (rows_.empty() || rows_.back().element != q.element) {
          if (rows_.size() == rows_.capacity()) continue;
          const std::size_t slot = find(q.element);
          table_[slot] = static_cast<std::int32_t>(rows_.size());
          std::fill_n(&bends_[rows_.size() * per_element_], per_element_, Bend{});
          rows_.push_back({q.element, slot});
        }
        bends_[(rows_.size() - 1) * per_element_ + q.sample] = {left, b.slips[l] > 0};
      }
    }
  }

 private:
  using Lanes = ProfileLanes<double>;
  static constexpr std::int32_t kNone = -1;
  /// A bristle that slid and is as long as its law lets it be, but for this share, slides on.
  static constexpr double kAtLimit = 1e-6;

  struct Row {  // of bristles, those of a element
    std::uint64_t element;
    std::size_t slot;  // in the table
  };
  struct Bend {
    Vec3d way = Vec3d::Zero();  // of the tool against the bone, in G [m]
    bool slid = false;          // at the last tick
  };
  /// Points in lanes: arms, normals and bends in G [m], depths [m], stiffnesses [N/m].
  struct Group {
    std::array<Lanes, 3> arm, normal, bend;
    Lanes depth, active, stiffness, slid;

    void clear(std::size_t l) noexcept {
      for (auto* v : {&arm, &normal, &bend})
        for (Lanes& lanes : *v) lanes[l] = 0;
      depth[l] = active[l] = stiffness[l] = slid[l] = 0;
    }
  };
  struct Bent {
    std::array<Lanes, 3> way;  // along the surface, before slipping [m]
    Lanes length, share;       // of the way [m], and what is left of it
    Lanes depth;               // [m]
    Lanes slips, slides;       // now; or would, if it were bent a little more
  };

  [[nodiscard]] std::size_t groups() const noexcept { return (count_ + kProfileLanes - 1) / kProfileLanes; }

  /// Where a element is in the table, or the free place where it would be.
  [[nodiscard]] std::size_t find(std::uint64_t key) const noexcept {
    const std::size_t mask = table_.size() - 1;
    std::size_t t = static_cast<std::size_t>((key * 0x9E3779B97F4A7C15ULL) >> 32) & mask;
    while (table_[t] != kNone && rows_[static_cast<std::size_t>(table_[t])].element != key) t = (t + 1) & mask;
    return t;
  }

  [[nodiscard]] Bent bent(const Group& g, const Vec6d& motion) const noexcept {
    Bent b;
    const double px = motion[0], py = motion[1], pz = motion[2], tx = motion[3], ty = motion[4], tz = motion[5];
    for (std::size_t l = 0; l < kProfileLanes; ++l) {
      const double ax = g.arm[0][l], ay = g.arm[1][l], az = g.arm[2][l];
      const double nx = g.normal[0][l], ny = g.normal[1][l], nz = g.normal[2][l];
      const double sx = px + ty * az - tz * ay, sy = py + tz * ax - tx * az, sz = pz + tx * ay - ty * ax;
      const double deeper = g.depth[l] + g.active[l] * (sx * nx + sy * ny + sz * nz);
      b.depth[l] = deeper > 0 ? deeper : 0.0;
      const double wx = g.bend[0][l] + sx, wy = g.bend[1][l] + sy, wz = g.bend[2][l] + sz;
      const double out = wx * nx + wy * ny + wz * nz;
      b.way[0][l] = wx - out * nx;
      b.way[1][l] = wy - out * ny;
      b.way[2][l] = wz - out * nz;
    }
    for (std::size_t l = 0; l < kProfileLanes; ++l)
      b.length[l] = b.way[0][l] * b.way[0][l] + b.way[1][l] * b.way[1][l] + b.way[2][l] * b.way[2][l];
    square_roots(b.length);
    for (std::size_t l = 0; l < kProfileLanes; ++l) {
      const double length = b.length[l], depth = b.depth[l];
      const bool sticking = !(g.slid[l] > 0);
      const double slip = std::min(law_.slip(length, depth, sticking), length);
      b.slips[l] = slip > 0 ? 1.0 : 0.0;
      b.slides[l] = law_.slip(length * (1 + kAtLimit), depth, sticking) > 0 ? 1.0 : 0.0;
      b.share[l] = length > 0 ? (length - std::max(slip, 0.0)) / length : 1.0;
    }
    return b;
  }

  Law law_;
  bool holds_;
  Posed X_begin_ = Posed::Identity();
  std::size_t per_element_ = 0;
  std::vector<Row> rows_;
  std::vector<Bend> bends_;          // per_element_ a row
  std::vector<std::int32_t> table_;  // rows by their elements' hashes
  std::vector<Group> lanes_;         // of the points attached
  std::size_t count_ = 0;
};

template <>
class Bristles<Frictionless> {
 public:
  explicit Bristles(const Frictionless&) noexcept {}
  [[nodiscard]] static constexpr bool holds() noexcept { return false; }
  void reserve(std::size_t, std::size_t, std::size_t) noexcept {}
  void reset() noexcept {}
  void begin(const Posed&) noexcept {}
  void attach(std::span<const FoundationPoint>, const Posed&, double) noexcept {}
  [[nodiscard]] static FrictionSum at(const Vec6d&) noexcept { return {}; }
  template <class Visit>
  void settle(std::span<const FoundationPoint>, const Vec6d&, Visit&&) noexcept {}
};

}  // namespace trephine
