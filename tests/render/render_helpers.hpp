// SPDX-License-Identifier: MIT
#pragma once

#include "support/fields.hpp"
#include "support/poses.hpp"

#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>

namespace trephine::test {

inline constexpr double kVoxel = 3e-4;  ///< [m] of every grid in these tests unless it says otherwise

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
