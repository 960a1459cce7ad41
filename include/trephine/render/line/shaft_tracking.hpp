// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/status.hpp>
#include <trephine/render/line/shaft_field.hpp>

/// Tracking of the shaft's intersection point IntP while contact persists (thesis 3.1, "tracking"; ours). The shaft is
/// a rigid line that rotates about the tip's proxy toward the probe's direction as far as bone allows (`ShaftField`).
/// IntP is the contact point of that line. The solution is exact up to the spacing of vertices.
///
/// The tip moves in pieces of at most half a voxel, each followed by its own rotation. In a single piece, a quick tip
/// would drag the middle of the line through a thin rib. Cost: at most `kMaxPieces` proxy steps; a single step below
/// 0.15 m/s at 1 kHz with voxels of 0.3 mm.
namespace trephine::inline TREPHINE_ALIGNED {

/// Input of tracking: the bone, the shaft's vertices and its centrelines at t−1 and t, in G.
template <ContactField Field>
struct ShaftScene {
  using Scalar = typename Field::Scalar;
  const Field& field;
  const ToolDiscretization<LineCounts, Scalar>& tool;
  Centreline<Scalar> offset;    ///< the probe's centreline, translated so that its tip is at the tip's proxy
  Centreline<Scalar> previous;  ///< offset of t−1; at the start of contact, the last free line before it
  Scalar* scratch;              ///< 2 · tool.padded() numbers

  /// Height of the last vertex above the tip [m].
  [[nodiscard]] Scalar length() const noexcept { return tool.heights()[static_cast<std::size_t>(tool.count() - 1)]; }
  /// The bone as a field over the far end's positions, for a tip [m].
  [[nodiscard]] ShaftField<Field> shaft_field(const Vec3<Scalar>& tip) const noexcept {
    return {field, tool, tip, scratch};
  }
};

/// Output of tracking, in G.
template <RealScalar Scalar>
struct ShaftContact {
  bool touching = false;
  Vec3<Scalar> point = Vec3<Scalar>::Zero();   ///< IntP
  Vec3<Scalar> normal = Vec3<Scalar>::Zero();  ///< outward normal of the bone at IntP
  Status status = Status::kOk;
};

/// Moves the proxy, the shaft's far end, from t−1 to t. Contact ends when `touching` is false.
template <ContactField Field, class Proxy, RealScalar Scalar = typename Field::Scalar>
ShaftContact<Scalar> track_shaft(const ShaftScene<Field>& s, Proxy& proxy) noexcept {
  constexpr int kMaxPieces = 64;        // of a motion; bounds the work, longer motions get longer pieces
  constexpr double kPieceLength = 0.5;  // largest piece, in voxels
  const Vec3<Scalar> move = s.offset.tip - s.previous.tip;
  const StepPlan pieces =
      plan_steps(static_cast<double>(move.norm()), kPieceLength * static_cast<double>(s.field.voxel()), kMaxPieces);
  ShaftContact<Scalar> c;
  if (pieces.bounded) c.status = Status::kWorkBound;
  for (int i = pieces.count - 1; i >= 0; --i) {
    const Scalar left = static_cast<Scalar>(i) / static_cast<Scalar>(pieces.count);
    const Vec3<Scalar> tip = s.offset.tip - left * move;
    c.status = worse(c.status, proxy.follow(s.shaft_field(tip), Vec3<Scalar>(tip + s.length() * s.offset.direction)));
  }
  c.touching = proxy.in_contact();
  if (!c.touching) return c;
  const ShaftField<Field> shaft = s.shaft_field(s.offset.tip);
  c.point = shaft.line_to(proxy.position()).at(shaft.deepest(proxy.position()).height);
  c.normal = proxy.normal();
  return c;
}

/// Starts contact at the last free line before it, and tracks it to t.
template <ContactField Field, class Proxy, RealScalar Scalar = typename Field::Scalar>
ShaftContact<Scalar> start_shaft_contact(const ShaftScene<Field>& s, Proxy& proxy) noexcept {
  proxy.attach_at(s.shaft_field(s.previous.tip), s.previous.at(s.length()));
  return track_shaft(s, proxy);
}

}  // namespace trephine
