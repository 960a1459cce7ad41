// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/tool_shape.hpp>

namespace trephine::test {

/// What a tool answers for one point of its half plane.
struct ProfilePoint {
  double distance, normal_rho, normal_z, curvature;
  bool central;
};

template <ToolShape Shape>
[[nodiscard]] ProfilePoint profile_at(const Shape& tool, double rho, double z) {
  ProfileLanes<double> rhos, zs;
  rhos.fill(rho);
  zs.fill(z);
  Profile out;
  tool.profile(rhos, zs, out);
  return {out.distance[0], out.normal_rho[0], out.normal_z[0], out.curvature[0], out.central[0] == 1};
}

}  // namespace trephine::test
