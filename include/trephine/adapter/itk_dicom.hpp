// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/adapter/dicom_elements.hpp>
#include <trephine/adapter/itk_image.hpp>
#include <trephine/adapter/volume_options.hpp>
#include <trephine/adapter/volume_text.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

/// Lists the series of a DICOM folder and checks that a series' slices form a volume. Unlike ITK's series reader it
/// refuses slices that are missing, unevenly spaced or sheared by a tilted gantry.
namespace trephine::inline TREPHINE_ALIGNED {

namespace itk_detail {

/// Header of a slice.
struct Slice {
  DicomFile file;
  std::string uid;
  std::array<int, 2> size{};                        // columns, rows
  std::optional<Eigen::Vector2d> spacing_mm;        // between columns, between rows
  std::optional<Vec3d> position_mm;                 // the first pixel's centre
  std::optional<Eigen::Matrix<double, 6, 1>> axes;  // unit vectors along a row and along a column

  [[nodiscard]] std::string name() const { return file.path.string(); }
  [[nodiscard]] bool has_place() const noexcept { return position_mm && axes; }
};

/// A file that may have been a slice.
struct LostSlice {
  std::filesystem::path path;
  std::string reason;
  std::string uid;       // of its series, if that can be read
  bool certain = false;  // by its content or name
};

/// Files of a folder. Companions are DICOM objects that are no slices: reports, contours, doses, colour images.
struct DicomFolder {
  std::vector<Slice> slices{};
  std::vector<LostSlice> lost{};
  std::map<std::string, int> companions{};  // files by kind
};

/// Returns the kind of object that is no slice, or "" for a slice.
inline std::string companion_kind(const DicomFile& file) {
  namespace tag = dicom_tag;
  // By class (PS3.4, annex B): some of them have pixels that are no densities.
  const std::string of = file.text(tag::kClass);
  constexpr std::string_view kStorage = "1.2.840.10008.5.1.4.1.1.";
  if (of == "1.2.840.10008.1.3.10" || file.text(0x00020002) == "1.2.840.10008.1.3.10") return "directory (DICOMDIR)";
  if (of.starts_with(kStorage)) {
    const std::string kind = of.substr(kStorage.size()) + ".";
    if (kind.starts_with("481.")) return "radiotherapy object";
    if (kind.starts_with("66.")) return "segmentation or registration";
    if (kind.starts_with("88.") || kind.starts_with("104.")) return "report";
    if (kind.starts_with("9.") || kind.starts_with("11.") || kind.starts_with("30.")) return "object without densities";
  }
  if (!file.has_pixels) return file.has(tag::kFloatPixels) || file.has(tag::kDoublePixels) ? "parametric map" : "";
  if (number_of(file.text(tag::kFrames)).value_or(1) > 1) return "multi-frame object";
  if (file.number(tag::kSamples).value_or(1) != 1 || file.text(tag::kPhotometric) == "PALETTE COLOR")
    return "colour image";
  return "";
}

inline Slice to_slice(const DicomFile& file) {
  namespace tag = dicom_tag;
  Slice slice{.file = file,
              .uid = file.text(tag::kSeries),
              .size = {file.number(tag::kColumns).value_or(0), file.number(tag::kRows).value_or(0)},
              .spacing_mm = file.decimals<2>(tag::kPixelSpacing),
              .position_mm = file.decimals<3>(tag::kPosition),
              .axes = file.decimals<6>(tag::kAxes)};
  if (slice.spacing_mm) slice.spacing_mm = slice.spacing_mm->reverse().eval();
  return slice;
}

/// Looks at every file in a folder.
inline DicomFolder scan_folder(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::sort(files.begin(), files.end());

  DicomFolder out;
  for (const auto& path : files) {
    const auto file = walk_dicom(path);
    if (!file) {
      const bool named = lower_case(path.extension().string()) == ".dcm";
      std::error_code error;
      out.lost.push_back({path,
                          std::filesystem::file_size(path, error) == 0 ? "is empty"
                          : named                                      ? "is named .dcm and is no DICOM file"
                                                                       : "is named like a slice and is no DICOM file",
                          "", named});
    } else if (const std::string kind = companion_kind(*file); !kind.empty()) {
      ++out.companions[kind];
    } else if (!file->has_pixels) {
      out.lost.push_back(
          {path, file->damage.empty() ? "holds no pixels" : file->damage, file->text(dicom_tag::kSeries), true});
    } else {
      out.slices.push_back(to_slice(*file));
    }
  }
  return out;
}

/// Returns a name with its numbers alike: slices of a series differ in them alone.
inline std::string name_pattern(const std::filesystem::path& path) {
  std::string pattern;
  for (const char c : path.filename().string()) {
    const bool of_number = std::string_view("0123456789abcdefABCDEF._-").find(c) != std::string_view::npos;
    if (!of_number)
      pattern.push_back(c);
    else if (pattern.empty() || pattern.back() != '#')
      pattern.push_back('#');
  }
  return pattern;
}

/// Refuses a folder with a file that may be a slice of the chosen series: without it the volume would be shorter.
inline void check_lost(const std::vector<LostSlice>& lost, const std::vector<Slice>& chosen) {
  for (const LostSlice& l : lost) {
    const bool of_series = std::any_of(chosen.begin(), chosen.end(), [&l](const Slice& s) {
      return l.uid.empty() ? l.certain || name_pattern(s.file.path) == name_pattern(l.path) : l.uid == s.uid;
    });
    if (of_series) refuse_volume(l.path.string(), l.reason + "; fetch it again or remove it from the folder");
  }
}

// Numbers that decide.
inline constexpr double kSameAxes = 1e-3;  // largest difference of direction cosines in a series: files round to 1e-4
inline constexpr double kSameSpacing = 1e-3;  // largest relative difference of pixel spacings in a series
inline constexpr double kMinGap = 1e-3;       // smallest gap of slices, as a share of the mean gap: else they coincide

/// Groups slices by series. A scout image may share the UID of its series but differs in size or orientation. Slices
/// without a place, as screenshots are, make no series beside others.
inline std::vector<std::vector<Slice>> group_series(const DicomFolder& folder, const std::filesystem::path& path) {
  std::vector<std::vector<Slice>> groups;
  for (const Slice& slice : folder.slices) {
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
  const auto has_place = [](const std::vector<Slice>& group) { return group.front().has_place(); };
  if (std::any_of(groups.begin(), groups.end(), has_place))
    groups.erase(std::stable_partition(groups.begin(), groups.end(), has_place), groups.end());
  if (!groups.empty()) return groups;

  std::string kinds;
  for (const auto& [kind, files] : folder.companions)
    kinds += (kinds.empty() ? "" : ", ") + std::to_string(files) + " " + kind + (files == 1 ? "" : "s");
  if (!kinds.empty())
    refuse_volume(path.string(),
                  "holds no slices but " + kinds + "; export the series as one file per slice, or as NRRD or NIfTI");
  for (const LostSlice& l : folder.lost)
    if (l.certain) refuse_volume(l.path.string(), l.reason + "; fetch it again or remove it from the folder");
  refuse_volume(path.string(), "holds no DICOM file; give a DICOM folder, or an NRRD, NIfTI or MetaImage file");
}

/// Returns the public description of each group.
inline std::vector<DicomSeries> describe(const std::vector<std::vector<Slice>>& groups) {
  std::vector<DicomSeries> series;
  for (const auto& group : groups) {
    const Slice& s = group.front();
    series.push_back({.number = static_cast<int>(series.size()) + 1,
                      .uid = s.uid,
                      .description = s.file.text(dicom_tag::kDescription),
                      .modality = s.file.text(dicom_tag::kModality),
                      .slices = static_cast<int>(group.size()),
                      .columns = s.size[0],
                      .rows = s.size[1]});
  }
  return series;
}

/// Returns the slices of the requested series, or of the only series.
inline std::vector<Slice> choose_series(const std::filesystem::path& path, const VolumeOptions& options) {
  const DicomFolder folder = scan_folder(path);
  const auto groups = group_series(folder, path);
  const auto series = describe(groups);
  Text list;
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < series.size(); ++i) {
    const DicomSeries& s = series[i];
    list << (i == 0 ? "" : "; ") << s.number << ": " << s.modality << (s.description.empty() ? "" : " " + s.description)
         << ", " << s.slices << " slices of " << s.columns << " x " << s.rows << ", " << s.uid;
    if (options.series.empty() || options.series == s.uid || options.series == std::to_string(s.number))
      chosen.push_back(i);
  }
  if (chosen.size() == 1) {
    check_lost(folder.lost, groups[chosen[0]]);
    return groups[chosen[0]];
  }
  const std::string where = "trephine::read_volume: " + path.string();
  if (chosen.empty())
    throw SeveralSeries(one_line(where + ": has no series '" + options.series + "'; there are " + list.str()), series);
  throw SeveralSeries(one_line(where + ": holds " + std::to_string(series.size()) +
                               " series, choose one by its number or UID (VolumeOptions::series): " + list.str()),
                      series);
}

/// Refuses two slices at one place.
inline void check_places(const std::vector<Slice>& slices, const Vec3d& normal, double step) {
  for (std::size_t i = 0; i + 1 < slices.size(); ++i) {
    const Slice& a = slices[i];
    const Slice& b = slices[i + 1];
    if (normal.dot(*b.position_mm - *a.position_mm) > kMinGap * step) continue;
    const std::string instance = a.file.text(dicom_tag::kInstance);
    if (!instance.empty() && instance == b.file.text(dicom_tag::kInstance))
      refuse_volume(b.name(), "is the same slice as " + a.name() + "; remove one of them from the folder");
    refuse_volume(b.name(), "two slices at one place, it and " + a.name() +
                                ": several volumes (phases, echoes) share the series; split them first");
  }
}

/// Refuses slices that are shifted in their plane: all along, or some of them.
inline void check_shifts(const std::vector<Slice>& slices, const Vec3d& normal, const VolumeOptions& options,
                         const std::string& where) {
  const Vec3d first = *slices.front().position_mm;
  const Vec3d extent = *slices.back().position_mm - first;
  const double length = normal.dot(extent);
  const double allowed =
      options.shift_tolerance * slices.front().spacing_mm.value_or(Eigen::Vector2d::Ones()).minCoeff();
  const double shift = (extent - length * normal).norm();
  Text s;
  if (!(shift <= allowed)) {
    const std::string tilt = slices.front().file.text(dicom_tag::kTilt);
    s << "the slices are sheared by " << std::atan2(shift, length) * 180 / std::numbers::pi
      << " degrees, as from a tilted "
      << "gantry" << (tilt.empty() ? "" : " (the file says " + tilt + ")") << ": the last is " << shift
      << " mm off the first's normal, allowed are " << options.shift_tolerance
      << " pixels (shift_tolerance); resample the series upright first";
    refuse_volume(where, s.str());
  }
  for (const Slice& slice : slices) {
    const Vec3d p = *slice.position_mm - first;
    const double aside = (p - normal.dot(p) * normal).norm();
    if (aside <= allowed) continue;
    s << "is shifted by " << aside << " mm in its plane against the first slice, allowed are "
      << options.shift_tolerance << " pixels (shift_tolerance); resample the series first";
    refuse_volume(slice.name(), s.str());
  }
}

/// Sorts a series' slices along its normal and returns the volume's geometry. Throws VolumeError if they form no
/// volume.
inline ImageGeometry check_slices(std::vector<Slice>& slices, const VolumeOptions& options, const std::string& where) {
  ImageGeometry g{.size = {slices.front().size[0], slices.front().size[1], static_cast<int>(slices.size())}};
  for (const Slice& s : slices) {
    if (!s.has_place())
      refuse_volume(s.name(), "has no image position or orientation, so its place in the volume is unknown");
    if (!s.spacing_mm) g.no_spacing = "has no pixel spacing";
    if (g.no_spacing.empty() &&
        (*s.spacing_mm - *slices.front().spacing_mm).cwiseAbs().maxCoeff() > kSameSpacing * s.spacing_mm->maxCoeff())
      refuse_volume(s.name(), "has another pixel spacing than its series' other slices");
  }
  if (slices.size() < 2) refuse_volume(where, "the series is a single slice; a volume needs two or more");
  const Vec3d along_row = slices.front().axes->head<3>();
  const Vec3d along_column = slices.front().axes->tail<3>();
  const Vec3d normal = along_row.cross(along_column).normalized();
  std::sort(slices.begin(), slices.end(), [&normal](const Slice& a, const Slice& b) {
    return normal.dot(*a.position_mm) < normal.dot(*b.position_mm);
  });

  const Vec3d first = *slices.front().position_mm;
  const double length = normal.dot(*slices.back().position_mm - first);
  const double step = length / static_cast<double>(slices.size() - 1);
  check_places(slices, normal, step);
  check_shifts(slices, normal, options, where);
  for (std::size_t i = 0; i + 1 < slices.size(); ++i) {
    const double even = static_cast<double>(i + 1) * step;
    if (std::abs(normal.dot(*slices[i + 1].position_mm - first) - even) <= options.slice_tolerance * step) continue;
    Text s;
    s << "the slices are not evenly spaced (slice_tolerance " << options.slice_tolerance
      << "): " << normal.dot(*slices[i + 1].position_mm - *slices[i].position_mm) << " mm between " << slices[i].name()
      << " and " << slices[i + 1].name() << " where " << step << " mm is the mean; is a slice missing?";
    refuse_volume(where, s.str());
  }
  if (g.no_spacing.empty()) g.spacing_mm << *slices.front().spacing_mm, step;
  g.origin_mm = first;
  g.direction << along_row, along_column, normal;
  return g;
}

}  // namespace itk_detail

/// Returns the series in a folder of DICOM files, for a choice. Throws VolumeError if there are none.
[[nodiscard]] inline std::vector<DicomSeries> list_dicom_series(const std::filesystem::path& folder) {
  return itk_detail::describe(itk_detail::group_series(itk_detail::scan_folder(folder), folder));
}

}  // namespace trephine
