// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/render/coupled/element_list.hpp>
#include <trephine/render/coupled/tool_distances.hpp>
#include <trephine/tool/tool_shape.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <utility>

/// Signed distances of surface elements' points from a tool, many elements at a time, to leave out free points early.
namespace trephine::inline TREPHINE_ALIGNED {

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

/// A batch of elements whose points' distances from the tool are computed together, in single precision. A point is
/// r + i a + k c, with r the element's arm from T's origin and a, c its half sides.
struct ElementBatch {
  static constexpr std::size_t kSize = kProfileLanes;
  using Floats = ProfileLanes<float>;
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
    min_distance.fill(std::numeric_limits<float>::max());
    for (std::size_t j = 0; j < lattice.points; ++j) {
      const auto i = static_cast<float>(lattice.along[j]), k = static_cast<float>(lattice.across[j]);
      std::array<Floats, 3> p;
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (std::size_t l = 0; l < kSize; ++l)
          p[axis][l] = position[axis][l] + i * along[axis][l] + k * across[axis][l];
      Floats& d = distance[j];
      trephine::compute_distances(shape, u, Vec3<float>::Zero(), p[0].data(), p[1].data(), p[2].data(), d);
      for (std::size_t l = 0; l < kSize; ++l) min_distance[l] = d[l] < min_distance[l] ? d[l] : min_distance[l];
    }
  }
};

}  // namespace trephine
