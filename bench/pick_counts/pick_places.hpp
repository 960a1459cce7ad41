// SPDX-License-Identifier: MIT
#pragma once

#include "support/random.hpp"

#include <trephine/contact/surface_search.hpp>
#include <trephine/core/math.hpp>
#include <trephine/core/rotation.hpp>
#include <trephine/core/wrench.hpp>
#include <trephine/tool/revolved_tool.hpp>
#include <trephine/tool/surface_discretization.hpp>
#include <trephine/voxel/density_field.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <optional>
#include <vector>

namespace pick {

using trephine::Burr;
using trephine::Mat3d;
using trephine::Posed;
using trephine::Vec3d;
using trephine::Wrenchd;
using trephine::test::Random;

/// A unit vector square to the unit vector `axis`.
[[nodiscard]] inline Vec3d square_to(const Vec3d& axis, Random& random) {
  const double a = random.uniform(0, 2 * std::numbers::pi);
  const Vec3d u = axis.unitOrthogonal();
  return std::cos(a) * u + std::sin(a) * axis.cross(u);
}
/// Evenly over the part of the unit sphere whose angle to the unit vector `axis` has a cosine of `least` or more.
[[nodiscard]] inline Vec3d direction_near(const Vec3d& axis, double least, Random& random) {
  const double c = random.uniform(least, 1);
  return c * axis + std::sqrt(std::max(0.0, 1 - c * c)) * square_to(axis, random);
}

using Grid = trephine::VoxelGrid<std::int16_t>;
using Field = trephine::DensityField<std::int16_t, double>;

/// What a short run of the tool was aimed at.
enum class Kind { kTipPress, kShaftLean, kSlide };
inline constexpr int kKinds = 3;
inline constexpr std::array<const char*, kKinds> kKindNames{"tip presses", "shaft on ridges and edges", "sliding"};

/// A run of the tool, a pose a tick: from just free of the bone into it. The Line approximation has a history, so a
/// single pose says nothing about it.
struct Case {
  Kind kind = Kind::kTipPress;
  std::vector<Posed> X_GT{};  ///< of the tool in the grid, one a tick of 1 ms
};

[[nodiscard]] inline std::size_t tick_count(const std::vector<Case>& cases) {
  std::size_t n = 0;
  for (const Case& c : cases) n += c.X_GT.size();
  return n;
}

/// How many there are of each kind.
[[nodiscard]] inline std::array<int, kKinds> count_kinds(const std::vector<Case>& cases) {
  std::array<int, kKinds> counts{};
  for (const Case& c : cases) ++counts[static_cast<std::size_t>(c.kind)];
  return counts;
}

/// Where an algorithm feels: Line with the ball's centre and the shaft's centreline, Surface and Coupled with the skins
/// of both. The same hand pose is a different contact for each, so each is tried at contacts of its own.
enum class Algorithm { kLine, kSurface, kCoupled };
inline constexpr std::array kAlgorithms{Algorithm::kLine, Algorithm::kSurface, Algorithm::kCoupled};

[[nodiscard]] inline const char* name_of(Algorithm a) {
  return std::array{"line", "surface", "coupled"}[static_cast<std::size_t>(a)];
}

[[nodiscard]] inline const char* title_of(Algorithm a) {
  return std::array{"Line", "Surface", "Coupled"}[static_cast<std::size_t>(a)];
}

/// Points that stand closely over what an algorithm feels with: says whether it touches the bone.
class Feeler {
 public:
  /// Points lie about `spacing` [m] apart. `tool`: in place of the burr, which then has its size.
  Feeler(Algorithm algorithm, const Burr& burr, double spacing, const std::optional<trephine::RevolvedTool>& tool = {})
      : algorithm_(algorithm), burr_(burr) {
    const double length = burr.has_shaft() ? burr.shaft_length : 0;
    points_.push_back({0, 0, 0});
    if (algorithm == Algorithm::kLine) {
      if (length > 0) add_column(burr.tip_radius, length, 0, spacing);
    } else if (tool) {
      add_outline(tool->outline(), spacing);
    } else {
      const double R = burr.tip_radius;
      const double per_area = spacing * spacing;
      const int on_ball = std::clamp(static_cast<int>(4 * std::numbers::pi * R * R / per_area), 200, 4000);
      for (const auto& d : trephine::spread_over_sphere(on_ball).directions) points_.push_back(R * d);
      const double r = burr.shaft_radius;
      const int columns = std::clamp(static_cast<int>(2 * std::numbers::pi * r / spacing), 12, 64);
      for (int i = 0; i < columns && length > 0; ++i)
        add_column(burr.shaft_emerges(), length, 2 * std::numbers::pi * i / columns, spacing, r);
    }
    points_.pad();
    values_.resize(static_cast<std::size_t>(points_.size()));
  }

