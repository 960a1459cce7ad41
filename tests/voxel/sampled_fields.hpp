// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/voxel_grid.hpp>

#include <array>
#include <cmath>
#include <optional>
#include <random>
#include <vector>

/// Volumes and slow, plain references for the voxel tests.
namespace trephine::test {

template <VoxelDensity Density>
[[nodiscard]] Density random_density(std::mt19937& rng) {
  if constexpr (std::is_floating_point_v<Density>) {
    return std::uniform_real_distribution<float>(-2.0F, 3.0F)(rng);
  } else {
    return static_cast<Density>(std::uniform_int_distribution<int>(std::numeric_limits<Density>::lowest(),
                                                                   std::numeric_limits<Density>::max())(rng));
  }
}

/// A grid of `density(i, j, k)`.
template <VoxelDensity Density, class Function>
[[nodiscard]] VoxelGrid<Density> make_grid(const GridGeometry& geometry, Function&& density,
                                           const GridOptions& options = {}) {
  std::vector<Density> voxels;
  for (int k = 0; k < geometry.size[2]; ++k)
    for (int j = 0; j < geometry.size[1]; ++j)
      for (int i = 0; i < geometry.size[0]; ++i) voxels.push_back(static_cast<Density>(density(i, j, k)));
  return VoxelGrid<Density>(geometry, voxels, options);
}

template <VoxelDensity Density>
[[nodiscard]] VoxelGrid<Density> random_grid(const GridGeometry& geometry, std::mt19937& rng,
                                             const GridOptions& options = {}) {
  return make_grid<Density>(
      geometry, [&](int, int, int) { return random_density<Density>(rng); }, options);
}

template <VoxelDensity Density>
[[nodiscard]] double density_at(const VoxelGrid<Density>& grid, int i, int j, int k) {
  return static_cast<double>(grid.contains(i, j, k) ? grid.at(i, j, k) : grid.outside());
}

/// Trilinear interpolation by its definition: eight weights, everything beyond the grid is `outside`.
template <VoxelDensity Density>
[[nodiscard]] double interpolate(const VoxelGrid<Density>& grid, const Vec3d& p_G) {
  const Vec3d u = p_G.cwiseQuotient(grid.spacing());
  // Far away all is outside; stay within int.
  for (int a = 0; a < 3; ++a)
    if (!(std::abs(u[a]) < 1e6)) return static_cast<double>(grid.outside());
  const std::array base{static_cast<int>(std::floor(u.x())), static_cast<int>(std::floor(u.y())),
                        static_cast<int>(std::floor(u.z()))};
  double sum = 0;
  for (int c = 0; c < 8; ++c) {
    const std::array at{c & 1, (c >> 1) & 1, c >> 2};
    double w = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      const double f = u[static_cast<Eigen::Index>(a)] - base[a];
      w *= at[a] != 0 ? f : 1 - f;
    }
    sum += w * density_at(grid, base[0] + at[0], base[1] + at[1], base[2] + at[2]);
  }
  return sum;
}

/// All voxels of a grid without its border.
template <VoxelDensity Density>
[[nodiscard]] std::vector<Density> copy_of(const VoxelGrid<Density>& grid) {
  std::vector<Density> out(static_cast<std::size_t>(grid.size()[0]) * static_cast<std::size_t>(grid.size()[1]) *
                           static_cast<std::size_t>(grid.size()[2]));
  grid.copy_voxels(out);
  return out;
}

/// Smallest and largest density in a brick and its halo, voxel by voxel.
template <VoxelDensity Density>
[[nodiscard]] DensityRange<Density> slow_range(const VoxelGrid<Density>& grid, std::size_t b) {
  const auto at = grid.brick_coordinates(b);
  DensityRange<Density> r{std::numeric_limits<Density>::max(), std::numeric_limits<Density>::lowest()};
  const int n = VoxelGrid<Density>::kBrick;
  for (int k = at[2] * n - 1; k <= std::min(at[2] * n + n, grid.size()[2]); ++k)
    for (int j = at[1] * n - 1; j <= std::min(at[1] * n + n, grid.size()[1]); ++j)
      for (int i = at[0] * n - 1; i <= std::min(at[0] * n + n, grid.size()[0]); ++i) {
        r.min = std::min(r.min, grid.at(i, j, k));
        r.max = std::max(r.max, grid.at(i, j, k));
      }
  return r;
}

[[nodiscard]] inline Mat3d random_rotation(std::mt19937& rng) {
  std::normal_distribution<double> n;
  return Quatd{n(rng), n(rng), n(rng), n(rng)}.normalized().toRotationMatrix();
}

[[nodiscard]] inline Vec3d random_point(std::mt19937& rng, const Vec3d& lo, const Vec3d& hi) {
  std::uniform_real_distribution<double> u(0.0, 1.0);
  const double x = u(rng), y = u(rng), z = u(rng);
  return lo + Vec3d(x, y, z).cwiseProduct(hi - lo);
}

[[nodiscard]] inline Vec3d random_direction(std::mt19937& rng) {
  std::normal_distribution<double> n;
  const double x = n(rng), y = n(rng), z = n(rng);
  return Vec3d(x, y, z).normalized();
}

/// Logistic edge of a body: what a CT's blur of about a voxel leaves of a sharp one. `d` voxels, negative inside.
[[nodiscard]] inline double blurred(double air, double bone, double d) {
  return air + (bone - air) * 0.5 * std::erfc(d / std::sqrt(2.0));
}

/// Crossings of the isosurface with voxel edges, by their definition: between bone and air, by linear interpolation.
template <VoxelDensity Density>
struct PlainCrossings {
  using Voxel = std::array<int, 3>;
  const VoxelGrid<Density>& grid;
  double isovalue;

  [[nodiscard]] static Voxel moved(Voxel v, std::size_t a, int n) {
    v[a] += n;
    return v;
  }
  [[nodiscard]] double density(const Voxel& v) const { return density_at(grid, v[0], v[1], v[2]); }
  [[nodiscard]] bool is_bone(const Voxel& v) const { return density(v) >= isovalue; }
  /// On the edge from v along axis a [m].
  [[nodiscard]] std::optional<Vec3d> on_edge(const Voxel& v, std::size_t a) const {
    const Voxel w = moved(v, a, 1);
    if (is_bone(v) == is_bone(w)) return std::nullopt;
    Vec3d at(v[0], v[1], v[2]);
    at[static_cast<Eigen::Index>(a)] += (isovalue - density(v)) / (density(w) - density(v));
    return Vec3d(at.cwiseProduct(grid.spacing()));
  }
  /// The next one on the face beside edge (v, a), to that side along b.
  [[nodiscard]] Vec3d next(const Voxel& v, std::size_t a, std::size_t b, int side) const {
    if (const auto across = on_edge(moved(v, b, side), a)) return *across;
    const Voxel low = side < 0 ? moved(v, b, -1) : v;
    if (const auto start = on_edge(low, b)) return *start;
    return on_edge(moved(low, a, 1), b).value();
  }
};

}  // namespace trephine::test
