// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/adapter/itk_complete.hpp>
#include <trephine/adapter/itk_dicom.hpp>
#include <trephine/adapter/itk_image.hpp>
#include <trephine/adapter/volume_options.hpp>
#include <trephine/voxel/grid_checks.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <itkGDCMImageIO.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <variant>
#include <vector>

/// Reads CT volumes with ITK 5.2 or newer, which the including program links (ITKCommon, ITKIOGDCM, ITKIONRRD,
/// ITKIONIFTI, ITKIOMeta). Not for the haptic thread: it reads files and allocates memory.
namespace trephine::inline TREPHINE_ALIGNED {

/// A grid of any density type, chosen by the file.
using AnyVoxelGrid = std::variant<VoxelGrid<std::uint8_t>, VoxelGrid<std::int8_t>, VoxelGrid<std::uint16_t>,
                                  VoxelGrid<std::int16_t>, VoxelGrid<float>>;

namespace itk_detail {

using Component = itk::IOComponentEnum;

/// A volume with checked headers and voxels still unread.
struct Source {
  std::string where;  // path, for messages
  ImageGeometry geometry;
  std::vector<std::string> files;  // one, or one per slice
  bool dicom = false;
};

/// Returns a reader for the file's format, or nullptr.
inline itk::ImageIOBase::Pointer reader_for(const std::string& file) {
  const std::array<itk::ImageIOBase::Pointer, 3> readers{itk::NrrdImageIO::New().GetPointer(),
                                                         itk::MetaImageIO::New().GetPointer(),
                                                         itk::NiftiImageIO::New().GetPointer()};
  for (const auto& reader : readers)
    if (reader->CanReadFile(file.c_str())) return reader;
  return nullptr;
}

/// Returns a reader of the file that has read the header.
inline itk::ImageIOBase::Pointer open_image(const std::string& file) {
  // If both exist, the NIfTI library opens the uncompressed file, which may be another patient's.
  const std::filesystem::path path = file;
  if (path.extension() == ".gz" && std::filesystem::exists(path.parent_path() / path.stem()))
    refuse_volume(file, path.stem().string() + " lies beside it and would be read in its place; move one away");
  const auto io = reader_for(file);
  if (io == nullptr)
    refuse_volume(file, "is no image that can be read here: a DICOM folder, or an NRRD, NIfTI or MetaImage file");
  io->SetFileName(file);
  try {
    io->ReadImageInformation();
  } catch (const itk::ExceptionObject& e) {
    refuse_volume(file, "its header cannot be read (" + last_line(e.GetDescription()) + "); fetch it again");
  }
  return io;
}

/// Returns the geometry of an image's first three dimensions; it has no fewer.
inline ImageGeometry geometry_of(const itk::ImageIOBase& io, const std::string& file) {
  ImageGeometry geometry;
  for (unsigned a = 0; a < 3; ++a) {
    if (io.GetDimensions(a) > std::size_t{kMaxGridSize})
      refuse_volume(file, "is larger than 2^20 voxels along an axis");
    geometry.size[a] = static_cast<int>(io.GetDimensions(a));
    geometry.spacing_mm[a] = io.GetSpacing(a);
    geometry.origin_mm[a] = io.GetOrigin(a);
    const auto axis = io.GetDirection(a);
    for (unsigned b = 0; b < 3; ++b) geometry.direction(b, a) = axis[b];
  }
  return geometry;
}

inline Source open_file(const std::string& file) {
  if (reader_for(file) == nullptr && itk::GDCMImageIO::New()->CanReadFile(file.c_str()))
    refuse_volume(file, "is a single DICOM file; give the folder that holds its series");
  const auto io = open_image(file);
  if (io->GetNumberOfComponents() != 1)
    refuse_volume(file, "has several numbers per voxel; a density is a single number");
  const unsigned dimensions = io->GetNumberOfDimensions();
  for (unsigned a = 3; a < dimensions; ++a)
    if (io->GetDimensions(a) != 1) refuse_volume(file, "holds several volumes (a time series?); extract one");
  if (dimensions < 3 || io->GetDimensions(2) < 2) refuse_volume(file, "is a single slice; a volume needs two or more");
  return {.where = file, .geometry = geometry_of(*io, file), .files = {file}};
}

inline Source open_volume(const std::filesystem::path& path, const VolumeOptions& options) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) refuse_volume(path.string(), "there is no such file or folder");
  if (!std::filesystem::is_directory(path)) return open_file(path.string());
  auto slices = choose_series(path, options);
  Source source{
      .where = path.string(), .geometry = check_slices(slices, options, path.string()), .files = {}, .dicom = true};
  for (const auto& slice : slices) source.files.push_back(slice.file);
  return source;
}

