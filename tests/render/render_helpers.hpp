// SPDX-License-Identifier: MIT
#pragma once

#include "support/fields.hpp"

#include <trephine/render/line_approx_renderer.hpp>
#include <trephine/render/surface_approx_renderer.hpp>

namespace trephine::test {

inline constexpr double kVoxel = 3e-4;  ///< [m] of every grid in these tests unless it says otherwise

/// A tool whose ball is at `tip` and whose shaft points along `direction`.
[[nodiscard]] inline Posed tool_at(const Vec3d& tip, const Vec3d& direction) {
  return make_pose<double>(Quatd::FromTwoVectors(Vec3d::UnitZ(), direction).toRotationMatrix(), tip);
}

/// The pose `share` of the way from a to b: translation and rotation at even speed.
[[nodiscard]] inline Posed between(const Posed& a, const Posed& b, double share) {
  const Vec3d w = rotation_vector(Mat3d(a.linear().transpose() * b.linear()));
  return make_pose<double>(a.linear() * rotation_from_vector(Vec3d(share * w)),
                           a.translation() + share * (b.translation() - a.translation()));
}

template <class Renderer, class Field>
auto render_at(Renderer& renderer, const Field& field, const Posed& X_GT) {
  return renderer.render(field, Pose<typename Renderer::Scalar>(X_GT.template cast<typename Renderer::Scalar>()));
}

/// Moves a tool from a to b in `ticks`; returns what the last tick gave, its status the worst on the way.
template <class Renderer, class Field>
auto lead(Renderer& renderer, const Field& field, const Posed& a, const Posed& b, int ticks) {
  auto out = render_at(renderer, field, a);
  Status worst = out.status;
  for (int i = 1; i <= ticks; ++i) {
    out = render_at(renderer, field, between(a, b, static_cast<double>(i) / ticks));
    worst = worse(worst, out.status);
  }
  out.status = worst;
  return out;
}

template <class Scalar>
[[nodiscard]] Wrenchd in_double(const Wrench<Scalar>& w) {
  return w.template cast<double>();
}

}  // namespace trephine::test