  [[nodiscard]] bool touches(const Field& field, const Posed& X_GT) {
    field.values(X_GT, points_.x.data(), points_.y.data(), points_.z.data(), values_.data(), points_.size());
    return *std::max_element(values_.begin(), values_.end()) >= 0;
  }

  [[nodiscard]] const Burr& burr() const noexcept { return burr_; }
  /// From the ball's centre and from the shaft's axis to what feels [m].
  [[nodiscard]] double tip_reach() const noexcept { return algorithm_ == Algorithm::kLine ? 0 : burr_.tip_radius; }
  [[nodiscard]] double shaft_reach() const noexcept { return algorithm_ == Algorithm::kLine ? 0 : burr_.shaft_radius; }

 private:
  void add_outline(const trephine::ToolOutline& outline, double spacing) {
    const double length = outline.side_length();
    const int rings = std::clamp(static_cast<int>(std::ceil(length / spacing)), 1, 2000);
    for (int i = 0; i <= rings; ++i) {
      const auto at = outline.place_at(length * i / rings);
      const int around = std::clamp(static_cast<int>(2 * std::numbers::pi * at.rho / spacing), 1, 64);
      for (int c = 0; c < around; ++c) {
        const double a = 2 * std::numbers::pi * c / around;
        points_.push_back({at.rho * std::cos(a), at.rho * std::sin(a), at.z});
      }
    }
  }

  void add_column(double from, double to, double angle, double spacing, double radius = 0) {
    const int n = std::clamp(static_cast<int>(std::ceil((to - from) / spacing)), 1, 2000);
    for (int i = 0; i <= n; ++i)
      points_.push_back({radius * std::cos(angle), radius * std::sin(angle), from + (to - from) * i / n});
  }

  Algorithm algorithm_;
  Burr burr_;
  trephine::PointArrays<double> points_;
  std::vector<double> values_;
};

/// A tool on its way, by the distance s [m] it has gone: T's origin moves on a straight line, the tool turns about it.
struct Motion {
  Posed start = Posed::Identity();  ///< X_GT at s = 0
  Vec3d velocity = Vec3d::Zero();   ///< of T's origin, in G, per metre of s
  Vec3d turn = Vec3d::Zero();       ///< rotation vector in G [rad per metre of s]

