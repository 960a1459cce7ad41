// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/square_roots.hpp>
#include <trephine/render/coupled/broad_phase.hpp>
#include <trephine/tool/tool_shape.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <utility>

/// Signed distances of surface elements' points from a tool, many elements at a time, to leave out free points early.
namespace trephine {

/// Places of an element's points: a lattice of `side`² points, spread evenly over the element [half sides].
struct PointLattice {
  static constexpr std::size_t kMaxSide = 4;
  std::size_t points;
  std::array<double, kMaxSide * kMaxSide> along{}, across{};  ///< of each point, from −1 to 1
  double outermost;                                           ///< largest coordinate

  /// `side` from 1 to kMaxSide; a number beyond is clamped.
  explicit constexpr PointLattice(std::size_t side) noexcept {
    const std::size_t n = std::clamp<std::size_t>(side, 1, kMaxSide);
    const auto coordinate = [n](std::size_t i) {
      return (2.0 * static_cast<double>(i) + 1 - static_cast<double>(n)) / static_cast<double>(n);
    };
    points = n * n;
    outermost = coordinate(n - 1);
    for (std::size_t j = 0; j < points; ++j) {
      along[j] = coordinate(j / n);
      across[j] = coordinate(j % n);
    }
  }
};

/// A batch of elements whose points' distances from the tool are computed together, in single precision.
///
/// A point is r + i a + j c, with r the element's arm from T's origin and a, c its half sides. Its height is a sum of
/// their heights. Its distance from the axis follows from products of their parts perpendicular to the axis.
struct ElementBatch {
  static constexpr std::size_t kSize = 2 * kProfileLanes;
  using Floats = std::array<float, kSize>;
  std::size_t count = 0;
  std::array<Floats, 3> position, along, across;  ///< from T's origin, in G [m]
  /// Signed distances of the elements' points from the tool [m], by point and element.
  std::array<Floats, PointLattice::kMaxSide * PointLattice::kMaxSide> distance;
  Floats min_distance;  ///< least distance of an element's points [m]
  std::array<std::pair<const NearBlock*, std::size_t>, kSize> element;

  void add(const NearBlock& block, std::size_t i, const Vec3<float>& shift) noexcept {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      position[axis][count] = block.elements->position[axis][i] + shift[static_cast<Eigen::Index>(axis)];
      along[axis][count] = block.elements->along[axis][i];
      across[axis][count] = block.elements->across[axis][i];
    }
    element[count++] = {&block, i};
  }

  /// Computes the distances of the elements' points; `u` is the tool's axis in G.
  template <ToolShape Shape>
  void compute_distances(const Shape& shape, const PointLattice& lattice, const Vec3<float>& u) noexcept {
    for (std::size_t first = 0; first < count; first += kProfileLanes) compute_lanes(shape, lattice, u, first);
  }

 private:
  using Lanes = ProfileLanes<float>;
  using VectorLanes = std::array<Lanes, 3>;

  // Results stay local until they are complete: memory that may overlap the input keeps loops from being vectorised.
  template <ToolShape Shape>
  void compute_lanes(const Shape& shape, const PointLattice& lattice, const Vec3<float>& u,
                     std::size_t first) noexcept {
    VectorLanes r = load(position, first), a = load(along, first), c = load(across, first);
    const Lanes hr = split_height(r, u), ha = split_height(a, u), hc = split_height(c, u);
    const Lanes rr = dot(r, r), ra = dot(r, a), rc = dot(r, c), aa = dot(a, a), cc = dot(c, c), ac = dot(a, c);
    Lanes low;
    low.fill(std::numeric_limits<float>::max());
    for (std::size_t j = 0; j < lattice.points; ++j) {
      const auto i = static_cast<float>(lattice.along[j]), k = static_cast<float>(lattice.across[j]);
      Lanes z, rho, d;
      for (std::size_t l = 0; l < kProfileLanes; ++l) z[l] = hr[l] + i * ha[l] + k * hc[l];
      for (std::size_t l = 0; l < kProfileLanes; ++l) {
        const float square = rr[l] + 2 * (i * ra[l] + k * rc[l] + i * k * ac[l]) + i * i * aa[l] + k * k * cc[l];
        rho[l] = square > 0 ? square : 0.0F;
      }
      square_roots(rho);
      shape.distances(rho, z, d);
      for (std::size_t l = 0; l < kProfileLanes; ++l) low[l] = d[l] < low[l] ? d[l] : low[l];
      std::copy(d.begin(), d.end(), distance[j].begin() + static_cast<std::ptrdiff_t>(first));
    }
    std::copy(low.begin(), low.end(), min_distance.begin() + static_cast<std::ptrdiff_t>(first));
  }

  [[nodiscard]] static VectorLanes load(const std::array<Floats, 3>& v, std::size_t first) noexcept {
    VectorLanes lanes;
    for (std::size_t axis = 0; axis < 3; ++axis) std::copy_n(v[axis].data() + first, kProfileLanes, lanes[axis].data());
    return lanes;
  }
  /// Returns the components along u, and leaves in v the parts perpendicular to it.
  [[nodiscard]] static Lanes split_height(VectorLanes& v, const Vec3<float>& u) noexcept {
    const float ux = u.x(), uy = u.y(), uz = u.z();
    Lanes height;
    for (std::size_t l = 0; l < kProfileLanes; ++l) height[l] = v[0][l] * ux + v[1][l] * uy + v[2][l] * uz;
    for (std::size_t l = 0; l < kProfileLanes; ++l) v[0][l] -= height[l] * ux;
    for (std::size_t l = 0; l < kProfileLanes; ++l) v[1][l] -= height[l] * uy;
    for (std::size_t l = 0; l < kProfileLanes; ++l) v[2][l] -= height[l] * uz;
    return height;
  }
  [[nodiscard]] static Lanes dot(const VectorLanes& v, const VectorLanes& w) noexcept {
    Lanes product;
    for (std::size_t l = 0; l < kProfileLanes; ++l)
      product[l] = v[0][l] * w[0][l] + v[1][l] * w[1][l] + v[2][l] * w[2][l];
    return product;
  }
};

}  // namespace trephine
