// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/square_roots.hpp>
#include <trephine/tool/tool_shape.hpp>
#include <trephine/voxel/lane_bits.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

/// Signed distances of points and bounding spheres from a tool, kProfileLanes at a time, in single precision.
namespace trephine::inline TREPHINE_ALIGNED {

/// Computes the signed distances [m] of kProfileLanes points from a tool along the unit vector `axis`. `shift` is the
/// points' origin less the tool's [m].
template <ToolShape Shape>
void compute_distances(const Shape& shape, const Vec3<float>& axis, const Vec3<float>& shift, const float* x,
                       const float* y, const float* z, ProfileLanes<float>& distance) noexcept {
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
  square_roots(rho);
  shape.distances(rho, along, distance);
}

/// Takes `turn` times the arms of kProfileLanes points off their distances [m]: a rotation of the tool's axis by `turn`
/// [rad] brings them no nearer. The points are from an origin that the rotation keeps.
inline void subtract_turn(float turn, const float* x, const float* y, const float* z,
                          ProfileLanes<float>& distance) noexcept {
  ProfileLanes<float> arm;
  for (std::size_t l = 0; l < kProfileLanes; ++l) arm[l] = x[l] * x[l] + y[l] * y[l] + z[l] * z[l];
  square_roots(arm);
  for (std::size_t l = 0; l < kProfileLanes; ++l) distance[l] -= turn * arm[l];
}

/// Centres of bounding spheres in lanes, about an origin [m], and their signed distances from a tool [m].
class SphereLanes {
 public:
  /// Allocates room for `spheres` centres.
  void reserve(std::size_t spheres) {
    for (auto* v : {&x_, &y_, &z_}) v->resize(spheres + kProfileLanes);
    distance_.resize(spheres / kProfileLanes + 1);
  }
  void set_centre(std::size_t i, const Vec3<float>& p) noexcept {
    x_[i] = p.x();
    y_[i] = p.y();
    z_[i] = p.z();
  }
  /// Takes the first `count` centres of others.
  void take_centres(const SphereLanes& other, std::size_t count) noexcept {
    for (auto v : {&SphereLanes::x_, &SphereLanes::y_, &SphereLanes::z_})
      std::copy_n((other.*v).begin(), count, (this->*v).begin());
  }
  /// Distance of centre i from the lanes' origin [m].
  [[nodiscard]] float arm(std::size_t i) const noexcept { return Vec3<float>(x_[i], y_[i], z_[i]).norm(); }
  /// Distance of centre i from the tool [m], as `measure` computed it last.
  [[nodiscard]] float distance(std::size_t i) const noexcept { return distance_[i / kProfileLanes][i % kProfileLanes]; }
  /// Distances of the centres from `first` on, a multiple of kProfileLanes.
  [[nodiscard]] const ProfileLanes<float>& distances(std::size_t first) const noexcept {
    return distance_[first / kProfileLanes];
  }
  /// Coordinates of the centres [m].
  [[nodiscard]] std::array<float*, 3> centres() noexcept { return {x_.data(), y_.data(), z_.data()}; }
  /// Computes the signed distances of the first `count` centres from a tool with the axis `axis`, less what a rotation
  /// of the axis by `turn` [rad] may take off (`subtract_turn`). `shift` is the lanes' origin less the tool's [m].
  template <ToolShape Shape>
  void measure(const Shape& shape, const Vec3<float>& axis, const Vec3<float>& shift, std::size_t count,
               float turn = 0) noexcept {
    for (std::size_t i = 0; i < count; i += kProfileLanes) {
      const float *const x = x_.data() + i, *const y = y_.data() + i, *const z = z_.data() + i;
      ProfileLanes<float>& distance = distance_[i / kProfileLanes];
      compute_distances(shape, axis, shift, x, y, z, distance);
      if (turn > 0) subtract_turn(turn, x, y, z, distance);
    }
  }

 private:
  std::vector<float> x_, y_, z_;
  std::vector<ProfileLanes<float>> distance_;
};

/// Bounding spheres of equal radius, tested for nearness to a tool kProfileLanes at a time.
template <class Key>
class SphereBatch {
 public:
  /// Takes a sphere about `centre`, from the tool's origin [m].
  void add(const Vec3<float>& centre, const Key& key) noexcept {
    x_[count_] = centre.x();
    y_[count_] = centre.y();
    z_[count_] = centre.z();
    key_[count_++] = key;
  }
  [[nodiscard]] bool is_full() const noexcept { return count_ == kProfileLanes; }

  /// Calls visit(key, centre) for the spheres within `max_distance` + `turn` · arm of the tool [m], the arm being the
  /// centre's distance from the tool's origin. Empties the batch.
  template <ToolShape Shape, class Visit>
  void flush(const Shape& shape, const Vec3<float>& axis, float max_distance, float turn, Visit&& visit) noexcept {
    ProfileLanes<float> distance;
    compute_distances(shape, axis, Vec3<float>::Zero(), x_.data(), y_.data(), z_.data(), distance);
    subtract_turn(turn, x_.data(), y_.data(), z_.data(), distance);
    std::uint32_t is_close =
        detail::lane_bits<float, kProfileLanes>([&](std::size_t l) { return distance[l] <= max_distance; });
    for (is_close &= (1U << count_) - 1; is_close != 0; is_close &= is_close - 1) {
      const auto l = static_cast<std::size_t>(std::countr_zero(is_close));
      visit(key_[l], Vec3<float>(x_[l], y_[l], z_[l]));
    }
    count_ = 0;
  }

 private:
  std::size_t count_ = 0;
  ProfileLanes<float> x_{}, y_{}, z_{};
  std::array<Key, kProfileLanes> key_{};
};

}  // namespace trephine
