// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/status.hpp>
#include <trephine/render/line/shaft_field.hpp>

#include <concepts>
#include <limits>

/// How the shaft's intersection point IntP follows while contact persists (thesis 3.1, "tracking"). Each policy moves
/// one SurfaceProxy; what that proxy stands for differs.
namespace trephine {

template <ContactField Field>
struct ShaftScene {
  using Scalar = typename Field::Scalar;
  const Field& field;
  const ToolDiscretization<LineCounts, Scalar>& tool;
  Centreline<Scalar> offset;    ///< the probe's centreline moved so that its tip lies on the tip's proxy
  Centreline<Scalar> previous;  ///< offset of t−1; where contact begins, the last free line before it
  Scalar* scratch;              ///< 2 · tool.padded() numbers
  bool refined = false;         ///< look between vertices too

  [[nodiscard]] Scalar length() const noexcept { return tool.heights()[static_cast<std::size_t>(tool.count() - 1)]; }
};

template <RealScalar Scalar>
struct ShaftContact {
  bool touching = false;
  Vec3<Scalar> point = Vec3<Scalar>::Zero();   ///< IntP
  Vec3<Scalar> normal = Vec3<Scalar>::Zero();  ///< outward, of the bone at IntP
  Status status = Status::kOk;
};

namespace detail {

template <ContactField Field, class Proxy, RealScalar Scalar = typename Field::Scalar>
ShaftContact<Scalar> hold_point(const ShaftScene<Field>& s, const Vec3<Scalar>& point, Proxy& proxy) noexcept {
  proxy.attach_at(s.field, point);
  return {.touching = true, .point = point, .normal = proxy.normal()};
}

// One proxy step of IntP toward `vertex`, the deepest of `line`.
template <ContactField Field, class Proxy, RealScalar Scalar = typename Field::Scalar>
ShaftContact<Scalar> track_point(const ShaftScene<Field>& s, const Centreline<Scalar>& line, Proxy& proxy,
                                 bool release) noexcept {
  line_values(s.field, s.tool, line, s.scratch);
  // The density saturates in bone, so many vertices may be equally deep: the one nearest to IntP acts.
  const int n = s.tool.count();
  const Scalar deepest = s.scratch[index_of_largest(s.scratch, n)];
  int acting = -1;
  Scalar nearest = std::numeric_limits<Scalar>::max();
  for (int i = 0; i < n; ++i) {
    if (s.scratch[i] < deepest) continue;
    const Scalar d = (line.at(s.tool.heights()[static_cast<std::size_t>(i)]) - proxy.position()).squaredNorm();
    if (!(d < nearest)) continue;
    nearest = d;
    acting = i;
  }
  ShaftContact<Scalar> c{.touching = true};
  if (acting >= 0 && (release || deepest >= Scalar(0)))
    c.status = proxy.follow(s.field, line.at(s.tool.heights()[static_cast<std::size_t>(acting)]));
  c.touching = proxy.in_contact();
  c.point = proxy.position();
  c.normal = proxy.normal();
  return c;
}

}  // namespace detail

/// Thesis: the vertices are projected onto the line from the tip through IntP of t−1; the deepest of them is the probe
/// and IntP the proxy. That line hardly depends on how the shaft turns at t. Where no projected vertex is in bone IntP
/// stays.
struct ProjectedTracking {
  template <ContactField Field, class Proxy, RealScalar Scalar = typename Field::Scalar>
  static ShaftContact<Scalar> begin(const ShaftScene<Field>& s, const Vec3<Scalar>& point, Proxy& proxy) noexcept {
    return detail::hold_point(s, point, proxy);
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

/// The alternative reading: the deepest vertex of the actual (offset) centreline is the probe.
struct CentrelineTracking {
  template <ContactField Field, class Proxy, RealScalar Scalar = typename Field::Scalar>
  static ShaftContact<Scalar> begin(const ShaftScene<Field>& s, const Vec3<Scalar>& point, Proxy& proxy) noexcept {
    return detail::hold_point(s, point, proxy);
  }
  template <ContactField Field, class Proxy, RealScalar Scalar = typename Field::Scalar>
  static ShaftContact<Scalar> track(const ShaftScene<Field>& s, Proxy& proxy) noexcept {
    return detail::track_point(s, s.offset, proxy, true);
  }
};

/// Ours: the shaft is a rigid line that turns about the tip's proxy as far toward the probe's direction as bone lets it
/// (`ShaftField`); IntP is where that line touches. The exact constrained solution up to the vertices' spacing.
///
/// The tip is carried along in pieces of at most half a voxel, each followed by its own turn: in one piece a quick tip
/// would drag the middle of the line through a thin rib. Cost: at most `kMostPieces` proxy steps, one below .15 m/s at
/// 1 kHz and voxels of .3 mm.
struct ConstrainedTracking {
  static constexpr int kMostPieces = 64;

  template <ContactField Field, class Proxy, RealScalar Scalar = typename Field::Scalar>
  static ShaftContact<Scalar> begin(const ShaftScene<Field>& s, const Vec3<Scalar>&, Proxy& proxy) noexcept {
    const ShaftField<Field> shaft(s.field, s.tool, s.previous.tip, s.refined, s.scratch);
    proxy.attach_at(shaft, s.previous.at(s.length()));
    return track(s, proxy);
  }
  template <ContactField Field, class Proxy, RealScalar Scalar = typename Field::Scalar>
  static ShaftContact<Scalar> track(const ShaftScene<Field>& s, Proxy& proxy) noexcept {
    const Vec3<Scalar> move = s.offset.tip - s.previous.tip;
    const StepPlan pieces =
        plan_steps(static_cast<double>(move.norm()), 0.5 * static_cast<double>(s.field.voxel()), kMostPieces);
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

template <class T>
concept Tracking =
    std::same_as<T, ProjectedTracking> || std::same_as<T, CentrelineTracking> || std::same_as<T, ConstrainedTracking>;

}  // namespace trephine
