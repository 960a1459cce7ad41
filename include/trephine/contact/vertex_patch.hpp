// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <cmath>

namespace trephine {

/// What a vertex of a tool stands for: of a ball a cap round it, of a slice of shaft an arc; in T.
template <RealScalar Scalar>
struct VertexPatch {
  Vec3<Scalar> axis;    ///< unit, from the ball's centre or the shaft's axis to the vertex
  Scalar radius;        ///< of ball or shaft [m]
  Scalar cosine, sine;  ///< of the angle from the vertex to the edge, less than a right one
  bool ball;
  Scalar height = Scalar(0);  ///< of an arc's slice along the axis [m]

  [[nodiscard]] bool holds(const Vec3<Scalar>& p) const noexcept { return axis.dot(p) >= radius * cosine; }
  /// What of a way counts: a slice lies square to the shaft.
  [[nodiscard]] Vec3<Scalar> across(const Vec3<Scalar>& way) const noexcept {
    return ball ? way : Vec3<Scalar>(way.x(), way.y(), Scalar(0));
  }
  /// A place on it where the tool's middle is at the height of the slice.
  [[nodiscard]] Vec3<Scalar> raised(const Vec3<Scalar>& p) const noexcept {
    return ball ? p : Vec3<Scalar>(p.x(), p.y(), height);
  }
  /// The place that lies farthest along `way`; the vertex where none does.
  [[nodiscard]] Vec3<Scalar> farthest(const Vec3<Scalar>& way) const noexcept {
    const Vec3<Scalar> to = across(way);
    const Scalar length2 = to.squaredNorm();
    if (!(length2 > Scalar(0))) return raised(radius * axis);
    // Within the patch, or beyond it: at its edge's nearest place.
    const Scalar along = axis.dot(to);
    if (along > Scalar(0) && along * along >= cosine * cosine * length2)
      return raised((radius / std::sqrt(length2)) * to);
    const Vec3<Scalar> beside = to - along * axis;
    const Scalar beside2 = beside.squaredNorm();
    if (!(beside2 > Scalar(1e-12) * length2)) return raised(radius * axis);
    return raised((radius * cosine) * axis + (radius * sine / std::sqrt(beside2)) * beside);
  }
};

}  // namespace trephine
