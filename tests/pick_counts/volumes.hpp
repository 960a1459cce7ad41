// SPDX-License-Identifier: MIT
#pragma once

#include "pick_places.hpp"

#include <algorithm>
#include <cmath>

namespace pick::test {

/// A grid whose density falls by 400 a voxel across the shape's surface, where it is `kIsovalue`; `shape` is a signed
/// distance [m] in G, negative in bone. Where that is linear the grid's surface is exact.
inline constexpr double kIsovalue = 1000;

template <class Shape>
[[nodiscard]] Grid rasterise(const std::array<int, 3>& size, const trephine::Vec3d& spacing, const Shape& shape) {
  std::vector<std::int16_t> voxels;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i) {
        const double d = shape(spacing.cwiseProduct(trephine::Vec3d(i, j, k))) / spacing.minCoeff();
        voxels.push_back(static_cast<std::int16_t>(std::lround(kIsovalue - 400 * std::clamp(d, -2.4, 2.4))));
      }
  return {{.size = size, .spacing = spacing}, voxels};
}

/// The half space below z = height.
[[nodiscard]] inline Grid plane(double height, double spacing = 5e-4, int size = 60) {
  return rasterise({size, size, size}, trephine::Vec3d::Constant(spacing),
                   [=](const trephine::Vec3d& p) { return p.z() - height; });
}

/// A ball in the middle.
[[nodiscard]] inline Grid ball(double radius, double spacing = 5e-4, int size = 60) {
  const trephine::Vec3d middle = trephine::Vec3d::Constant(0.5 * spacing * (size - 1));
  return rasterise({size, size, size}, trephine::Vec3d::Constant(spacing),
                   [=](const trephine::Vec3d& p) { return (p - middle).norm() - radius; });
}

/// A knuckle: a lumpy ball of 8 mm, a ridge across it; voxels that are not cubes.
[[nodiscard]] inline Grid knuckle() {
  const trephine::Vec3d spacing(4e-4, 4e-4, 5e-4);
  const trephine::Vec3d middle(14e-3, 14e-3, 14e-3);
  return rasterise({72, 72, 57}, spacing, [=](const trephine::Vec3d& p) {
    const trephine::Vec3d q = p - middle;
    const double lumps = 4e-4 * std::sin(700 * q.x()) * std::sin(600 * q.y() + 1) * std::cos(650 * q.z());
    const double head = q.norm() - 8e-3 + lumps;
    // A bar along y on top, its edge rounded.
    const double ridge = std::hypot(q.x(), q.z() - 7.5e-3) - 2.5e-3;
    const double bar = std::max(ridge, std::abs(q.y()) - 7e-3);
    return std::min(head, bar);
  });
}

inline constexpr trephine::Burr kBurr{.tip_radius = 1.5e-3, .shaft_radius = 8e-4, .shaft_length = 0.02};

}  // namespace pick::test
