// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/square_roots.hpp>
#include <trephine/voxel/crossed_edges.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace trephine::inline TREPHINE_ALIGNED {

/// The parallelograms that stand for the isosurface around some crossed voxel edges. Metres from the brick's voxel 0.
/// Vectors have the components of `CrossingLanes`.
struct DualElementLanes {
  using Lanes = CrossingLanes::Lanes;
  std::array<Lanes, 3> middle;
  std::array<Lanes, 3> along, across;  ///< half sides
  Lanes area;                          ///< quadrature weight [m²]; 0: the element is too small
  Lanes along_length, across_length;   ///< of the half sides [m]
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
/// crossings, and ends as the parallelogram about their mean. Its chords cut an edge off. So that a tool fits into the
/// rim of the hole that it cut, no end may stand out beside the edge by more than kStandsOut: the parallelogram then
/// lies nearer to the deeper of the two chords between faces that face one another, about which no end stands out.
struct DualElements {
  /// Smaller elements are left out [faces of a voxel]: a ten-thousandth of the area in the worst direction.
  static constexpr float kMinArea = 1e-4F;
  /// Radius below which convex bone counts as an edge [shortest spacings]: by degrees, fully so at half of it. The sag
  /// of chords of the shortest spacings decides. By that of long ones the rim of a hole would bulge into it.
  static constexpr float kRound = 12;
  /// How far the end of an edge's element may stand out beside it [shortest spacings], over an area of their square;
  /// less far over more area, so that it holds a tool as little. At a right edge in cubic voxels none stands out more.
  static constexpr float kStandsOut = 0.125F;

  static constexpr std::size_t kLanes = CrossingLanes::kLanes;
  using Lanes = CrossingLanes::Lanes;

  Vec3<float> spacing;  ///< of the grid [m]

