// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/surface_search.hpp>
#include <trephine/tool/discretization.hpp>
#include <trephine/voxel/clearance_field.hpp>
#include <trephine/voxel/density_field.hpp>

#include <array>

/// First contact of the shaft's centreline as it moves from its place at t−1 to its place at t: thesis 3.1, Eq. 1–5.
namespace trephine {

/// A centreline: vertex i is at tip + heights[i] * direction. The direction is a unit vector except along a ray cast,
/// where every vertex moves on its own straight line.
template <RealScalar Scalar>
struct Centreline {
  Vec3<Scalar> tip = Vec3<Scalar>::Zero();
  Vec3<Scalar> direction = Vec3<Scalar>::UnitZ();

  [[nodiscard]] Vec3<Scalar> at(Scalar height) const noexcept { return tip + height * direction; }
  [[nodiscard]] bool operator==(const Centreline&) const = default;
};

/// Takes heights on a line, points (0, 0, h), to their places.
template <RealScalar Scalar>
[[nodiscard]] Pose<Scalar> pose_of(const Centreline<Scalar>& line) noexcept {
  auto X = Pose<Scalar>::Identity();
  X.linear().col(2) = line.direction;  // x = y = 0 on the centreline: the other columns do not matter
  X.translation() = line.tip;
  return X;
}

/// field.value at all vertices of a line; `out` holds tool.padded() numbers.
template <ContactField Field, RealScalar Scalar>
void line_values(const Field& field, const ToolDiscretization<LineCounts, Scalar>& tool, const Centreline<Scalar>& line,
                 Scalar* out) noexcept {
  const Pose<Scalar> X = pose_of(line);
  const auto& p = tool.points();
  field.values(X, p.x.data(), p.y.data(), p.z.data(), out, tool.padded());
}

/// Largest of n values, first of equals.
template <RealScalar Scalar>
[[nodiscard]] int index_of_largest(const Scalar* v, int n) noexcept {
  int best = 0;
  for (int i = 1; i < n; ++i)
    if (v[i] > v[best]) best = i;
  return best;
}

/// The deepest place of a line: at a vertex, or, `refined`, at one of a lane of places between the two neighbours of
/// the deepest vertex. Cost: tool.count() samples, and a lane more where it refines.
template <RealScalar Scalar>
struct DeepestOnLine {
  int vertex = 0;
  Scalar height = Scalar(0);
  Scalar value = Scalar(0);
};
template <ContactField Field, RealScalar Scalar>
[[nodiscard]] DeepestOnLine<Scalar> deepest_on_line(const Field& field,
                                                    const ToolDiscretization<LineCounts, Scalar>& tool,
                                                    const Centreline<Scalar>& line, bool refined,
                                                    Scalar* scratch) noexcept {
  line_values(field, tool, line, scratch);
  DeepestOnLine<Scalar> best;
  best.vertex = index_of_largest(scratch, tool.count());
  const auto& heights = tool.heights();
  const auto at = static_cast<std::size_t>(best.vertex);
  best.height = heights[at];
  best.value = scratch[at];
  if (!refined || tool.count() < 2) return best;
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

/// How finely a search steps: counts as in the thesis where they are given (> 0), else steps of at most `step` voxels
/// of the farthest vertex, at most `most_steps` in all.
struct SteppingOptions {
  double step = 0.5;
  int most_steps = 512;

  void validate(const char* who) const {
    if (!(step > 0 && step <= 16)) refuse(who, "step must be > 0 and at most 16 voxels", step);
    if (!(most_steps >= 1 && most_steps <= 100000)) refuse(who, "most_steps must be 1 to 100000", most_steps);
  }
};

/// Translate, then rotate: Eq. 3, 4. The t−1 line is moved to the tip of t in equal steps, then turned to the direction
/// of t in equal angles.
struct TranslateRotate {
  int translation_steps = 0;  ///< fixed count (thesis); 0: by `stepping`
  int rotation_steps = 0;
  SteppingOptions stepping{};

  void validate() const {
    stepping.validate("TranslateRotate");
    if (translation_steps < 0 || rotation_steps < 0)
      refuse("TranslateRotate", "step counts must be >= 0", std::min(translation_steps, rotation_steps));
  }

  template <RealScalar Scalar>
  struct Path {
    Centreline<Scalar> from, to;
    int translations, rotations;
    bool bounded;
    Vec3<Scalar> axis;
    Scalar angle;

    [[nodiscard]] int steps() const noexcept { return translations + rotations; }
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

  template <RealScalar Scalar>
  [[nodiscard]] Path<Scalar> path(const Centreline<Scalar>& from, const Centreline<Scalar>& to, Scalar reach,
                                  Scalar voxel) const noexcept {
    Path<Scalar> p{from, to, 0, 0, false, Vec3<Scalar>::UnitX(), Scalar(0)};
    const Vec3<Scalar> cross = from.direction.cross(to.direction);
    const Scalar sine = cross.norm();
    p.angle = std::atan2(sine, from.direction.dot(to.direction));
    // Parallel lines have no axis of their own: opposite ones may turn about any that is square to them.
    p.axis = sine > Scalar(1e-9) ? Vec3<Scalar>(cross / sine) : from.direction.unitOrthogonal();
    const double step = stepping.step * static_cast<double>(voxel);
    const auto translation = plan_steps(static_cast<double>((to.tip - from.tip).norm()), step, stepping.most_steps);
    const auto rotation = plan_steps(static_cast<double>(p.angle * reach), step, stepping.most_steps);
    p.translations = translation_steps > 0 ? translation_steps : translation.count;
    p.rotations = rotation_steps > 0 ? rotation_steps : rotation.count;
    p.bounded = (translation_steps == 0 && translation.bounded) || (rotation_steps == 0 && rotation.bounded);
    return p;
  }
};

/// Ray casting: Eq. 5. Every vertex moves on a straight ray from its place at t−1 to its place at t in equal steps.
struct RayCast {
  int steps = 0;  ///< fixed count (thesis); 0: by `stepping`
  SteppingOptions stepping{};

  void validate() const {
    stepping.validate("RayCast");
    if (steps < 0) refuse("RayCast", "the step count must be >= 0", steps);
  }

  template <RealScalar Scalar>
  struct Path {
    Centreline<Scalar> from, to;
    int count;
    bool bounded;

    [[nodiscard]] int steps() const noexcept { return count; }
    [[nodiscard]] Centreline<Scalar> at(int n) const noexcept {
      if (n == count) return to;
      const Scalar f = static_cast<Scalar>(n) / static_cast<Scalar>(count);
      return {from.tip + f * (to.tip - from.tip), from.direction + f * (to.direction - from.direction)};
    }
  };

  template <RealScalar Scalar>
  [[nodiscard]] Path<Scalar> path(const Centreline<Scalar>& from, const Centreline<Scalar>& to, Scalar reach,
                                  Scalar voxel) const noexcept {
    const Scalar near_end = (to.tip - from.tip).norm();
    const Scalar far_end = (to.at(reach) - from.at(reach)).norm();
    const auto plan = plan_steps(static_cast<double>(std::max(near_end, far_end)),
                                 stepping.step * static_cast<double>(voxel), stepping.most_steps);
    return {from, to, steps > 0 ? steps : plan.count, steps == 0 && plan.bounded};
  }
};

template <class S>
concept Stepping = requires(const S& s, const Centreline<float>& line) {
  s.validate();
  { s.path(line, line, 1.0F, 1.0F).steps() } -> std::same_as<int>;
};

template <RealScalar Scalar>
struct FirstContact {
  bool found = false;
  bool bounded = false;                       ///< the step limit made steps longer than asked
  bool started_inside = false;                ///< a vertex was in bone at step 0 (its fraction is defined as 0)
  int step = 0;                               ///< n of Eq. 1, 2
  int active = 0;                             ///< vertices in bone at that step
  int vertex = -1;                            ///< the most active one
  Scalar fraction = Scalar(0);                ///< Eq. 1: of the step from n−1 to n
  Vec3<Scalar> point = Vec3<Scalar>::Zero();  ///< Eq. 2: IntP
  Centreline<Scalar> line{};                  ///< the last line that was free
};

/// Whether the field knows, without a sample, that a line up to `reach` [m] meets no bone on its way. A place at height
/// h comes no farther from where it started than |Δtip| + h |Δdirection|, whichever way it is stepped.
template <ContactField Field, RealScalar Scalar>
[[nodiscard]] bool is_way_clear(const Field& field, const Centreline<Scalar>& from, const Centreline<Scalar>& to,
                                Scalar reach) noexcept {
  if constexpr (BoundedField<Field> || ClearanceField<Field>) {
    constexpr Scalar kSlack = Scalar(1.0001);  // for what directions are off unit length by
    const Scalar shift = (to.tip - from.tip).norm() + static_cast<Scalar>(kClearanceMargin) * field.voxel();
    const Scalar turn = (to.direction - from.direction).norm();
    if constexpr (BoundedField<Field>) {
      const Scalar half = reach / Scalar(2);
      if (field.is_beyond(from.at(half), kSlack * (half + shift + reach * turn))) return true;
    }
    if constexpr (ClearanceField<Field>) {
      // Ball after ball of air along the line: one at height h clears what is below (air + h − shift) / (1 + turn).
      constexpr int kMostLooks = 16;
      Scalar clear = Scalar(0);
      for (int i = 0; i < kMostLooks; ++i) {
        const Scalar air = field.clearance_at(from.at(clear)) / kSlack;
        const Scalar next = (air + clear - shift) / (Scalar(1) + turn);
        if (!(next > clear)) return false;
        if (next > reach) return true;
        clear = next;
      }
    }
  }
  return false;
}

/// Searches forward from `from` (t−1) to `to` (t); stops at the first step where any vertex is in bone. `scratch` holds
/// 2 · tool.padded() numbers. Searching backward from t could miss the first surface of a thin wall.
/// `refined`: looks between vertices too (`deepest_on_line`). Cost: tool.count() samples a step, refined a lane more;
/// none where the field knows that the way is clear.
template <ContactField Field, Stepping Step, RealScalar Scalar>
[[nodiscard]] FirstContact<Scalar> find_first_contact(const Field& field,
                                                      const ToolDiscretization<LineCounts, Scalar>& tool,
                                                      const Step& stepping, const Centreline<Scalar>& from,
                                                      const Centreline<Scalar>& to, Scalar* scratch,
                                                      bool refined = false) noexcept {
  const Scalar reach = tool.heights()[static_cast<std::size_t>(tool.count() - 1)];
  const auto path = stepping.path(from, to, reach, field.voxel());
  FirstContact<Scalar> hit;
  hit.bounded = path.bounded;
  if (is_way_clear(field, from, to, reach)) {
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
    const auto deepest = deepest_on_line(field, tool, line, refined, now);
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
    if (hit.active == 0) {  // between vertices
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
