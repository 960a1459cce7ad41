// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/structure/structure_field.hpp>
#include <trephine/tool/shape.hpp>

#include <algorithm>

namespace trephine {

/// Distance of a whole tool from the nearest structure.
struct ToolDistance {
  double distance = 0;                ///< signed [m]; negative where the tool is in the structure
  int structure = -1;                 ///< number of the structure; -1 if the pose is not finite
  Vec3d p_S = Vec3d::Zero();          ///< point of the tool's surface nearest to the structure, in S [m]
  Vec3d direction_S = Vec3d::Zero();  ///< unit vector in S along which the distance there increases; zero if unknown
  double z_T = 0;                     ///< place on the tool's axis that belongs to the point [m]
  int lookups = 0;                    ///< of the field that it took
};

namespace detail {
/// Step past the end of a cell [longest spacings]: more than rounding, less than is felt.
inline constexpr double kIntoNext = 1e-6;
}  // namespace detail

/// Distance of a burr, ball and shaft, from the nearest structure, at the pose `X_ST` of the tool in S.
///
/// The burr is the union of balls on its axis: the tip's at T's origin, and the shaft's from there to its end. So its
/// distance is the least of field minus radius along the axis. The shaft's flat end counts as a half ball beyond it.
///
/// Marches along the axis. From a point whose distance exceeds the least so far by c, no nearer point is closer than
/// c - `field.slack()`, so the march skips to there. Where that is less than a cell it takes the cell's exact least
/// value. The result is the least value of the interpolant, to 0.02 longest spacings. The field's own error comes on
/// top, as for a point.
///
/// At most 10 + length (1/h_x + 1/h_y + 1/h_z + 1/max h) lookups for spacings h. No memory, no exceptions, any thread.
[[nodiscard]] inline ToolDistance tool_distance(const StructureField& field, const Burr& burr,
                                                const Posed& X_ST) noexcept {
  ToolDistance r;
  const Vec3d origin = X_ST.translation(), axis = X_ST.linear().col(2);
  if (!is_finite(origin) || !is_finite(axis)) return r;
  double radius = burr.tip_radius;
  r.distance = field.nearest(origin).distance - radius;
  r.lookups = 2;  // the first and the last
  const double into_next = detail::kIntoNext * field.spacing().maxCoeff();
  for (double z = 0; burr.has_shaft() && z <= burr.shaft_length;) {
    const Vec3d p = origin + z * axis;
    const LinePiece piece = field.line_piece(p, axis, burr.shaft_length - z, r.distance + burr.shaft_radius);
    ++r.lookups;
    if (!piece.valid) break;
    if (piece.least - burr.shaft_radius < r.distance) {
      r.distance = piece.least - burr.shaft_radius;
      radius = burr.shaft_radius;
      r.z_T = z + piece.at;
    }
    z += into_next + std::max(piece.length, piece.distance - burr.shaft_radius - r.distance - field.slack());
  }
  const Vec3d p = origin + r.z_T * axis;
  r.structure = field.nearest(p, r.direction_S).structure;
  const double length = r.direction_S.norm();
  if (length > 0) r.direction_S /= length;
  r.p_S = p - radius * r.direction_S;
  return r;
}

}  // namespace trephine
