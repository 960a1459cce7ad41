// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/field_archetype.hpp>
#include <trephine/contact/surface_proxy.hpp>
#include <trephine/core/status.hpp>
#include <trephine/render/line/shaft_field.hpp>

#include <concepts>
#include <limits>

/// Tracking of the shaft's intersection point IntP while contact persists (thesis 3.1, "tracking"). Each policy moves a
/// SurfaceProxy; its meaning differs between policies.
namespace trephine::inline TREPHINE_ALIGNED {

/// Input of a tracking policy: the bone, the shaft's vertices and its centrelines at t−1 and t, in G.
template <ContactField Field>
struct ShaftScene {
  using Scalar = typename Field::Scalar;
  const Field& field;
  const ToolDiscretization<LineCounts, Scalar>& tool;
  Centreline<Scalar> offset;    ///< the probe's centreline, translated so that its tip is at the tip's proxy
  Centreline<Scalar> previous;  ///< offset of t−1; at the start of contact, the last free line before it
  Scalar* scratch;              ///< 2 · tool.padded() numbers
  bool refined = false;         ///< search between vertices too

  /// Height of the last vertex above the tip [m].
  [[nodiscard]] Scalar length() const noexcept { return tool.heights()[static_cast<std::size_t>(tool.count() - 1)]; }
};

/// Output of a tracking policy, in G.
template <RealScalar Scalar>
struct ShaftContact {
  bool touching = false;
  Vec3<Scalar> point = Vec3<Scalar>::Zero();   ///< IntP
  Vec3<Scalar> normal = Vec3<Scalar>::Zero();  ///< outward normal of the bone at IntP
  Status status = Status::kOk;
};

namespace detail {

// Attaches the proxy to a surface point.
template <ContactField Field, class Proxy, RealScalar Scalar = typename Field::Scalar>
ShaftContact<Scalar> attach_to_point(const ShaftScene<Field>& s, const Vec3<Scalar>& point, Proxy& proxy) noexcept {
  proxy.attach_at(s.field, point);
  return {.touching = true, .point = point, .normal = proxy.normal()};
}

// Moves the proxy, which is IntP, toward the deepest vertex of `line`. `release` allows contact to end if that vertex
// is outside bone; else IntP stays.
template <ContactField Field, class Proxy, RealScalar Scalar = typename Field::Scalar>
ShaftContact<Scalar> track_point(const ShaftScene<Field>& s, const Centreline<Scalar>& line, Proxy& proxy,
                                 bool release) noexcept {
  line_values(s.field, s.tool, line, s.scratch);
  // The density saturates in bone, so several vertices may be equally deep: the vertex nearest to IntP is the probe.
  const int n = s.tool.count();
  const Scalar deepest = s.scratch[index_of_largest(s.scratch, n)];
  int probe = -1;
  Scalar nearest = std::numeric_limits<Scalar>::max();
  for (int i = 0; i < n; ++i) {
    if (s.scratch[i] < deepest) continue;
    const Scalar d = (line.at(s.tool.heights()[static_cast<std::size_t>(i)]) - proxy.position()).squaredNorm();
    if (!(d < nearest)) continue;
    nearest = d;
    probe = i;
  }
  ShaftContact<Scalar> c{.touching = true};
  if (probe >= 0 && (release || deepest >= Scalar(0)))
    c.status = proxy.follow(s.field, line.at(s.tool.heights()[static_cast<std::size_t>(probe)]));
  c.touching = proxy.in_contact();
  c.point = proxy.position();
  c.normal = proxy.normal();
  return c;
}

}  // namespace detail

/// Tracking of the thesis. It projects the vertices onto the line from the tip through IntP of t−1. The deepest
/// projected vertex is the probe and IntP the proxy. This line hardly depends on the shaft's rotation at t. IntP stays
/// if no projected vertex is in bone.
struct ProjectedTracking {
  template <ContactField Field, class Proxy, RealScalar Scalar = typename Field::Scalar>
  static ShaftContact<Scalar> start(const ShaftScene<Field>& s, const Vec3<Scalar>& point, Proxy& proxy) noexcept {
    return detail::attach_to_point(s, point, proxy);
  }
  template <ContactField Field, class Proxy, RealScalar Scalar = typename Field::Scalar>
  static ShaftContact<Scalar> track(const ShaftScene<Field>& s, Proxy& proxy) noexcept {
    line_values(s.field, s.tool, s.offset, s.scratch);
    if (s.scratch[index_of_largest(s.scratch, s.tool.count())] < Scalar(0)) {
      proxy.reset();
      return {};
    }
    const Vec3<Scalar> r = proxy.position() - s.offset.tip;
    const Scalar length = r.norm();
    const Centreline<Scalar> line{s.offset.tip, length > Scalar(0) ? Vec3<Scalar>(r / length) : s.offset.direction};
    return detail::track_point(s, line, proxy, false);
  }
};

/// Tracking by an alternative reading of the thesis: the deepest vertex of the offset centreline is the probe.
struct CentrelineTracking {
  template <ContactField Field, class Proxy, RealScalar Scalar = typename Field::Scalar>
  static ShaftContact<Scalar> start(const ShaftScene<Field>& s, const Vec3<Scalar>& point, Proxy& proxy) noexcept {
    return detail::attach_to_point(s, point, proxy);
  }
  template <ContactField Field, class Proxy, RealScalar Scalar = typename Field::Scalar>
  static ShaftContact<Scalar> track(const ShaftScene<Field>& s, Proxy& proxy) noexcept {
    return detail::track_point(s, s.offset, proxy, true);
  }
};

/// Tracking by constrained rotation (ours). The shaft is a rigid line that rotates about the tip's proxy toward the
/// probe's direction as far as bone allows (`ShaftField`). IntP is the contact point of that line. The solution is
/// exact up to the spacing of vertices.
///
/// The tip moves in pieces of at most half a voxel, each followed by its own rotation. In a single piece, a quick tip
/// would drag the middle of the line through a thin rib. Cost: at most `kMaxPieces` proxy steps; a single step below
/// 0.15 m/s at 1 kHz with voxels of 0.3 mm.
struct ConstrainedTracking {
  static constexpr int kMaxPieces = 64;        ///< of a motion; bounds the work, longer motions get longer pieces
  static constexpr double kPieceLength = 0.5;  ///< largest piece, in voxels

