// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

/// Volumes that need no file: a tooth as a CT scanner would see it, and a block. Densities are made for 8 bits (0..255)
/// and fit every density type.
namespace drill {

struct PhantomOptions {
  std::array<int, 3> size{256, 256, 176};  ///< voxels; the default is the thesis' tooth
  double spacing = 0.1e-3;                 ///< [m]; the tooth itself is 16.4 mm tall whatever the spacing
  double blur = 1.0;                       ///< standard deviation of the scanner's blur, in voxels
};

/// Densities of the phantom's materials, and an isovalue half way between air and dentine.
struct PhantomDensities {
  static constexpr double kAir = 8, kPulp = 52, kDentine = 163, kEnamel = 234;
  static constexpr double kIsovalue = 85.5;
};

namespace phantom {

using trephine::Vec3d;

/// The share of the far side of an edge that a Gaussian blur leaves at a signed distance, in deviations.
inline double blurred_step(double distance, double sigma) {
  if (distance > 4 * sigma) return 0;
  if (distance < -4 * sigma) return 1;
  return 0.5 * std::erfc(distance / (std::sqrt(2.0) * sigma));
}

/// Near enough a signed distance to an ellipsoid, exact on its surface to first order.
inline double ellipsoid(const Vec3d& p, const Vec3d& radii) {
  const double k0 = p.cwiseQuotient(radii).norm();
  const double k1 = p.cwiseQuotient(radii.cwiseProduct(radii)).norm();
  return k1 > 0 ? k0 * (k0 - 1) / k1 : -radii.minCoeff();
}

/// A cone with round ends from a to b.
inline double round_cone(const Vec3d& p, const Vec3d& a, const Vec3d& b, double ra, double rb) {
  const Vec3d ab = b - a;
  const double s = std::clamp((p - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0);
  return (p - a - s * ab).norm() - (ra + s * (rb - ra));
}

/// Union with a fillet of about k.
inline double joined(double a, double b, double k) {
  const double h = std::max(k - std::abs(a - b), 0.0) / k;
  return std::min(a, b) - h * h * k / 4;
}

/// Intersection with an edge rounded by about k.
inline double cut(double a, double b, double k) { return -joined(-a, -b, k); }

/// Signed distances [mm] to enamel's outside, dentine and pulp of a molar; p [mm] from the middle of its neck, z up.
struct Tooth {
  double outside, dentine, pulp;
};

inline Tooth tooth_at(const Vec3d& p) {
  // The chewing surface: cusps round a groove that crosses it.
  const double cusps = 0.45 * std::cos(1.25 * p.x()) * std::cos(1.35 * p.y()) + 0.02 * p.head<2>().squaredNorm();
  const double lid = p.z() - (5.9 - cusps);
  const double body = cut(ellipsoid(p - Vec3d(0, 0, 2.4), {5.2, 4.7, 5.0}), lid, 1.4);
  double roots = round_cone(p, {-1.9, 0.5, 0.2}, {-3.0, 0.9, -9.2}, 2.3, 0.8);
  roots = joined(roots, round_cone(p, {1.9, 0.5, 0.2}, {3.2, 0.8, -8.8}, 2.3, 0.8), 0.8);
  roots = joined(roots, round_cone(p, {0.0, -1.4, 0.2}, {0.3, -2.6, -8.2}, 2.2, 0.8), 0.8);
  const double core = cut(ellipsoid(p - Vec3d(0, 0, 1.1), {4.25, 3.8, 4.6}), lid + 1.6, 1.0);
  const double dentine = joined(core, roots, 1.2);
  double pulp = ellipsoid(p - Vec3d(0, 0, 1.2), {2.0, 1.6, 1.1});
  pulp = joined(pulp, round_cone(p, {-1.4, 0.4, 0.6}, {-2.8, 0.8, -7.8}, 0.55, 0.22), 0.4);
  pulp = joined(pulp, round_cone(p, {1.4, 0.4, 0.6}, {3.0, 0.7, -7.4}, 0.55, 0.22), 0.4);
  pulp = joined(pulp, round_cone(p, {0.0, -1.0, 0.6}, {0.3, -2.3, -6.8}, 0.55, 0.22), 0.4);
  // Enamel thins out toward the neck.
  const double enamel = cut(body, -(p.z() + 0.7), 0.8);
  return {std::min(enamel, dentine), dentine, pulp};
}

template <trephine::VoxelDensity Density>
Density stored(double density) {
  if constexpr (std::is_floating_point_v<Density>)
    return static_cast<Density>(density);
  else  // std::int8_t has room for half the levels only
    return static_cast<Density>(
        std::lround(std::min(density, static_cast<double>(std::numeric_limits<Density>::max()))));
}

}  // namespace phantom

/// A molar of enamel, dentine and pulp, its crown up (+z), in the middle of the volume. Throws std::invalid_argument on
/// sizes or spacings that VoxelGrid refuses.
template <trephine::VoxelDensity Density>
[[nodiscard]] trephine::VoxelGrid<Density> tooth_phantom(const PhantomOptions& options = {}) {
  using trephine::Vec3d;
  using D = PhantomDensities;
  const double spacing_mm = 1e3 * options.spacing;
  const double sigma = options.blur * spacing_mm;
  const Vec3d middle = 0.5 * spacing_mm * Vec3d(options.size[0] - 1, options.size[1] - 1, options.size[2] - 1);
  const auto place = [&](double i, double j, double k) {
    return Vec3d(spacing_mm * Vec3d(i, j, k) - middle + Vec3d(0, 0, -1.8));
  };
  const auto density_at = [&](const Vec3d& p, const phantom::Tooth& t) {
    double density = D::kAir;
    if (p.head<2>().squaredNorm() < 49 && std::abs(p.z()) < 12) {
      density += (D::kEnamel - D::kAir) * phantom::blurred_step(t.outside, sigma);
      density += (D::kDentine - D::kEnamel) * phantom::blurred_step(t.dentine, sigma);
      density += (D::kPulp - D::kDentine) * phantom::blurred_step(t.pulp, sigma);
    }
    return phantom::stored<Density>(density);
  };
  std::vector<Density> voxels(static_cast<std::size_t>(options.size[0]) * static_cast<std::size_t>(options.size[1]) *
                              static_cast<std::size_t>(options.size[2]));
  // By blocks, of which most are of one material, as the distances of their middles tell.
  constexpr int kBlock = 4;
  constexpr double kHalf = 0.5 * (kBlock - 1), kSteepest = 1.5;  // of distances, where the lid's cusps are
  const double reach = kSteepest * spacing_mm * kHalf * std::sqrt(3.0) + 4 * sigma;
  for (int bk = 0; bk < options.size[2]; bk += kBlock)
    for (int bj = 0; bj < options.size[1]; bj += kBlock)
      for (int bi = 0; bi < options.size[0]; bi += kBlock) {
        const Vec3d centre = place(bi + kHalf, bj + kHalf, bk + kHalf);
        const phantom::Tooth t = phantom::tooth_at(centre);
        const bool one = std::min({std::abs(t.outside), std::abs(t.dentine), std::abs(t.pulp)}) > reach;
        const Density all = density_at(centre, t);
        for (int k = bk; k < std::min(bk + kBlock, options.size[2]); ++k)
          for (int j = bj; j < std::min(bj + kBlock, options.size[1]); ++j) {
            const std::size_t row =
                static_cast<std::size_t>(k) * static_cast<std::size_t>(options.size[1]) + static_cast<std::size_t>(j);
            Density* const to = voxels.data() + row * static_cast<std::size_t>(options.size[0]);
            for (int i = bi; i < std::min(bi + kBlock, options.size[0]); ++i) {
              const Vec3d p = place(i, j, k);
              to[i] = one ? all : density_at(p, phantom::tooth_at(p));
            }
          }
      }
  const Vec3d spacing = Vec3d::Constant(options.spacing);
  return {{.size = options.size, .spacing = spacing}, std::span<const Density>(voxels)};
}

/// A block of one material with `margin` voxels of air round it; `edge` voxels a side, centred. Its faces lie half way
/// between voxels, blurred as the tooth's.
template <trephine::VoxelDensity Density>
[[nodiscard]] trephine::VoxelGrid<Density> block_phantom(int edge, int margin, double spacing, double blur = 1.0) {
  using D = PhantomDensities;
  const int n = edge + 2 * margin;
  std::vector<double> inside(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    const double from_middle = std::abs(i - 0.5 * (n - 1));
    inside[static_cast<std::size_t>(i)] = phantom::blurred_step(from_middle - 0.5 * edge, blur);
  }
  std::vector<Density> voxels;
  for (const double z : inside)
    for (const double y : inside)
      for (const double x : inside)
        voxels.push_back(phantom::stored<Density>(D::kAir + (D::kDentine - D::kAir) * x * y * z));
  return {{.size = {n, n, n}, .spacing = trephine::Vec3d::Constant(spacing)}, std::span<const Density>(voxels)};
}

}  // namespace drill