/// Reads the voxels of a file in their stored type (DICOM rescaled to Hounsfield units) and calls
/// `visit(const Pixel*, count)`.
template <class Visit>
void read_pixels(const Source& source, const std::string& file, std::size_t count, Visit&& visit) {
  itk::ImageIOBase::Pointer io;
  std::vector<std::byte> buffer;
  try {
    io = source.dicom ? itk::ImageIOBase::Pointer(itk::GDCMImageIO::New().GetPointer()) : reader_for(file);
    io->SetFileName(file);
    io->ReadImageInformation();
    itk::ImageIORegion region(io->GetNumberOfDimensions());
    for (unsigned a = 0; a < io->GetNumberOfDimensions(); ++a) region.SetSize(a, io->GetDimensions(a));
    io->SetIORegion(region);
    if (static_cast<std::size_t>(io->GetImageSizeInPixels()) != count) refuse_volume(file, "changed while it was read");
    read_completely(*io, file, buffer);
  } catch (const itk::ExceptionObject& e) {
    refuse_volume(file, "its voxels cannot be read (" + last_line(e.GetDescription()) + "); is the file complete?");
  }
  const auto as = [&]<class Pixel>(Pixel) { visit(reinterpret_cast<const Pixel*>(buffer.data()), count); };
  switch (io->GetComponentType()) {
    case Component::UCHAR:
      return as(static_cast<unsigned char>(0));
    case Component::CHAR:
      return as(static_cast<signed char>(0));
    case Component::USHORT:
      return as(static_cast<unsigned short>(0));
    case Component::SHORT:
      return as(static_cast<short>(0));
    case Component::UINT:
      return as(0U);
    case Component::INT:
      return as(0);
    case Component::ULONG:
      return as(0UL);
    case Component::LONG:
      return as(0L);
    case Component::ULONGLONG:
      return as(0ULL);
    case Component::LONGLONG:
      return as(0LL);
    case Component::FLOAT:
      return as(0.0F);
    case Component::DOUBLE:
      return as(0.0);
    default:
      refuse_volume(file, "its voxels are no plain numbers");
  }
}

/// Returns the number of voxels per file.
inline std::size_t voxels_per_file(const Source& source) {
  const auto& n = source.geometry.size;
  const auto all = static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(n[2]);
  return all / source.files.size();
}

template <VoxelDensity Density>
VoxelGrid<Density> read_as(const Source& source, const VolumeOptions& options) {
  const auto rigid = to_rigid(source.geometry, options, source.where);
  const std::size_t count = voxels_per_file(source);
  std::vector<Density> voxels(count * source.files.size());
  ConversionSummary summary;
  auto* to = voxels.data();
  for (const auto& file : source.files) {
    read_pixels(source, file, count, [&summary, to](const auto* in, std::size_t n) { convert(in, n, to, summary); });
    to += count;
  }
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
  for (const auto& file : source.files) {
    read_pixels(source, file, voxels_per_file(source), [&]<class Pixel>(const Pixel* in, std::size_t n) {
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
  }
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
/// also throws for: no such file, not an image, no voxels, several series (SeveralSeries, with the list). Missing,
/// uneven or sheared slices (tilted gantry) and axes that are not perpendicular are refused too.
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