  template <ContactField Field, class Proxy, RealScalar Scalar = typename Field::Scalar>
  static ShaftContact<Scalar> start(const ShaftScene<Field>& s, const Vec3<Scalar>&, Proxy& proxy) noexcept {
    const ShaftField<Field> shaft(s.field, s.tool, s.previous.tip, s.refined, s.scratch);
    proxy.attach_at(shaft, s.previous.at(s.length()));
    return track(s, proxy);
  }
  template <ContactField Field, class Proxy, RealScalar Scalar = typename Field::Scalar>
  static ShaftContact<Scalar> track(const ShaftScene<Field>& s, Proxy& proxy) noexcept {
    const Vec3<Scalar> move = s.offset.tip - s.previous.tip;
    const StepPlan pieces =
        plan_steps(static_cast<double>(move.norm()), kPieceLength * static_cast<double>(s.field.voxel()), kMaxPieces);
    ShaftContact<Scalar> c;
    if (pieces.bounded) c.status = Status::kWorkBound;
    for (int i = pieces.count - 1; i >= 0; --i) {
      const Scalar left = static_cast<Scalar>(i) / static_cast<Scalar>(pieces.count);
      const Vec3<Scalar> tip = s.offset.tip - left * move;
      const ShaftField<Field> shaft(s.field, s.tool, tip, s.refined, s.scratch);
      c.status = worse(c.status, proxy.follow(shaft, Vec3<Scalar>(tip + s.length() * s.offset.direction)));
    }
    c.touching = proxy.in_contact();
    if (!c.touching) return c;
    const ShaftField<Field> shaft(s.field, s.tool, s.offset.tip, s.refined, s.scratch);
    c.point = shaft.line_to(proxy.position()).at(shaft.deepest(proxy.position()).height);
    c.normal = proxy.normal();
    return c;
  }
};

/// Policy that tracks IntP. `start(scene, point, proxy)` starts contact at a surface point; `track(scene, proxy)`
/// updates it. Both return the contact; contact ends when `touching` is false.
// clang-format off
template <class T>
concept Tracking = requires(const ShaftScene<detail::FieldArchetype<float>>& scene, const Vec3<float>& point,
                            SurfaceProxy<float>& proxy) {
  { T::start(scene, point, proxy) } noexcept -> std::same_as<ShaftContact<float>>;
  { T::track(scene, proxy) } noexcept -> std::same_as<ShaftContact<float>>;
};
// clang-format on

}  // namespace trephine
