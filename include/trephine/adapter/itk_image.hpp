// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/adapter/volume_options.hpp>
#include <trephine/adapter/volume_text.hpp>
#include <trephine/core/tolerances.hpp>
#include <trephine/voxel/grid_checks.hpp>
#include <trephine/voxel/voxel_grid.hpp>

// Eigen must precede ITK's headers: ITK includes an older Eigen with the same include guards, so each module comes from
// the first inclusion. A mixture of both versions does not compile.
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

#include <itkImage.h>
#include <itkImageIOBase.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

/// Converts images in ITK's convention to grids: geometry, number types and checks.
namespace trephine::inline TREPHINE_ALIGNED {

static_assert(EIGEN_VERSION_AT_LEAST(3, 4, 0),
              "ITK's own, older Eigen was included first: include trephine before ITK or define ITK_USE_SYSTEM_EIGEN");

namespace itk_detail {

/// Geometry of an image in ITK's convention: millimetres; the columns of `direction` are the axes of i, j, k.
struct ImageGeometry {
  std::array<int, 3> size{};
  Vec3d spacing_mm = Vec3d::Ones();
  Vec3d origin_mm = Vec3d::Zero();
  Mat3d direction = Mat3d::Identity();
  std::string no_spacing{};  // why the file's spacing is unknown, unless it is known
};

/// Geometry of a grid, and a flag to reverse the order of its slices.
struct RigidGeometry {
  GridGeometry grid;
  bool reverse_slices = false;
};

/// Converts an image's geometry to a rigid pose. Left-handed axes are no rotation; then the slices are reversed, which
/// moves no voxel.
inline RigidGeometry to_rigid(ImageGeometry image, const VolumeOptions& options, const std::string& where) {
  for (const int n : image.size)
    if (n < 1) refuse_volume(where, "has no voxels");
  if (options.spacing_m)
    image.spacing_mm = 1e3 * *options.spacing_m;
  else if (!image.no_spacing.empty())
    refuse_volume(where, image.no_spacing + "; give spacing_m in the options");
  if (!(image.spacing_mm.minCoeff() > 0) || !is_finite(image.spacing_mm)) {
    Text s;
    s << "the spacing must be > 0 mm, is " << image.spacing_mm.transpose() << "; give spacing_m in the options";
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
  // Files round their direction cosines, so the nearest rotation is taken.
  const Eigen::JacobiSVD<Mat3d> svd(image.direction, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Mat3d R_WG = svd.matrixU() * svd.matrixV().transpose();
  out.grid = {.size = image.size,
              .spacing = 1e-3 * image.spacing_mm,
              .X_WG = make_pose<double>(R_WG, 1e-3 * image.origin_mm),
              .outside = options.outside};
  return out;
}

/// Statistics of converted densities.
struct ConversionSummary {
  double min = std::numeric_limits<double>::infinity();
  double max = -std::numeric_limits<double>::infinity();
  bool finite = true;
  bool rounded = false;  // some were not whole numbers
};

/// Converts densities: rounds to the nearest integer if Density is one, clamps to its range, and updates `summary`.
template <VoxelDensity Density, class Pixel>
void convert(const Pixel* in, std::size_t count, Density* out, ConversionSummary& summary) {
  constexpr auto kLowest = static_cast<double>(std::numeric_limits<Density>::lowest());
  constexpr auto kHighest = static_cast<double>(std::numeric_limits<Density>::max());
  for (std::size_t i = 0; i < count; ++i) {
    auto v = static_cast<double>(in[i]);
    if (!std::isfinite(v)) {
      summary.finite = false;
      out[i] = Density{};
      continue;
    }
    summary.min = std::min(summary.min, v);
    summary.max = std::max(summary.max, v);
    if constexpr (std::is_floating_point_v<Pixel> && std::is_integral_v<Density>) {
      const double nearest = std::nearbyint(v);
      summary.rounded = summary.rounded || nearest != v;
      v = nearest;
    }
    out[i] = static_cast<Density>(std::clamp(v, kLowest, kHighest));
  }
}

/// Smallest range of densities that may be rounded to whole numbers. A hand feels the steps of fewer levels.
inline constexpr double kMinLevels = 64;

/// Returns true if all densities are in the range of Density.
template <VoxelDensity Density>
[[nodiscard]] bool fits(const ConversionSummary& summary) {
  return summary.min >= static_cast<double>(std::numeric_limits<Density>::lowest()) &&
         summary.max <= static_cast<double>(std::numeric_limits<Density>::max());
}

/// Throws VolumeError unless the densities are finite, fit, have enough levels, and have a surface at the isovalue.
template <VoxelDensity Density>
void check_converted(const ConversionSummary& summary, const VolumeOptions& options, const std::string& where) {
  Text s;
  if (!summary.finite)
    refuse_volume(where, "holds densities that are not finite numbers; replace them, with air for instance");
  if (!fits<Density>(summary)) {
    s << "densities from " << summary.min << " to " << summary.max << " do not fit the grid's type ("
      << +std::numeric_limits<Density>::lowest() << " to " << +std::numeric_limits<Density>::max()
      << "); read it as another type, float for instance";
    refuse_volume(where, s.str());
  }
  if (summary.rounded && summary.max - summary.min < kMinLevels) {
    s << "densities from " << summary.min << " to " << summary.max
      << " would be rounded to a few whole numbers; read it as float or scale it";
    refuse_volume(where, s.str());
  }
  if (options.isovalue && !(summary.min < *options.isovalue && *options.isovalue <= summary.max)) {
    s << "has no surface at isovalue " << *options.isovalue << ": its densities are " << summary.min << " to "
      << summary.max << "; choose an isovalue between them";
    refuse_volume(where, s.str());
  }
}

/// Reverses the order of the slices in place.
template <VoxelDensity Density>
void reverse_slices(const std::array<int, 3>& size, std::vector<Density>& voxels) {
  const auto plane = static_cast<std::ptrdiff_t>(size[0]) * size[1];
  for (std::ptrdiff_t a = 0, b = size[2] - 1; a < b; ++a, --b)
    std::swap_ranges(voxels.begin() + a * plane, voxels.begin() + (a + 1) * plane, voxels.begin() + b * plane);
}

/// Constructs the grid. Converts its std::invalid_argument to a VolumeError with the file's name.
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

/// Returns a grid of an ITK image's buffered region, each voxel at the same place. W is ITK's physical space in metres;
/// for medical files it has the patient's axes: x to the left, y to the back, z to the head. Pixels of other types are
/// converted to `Density`. Throws VolumeError if the image is empty, its axes are not perpendicular, densities do not
/// fit or are not finite, or no surface lies at the requested isovalue. Copies the voxels; not for the haptic thread.
template <VoxelDensity Density, class Pixel>
[[nodiscard]] VoxelGrid<Density> grid_from_image(const itk::Image<Pixel, 3>& image, const VolumeOptions& options = {}) {
  static_assert(std::is_arithmetic_v<Pixel>, "densities are numbers: take one channel of a vector or colour image");
  const std::string where = "itk::Image";
  const auto region = image.GetBufferedRegion();
  typename itk::Image<Pixel, 3>::PointType origin;
  image.TransformIndexToPhysicalPoint(region.GetIndex(), origin);
  itk_detail::ImageGeometry g;
  for (unsigned a = 0; a < 3; ++a) {
    if (region.GetSize(a) > std::size_t{kMaxGridSize})
      itk_detail::refuse_volume(where, "is larger than 2^20 voxels along an axis");
    g.size[a] = static_cast<int>(region.GetSize(a));
    g.spacing_mm[a] = image.GetSpacing()[a];
    g.origin_mm[a] = origin[a];
    for (unsigned b = 0; b < 3; ++b) g.direction(a, b) = image.GetDirection()(a, b);
  }
  const auto rigid = itk_detail::to_rigid(g, options, where);
  if (image.GetBufferPointer() == nullptr) itk_detail::refuse_volume(where, "has no voxels; update its filter first");
  const std::size_t count = region.GetNumberOfPixels();
  std::vector<Density> voxels(count);
  itk_detail::ConversionSummary summary;
  itk_detail::convert(image.GetBufferPointer(), count, voxels.data(), summary);
  itk_detail::check_converted<Density>(summary, options, where);
  return itk_detail::make_grid<Density>(rigid, std::move(voxels), options, where);
}

}  // namespace trephine
