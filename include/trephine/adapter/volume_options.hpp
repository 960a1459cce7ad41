// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/voxel/grid_geometry.hpp>

#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// Error for an unusable volume. Its message has one line: the file, the reason and a remedy.
class VolumeError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A series of slices in a folder of DICOM files, with a common series UID, image size and orientation.
struct DicomSeries {
  int number = 0;           ///< counted from 1 in this folder
  std::string uid;          ///< SeriesInstanceUID
  std::string description;  ///< SeriesDescription, often empty
  std::string modality;     ///< CT, MR, ...
  int slices = 0;
  int columns = 0;
  int rows = 0;
};

/// Error for a folder with several series and no valid choice; what() lists them too.
class SeveralSeries : public VolumeError {
 public:
  SeveralSeries(const std::string& what, std::vector<DicomSeries> series)
      : VolumeError(what), series_(std::move(series)) {}
  [[nodiscard]] const std::vector<DicomSeries>& series() const noexcept { return series_; }

 private:
  std::vector<DicomSeries> series_;
};

/// Options for converting a file or an image to a grid.
struct VolumeOptions {
  std::string series{};              ///< UID of a DICOM series, or its number in the list; needed if there are several
  std::optional<double> isovalue{};  ///< refuse volumes without a surface at this density
  std::optional<double> outside{};   ///< density beyond the grid; the smallest in the data unless given
  std::optional<Vec3d> spacing_m{};  ///< replaces the file's spacing [m], for formats and files without a unit
  /// Largest deviation of a DICOM slice from even spacing, as a share of the spacing. Scanners round positions, some to
  /// 0.1 mm; a missing slice gives a deviation of half a spacing or more.
  double slice_tolerance = 0.1;
  /// Largest shift of the last DICOM slice against the first within their plane [pixels]. A tilted gantry shifts each
  /// slice; reading the slices as upright would shear the anatomy.
  double shift_tolerance = 0.5;
  GridOptions grid{};  ///< options of the grid's memory
};

}  // namespace trephine
