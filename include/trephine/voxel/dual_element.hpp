// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/crossed_edges.hpp>

#include <algorithm>
#include <optional>

namespace trephine {

/// The parallelogram that stands for the isosurface around a crossed voxel edge. Metres from the brick's voxel 0.
struct DualElement {
  Vec3<float> middle;
  Vec3<float> along, across;  ///< half sides
  float area;                 ///< quadrature weight [m²]
};

/// Computes the surface elements of crossed voxel edges.
///
/// An element is the parallelogram of the same middle and area as the quadrilateral of the four cells around the edge
/// (dual contouring's: Ju et al. 2002). Its corners are the means of the cells' crossings (surface nets', Gibson 1998).
/// So elements tile the surface whichever way it lies, and follow from the trilinear interpolant's crossings alone.
///
/// *Curved bone*: means of crossings are chords. With S = κ L² + κ' L'², L and L' the distances to the next crossings,
/// the quadrilateral lies S/4 below the edge's own crossing, the means of the crossings on faces S/8, and points of a
/// surface element S/32. Crossings themselves lie up to κ L²/8 below a curved surface, as densities are interpolated
/// along edges. So an element moves out by twice the distance from its quadrilateral to the faces' mean.
///
/// *Edges of bone*: where bone is more convex than a ball of radius kRound, an element moves less, widens to the faces'
/// means, and ends as the parallelogram through them. Their chords cut an edge off, so that no point stands out beside
/// it: a tool fits into the rim of the hole that it cut.
struct DualElements {
  /// Smaller elements are left out [faces of a voxel]: a ten-thousandth of the area in the worst direction.
  static constexpr float kMinArea = 1e-4F;
  /// Radius below which convex bone counts as an edge [shortest spacings]: by degrees, fully so at half of it.
  static constexpr float kRound = 12;

  Vec3<float> spacing;  ///< of the grid [m]

  /// The element of a crossing; nothing where it would be smaller than kMinArea.
  template <VoxelDensity Density>
  [[nodiscard]] std::optional<DualElement> at(const CrossedEdges<Density>& edges,
                                              const typename CrossedEdges<Density>::Crossing& crossing) const noexcept {
    const std::size_t a = crossing.axis, b = (a + 1) % 3, c = (a + 2) % 3;
    const auto length = [&](std::size_t axis) { return spacing[static_cast<Eigen::Index>(axis)]; };
    const auto metres = [&](const Vec3<float>& u) -> Vec3<float> { return u.cwiseProduct(spacing); };
    const Vec3<float> p00 = metres(edges.cell_mean(crossing, -1, -1)), p10 = metres(edges.cell_mean(crossing, 0, -1)),
                      p01 = metres(edges.cell_mean(crossing, -1, 0)), p11 = metres(edges.cell_mean(crossing, 0, 0));
    DualElement e{0.25F * (p00 + p10 + p01 + p11), 0.25F * (p10 + p11 - p00 - p01), 0.25F * (p01 + p11 - p00 - p10), 0};
    const Vec3<float> normal = e.along.cross(e.across);
    const float size = normal.norm();
    if (!(4 * size > kMinArea * length(b) * length(c))) return std::nullopt;
    e.area = 4 * size;

    // Outward is away from the edge's end in bone.
    const bool up = (normal[static_cast<Eigen::Index>(a)] > 0) == crossing.starts_in_bone;
    const Vec3<float> outward = (up ? 1 / size : -1 / size) * normal;
    const Vec3<float> b0 = metres(edges.next_crossing(crossing, b, -1)),
                      b1 = metres(edges.next_crossing(crossing, b, 1)),
                      c0 = metres(edges.next_crossing(crossing, c, -1)),
                      c1 = metres(edges.next_crossing(crossing, c, 1));
    // The surface crosses the cells' faces halfway to the next crossings.
    const Vec3<float> on_faces = 0.5F * metres(crossing.position()) + 0.125F * (b0 + b1 + c0 + c1);
    const float rise = (on_faces - e.middle).dot(outward);
    const float round = (length(b) * length(b) + length(c) * length(c)) / (8 * kRound * spacing.minCoeff());
    e.middle += (rise + std::min(rise, std::max(0.0F, 2 * round - rise))) * outward;
    const float sharpness = std::clamp(rise / round - 1, 0.0F, 1.0F);
    if (sharpness > 0) {
      e.middle += sharpness * (on_faces - e.middle);
      e.along += sharpness * (0.25F * (b1 - b0) - e.along);
      e.across += sharpness * (0.25F * (c1 - c0) - e.across);
    }
    return e;
  }
};

}  // namespace trephine
