// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/surface_search.hpp>
#include <trephine/tool/line_discretization.hpp>
#include <trephine/voxel/density_field.hpp>

#include <array>

/// First contact of the shaft's centreline on its path from t−1 to t: thesis 3.1, Eq. 1–5.
namespace trephine::inline TREPHINE_ALIGNED {

/// Centreline of the shaft: vertex i is at tip + heights[i] * direction. The direction is a unit vector except within a
/// ray cast, where every vertex moves along its own straight line.
template <RealScalar Scalar>
struct Centreline {
  Vec3<Scalar> tip = Vec3<Scalar>::Zero();
  Vec3<Scalar> direction = Vec3<Scalar>::UnitZ();

  /// Point at a height above the tip [m].
  [[nodiscard]] Vec3<Scalar> at(Scalar height) const noexcept { return tip + height * direction; }
  [[nodiscard]] bool operator==(const Centreline&) const = default;
};

/// Transform that maps points (0, 0, h) to the line's points at height h.
template <RealScalar Scalar>
[[nodiscard]] Pose<Scalar> pose_of(const Centreline<Scalar>& line) noexcept {
  auto X = Pose<Scalar>::Identity();
  X.linear().col(2) = line.direction;  // x = y = 0 on the centreline: the other columns have no effect
  X.translation() = line.tip;
  return X;
}

/// Writes the field's values at all vertices of a line to `values`, which has room for tool.padded() numbers.
template <ContactField Field, RealScalar Scalar>
void line_values(const Field& field, const ToolDiscretization<LineCounts, Scalar>& tool, const Centreline<Scalar>& line,
                 Scalar* values) noexcept {
  const Pose<Scalar> X = pose_of(line);
  const auto& p = tool.points();
  field.values(X, p.x.data(), p.y.data(), p.z.data(), values, tool.padded());
}

/// Index of the largest of n values; of equal values the first.
template <RealScalar Scalar>
[[nodiscard]] int index_of_largest(const Scalar* v, int n) noexcept {
  int best = 0;
  for (int i = 1; i < n; ++i)
    if (v[i] > v[best]) best = i;
  return best;
}

/// Deepest point of a line: the point with the largest field value.
template <RealScalar Scalar>
struct DeepestOnLine {
  int vertex = 0;             ///< deepest vertex
  Scalar height = Scalar(0);  ///< of the deepest point above the tip [m]
  Scalar value = Scalar(0);   ///< of the field there
};
/// Searches the deepest point at the vertices, then at a lane of points between the two neighbours of the deepest
/// vertex. A ridge between vertices is thus located within a sixteenth of their spacing. Cost: tool.count() samples and
/// a lane more. `scratch` has room for tool.padded() numbers.
template <ContactField Field, RealScalar Scalar>
[[nodiscard]] DeepestOnLine<Scalar> deepest_on_line(const Field& field,
                                                    const ToolDiscretization<LineCounts, Scalar>& tool,
                                                    const Centreline<Scalar>& line, Scalar* scratch) noexcept {
  line_values(field, tool, line, scratch);
  DeepestOnLine<Scalar> best;
  best.vertex = index_of_largest(scratch, tool.count());
  const auto& heights = tool.heights();
  const auto at = static_cast<std::size_t>(best.vertex);
  best.height = heights[at];
  best.value = scratch[at];
  if (tool.count() < 2) return best;
  const Scalar from = heights[at > 0 ? at - 1 : at];
  const Scalar to = heights[best.vertex + 1 < tool.count() ? at + 1 : at];
  const auto spacing = (to - from) / Scalar(kLane + 1);
  std::array<Scalar, kLane> zero{}, z, v;
  for (std::size_t l = 0; l < kLane; ++l) z[l] = from + spacing * Scalar(static_cast<int>(l) + 1);
  field.values(pose_of(line), zero.data(), zero.data(), z.data(), v.data(), kLane);
  const auto finer = static_cast<std::size_t>(index_of_largest(v.data(), kLane));
  if (v[finer] > best.value) {
    best.value = v[finer];
    best.height = z[finer];
  }
  return best;
}

/// Step length of a search.
struct SteppingOptions {
  double step = 0.5;    ///< largest step of the farthest vertex, in voxels; longer steps can miss thin walls
  int max_steps = 512;  ///< of a translation, rotation or ray; bounds the work, longer paths get longer steps

