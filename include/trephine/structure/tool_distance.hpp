// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/structure/structure_field.hpp>
#include <trephine/tool/shape.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

namespace trephine::inline TREPHINE_ALIGNED {

/// Distance of a whole tool from the nearest structure.
struct ToolDistance {
  double distance = 0;                ///< signed [m]; negative where the tool is in the structure
  int structure = -1;                 ///< number of the structure; -1 if the pose is not finite
  Vec3d p_S = Vec3d::Zero();          ///< point of the tool's surface nearest to the structure, in S [m]
  Vec3d direction_S = Vec3d::Zero();  ///< unit vector in S along which the distance there increases; zero if unknown
  double z_T = 0;                     ///< place on the tool's axis that belongs to the point [m]
  int lookups = 0;                    ///< of the field that it took
};

/// A field's distance at a place on a tool's axis, z in T [m].
struct AxisProbe {
  double z, distance;
};

namespace detail {

/// Step past the end of a cell [longest spacings]: more than rounding, less than is felt.
inline constexpr double kIntoNext = 1e-6;
/// Roughness of the interpolant that a march allows for [longest spacings]: its errors on neighbouring samples.
inline constexpr double kRoughness = 0.1;

/// Length of a line that can be skipped from a point at `distance`, as no distance on it is a minimum below `bound`.
///
/// At a minimum, x, the direction to the structure is across the line. So distance² <= x² + way², which is far more
/// than distance <= x + way for short ways. The latter holds within structures, too.
[[nodiscard]] inline double line_to_skip(double distance, double bound, double slack, double rough) noexcept {
  const double straight = distance - bound - slack, sure = distance - rough;
  return bound > 0 && sure > bound ? std::max(straight, std::sqrt(sure * sure - bound * bound)) : straight;
}

}  // namespace detail

/// Distance of a burr, ball and shaft, from the nearest structure, at the pose `X_ST` of the tool in S.
///
/// The burr is the union of balls on its axis: the tip's at T's origin, and the shaft's from there to its end. So its
/// distance is the least of field minus radius along the axis. The shaft's flat end counts as a half ball beyond it.
///
/// Marches along the axis and skips what cannot hold the minimum (`detail::line_to_skip`). Where that is less than a
/// cell it takes the cell's exact least value. The result is the least value of the interpolant, to 0.02 longest
/// spacings. The field's own error comes on top, as for a point.
///
/// `known`: the field's distances at places on the axis, ascending, as `GuardPotential::find` has looked them up. They
/// change the result by rounding alone, and save most lookups.
///
/// At most 10 + length (1/h_x + 1/h_y + 1/h_z + 1/max h) lookups for spacings h. No memory, no exceptions, any thread.
[[nodiscard]] inline ToolDistance tool_distance(const StructureField& field, const Burr& burr, const Posed& X_ST,
                                                std::span<const AxisProbe> known = {}) noexcept {
  ToolDistance r;
  const Vec3d origin = X_ST.translation(), axis = z_axis(X_ST);
  if (!is_finite(origin) || !is_finite(axis)) return r;
  double radius = burr.tip_radius;
  const double at_origin = field.nearest(origin).distance;
  r.distance = at_origin - radius;
  r.lookups = 2;  // the first and the last
  const auto offer = [&](double distance, double z) {
    if (!(distance - burr.shaft_radius < r.distance)) return;
    r.distance = distance - burr.shaft_radius;
    radius = burr.shaft_radius;
    r.z_T = z;
  };
  if (burr.has_shaft()) {  // an end need not be a minimum of the line
    offer(at_origin, 0);
    offer(field.nearest(origin + burr.shaft_length * axis).distance, burr.shaft_length);
    ++r.lookups;
    for (const AxisProbe& probe : known) offer(probe.distance, probe.z);
  }
  const double roughness = detail::kRoughness * field.spacing().maxCoeff();
  const double into_next = detail::kIntoNext * field.spacing().maxCoeff();
  const auto to_skip = [&](double distance) {
    return detail::line_to_skip(distance, r.distance + burr.shaft_radius, field.slack(), roughness);
  };
  std::size_t next = 0;  // of the known distances, beyond z
  for (double z = 0; burr.has_shaft() && z <= burr.shaft_length;) {
    while (next < known.size() && known[next].z <= z) ++next;
    double clear_to = next > 0 ? known[next - 1].z + to_skip(known[next - 1].distance) : z;
    if (next < known.size()) {
      const double around = to_skip(known[next].distance);
      if (known[next].z - around <= std::max(z, clear_to)) clear_to = known[next].z + around;
    }
    if (clear_to > z) {
      z = clear_to + into_next;
      continue;
    }
    const LinePiece piece =
        field.line_piece(origin + z * axis, axis, burr.shaft_length - z, r.distance + burr.shaft_radius);
    ++r.lookups;
    if (!piece.valid) break;
    offer(piece.least, z + piece.at);
    z += into_next + std::max(piece.length, to_skip(piece.distance));
  }
  const Vec3d p = origin + r.z_T * axis;
  r.structure = field.nearest(p, r.direction_S).structure;
  const double length = r.direction_S.norm();
  if (length > 0) r.direction_S /= length;
  r.p_S = p - radius * r.direction_S;
  return r;
}

}  // namespace trephine
