// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/adapter/volume_options.hpp>
#include <trephine/core/tolerances.hpp>
#include <trephine/voxel/voxel_grid.hpp>

// Before ITK's headers: ITK brings an older Eigen of its own, which hides behind the same include guards, so that the
// module that comes first is used. Both from one Eigen or nothing compiles.
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

#include <itkImage.h>
#include <itkImageIOBase.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace trephine {

static_assert(EIGEN_VERSION_AT_LEAST(3, 4, 0),
              "ITK's own, older Eigen was included first: include trephine before ITK or define ITK_USE_SYSTEM_EIGEN");

namespace itk_detail {

[[noreturn]] inline void refuse_volume(const std::string& where, const std::string& what) {
  throw VolumeError("trephine::read_volume: " + where + ": " + what);
}

/// Where an image's voxels are, in ITK's terms: millimetres, columns of `direction` are the axes of i, j, k.
struct ImageGeometry {
  std::array<int, 3> size{};
  Vec3d spacing_mm = Vec3d::Ones();
  Vec3d origin_mm = Vec3d::Zero();
  Mat3d direction = Mat3d::Identity();
};

/// The grid's geometry, and whether the slices must be stored in reverse for it.
struct RigidGeometry {
  GridGeometry grid;
  bool reverse_slices = false;
};

/// Axes that are left-handed are no rotation: the slices are counted from the other end then, which moves nothing.
inline RigidGeometry to_rigid(ImageGeometry image, const VolumeOptions& options, const std::string& where) {
  for (const int n : image.size)
    if (n < 1) refuse_volume(where, "has no voxels");
  if (options.spacing_m) image.spacing_mm = 1e3 * *options.spacing_m;
  if (!(image.spacing_mm.minCoeff() > 0) || !is_finite(image.spacing_mm)) {
    std::ostringstream s;
    s << "the spacing must be > 0 mm, is " << image.spacing_mm.transpose() << "; give VolumeOptions::spacing_m";
    refuse_volume(where, s.str());
  }
  const double skew = (image.direction.transpose() * image.direction - Mat3d::Identity()).cwiseAbs().maxCoeff();
  if (!(skew <= kRotationTolerance) || !is_finite(image.origin_mm))
    refuse_volume(where,
                  "its axes are not perpendicular (a tilted gantry?), so voxels are no boxes; resample it upright");

  RigidGeometry out;
  out.reverse_slices = image.direction.determinant() < 0;
  if (out.reverse_slices) {
    image.origin_mm += (image.size[2] - 1) * image.spacing_mm.z() * image.direction.col(2);
    image.direction.col(2) = -image.direction.col(2);
  }
  // Files round their direction cosines; the nearest rotation is meant.
  const Eigen::JacobiSVD<Mat3d> svd(image.direction, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Mat3d R_WG = svd.matrixU() * svd.matrixV().transpose();
  out.grid = {.size = image.size,
              .spacing = 1e-3 * image.spacing_mm,
              .X_WG = make_pose<double>(R_WG, 1e-3 * image.origin_mm),
              .outside = options.outside};
  return out;
}

/// What came by while densities were converted.
struct Converted {
  double min = std::numeric_limits<double>::infinity();
  double max = -std::numeric_limits<double>::infinity();
  bool finite = true;
  bool rounded = false;
};

/// Converts densities: rounds to the nearest where Density is an integer and clamps what does not fit; `seen` tells.
template <VoxelDensity Density, class Pixel>
void convert(const Pixel* in, std::size_t count, Density* out, Converted& seen) {
  constexpr auto kLowest = static_cast<double>(std::numeric_limits<Density>::lowest());
  constexpr auto kHighest = static_cast<double>(std::numeric_limits<Density>::max());
  for (std::size_t i = 0; i < count; ++i) {
    auto v = static_cast<double>(in[i]);
    if (!std::isfinite(v)) {
      seen.finite = false;
      out[i] = Density{};
      continue;
    }
    seen.min = std::min(seen.min, v);
    seen.max = std::max(seen.max, v);
    if constexpr (std::is_floating_point_v<Pixel> && std::is_integral_v<Density>) {
      const double nearest = std::nearbyint(v);
      seen.rounded = seen.rounded || nearest != v;
      v = nearest;
    }
    out[i] = static_cast<Density>(std::clamp(v, kLowest, kHighest));
  }
}

/// Fewer levels than this between a volume's smallest and largest density make steps that a hand feels.
inline constexpr double kFewestLevels = 64;

template <VoxelDensity Density>
[[nodiscard]] bool fits(const Converted& seen) {
  return seen.min >= static_cast<double>(std::numeric_limits<Density>::lowest()) &&
         seen.max <= static_cast<double>(std::numeric_limits<Density>::max());
}

template <VoxelDensity Density>
void check_converted(const Converted& seen, const VolumeOptions& options, const std::string& where) {
  std::ostringstream s;
  if (!seen.finite)
    refuse_volume(where, "holds densities that are not finite numbers; replace them, with air for instance");
  if (!fits<Density>(seen)) {
    s << "densities from " << seen.min << " to " << seen.max << " do not fit the grid's type ("
      << +std::numeric_limits<Density>::lowest() << " to " << +std::numeric_limits<Density>::max()
      << "); read it as another one, float for instance";
    refuse_volume(where, s.str());
  }
  if (seen.rounded && seen.max - seen.min < kFewestLevels) {
    s << "densities from " << seen.min << " to " << seen.max
      << " would be rounded to a few whole numbers; read it as float or scale it";
    refuse_volume(where, s.str());
  }
  if (options.isovalue && !(seen.min < *options.isovalue && *options.isovalue <= seen.max)) {
    s << "has no surface at isovalue " << *options.isovalue << ": its densities are " << seen.min << " to " << seen.max
      << "; choose an isovalue between them";
    refuse_volume(where, s.str());
  }
}

template <VoxelDensity Density>
void reverse_slices(const std::array<int, 3>& size, std::vector<Density>& voxels) {
  const auto plane = static_cast<std::ptrdiff_t>(size[0]) * size[1];
  for (std::ptrdiff_t a = 0, b = size[2] - 1; a < b; ++a, --b)
    std::swap_ranges(voxels.begin() + a * plane, voxels.begin() + (a + 1) * plane, voxels.begin() + b * plane);
}

/// The library's own refusals, with the file's name.
template <VoxelDensity Density>
VoxelGrid<Density> make_grid(const RigidGeometry& geometry, std::vector<Density>&& voxels, const VolumeOptions& options,
                             const std::string& where) {
  if (geometry.reverse_slices) reverse_slices(geometry.grid.size, voxels);
  try {
    return VoxelGrid<Density>(geometry.grid, voxels, options.grid);
  } catch (const std::invalid_argument& e) {
    refuse_volume(where, e.what());
  }
}

}  // namespace itk_detail

/// A grid of an ITK image's buffered region, voxel by voxel at the same place: W is ITK's physical space (for medical
/// files the patient's axes: x to the left, y to the back, z to the head) in metres. Densities are converted to
/// `Density` where the pixels are of another type. Throws VolumeError where the image is empty, its axes are not
/// perpendicular, densities do not fit or are not finite, or no surface lies at the isovalue asked for. Copies the
/// voxels; not for the haptic thread.
template <VoxelDensity Density, class Pixel>
[[nodiscard]] VoxelGrid<Density> grid_from_image(const itk::Image<Pixel, 3>& image, const VolumeOptions& options = {}) {
  static_assert(std::is_arithmetic_v<Pixel>, "densities are numbers: take one channel of a vector or colour image");
  const std::string where = "itk::Image";
  const auto region = image.GetBufferedRegion();
  typename itk::Image<Pixel, 3>::PointType origin;
  image.TransformIndexToPhysicalPoint(region.GetIndex(), origin);
  itk_detail::ImageGeometry g;
  for (unsigned a = 0; a < 3; ++a) {
    if (region.GetSize(a) > (1U << 20)) itk_detail::refuse_volume(where, "is larger than 2^20 voxels along an axis");
    g.size[a] = static_cast<int>(region.GetSize(a));
    g.spacing_mm[a] = image.GetSpacing()[a];
    g.origin_mm[a] = origin[a];
    for (unsigned b = 0; b < 3; ++b) g.direction(a, b) = image.GetDirection()(a, b);
  }
  const auto rigid = itk_detail::to_rigid(g, options, where);
  if (image.GetBufferPointer() == nullptr) itk_detail::refuse_volume(where, "has no voxels; update its filter first");
  const std::size_t count = region.GetNumberOfPixels();
  std::vector<Density> voxels(count);
  itk_detail::Converted seen;
  itk_detail::convert(image.GetBufferPointer(), count, voxels.data(), seen);
  itk_detail::check_converted<Density>(seen, options, where);
  return itk_detail::make_grid<Density>(rigid, std::move(voxels), options, where);
}

}  // namespace trephine
