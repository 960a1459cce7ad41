// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/adapter/itk_image.hpp>
#include <trephine/adapter/volume_options.hpp>

#include <itkGDCMImageIO.h>
#include <itkMetaDataObject.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <locale>
#include <numbers>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

/// Lists the series of a DICOM folder and checks that a series' slices form a volume. Unlike ITK's series reader it
/// refuses slices that are missing, unevenly spaced or sheared by a tilted gantry.
namespace trephine::inline TREPHINE_ALIGNED {

namespace itk_detail {

/// Header of a slice.
struct Slice {
  std::string file;
  std::string uid;
  std::string description;
  std::string modality;
  std::string tilt;
  std::array<int, 2> size{};                        // columns, rows
  Eigen::Vector2d spacing_mm{0, 0};                 // between columns, between rows
  std::optional<Vec3d> position_mm;                 // the first pixel's centre
  std::optional<Eigen::Matrix<double, 6, 1>> axes;  // unit vectors along a row and along a column
  bool has_pixel_spacing = false;
};

/// Returns the text of a DICOM element without padding; empty if it is missing.
inline std::string tag(const itk::MetaDataDictionary& dictionary, const char* key) {
  std::string value;
  itk::ExposeMetaData(dictionary, key, value);
  const auto last = value.find_last_not_of(std::string(" \t\r\n\0", 5));
  value.erase(last == std::string::npos ? 0 : last + 1);
  value.erase(0, std::min(value.find_first_not_of(' '), value.size()));
  return value;
}

/// Returns N numbers of a DICOM element, which has the form "1.5\-2\3"; nothing if it is missing or malformed.
template <int N>
std::optional<Eigen::Matrix<double, N, 1>> numbers_of(const itk::MetaDataDictionary& dictionary, const char* key) {
  std::istringstream text(tag(dictionary, key));
  text.imbue(std::locale::classic());
  Eigen::Matrix<double, N, 1> v;
  for (int i = 0; i < N; ++i) {
    char backslash = 0;
    if (!(text >> v[i]) || (i + 1 < N && !(text >> backslash && backslash == '\\'))) return std::nullopt;
  }
  return v;
}

/// Returns the last line of an ITK message, which gives the reason.
inline std::string last_line(const std::string& text) {
  const auto end = text.find_last_not_of(" \n\r\t");
  if (end == std::string::npos) return "no reason given";
  const auto begin = text.find_last_of('\n', end);
  return text.substr(begin == std::string::npos ? 0 : begin + 1,
                     end - (begin == std::string::npos ? 0 : begin + 1) + 1);
}

/// Reads the headers of all slices in a folder. Skips DICOM files without pixels (reports, contours) and other files.
inline std::vector<Slice> scan_folder(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::sort(files.begin(), files.end());

  std::vector<Slice> slices;
  std::size_t without_pixels = 0;
  for (const auto& path : files) {
    Slice slice;
    slice.file = path.string();
    const auto io = itk::GDCMImageIO::New();
    io->LoadPrivateTagsOff();
    if (!io->CanReadFile(slice.file.c_str())) {
      // Skipping a damaged slice could shorten the volume without notice.
      if (path.extension() == ".dcm" || path.extension() == ".DCM")
        refuse_volume(slice.file, "is named .dcm and is no DICOM file; fetch it again or remove it from the folder");
      continue;
    }
    io->SetFileName(slice.file);
    try {
      io->ReadImageInformation();
    } catch (const itk::ExceptionObject&) {
      ++without_pixels;
      continue;
    }
    const auto& tags = io->GetMetaDataDictionary();
    if (io->GetNumberOfComponents() != 1) refuse_volume(slice.file, "is a colour image; densities are single numbers");
    if (io->GetNumberOfDimensions() > 2 && io->GetDimensions(2) > 1)
      refuse_volume(slice.file, "holds several frames; export the series as one file per slice, or as NRRD or NIfTI");
    slice.uid = tag(tags, "0020|000e");
    slice.description = tag(tags, "0008|103e");
    slice.modality = tag(tags, "0008|0060");
    slice.tilt = tag(tags, "0018|1120");
    slice.size = {static_cast<int>(io->GetDimensions(0)), static_cast<int>(io->GetDimensions(1))};
    slice.spacing_mm = {io->GetSpacing(0), io->GetSpacing(1)};
    slice.position_mm = numbers_of<3>(tags, "0020|0032");
    slice.axes = numbers_of<6>(tags, "0020|0037");
    slice.has_pixel_spacing = numbers_of<2>(tags, "0028|0030").has_value();
    slices.push_back(slice);
  }
  if (slices.empty()) {
    if (without_pixels > 0)
      refuse_volume(folder.string(), "its DICOM files hold no pixels; choose the folder of the images");
    refuse_volume(folder.string(), "holds no DICOM file; give a DICOM folder, or an NRRD, NIfTI or MetaImage file");
  }
  return slices;
}

// Numbers that decide.
inline constexpr double kSameAxes = 1e-3;  // largest difference of direction cosines in a series: files round to 1e-4
inline constexpr double kSameSpacing = 1e-3;  // largest relative difference of pixel spacings in a series
inline constexpr double kMinGap = 1e-3;       // smallest gap of slices, as a share of the mean gap: else they coincide

/// Groups slices by series. A scout image may share the UID of its series but differs in size or orientation.
inline std::vector<std::vector<Slice>> group_series(const std::vector<Slice>& slices) {
  std::vector<std::vector<Slice>> groups;
  for (const Slice& slice : slices) {
    const auto same = [&slice](const std::vector<Slice>& group) {
      const Slice& first = group.front();
      const bool same_axes = slice.axes && first.axes ? (*slice.axes - *first.axes).cwiseAbs().maxCoeff() < kSameAxes
                                                      : slice.axes.has_value() == first.axes.has_value();
      return slice.uid == first.uid && slice.size == first.size && same_axes;
    };
    const auto group = std::find_if(groups.begin(), groups.end(), same);
    if (group == groups.end())
      groups.push_back({slice});
    else
      group->push_back(slice);
  }
  return groups;
}

/// Returns the public description of each group.
inline std::vector<DicomSeries> describe(const std::vector<std::vector<Slice>>& groups) {
  std::vector<DicomSeries> series;
  for (const auto& group : groups) {
    const Slice& s = group.front();
    series.push_back({.number = static_cast<int>(series.size()) + 1,
                      .uid = s.uid,
                      .description = s.description,
                      .modality = s.modality,
                      .slices = static_cast<int>(group.size()),
                      .columns = s.size[0],
                      .rows = s.size[1]});
  }
  return series;
}

/// Returns the slices of the requested series, or of the only series.
inline std::vector<Slice> choose_series(const std::filesystem::path& folder, const VolumeOptions& options) {
  const auto groups = group_series(scan_folder(folder));
  const auto series = describe(groups);
  std::ostringstream list;
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < series.size(); ++i) {
    const DicomSeries& s = series[i];
    list << (i == 0 ? "" : "; ") << s.number << ": " << s.modality << (s.description.empty() ? "" : " " + s.description)
         << ", " << s.slices << " slices of " << s.columns << " x " << s.rows << ", " << s.uid;
    if (options.series.empty() || options.series == s.uid || options.series == std::to_string(s.number))
      chosen.push_back(i);
  }
  if (chosen.size() == 1) return groups[chosen[0]];
  const std::string where = "trephine::read_volume: " + folder.string();
  if (chosen.empty())
    throw SeveralSeries(where + ": has no series '" + options.series + "'; there are " + list.str(), series);
  throw SeveralSeries(where + ": holds " + std::to_string(series.size()) +
                          " series, choose one by its number or UID (VolumeOptions::series): " + list.str(),
                      series);
}

/// Sorts a series' slices along its normal and returns the volume's geometry. Throws VolumeError if they form no
/// volume.
inline ImageGeometry check_slices(std::vector<Slice>& slices, const VolumeOptions& options, const std::string& where) {
  for (const Slice& s : slices) {
    if (!s.position_mm || !s.axes)
      refuse_volume(s.file, "has no image position or orientation, so its place in the volume is unknown");
    if (!s.has_pixel_spacing && !options.spacing_m)
      refuse_volume(s.file, "has no pixel spacing; give VolumeOptions::spacing_m");
    if ((s.spacing_mm - slices.front().spacing_mm).cwiseAbs().maxCoeff() > kSameSpacing * s.spacing_mm.maxCoeff())
      refuse_volume(s.file, "has another pixel spacing than its series' other slices");
  }
  if (slices.size() < 2) refuse_volume(where, "the series is a single slice; a volume needs two or more");
  const Vec3d along_row = slices.front().axes->head<3>();
  const Vec3d along_column = slices.front().axes->tail<3>();
  const Vec3d normal = along_row.cross(along_column).normalized();
  std::sort(slices.begin(), slices.end(), [&normal](const Slice& a, const Slice& b) {
    return normal.dot(*a.position_mm) < normal.dot(*b.position_mm);
  });

  const Vec3d first = *slices.front().position_mm;
  const Vec3d extent = *slices.back().position_mm - first;
  const double length = normal.dot(extent);
  const double step = length / static_cast<double>(slices.size() - 1);
  std::ostringstream s;
  const double shift = (extent - length * normal).norm();
  if (!(shift <= options.shift_tolerance * slices.front().spacing_mm.minCoeff())) {
    s << "the slices are sheared by " << std::atan2(shift, length) * 180 / std::numbers::pi
      << " degrees, as from a tilted "
      << "gantry" << (slices.front().tilt.empty() ? "" : " (the file says " + slices.front().tilt + ")")
      << ": the last is " << shift << " mm off the first's normal, allowed are " << options.shift_tolerance
      << " pixels (shift_tolerance); resample the series upright first";
    refuse_volume(where, s.str());
  }
  for (std::size_t i = 0; i + 1 < slices.size(); ++i) {
    const double gap = normal.dot(*slices[i + 1].position_mm - *slices[i].position_mm);
    if (!(gap > kMinGap * step)) {
      s << "two slices at one place, " << slices[i].file << " and " << slices[i + 1].file
        << ": several volumes (phases, echoes) share the series; split them first";
      refuse_volume(where, s.str());
    }
    const double even = static_cast<double>(i + 1) * step;
    if (!(std::abs(normal.dot(*slices[i + 1].position_mm - first) - even) <= options.slice_tolerance * step)) {
      s << "the slices are not evenly spaced (slice_tolerance " << options.slice_tolerance << "): " << gap
        << " mm between " << slices[i].file << " and " << slices[i + 1].file << " where " << step
        << " mm is the mean; is a slice missing?";
      refuse_volume(where, s.str());
    }
  }
  ImageGeometry g{.size = {slices.front().size[0], slices.front().size[1], static_cast<int>(slices.size())}};
  g.spacing_mm << slices.front().spacing_mm, step;
  g.origin_mm = first;
  g.direction << along_row, along_column, normal;
  return g;
}

}  // namespace itk_detail

/// Returns the series in a folder of DICOM files, for a choice. Throws VolumeError if there are none.
[[nodiscard]] inline std::vector<DicomSeries> list_dicom_series(const std::filesystem::path& folder) {
  return itk_detail::describe(itk_detail::group_series(itk_detail::scan_folder(folder)));
}

}  // namespace trephine
