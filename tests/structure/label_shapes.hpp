// SPDX-License-Identifier: MIT
#pragma once

#include "support/random.hpp"

#include <trephine/core/math.hpp>
#include <trephine/structure/label_volume.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

/// Shapes with exact signed distances, and labels sampled from them.
namespace trephine::test {

/// Voxels that own their memory.
struct Labels {
  std::array<int, 3> size{};
  Vec3d spacing = Vec3d::Zero();
  std::vector<std::uint8_t> structure{};

  Labels(const std::array<int, 3>& voxels, const Vec3d& h) : size(voxels), spacing(h) {
    structure.resize(static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
                     static_cast<std::size_t>(size[2]));
  }
  [[nodiscard]] LabelVolume view() const { return {size, spacing, structure}; }
  /// Sets voxels whose number `label(i, j, k)` is not 0.
  template <class Label>
  void set(const Label& label) {
    std::size_t n = 0;
    for (int k = 0; k < size[2]; ++k)
      for (int j = 0; j < size[1]; ++j)
        for (int i = 0; i < size[0]; ++i, ++n)
          if (const int s = label(i, j, k); s != 0) structure[n] = static_cast<std::uint8_t>(s);
  }
  /// Sets voxels whose centres are in a shape.
  void fill(const std::function<double(const Vec3d&)>& distance, int number) {
    set([&](int i, int j, int k) { return distance(spacing.cwiseProduct(Vec3d(i, j, k))) <= 0 ? number : 0; });
  }
  [[nodiscard]] Vec3d end() const { return spacing.cwiseProduct(Vec3d(size[0] - 1, size[1] - 1, size[2] - 1)); }
};

/// A shape by its signed distance [m].
struct Shape {
  std::string name;
  std::function<double(const Vec3d&)> distance;
};

constexpr int kShapes = 5;

/// A ball, tube, plate, torus or two balls about `centre`, of random size and direction; `h` is the longest spacing.
/// Only plates are thinner than three voxels.
[[nodiscard]] inline Shape random_shape(int kind, const Vec3d& centre, double h, Random& rng) {
  const Mat3d R = rng.rotation();
  const auto local = [=](const Vec3d& p) { return Vec3d(R.transpose() * (p - centre)); };
  const auto beyond = [](double x, double half) { return std::max(std::abs(x) - half, 0.0); };
  if (kind == 0) {
    const double r = rng.uniform(2.5, 10) * h;
    return {"ball", [=](const Vec3d& p) { return (p - centre).norm() - r; }};
  }
  if (kind == 1) {
    const double r = rng.uniform(1.5, 5) * h, half = rng.uniform(3, 9) * h;
    return {"tube", [=](const Vec3d& p) {
              const Vec3d q = local(p);
              return Vec3d(q.x(), q.y(), beyond(q.z(), half)).norm() - r;
            }};
  }
  if (kind == 2) {
    const double r = rng.uniform(0.8, 4) * h, half = rng.uniform(6, 10) * h;
    return {"plate", [=](const Vec3d& p) {
              const Vec3d q = local(p);
              return Vec3d(beyond(q.x(), half), beyond(q.y(), half), q.z()).norm() - r;
            }};
  }
  if (kind == 3) {
    const double r = rng.uniform(1.5, 4) * h, ring = rng.uniform(6, 11) * h;
    return {"torus", [=](const Vec3d& p) {
              const Vec3d q = local(p);
              return std::hypot(std::hypot(q.x(), q.y()) - ring, q.z()) - r;
            }};
  }
  const double a = rng.uniform(2.5, 5) * h, b = rng.uniform(2.5, 5) * h, half = rng.uniform(6, 9) * h;
  return {"two balls", [=](const Vec3d& p) {
            const Vec3d q = local(p), to(half, 0, 0);
            return std::min((q - to).norm() - a, (q + to).norm() - b);
          }};
}

}  // namespace trephine::test
