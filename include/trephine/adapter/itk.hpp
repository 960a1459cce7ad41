// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/adapter/dicom_elements.hpp>
#include <trephine/adapter/dicom_pixels.hpp>
#include <trephine/adapter/itk_dicom.hpp>
#include <trephine/adapter/itk_image.hpp>
#include <trephine/adapter/meta_image.hpp>
#include <trephine/adapter/nifti.hpp>
#include <trephine/adapter/nrrd.hpp>
#include <trephine/adapter/stored_image.hpp>
#include <trephine/adapter/volume_bytes.hpp>
#include <trephine/adapter/volume_options.hpp>
#include <trephine/adapter/volume_text.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

/// Reads CT volumes. Headers and plain voxels are read here; compressed DICOM pixels are decoded by ITK 5.2 or newer,
/// which the including program links (ITKCommon, ITKIOGDCM and their zlib). The result is the same under any locale and
/// on any thread but the haptic one: it reads files and allocates memory.
namespace trephine::inline TREPHINE_ALIGNED {

/// A grid of any density type, chosen by the file.
using AnyVoxelGrid = std::variant<VoxelGrid<std::uint8_t>, VoxelGrid<std::int8_t>, VoxelGrid<std::uint16_t>,
                                  VoxelGrid<std::int16_t>, VoxelGrid<float>>;

namespace itk_detail {

/// A volume with checked headers and voxels still unread: one file, or a series of slices.
struct Source {
  std::string where;  // path, for messages
  ImageGeometry geometry{};
  std::optional<StoredImage> image{};
  std::vector<Slice> slices{};

  [[nodiscard]] std::size_t files() const noexcept { return image ? 1 : slices.size(); }
};

/// Returns the description of a file's image by its content; nothing if it has no known format.
inline std::optional<StoredImage> find_image(const std::string& file) {
  namespace fs = std::filesystem;
  std::string header = file;
  // Voxels of a pair are named by their header.
  fs::path plain = file;
  if (lower_case(plain.extension().string()) == ".gz") plain.replace_extension();
  if (lower_case(plain.extension().string()) == ".img") {
    std::error_code error;
    for (const char* const ending : {".hdr", ".hdr.gz"})
      if (const fs::path beside = plain.replace_extension(ending); fs::exists(beside, error)) header = beside.string();
  }
  const std::string start = first_bytes(header, 1024);
  if (is_nrrd(start)) return open_nrrd(header);
  if (is_meta_image(header, start)) return open_meta_image(header);
  if (const auto nifti = nifti_header(start)) return open_nifti(header, *nifti);
  if (is_analyze(start, header))
    refuse_volume(file, "is an Analyze file, which tells left from right nowhere; convert it to NIfTI");
  return std::nullopt;
}

/// Returns the description of a file's image. Throws VolumeError if it is none.
inline StoredImage open_image(const std::string& file) {
  auto image = find_image(file);
  if (!image)
    refuse_volume(file, "is no image that can be read here: a DICOM folder, or an NRRD, NIfTI or MetaImage file");
  return std::move(*image);
}

/// Returns the geometry of an image's first three dimensions; it has no fewer.
inline ImageGeometry geometry_of(const StoredImage& image) {
  ImageGeometry geometry = image.geometry;
  for (std::size_t a = 0; a < 3; ++a) geometry.size[a] = static_cast<int>(image.size[a]);
  return geometry;
}

inline Source open_file(const std::string& file) {
  if (const auto dicom = walk_dicom(file)) {
    const std::string kind = companion_kind(*dicom);
    if (!kind.empty())
      refuse_volume(file, "is a " + kind + " in DICOM; export its volume as one file per slice, or as NRRD or NIfTI");
    if (!dicom->has_pixels)
      refuse_volume(file, "is a DICOM file that " + (dicom->damage.empty() ? "holds no pixels" : dicom->damage));
    refuse_volume(file, "is a single DICOM file; give the folder that holds its series");
  }
  StoredImage image = open_image(file);
  if (image.numbers != 1) refuse_volume(file, "has several numbers per voxel; a density is a single number");
  if (image.size.size() > 3 && image.volumes() != 1)
    refuse_volume(file, "holds several volumes (a time series?); extract one");
  if (image.size.size() < 3 || image.size[2] < 2) refuse_volume(file, "is a single slice; a volume needs two or more");
  return {.where = file, .geometry = geometry_of(image), .image = std::move(image)};
}

inline Source open_volume(const std::filesystem::path& path, const VolumeOptions& options) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) refuse_volume(path.string(), "there is no such file or folder");
  if (!std::filesystem::is_directory(path)) return open_file(path.string());
  std::string where = path.string();
  std::vector<Slice> slices = choose_series(path, options);
  ImageGeometry geometry = check_slices(slices, options, where);
  return {.where = std::move(where), .geometry = std::move(geometry), .slices = std::move(slices)};
}

