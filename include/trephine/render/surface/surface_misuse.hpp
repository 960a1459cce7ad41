// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/misuse.hpp>
#include <trephine/render/shaft_force.hpp>
#include <trephine/render/surface/deep_contact.hpp>
#include <trephine/render/surface/weighting.hpp>
#include <trephine/tool/shape.hpp>
#include <trephine/voxel/gradient.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// Reports template arguments that fit no Surface approximation in one readable error message.
template <class S, class Weights = PatchWeights, class Deep = ExtendAlongSurface, class Shaft = FullWrench,
          class GradientChoice = AnalyticGradient, class Shape = Burr>
class SurfaceApproxRenderer : public detail::UnusableRenderer {
  static_assert(detail::kFits<S>,
                "trephine::SurfaceApproxRenderer: write SurfaceApproxRenderer{ToolDiscretization{burr, "
                "SurfaceCounts{}}, SurfaceOptions{}}; it has no friction. As a type: SurfaceApproxRenderer<float, "
                "weighting, deep contact, shaft force, gradient, tool>");

 public:
  template <class... Arguments>
  explicit SurfaceApproxRenderer(const Arguments&...) noexcept {}
};

}  // namespace trephine
