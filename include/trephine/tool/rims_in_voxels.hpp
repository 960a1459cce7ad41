// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/square_roots.hpp>
#include <trephine/tool/outline.hpp>

#include <algorithm>
#include <array>
#include <cstddef>

/// Rims of a tool as voxels need them: the trilinear surface of a body's distances lies inside a bulge.
namespace trephine::inline TREPHINE_ALIGNED {

namespace detail {

/// Least cosine of half a rim's turn: a rim of half a turn has no corner between its tangents.
inline constexpr double kMinRimCosine = 0.1;
/// Part of a rim's radius that is left at least.
inline constexpr double kSharpestRim = 1e-3;
/// Trilinear surfaces lie 0.44 h sin β inside a sharp corner of the turn 2β whose diagonal is a cell's.
inline constexpr double kSharpCorner = 0.44;

/// How much thicker a piece becomes [m]: chord (1/r − 1/R) for an arc of radius r that bulges, R the body's largest.
[[nodiscard]] inline double thickening(const OutlinePiece& p, double largest, double chord) noexcept {
  return p.side > 0 ? std::max(0.0, chord * (1 / p.radius - 1 / largest)) : 0.0;
}

/// How much smaller a rim's radius must be in voxels of the size h [m]; 0 if the piece is no rim.
[[nodiscard]] inline double rim_reduction(const OutlinePiece& p, double largest, double h) noexcept {
  if (!(p.side > 0) || !(p.rho > 0) || !(p.end_rho > 0) || !(p.cosine > kMinRimCosine)) return 0;
  const double lacks = std::min(3 * h * h / 8 * (1 / p.radius - 1 / largest), kSharpCorner * h * p.sine());
  return std::clamp(lacks * p.cosine / (1 - p.cosine), 0.0, (1 - kSharpestRim) * p.radius);
}

}  // namespace detail

/// Computes the signed distances [m] of some points from the body with thicker rims: arcs of radius r that bulge,
/// enlarged by chord (1/r − 1/R), R the largest radius of the body. `chord` in m².
template <RealScalar S, std::size_t kLanes>
void enlarged_distances(const ToolOutline& outline, const std::array<S, kLanes>& rho, const std::array<S, kLanes>& z,
                        double chord, std::array<S, kLanes>& out) noexcept {
  outline.distances(rho, z, out);
  if (!(chord > 0)) return;
  detail::NearestOnPiece<S, kLanes> nearest(rho, z);
  for (const OutlinePiece& p : outline.pieces()) {
    const auto more = static_cast<S>(detail::thickening(p, outline.largest_radius(), chord));
    if (!(more > S(0))) continue;
    nearest.find(p);
    square_roots(nearest.square);
    for (std::size_t l = 0; l < kLanes; ++l) nearest.square[l] -= more;
    for (std::size_t l = 0; l < kLanes; ++l) out[l] = nearest.square[l] < out[l] ? nearest.square[l] : out[l];
  }
}

/// Returns the most that `enlarged_distances` adds anywhere [m].
[[nodiscard]] inline double thickest_rim(const ToolOutline& outline, double chord) noexcept {
  double most = 0;
  for (const OutlinePiece& p : outline.pieces())
    most = std::max(most, detail::thickening(p, outline.largest_radius(), chord));
  return most;
}

/// Returns the body with sharper rims, as voxels of the size `h` [m] need it. Of each rim's arc the radius shrinks and
/// the centre moves out, between the same tangents at its ends. So the rim's middle moves out by what voxels lack
/// there, and flanks and ends stay where they are.
///
/// Voxels lack 3h²/8 (1/r − 1/R) at an arc of radius r, R the body's largest: the sag of a chord over a cell's
/// diagonal. They lack no more than at a corner in the middle of a cell.
[[nodiscard]] inline ToolOutline with_sharper_rims(const ToolOutline& outline, double h) noexcept {
  using Piece = OutlinePiece;
  ToolOutline out(outline);
  out.count_ = 0;
  for (std::size_t i = 0; i < outline.count_; ++i) {
    const Piece& p = outline.pieces_[i];
    const double less = detail::rim_reduction(p, outline.largest_radius(), h), along = less * p.sine() / p.cosine;
    if (!(along > ToolOutline::kShortest) || out.count_ + outline.count_ - i + 2 > ToolOutline::kMaxPieces) {
      out.append(p);
      continue;
    }
    Piece arc = p;
    arc.radius -= less;
    arc.centre_rho += less / p.cosine * p.middle_rho;
    arc.centre_z += less / p.cosine * p.middle_z;
    // The outline goes on where the normal points after a quarter of a turn.
    const double step = along / p.radius;
    arc.rho -= step * (p.z - p.centre_z);
    arc.z += step * (p.rho - p.centre_rho);
    arc.end_rho += step * (p.end_z - p.centre_z);
    arc.end_z -= step * (p.end_rho - p.centre_rho);
    out.append(Piece::line(p.rho, p.z, arc.rho, arc.z));
    out.append(arc);
    out.append(Piece::line(arc.end_rho, arc.end_z, p.end_rho, p.end_z));
  }
  return out;
}

}  // namespace trephine