/// Reads the voxels of a source, file by file, and calls `visit(const Pixel*, count)` for each with their densities:
/// stored numbers, rescaled as the header tells.
template <class Visit>
void read_pixels(const Source& source, Visit&& visit) {
  if (source.image) read_voxels(*source.image, visit);
  for (const Slice& slice : source.slices) read_slice(slice.file, visit);
}

template <VoxelDensity Density>
VoxelGrid<Density> read_as(const Source& source, const VolumeOptions& options) {
  const auto rigid = to_rigid(source.geometry, options, source.where);
  std::vector<Density> voxels;  // grows with the bytes that are there, whatever a header announces
  ConversionSummary summary;
  read_pixels(source, [&](const auto* in, std::size_t count) {
    if (voxels.empty()) voxels.reserve(count * source.files());
    voxels.resize(voxels.size() + count);
    convert(in, count, voxels.data() + (voxels.size() - count), summary);
  });
  check_converted<Density>(summary, options, source.where);
  return make_grid<Density>(rigid, std::move(voxels), options, source.where);
}

/// Returns the index in AnyVoxelGrid of the density type that holds every file's voxels. It is their own type if all
/// files share it, else the smallest that fits.
inline std::size_t suitable_type(const Source& source) {
  ConversionSummary summary;
  bool whole = true;
  bool first = true;
  std::size_t own = std::variant_npos;
  read_pixels(source, [&]<class Pixel>(const Pixel* in, std::size_t n) {
    whole = whole && std::is_integral_v<Pixel>;
    std::size_t type = std::variant_npos;
    if constexpr (std::is_same_v<Pixel, std::uint8_t>) type = 0;
    if constexpr (std::is_same_v<Pixel, std::int8_t>) type = 1;
    if constexpr (std::is_same_v<Pixel, std::uint16_t>) type = 2;
    if constexpr (std::is_same_v<Pixel, std::int16_t>) type = 3;
    own = first || own == type ? type : std::variant_npos;
    first = false;
    for (std::size_t i = 0; i < n; ++i) {
      summary.min = std::min(summary.min, static_cast<double>(in[i]));
      summary.max = std::max(summary.max, static_cast<double>(in[i]));
    }
  });
  if (!whole) return 4;
  if (own != std::variant_npos) return own;
  if (fits<std::int16_t>(summary)) return 3;
  return fits<std::uint16_t>(summary) ? 2 : 4;
}

}  // namespace itk_detail

/// Reads a volume: a folder with a DICOM series, or an NRRD, NIfTI or MetaImage file. Densities are Hounsfield units if
/// the file has the rescaling. W is the patient's space as in ITK, in metres: x to the left, y to the back, z to the
/// head. The first voxel's position and the direction cosines become X_WG.
///
/// Other number types are converted to `Density`: whole numbers exactly, if all fit, and others to the nearest. Throws
/// VolumeError with one line if densities do not fit or are not finite, or if no surface lies at `options.isovalue`. It
/// also throws for: no such file, not an image, no voxels, no spacing or an unknown unit of length, fewer or more bytes
/// than the header announces, several series (SeveralSeries, with the list). Slices that are missing, damaged, uneven,
/// shifted or sheared (tilted gantry) and axes that are not perpendicular are refused too. Other DICOM objects in the
/// folder (reports, contours, doses, colour images) are left out.
template <VoxelDensity Density>
[[nodiscard]] VoxelGrid<Density> read_volume_as(const std::filesystem::path& path, const VolumeOptions& options = {}) {
  return itk_detail::read_as<Density>(itk_detail::open_volume(path, options), options);
}

/// Reads a volume in the density type that suits the file. Integers of 8 and 16 bits keep their type. Wider integers
/// become 16-bit if all fit, else float; other numbers become float. It reads the file twice.
[[nodiscard]] inline AnyVoxelGrid read_volume(const std::filesystem::path& path, const VolumeOptions& options = {}) {
  const auto source = itk_detail::open_volume(path, options);
  switch (itk_detail::suitable_type(source)) {
    case 0:
      return itk_detail::read_as<std::uint8_t>(source, options);
    case 1:
      return itk_detail::read_as<std::int8_t>(source, options);
    case 2:
      return itk_detail::read_as<std::uint16_t>(source, options);
    case 3:
      return itk_detail::read_as<std::int16_t>(source, options);
    default:
      return itk_detail::read_as<float>(source, options);
  }
}

}  // namespace trephine