  /// Throws std::invalid_argument, naming the type `owner`, for a number outside its range.
  void validate(const char* owner) const {
    if (!(step > 0 && step <= 16)) refuse(owner, "step must be > 0 and at most 16 voxels", step);
    if (!(max_steps >= 1 && max_steps <= 100000)) refuse(owner, "max_steps must be 1 to 100000", max_steps);
  }
};

/// Path that translates the line, then rotates it: Eq. 3, 4. The line of t−1 moves to the tip of t in equal steps, then
/// rotates to the direction of t by equal angles.
struct TranslateRotate {
  SteppingOptions stepping{};

  /// Throws std::invalid_argument for a number outside its range.
  void validate() const { stepping.validate("TranslateRotate"); }

  template <RealScalar Scalar>
  struct Path {
    Centreline<Scalar> from, to;
    int translations, rotations;
    bool bounded;       ///< the step limit made steps longer than requested
    Vec3<Scalar> axis;  ///< of the rotation, a unit vector
    Scalar angle;       ///< of the rotation [rad]

    [[nodiscard]] int steps() const noexcept { return translations + rotations; }
    /// The line after n steps.
    [[nodiscard]] Centreline<Scalar> at(int n) const noexcept {
      if (n <= translations) {
        const Scalar f = translations == 0 ? Scalar(1) : static_cast<Scalar>(n) / static_cast<Scalar>(translations);
        return {from.tip + f * (to.tip - from.tip), n == steps() ? to.direction : from.direction};
      }
      if (n == steps()) return to;
      const Scalar f = static_cast<Scalar>(n - translations) / static_cast<Scalar>(rotations);
      return {to.tip, Eigen::AngleAxis<Scalar>(f * angle, axis) * from.direction};
    }
  };

  /// Path between two lines of length `reach` [m], for a voxel size [m].
  template <RealScalar Scalar>
  [[nodiscard]] Path<Scalar> path(const Centreline<Scalar>& from, const Centreline<Scalar>& to, Scalar reach,
                                  Scalar voxel) const noexcept {
    constexpr auto kParallel = Scalar(1e-9);  // sine of the angle below which the lines have no common normal
    Path<Scalar> p{from, to, 0, 0, false, Vec3<Scalar>::UnitX(), Scalar(0)};
    const Vec3<Scalar> cross = from.direction.cross(to.direction);
    const Scalar sine = cross.norm();
    p.angle = std::atan2(sine, from.direction.dot(to.direction));
    // Opposite lines may rotate about any perpendicular axis.
    p.axis = sine > kParallel ? Vec3<Scalar>(cross / sine) : from.direction.unitOrthogonal();
    const double step = stepping.step * static_cast<double>(voxel);
    const auto translation = plan_steps(static_cast<double>((to.tip - from.tip).norm()), step, stepping.max_steps);
    const auto rotation = plan_steps(static_cast<double>(p.angle * reach), step, stepping.max_steps);
    p.translations = translation.count;
    p.rotations = rotation.count;
    p.bounded = translation.bounded || rotation.bounded;
    return p;
  }
};

/// Path by ray casting: Eq. 5. Every vertex moves along a straight ray from its position at t−1 to that at t, in equal
/// steps.
struct RayCast {
  SteppingOptions stepping{};

  /// Throws std::invalid_argument for a number outside its range.
  void validate() const { stepping.validate("RayCast"); }

  template <RealScalar Scalar>
  struct Path {
    Centreline<Scalar> from, to;
    int count;
    bool bounded;  ///< the step limit made steps longer than requested

    [[nodiscard]] int steps() const noexcept { return count; }
    /// The line after n steps.
    [[nodiscard]] Centreline<Scalar> at(int n) const noexcept {
      if (n == count) return to;
      const Scalar f = static_cast<Scalar>(n) / static_cast<Scalar>(count);
      return {from.tip + f * (to.tip - from.tip), from.direction + f * (to.direction - from.direction)};
    }
  };

