// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/friction.hpp>
#include <trephine/core/misuse.hpp>
#include <trephine/render/line/shaft_tracking.hpp>
#include <trephine/render/shaft_force.hpp>
#include <trephine/tool/shape.hpp>
#include <trephine/voxel/gradient.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// Reports template arguments that fit no Line approximation in one readable error message.
template <class S, class Step = TranslateRotate, class Track = ConstrainedTracking, class FrictionLaw = Frictionless,
          class Shaft = FullWrench, class GradientChoice = SplineGradient, class Shape = Burr>
class LineApproxRenderer : public detail::UnusableRenderer {
  static_assert(detail::kFits<S>,
                "trephine::LineApproxRenderer: write LineApproxRenderer{ToolDiscretization{burr, LineCounts{}}, "
                "LineOptions{}, TranslateRotate{}, Coulomb{0.2, 0.15}}; the last three may be left out. As a type: "
                "LineApproxRenderer<float, stepping, tracking, friction, shaft force, gradient, tool>");

 public:
  template <class... Arguments>
  explicit LineApproxRenderer(const Arguments&...) noexcept {}
};

}  // namespace trephine
