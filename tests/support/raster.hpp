// SPDX-License-Identifier: MIT
#pragma once

#include "support/random.hpp"

#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

/// Analytic shapes and voxel grids made of them. A shape is a function `double(const Vec3d& p_G)`: its signed distance
/// in metres, negative in bone. Whatever the kind of image, the isovalue lies on the shape's surface.
namespace trephine::test {

/// What a scanner makes of a shape.
enum class Image {
  kBinary,           ///< a mask: full contrast where the centre is in bone
  kPartialVolume,    ///< the share of the voxel's box that is in bone (4³ points)
  kCtBlur,           ///< the profile of a plane blurred with a Gaussian of `blur` voxels: never flat near the surface
  kClampedDistance,  ///< the distance, clamped to two voxels either side
};

struct RasterOptions {
  std::array<int, 3> size{64, 64, 64};
  Vec3d spacing = Vec3d::Constant(3e-4);  ///< [m]
  Image image = Image::kCtBlur;
  double blur = 1;        ///< standard deviation of kCtBlur [voxels]
  double contrast = 255;  ///< from air to bone, in densities
  double air = 0;
  double noise = 0;  ///< standard deviation of what is added to each voxel, in densities
  Posed X_WG = Posed::Identity();
  GridOptions grid{};

  [[nodiscard]] double isovalue() const { return air + 0.5 * contrast; }
  [[nodiscard]] Vec3d middle() const {
    return 0.5 * spacing.cwiseProduct(Vec3d(size[0] - 1, size[1] - 1, size[2] - 1));
  }
};

template <class Shape>
[[nodiscard]] Vec3d outward_normal(const Shape& shape, const Vec3d& p, double h = 1e-7) {
  Vec3d g;
  for (int a = 0; a < 3; ++a) {
    Vec3d d = Vec3d::Zero();
    d[a] = h;
    g[a] = shape(p + d) - shape(p - d);
  }
  const double n = g.norm();
  return n > 0 ? Vec3d(g / n) : Vec3d::UnitZ();
}

namespace raster_detail {

template <class Shape>
[[nodiscard]] double bone_share(const Shape& shape, const Vec3d& p, const RasterOptions& o) {
  const double d = shape(p);
  if (o.image == Image::kBinary) return d <= 0 ? 1 : 0;
  // Nothing below reaches farther than five voxels.
  if (std::abs(d) > 5.2 * o.spacing.norm()) return d < 0 ? 1 : 0;
  if (o.image == Image::kPartialVolume) {
    constexpr int kPoints = 4;
    int inside = 0;
    for (int i = 0; i < kPoints * kPoints * kPoints; ++i) {
      const Vec3d f(i % kPoints, i / kPoints % kPoints, i / (kPoints * kPoints));
      const Vec3d at = (f + Vec3d::Constant(0.5)) / kPoints - Vec3d::Constant(0.5);
      inside += shape(p + at.cwiseProduct(o.spacing)) <= 0 ? 1 : 0;
    }
    return static_cast<double>(inside) / (kPoints * kPoints * kPoints);
  }
  // A voxel's extent along the surface's normal: a Gaussian of one voxel per axis has this width there.
  const double h = outward_normal(shape, p).cwiseProduct(o.spacing).norm();
  if (o.image == Image::kCtBlur) return 0.5 * std::erfc(d / (o.blur * h * std::sqrt(2.0)));
  return 0.5 - 0.5 * std::clamp(d / (2 * h), -1.0, 1.0);
}

}  // namespace raster_detail

template <VoxelDensity Density>
[[nodiscard]] Density nearest_density(double v) {
  using Limits = std::numeric_limits<Density>;
  return static_cast<Density>(
      std::lround(std::clamp(v, static_cast<double>(Limits::lowest()), static_cast<double>(Limits::max()))));
}

template <VoxelDensity Density, class Shape>
[[nodiscard]] VoxelGrid<Density> rasterise(const Shape& shape, const RasterOptions& o) {
  std::vector<Density> voxels;
  Random noise(77);
  voxels.reserve(static_cast<std::size_t>(o.size[0]) * static_cast<std::size_t>(o.size[1]) *
                 static_cast<std::size_t>(o.size[2]));
  for (int k = 0; k < o.size[2]; ++k)
    for (int j = 0; j < o.size[1]; ++j)
      for (int i = 0; i < o.size[0]; ++i) {
        double v = o.air + o.contrast * raster_detail::bone_share(shape, o.spacing.cwiseProduct(Vec3d(i, j, k)), o);
        if (o.noise > 0) v += o.noise * noise.normal();
        if constexpr (std::is_floating_point_v<Density>)
          voxels.push_back(static_cast<Density>(v));
        else
          voxels.push_back(nearest_density<Density>(v));
      }
  return VoxelGrid<Density>({.size = o.size, .spacing = o.spacing, .X_WG = o.X_WG, .outside = o.air},
                            std::span<const Density>(voxels), o.grid);
}

// --- Shapes
// ------------------------------------------------------------------------------------------------------------

struct HalfSpace {
  Vec3d at;       ///< a point of the plane
  Vec3d outward;  ///< unit
  double operator()(const Vec3d& p) const { return (p - at).dot(outward); }
};

struct Ball {
  Vec3d centre;
  double radius;
  double operator()(const Vec3d& p) const { return (p - centre).norm() - radius; }
};

/// An endless cylinder.
struct Rod {
  Vec3d at;
  Vec3d axis;  ///< unit
  double radius;
  double operator()(const Vec3d& p) const {
    const Vec3d r = p - at;
    return (r - r.dot(axis) * axis).norm() - radius;
  }
};

/// A plate between two parallel planes.
struct Plate {
  Vec3d middle;
  Vec3d normal;  ///< unit
  double thickness;
  double operator()(const Vec3d& p) const { return std::abs((p - middle).dot(normal)) - thickness / 2; }
};

struct Block {
  Vec3d centre;
  Vec3d half;
  double operator()(const Vec3d& p) const {
    const Vec3d q = (p - centre).cwiseAbs() - half;
    return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
  }
};

/// What is air in the shape is bone.
template <class Shape>
struct Hollow {
  Shape shape;
  double operator()(const Vec3d& p) const { return -shape(p); }
};
template <class Shape>
Hollow(Shape) -> Hollow<Shape>;

template <class A, class B>
struct Both {  ///< bone where both are
  A a;
  B b;
  double operator()(const Vec3d& p) const { return std::max(a(p), b(p)); }
};
template <class A, class B>
Both(A, B) -> Both<A, B>;

template <class A, class B>
struct Either {  ///< bone where either is
  A a;
  B b;
  double operator()(const Vec3d& p) const { return std::min(a(p), b(p)); }
};
template <class A, class B>
Either(A, B) -> Either<A, B>;

/// The shape moved by a rigid motion.
template <class Shape>
struct Moved {
  Shape shape;
  Posed X;
  double operator()(const Vec3d& p) const { return shape(X.inverse(Eigen::Isometry) * p); }
};
template <class Shape>
Moved(Shape, Posed) -> Moved<Shape>;

[[nodiscard]] inline double degrees(double radians) { return radians * 57.29577951308232; }

/// Angle between two vectors in degrees; 180 where one of them is zero.
[[nodiscard]] inline double angle_deg(const Vec3d& a, const Vec3d& b) {
  if (!(a.norm() > 0) || !(b.norm() > 0)) return 180;
  return degrees(std::atan2(a.cross(b).norm(), a.dot(b)));
}

}  // namespace trephine::test
