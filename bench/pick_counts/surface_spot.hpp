// SPDX-License-Identifier: MIT
#pragma once

#include "contact_cases.hpp"
#include "random.hpp"

#include <trephine/contact/surface_search.hpp>

#include <optional>

namespace pick {

/// A place on the bone, in G.
struct Spot {
  trephine::Vec3d p;
  trephine::Vec3d n;  ///< outward
};

/// Where a random ray that starts outside the bone meets it; none where it misses. Rays start anywhere in the grid's
/// box, so cavities are met too; whether a tool fits there is for the caller to try.
[[nodiscard]] inline std::optional<Spot> random_spot(const Field& field, Random& random) {
  const auto& n = field.grid().size();
  const trephine::Vec3d box = field.grid().spacing().cwiseProduct(trephine::Vec3d(n[0] - 1, n[1] - 1, n[2] - 1));
  trephine::Vec3d from;
  for (int a = 0; a < 3; ++a) from[a] = random.between(0, box[a]);
  if (field.value(from) >= 0) return std::nullopt;
  const trephine::Vec3d to = from + 0.5 * box.norm() * random.direction();
  const auto c = trephine::first_crossing(field, from, to, 0.5 * field.voxel(), 4000);
  if (!c.found) return std::nullopt;
  Spot spot{from + c.before * (to - from), {}};
  if (!field.normal(spot.p, spot.n)) return std::nullopt;
  return spot;
}

/// Whether the surface falls away from its tangent plane to both sides along the unit tangent `along`: by 0.3 of
/// `width` [m] at that distance. Ridges, edges and crests do across them.
[[nodiscard]] inline bool is_crest(const Field& field, const Spot& spot, const trephine::Vec3d& along, double width) {
  const trephine::Vec3d below = spot.p - 0.3 * width * spot.n;
  return field.value(below + width * along) < 0 && field.value(below - width * along) < 0 &&
         field.value(spot.p - 0.15 * width * spot.n) >= 0;
}

}  // namespace pick
