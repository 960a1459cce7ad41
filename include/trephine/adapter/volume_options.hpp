// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/voxel/grid_geometry.hpp>

#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace trephine {

/// A volume that cannot be used, in one line: which file, what is wrong, what to do.
class VolumeError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A series of slices in a folder of DICOM files: same series UID, image size and orientation.
struct DicomSeries {
  int number = 0;           ///< counted from 1 in this folder
  std::string uid;          ///< SeriesInstanceUID
  std::string description;  ///< SeriesDescription, often empty
  std::string modality;     ///< CT, MR, ...
  int slices = 0;
  int columns = 0;
  int rows = 0;
};

/// The folder holds several series and none was asked for; what() lists them too.
class SeveralSeries : public VolumeError {
 public:
  SeveralSeries(const std::string& what, std::vector<DicomSeries> series)
      : VolumeError(what), series_(std::move(series)) {}
  [[nodiscard]] const std::vector<DicomSeries>& series() const noexcept { return series_; }

 private:
  std::vector<DicomSeries> series_;
};

/// How a file or an image becomes a grid.
struct VolumeOptions {
  std::string series{};              ///< DICOM folders with several series: the one's UID or its number in the list
  std::optional<double> isovalue{};  ///< refuse volumes that have no surface at this density
  std::optional<double> outside{};   ///< density beyond the grid; the smallest in the data unless given
  std::optional<Vec3d> spacing_m{};  ///< instead of the file's [m], for formats and files that know no unit
  /// Farthest a DICOM slice may lie from where evenly spaced slices would put it, as a share of their distance.
  /// Scanners round positions, some to 0.1 mm; a missing slice is off by half a distance or more.
  double slice_tolerance = 0.1;
  /// Farthest the last DICOM slice may be shifted against the first within their plane, in pixels. A tilted gantry
  /// shifts each slice; read as upright, that bends the anatomy.
  double shift_tolerance = 0.5;
  GridOptions grid{};
};

}  // namespace trephine