  /// Path between two lines of length `reach` [m], for a voxel size [m].
  template <RealScalar Scalar>
  [[nodiscard]] Path<Scalar> path(const Centreline<Scalar>& from, const Centreline<Scalar>& to, Scalar reach,
                                  Scalar voxel) const noexcept {
    const Scalar near_end = (to.tip - from.tip).norm();
    const Scalar far_end = (to.at(reach) - from.at(reach)).norm();
    const auto plan = plan_steps(static_cast<double>(std::max(near_end, far_end)),
                                 stepping.step * static_cast<double>(voxel), stepping.max_steps);
    return {from, to, plan.count, plan.bounded};
  }
};

/// Policy for the path of a search. `path(from, to, reach, voxel)` returns an object with `steps()`, `at(n)` and
/// `bounded`.
template <class S>
concept Stepping = requires(const S& s, const Centreline<float>& line) {
  s.validate();
  { s.path(line, line, 1.0F, 1.0F).steps() } -> std::same_as<int>;
};

/// Result of a search for first contact.
template <RealScalar Scalar>
struct FirstContact {
  bool found = false;
  bool bounded = false;                       ///< the step limit made steps longer than requested
  bool started_inside = false;                ///< a vertex was in bone at step 0 (its fraction is defined as 0)
  int step = 0;                               ///< n of Eq. 1, 2
  int active = 0;                             ///< vertices in bone at that step
  int vertex = -1;                            ///< most active vertex: the first to enter bone
  Scalar fraction = Scalar(0);                ///< Eq. 1: fraction of the step from n−1 to n at the contact
  Vec3<Scalar> point = Vec3<Scalar>::Zero();  ///< Eq. 2: IntP
  Centreline<Scalar> line{};                  ///< last line free of bone
};

/// True if the field knows, without a sample, that a line of length `reach` [m] stays beyond the volume between two
/// poses. On either path the point at height h moves by at most |Δtip| + h |Δdirection|.
template <ContactField Field, RealScalar Scalar>
[[nodiscard]] bool is_path_beyond(const Field& field, const Centreline<Scalar>& from, const Centreline<Scalar>& to,
                                  Scalar reach) noexcept {
  constexpr auto kRounding = Scalar(1.0001);  // covers directions that are not exactly of unit length
  const Scalar shift = (to.tip - from.tip).norm() + static_cast<Scalar>(kBeyondMargin) * field.voxel();
  const Scalar turn = (to.direction - from.direction).norm();
  const Scalar half = reach / Scalar(2);
  return is_known_beyond(field, from.at(half), kRounding * (half + shift + reach * turn));
}

/// Searches forward from `from` (t−1) to `to` (t) and stops at the first step with a vertex in bone. A search backward
/// from t could miss the first surface of a thin wall. `scratch` has room for 2 · tool.padded() numbers. Cost:
/// tool.count() samples and a lane more per step; none if the path is known to be beyond the volume.
template <ContactField Field, Stepping Step, RealScalar Scalar>
[[nodiscard]] FirstContact<Scalar> find_first_contact(const Field& field,
                                                      const ToolDiscretization<LineCounts, Scalar>& tool,
                                                      const Step& stepping, const Centreline<Scalar>& from,
                                                      const Centreline<Scalar>& to, Scalar* scratch) noexcept {
  const Scalar reach = tool.heights()[static_cast<std::size_t>(tool.count() - 1)];
  const auto path = stepping.path(from, to, reach, field.voxel());
  FirstContact<Scalar> hit;
  hit.bounded = path.bounded;
  if (is_path_beyond(field, from, to, reach)) {
    hit.line = path.at(path.steps());
    return hit;
  }
  hit.line = from;
  Scalar* before = scratch;
  Scalar* now = scratch + tool.padded();
  line_values(field, tool, from, before);
  hit.started_inside = before[index_of_largest(before, tool.count())] >= Scalar(0);
  for (int n = 1; n <= path.steps() && !hit.found; ++n, std::swap(before, now)) {
    const Centreline<Scalar> line = path.at(n);
    const auto deepest = deepest_on_line(field, tool, line, now);
    hit.found = deepest.value >= Scalar(0);
    if (!hit.found) {
      hit.line = line;
      continue;
    }
    hit.step = n;
    hit.fraction = Scalar(2);
    for (int i = 0; i < tool.count(); ++i) {
      if (!(now[i] >= Scalar(0))) continue;
      ++hit.active;
      const Scalar f = before[i] < Scalar(0) ? -before[i] / (now[i] - before[i]) : Scalar(0);
      if (!(f < hit.fraction)) continue;
      hit.fraction = f;
      hit.vertex = i;
    }
    Scalar height = deepest.height;
    if (hit.active == 0) {  // the deepest point is between vertices
      const Scalar v = field.value(hit.line.at(height));
      hit.fraction = v < Scalar(0) ? -v / (deepest.value - v) : Scalar(0);
      hit.vertex = deepest.vertex;
      hit.active = 1;
    } else {
      height = tool.heights()[static_cast<std::size_t>(hit.vertex)];
    }
    hit.point = (Scalar(1) - hit.fraction) * hit.line.at(height) + hit.fraction * line.at(height);
  }
  return hit;
}

}  // namespace trephine
