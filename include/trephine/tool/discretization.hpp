// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/tool/shape.hpp>
#include <trephine/voxel/sampling.hpp>

#include <vector>

/// A burr as vertices: what the Line and Surface approximations share (line_discretization.hpp,
/// surface_discretization.hpp).
namespace trephine::inline TREPHINE_ALIGNED {

/// Points as separate coordinate arrays, padded to a multiple of kLane by copies of the last point. Padding therefore
/// finds no contact of its own.
template <RealScalar Scalar>
struct PointArrays {
  std::vector<Scalar> x, y, z;

  void push_back(const Vec3d& p) {
    x.push_back(static_cast<Scalar>(p.x()));
    y.push_back(static_cast<Scalar>(p.y()));
    z.push_back(static_cast<Scalar>(p.z()));
  }
  void pad() {
    const auto padded = static_cast<std::size_t>(padded_to_lane(size()));
    for (auto* a : {&x, &y, &z})
      if (!a->empty()) a->resize(padded, a->back());
  }
  [[nodiscard]] int size() const noexcept { return static_cast<int>(x.size()); }
  [[nodiscard]] Vec3<Scalar> operator[](int i) const noexcept {
    const auto n = static_cast<std::size_t>(i);
    return {x[n], y[n], z[n]};
  }
};

/// Vertices that represent a tool in the tool frame T. The counts choose the specialisation for a renderer:
/// `ToolDiscretization{burr, LineCounts{…}}` or `ToolDiscretization{burr, SurfaceCounts{…}}`. Immutable after
/// construction. Other tools than a burr: `revolved_vertices.hpp`.
template <class Counts, RealScalar Scalar = float, class Shape = Burr>
class ToolDiscretization;

template <class Counts>
ToolDiscretization(const Burr&, const Counts&) -> ToolDiscretization<Counts, float>;

}  // namespace trephine