  /// Computes the elements of crossings of this isovalue.
  void compute(const CrossingLanes& q, float isovalue, DualElementLanes& out) const noexcept {
    const Vectors length = lengths(q.axis);
    // A quarter of the quadrilateral's corners.
    std::array<Vectors, 4> p;
    for (std::size_t m = 0; m < 4; ++m) {
      Lanes per;
      for (std::size_t l = 0; l < kLanes; ++l) per[l] = 0.25F / q.cells[m][3][l];
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t l = 0; l < kLanes; ++l) p[m][i][l] = q.cells[m][i][l] * per[l] * length[i][l];
    }
    Vectors middle, along, across, normal;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t l = 0; l < kLanes; ++l) middle[i][l] = p[0][i][l] + p[1][i][l] + p[2][i][l] + p[3][i][l];
      for (std::size_t l = 0; l < kLanes; ++l) along[i][l] = p[1][i][l] + p[3][i][l] - p[0][i][l] - p[2][i][l];
      for (std::size_t l = 0; l < kLanes; ++l) across[i][l] = p[2][i][l] + p[3][i][l] - p[0][i][l] - p[1][i][l];
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const Lanes &a1 = along[(i + 1) % 3], &a2 = along[(i + 2) % 3];
      const Lanes &c1 = across[(i + 1) % 3], &c2 = across[(i + 2) % 3];
      for (std::size_t l = 0; l < kLanes; ++l) normal[i][l] = a1[l] * c2[l] - a2[l] * c1[l];
    }
    const Lanes size = lengths_of(normal);
    const float h = spacing.minCoeff(), round = 2 * h / (8 * kRound);
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float area = 4 * size[l], bc = length[1][l] * length[2][l];
      out.area[l] = area > kMinArea * bc ? area : 0.0F;
    }

    // Outward is away from the edge's end in bone.
    Lanes out_of_bone;
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float up = normal[0][l] > 0 ? 1.0F : -1.0F;
      out_of_bone[l] = up * (2 * q.starts_in_bone[l] - 1) / std::max(size[l], std::numeric_limits<float>::min());
    }
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t l = 0; l < kLanes; ++l) normal[i][l] *= out_of_bone[l];

    // The surface crosses the cells' faces halfway to the next crossings.
    const std::array<std::array<Lanes, 2>, 4> next{next_crossing(q, isovalue, 0), next_crossing(q, isovalue, 1),
                                                   next_crossing(q, isovalue, 2), next_crossing(q, isovalue, 3)};
    // The mean of the faces' crossings, and half the way between those that face one another.
    Vectors on_faces, wide_along, wide_across;
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float own = (isovalue - q.ends[0][l]) / (q.ends[1][l] - q.ends[0][l]);
      const float sum_a = next[0][0][l] + next[1][0][l] + next[2][0][l] + next[3][0][l];
      on_faces[0][l] = (q.start[0][l] + 0.5F * own + 0.125F * sum_a) * length[0][l];
      wide_along[0][l] = 0.25F * (next[1][0][l] - next[0][0][l]) * length[0][l];
      wide_across[0][l] = 0.25F * (next[3][0][l] - next[2][0][l]) * length[0][l];
    }
    for (std::size_t l = 0; l < kLanes; ++l) {
      on_faces[1][l] = (q.start[1][l] + 0.125F * (next[1][1][l] - next[0][1][l])) * length[1][l];
      on_faces[2][l] = (q.start[2][l] + 0.125F * (next[3][1][l] - next[2][1][l])) * length[2][l];
      wide_along[1][l] = 0.25F * (next[1][1][l] + next[0][1][l]) * length[1][l];
      wide_across[2][l] = 0.25F * (next[3][1][l] + next[2][1][l]) * length[2][l];
    }
    wide_along[2].fill(0);
    wide_across[1].fill(0);
    // From the mean of all four to that of two that face one another, and the way from there to the deeper two.
    Vectors deeper;
    for (std::size_t l = 0; l < kLanes; ++l) {
      deeper[0][l] = 0.125F * (next[0][0][l] + next[1][0][l] - next[2][0][l] - next[3][0][l]) * length[0][l];
      deeper[1][l] = 0.125F * (next[1][1][l] - next[0][1][l]) * length[1][l];
      deeper[2][l] = 0.125F * (next[2][1][l] - next[3][1][l]) * length[2][l];
    }
    Lanes inward;
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float height = deeper[0][l] * normal[0][l] + deeper[1][l] * normal[1][l] + deeper[2][l] * normal[2][l];
      const float out_by = height > 0 ? height : -height;
      const float over = out_by - kStandsOut * h * h * h / (length[1][l] * length[2][l]);
      inward[l] = (height > 0 ? -1.0F : 1.0F) * (over > 0 ? over / out_by : 0.0F);
    }

    Lanes rise, moved, sharpness;
    for (std::size_t l = 0; l < kLanes; ++l)
      rise[l] = (on_faces[0][l] - middle[0][l]) * normal[0][l] + (on_faces[1][l] - middle[1][l]) * normal[1][l] +
                (on_faces[2][l] - middle[2][l]) * normal[2][l];
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float most = 2 * round - rise[l], bounded = most > 0 ? most : 0.0F;
      moved[l] = rise[l] + (rise[l] < bounded ? rise[l] : bounded);
    }
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float over = rise[l] / round - 1, some = over > 0 ? over : 0.0F;
      sharpness[l] = some < 1 ? some : 1.0F;
    }
    const auto blend = [&](const Lanes& from, const Lanes& to, Lanes& result) {
      Lanes mixed;
      for (std::size_t l = 0; l < kLanes; ++l) mixed[l] = from[l] + sharpness[l] * (to[l] - from[l]);
      result = mixed;
    };
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t l = 0; l < kLanes; ++l) middle[i][l] += moved[l] * normal[i][l];
      for (std::size_t l = 0; l < kLanes; ++l) on_faces[i][l] += inward[l] * deeper[i][l];
      blend(middle[i], on_faces[i], out.middle[i]);
      blend(along[i], wide_along[i], out.along[i]);
      blend(across[i], wide_across[i], out.across[i]);
    }
    out.along_length = lengths_of(out.along);
    out.across_length = lengths_of(out.across);
  }

  /// The surface's next crossing across the face to the edge beside at `n` (`CrossingLanes::beside`), from the edge's
  /// lower end: along a, and away from the edge [voxels]. On a face that is crossed four times it is the crossing of
  /// the opposite edge.
  [[nodiscard]] static std::array<Lanes, 2> next_crossing(const CrossingLanes& q, float isovalue,
                                                          std::size_t n) noexcept {
    const Lanes &v0 = q.ends[0], &v1 = q.ends[1], &w0 = q.beside[n][0], &w1 = q.beside[n][1];
    // 1 if the opposite edge is crossed, else 0; likewise if the edge from one upper end to the other is.
    Lanes in0, in1, across, at_end, from, to;
    for (std::size_t l = 0; l < kLanes; ++l) in0[l] = w0[l] >= isovalue ? 1.0F : 0.0F;
    for (std::size_t l = 0; l < kLanes; ++l) in1[l] = w1[l] >= isovalue ? 1.0F : 0.0F;
    for (std::size_t l = 0; l < kLanes; ++l) across[l] = std::abs(in0[l] - in1[l]);
    for (std::size_t l = 0; l < kLanes; ++l) at_end[l] = (1 - across[l]) * (1 - std::abs(in0[l] - q.starts_in_bone[l]));
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float here = at_end[l] > 0 ? v1[l] : v0[l], there = at_end[l] > 0 ? w1[l] : w0[l];
      from[l] = across[l] > 0 ? w0[l] : here;
      to[l] = across[l] > 0 ? w1[l] : there;
    }
    std::array<Lanes, 2> out;
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float part = (isovalue - from[l]) / (to[l] - from[l]);
      out[0][l] = across[l] * part + at_end[l];
      out[1][l] = across[l] + (1 - across[l]) * part;
    }
    return out;
  }

 private:
  using Vectors = std::array<Lanes, 3>;

  [[nodiscard]] static Lanes lengths_of(const Vectors& v) noexcept {
    Lanes out;
    for (std::size_t l = 0; l < kLanes; ++l) out[l] = v[0][l] * v[0][l] + v[1][l] * v[1][l] + v[2][l] * v[2][l];
    square_roots(out);
    return out;
  }

  /// Spacing along the axes a, b, c of each lane [m].
  [[nodiscard]] Vectors lengths(const std::array<std::uint8_t, kLanes>& axis) const noexcept {
    const std::array<float, 5> h{spacing[0], spacing[1], spacing[2], spacing[0], spacing[1]};
    Vectors out;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t l = 0; l < kLanes; ++l) out[i][l] = h[axis[l] + i];
    return out;
  }
};

}  // namespace trephine