  [[nodiscard]] Posed at(double s) const {
    return trephine::make_pose<double>(trephine::rotation_from_vector<double>(s * turn) * start.linear(),
                                       start.translation() + s * velocity);
  }
};

/// A tool whose shaft (+z) points along the unit vector `shaft`, T's origin at p_GT.
[[nodiscard]] inline Posed tool_pose(const Vec3d& p_GT, const Vec3d& shaft) {
  Mat3d R;
  R.col(2) = shaft;
  R.col(0) = shaft.unitOrthogonal();
  R.col(1) = shaft.cross(R.col(0));
  return trephine::make_pose<double>(R, p_GT);
}

/// The turn about T's origin that moves the shaft's point at `height` [m] along the unit vector `way`, square to
/// `shaft`, by a metre per metre of s.
[[nodiscard]] inline Vec3d turn_toward(const Vec3d& shaft, const Vec3d& way, double height) {
  return shaft.cross(way) / height;
}

/// The distance at which the tool first touches, to a hundredth of a step; none where it touches from the start or not
/// within `reach` [m]. A bone thinner than `step` [m] may be passed over.
[[nodiscard]] inline std::optional<double> find_touch(Feeler& feeler, const Field& field, const Motion& motion,
                                                      double reach, double step) {
  if (feeler.touches(field, motion.at(0))) return std::nullopt;
  double free = 0;
  for (double s = step; s <= reach; s += step) {
    if (!feeler.touches(field, motion.at(s))) {
      free = s;
      continue;
    }
    for (double held = s; held - free > 0.01 * step;) {
      const double middle = 0.5 * (free + held);
      (feeler.touches(field, motion.at(middle)) ? held : free) = middle;
    }
    return free;
  }
  return std::nullopt;
}

/// Poses of `ticks` ticks that go evenly from `gap` before the touch to `depth` after it, and stay there for two more.
inline void press(const Motion& motion, double touch, double gap, double depth, int ticks, std::vector<Posed>& out) {
  for (int i = 0; i < ticks; ++i) {
    const double share = static_cast<double>(i) / (ticks - 1);
    out.push_back(motion.at(std::max(0.0, touch - gap) + share * (depth + std::min(gap, touch))));
  }
  for (int i = 0; i < 2; ++i) out.push_back(out.back());
}

/// Poses of `ticks` ticks of the last pose moved on by `step` [m, in G] a tick.
inline void slide(const Vec3d& step, int ticks, std::vector<Posed>& out) {
  for (int i = 0; i < ticks; ++i) {
    Posed X = out.back();
    X.translation() += step;
    out.push_back(X);
  }
}

/// A place on the bone, in G.
struct Spot {
  Vec3d p;
  Vec3d n;  ///< outward
};

/// Where a random ray that starts outside the bone meets it; none where it misses. Rays start anywhere in the grid's
/// box, so cavities are met too; whether a tool fits there is for the caller to try.
[[nodiscard]] inline std::optional<Spot> random_spot(const Field& field, Random& random) {
  const auto& n = field.grid().size();
  const Vec3d box = field.grid().spacing().cwiseProduct(Vec3d(n[0] - 1, n[1] - 1, n[2] - 1));
  Vec3d from;
  for (int a = 0; a < 3; ++a) from[a] = random.uniform(0, box[a]);
  if (field.value(from) >= 0) return std::nullopt;
  const Vec3d to = from + 0.5 * box.norm() * direction_near(Vec3d::UnitZ(), -1, random);
  const auto c = trephine::first_crossing(field, from, to, 0.5 * field.voxel(), 4000);
  if (!c.found) return std::nullopt;
  Spot spot{from + c.before * (to - from), {}};
  if (!field.normal(spot.p, spot.n)) return std::nullopt;
  return spot;
}

/// Whether the surface falls away from its tangent plane to both sides along the unit tangent `along`: by 0.3 of
/// `width` [m] at that distance. Ridges, edges and crests do across them.
[[nodiscard]] inline bool is_crest(const Field& field, const Spot& spot, const Vec3d& along, double width) {
  const Vec3d below = spot.p - 0.3 * width * spot.n;
  return field.value(below + width * along) < 0 && field.value(below - width * along) < 0 &&
         field.value(spot.p - 0.15 * width * spot.n) >= 0;
}

struct CaseOptions {
  int per_kind = 60;       ///< cases of each kind, for each algorithm
  double deepest = 0.004;  ///< farthest [m] a press goes beyond the touch: what the device's force allows
  unsigned seed = 1;
};

/// Places a tool on a bone in as many ways as asked for, at places drawn from the seed. Fewer cases where the bone
/// offers no more: every kind ends after a bounded number of tries. `progress` hears how many are made. `tool`: in
/// place of the burr, which then has its size.
[[nodiscard]] std::vector<Case> make_cases(const Field& field, const Burr& burr, Algorithm algorithm,
                                           const CaseOptions& options, const std::function<void(int)>& progress = {},
                                           const std::optional<trephine::RevolvedTool>& tool = {});

}  // namespace pick
