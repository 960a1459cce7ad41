// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/square_roots.hpp>
#include <trephine/tool/tool_shape.hpp>

#include <algorithm>
#include <cstddef>
#include <vector>

/// Signed distances of points and bounding spheres from a tool, kProfileLanes at a time, in single precision.
namespace trephine {

/// Computes the signed distances [m] of kProfileLanes points from a tool along the unit vector `axis`. `shift` is the
/// points' origin less the tool's [m].
template <ToolShape Shape>
void compute_distances(const Shape& shape, const Vec3<float>& axis, const Vec3<float>& shift, const float* x,
                       const float* y, const float* z, float* distance) noexcept {
  ProfileLanes<float> rho, along;
  const float ux = axis.x(), uy = axis.y(), uz = axis.z(), sx = shift.x(), sy = shift.y(), sz = shift.z();
  for (std::size_t i = 0; i < kProfileLanes; ++i) {
    const float px = x[i] + sx, py = y[i] + sy, pz = z[i] + sz;
    const float a = px * ux + py * uy + pz * uz;
    // The part perpendicular to the axis, without cancellation.
    const float qx = px - a * ux, qy = py - a * uy, qz = pz - a * uz;
    along[i] = a;
    rho[i] = qx * qx + qy * qy + qz * qz;
  }
  square_roots<64>(rho);
  ProfileLanes<float> d;
  shape.distances(rho, along, d);
  std::copy(d.begin(), d.end(), distance);
}

/// Centres of bounding spheres in lanes, about an origin [m], and their signed distances from a tool [m].
class SphereLanes {
 public:
  /// Allocates room for `spheres` centres.
  void reserve(std::size_t spheres) {
    for (auto* v : {&x_, &y_, &z_, &distance_}) v->resize(spheres + kProfileLanes);
  }
  void set_centre(std::size_t i, const Vec3<float>& p) noexcept {
    x_[i] = p.x();
    y_[i] = p.y();
    z_[i] = p.z();
  }
  /// Distance of centre i from the lanes' origin [m].
  [[nodiscard]] float arm(std::size_t i) const noexcept { return Vec3<float>(x_[i], y_[i], z_[i]).norm(); }
  /// Signed distance of centre i from the tool [m], as `measure` computed it last.
  [[nodiscard]] float distance(std::size_t i) const noexcept { return distance_[i]; }
  /// Computes the distances of the first `count` centres from a tool with the axis `axis`. `shift` is the lanes' origin
  /// less the tool's [m].
  template <ToolShape Shape>
  void measure(const Shape& shape, const Vec3<float>& axis, const Vec3<float>& shift, std::size_t count) noexcept {
    for (std::size_t i = 0; i < count; i += kProfileLanes)
      compute_distances(shape, axis, shift, x_.data() + i, y_.data() + i, z_.data() + i, distance_.data() + i);
  }

 private:
  std::vector<float> x_, y_, z_, distance_;
};

}  // namespace trephine
