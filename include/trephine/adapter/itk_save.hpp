// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/adapter/itk.hpp>
#include <trephine/voxel/grid_reader.hpp>

#include <itkMetaDataObject.h>
#include <itkMetaImageIO.h>
#include <itkNrrdImageIO.h>

#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>
#include <system_error>
#include <type_traits>
#include <vector>

/// Saves drilled bone to standard files and loads it again, to continue a session later. Not for the haptic thread.
namespace trephine::inline TREPHINE_ALIGNED {

namespace itk_detail {

/// Metadata key of the density outside the grid.
inline constexpr const char* kOutsideKey = "trephine_outside";

/// Throws VolumeError with a path and a reason.
[[noreturn]] inline void refuse_saving(const std::filesystem::path& path, const std::string& what) {
  throw VolumeError("trephine::save_volume: " + path.string() + ": " + what);
}

template <VoxelDensity Density>
constexpr Component component_of() noexcept {
  if constexpr (std::is_same_v<Density, std::uint8_t>) return Component::UCHAR;
  if constexpr (std::is_same_v<Density, std::int8_t>) return Component::CHAR;
  if constexpr (std::is_same_v<Density, std::uint16_t>) return Component::USHORT;
  if constexpr (std::is_same_v<Density, std::int16_t>) return Component::SHORT;
  return Component::FLOAT;
}

/// Returns a writer for the path's ending. Throws VolumeError for other endings than .nrrd and .mha.
inline itk::ImageIOBase::Pointer writer_for(const std::filesystem::path& path) {
  if (path.extension() == ".nrrd") return itk::NrrdImageIO::New().GetPointer();
  if (path.extension() == ".mha") return itk::MetaImageIO::New().GetPointer();
  refuse_saving(path, "the name must end in .nrrd or .mha");
}

/// Returns v with 17 digits, which restore it bit by bit.
inline std::string to_exact_text(double v) {
  std::ostringstream text;
  text.precision(17);
  text << v;
  return text.str();
}

/// A temporary file next to its target. The destructor removes it unless it replaced the target.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::filesystem::path& target) : target_(target), file_(target) {
    file_.replace_filename(target.stem().string() + ".part" + target.extension().string());
  }
  ~TemporaryFile() {
    std::error_code ignored;
    if (!moved_) std::filesystem::remove(file_, ignored);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  [[nodiscard]] const std::filesystem::path& file() const noexcept { return file_; }
  void replace_target() {
    std::error_code error;
    std::filesystem::rename(file_, target_, error);
    if (error) refuse_saving(target_, "cannot be replaced (" + error.message() + ")");
    moved_ = true;
  }

 private:
  std::filesystem::path target_;
  std::filesystem::path file_;
  bool moved_ = false;
};

/// Throws VolumeError unless the path's folder exists.
inline void check_folder(const std::filesystem::path& path) {
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) refuse_saving(path, "there is no folder " + folder.string());
}

/// Writes voxels to a temporary file, and replaces `path` by it if `is_complete(file)` is true.
template <class IsComplete>
void write_and_replace(const std::filesystem::path& path, itk::ImageIOBase& io, const void* voxels,
                       IsComplete&& is_complete) {
  TemporaryFile temporary(path);
  io.SetFileName(temporary.file().string());
  try {
    io.Write(voxels);
  } catch (const itk::ExceptionObject& e) {
    refuse_saving(path, "cannot be written (" + last_line(e.GetDescription()) + ")");
  }
  // Some of ITK's writers do not report a full disk.
  if (!is_complete(temporary.file())) refuse_saving(path, "cannot be written in full (is the disk full?)");
  temporary.replace_target();
}

/// Sets the header of a file: geometry in millimetres, and the density outside.
inline void describe(itk::ImageIOBase& io, const std::array<int, 3>& size, const Vec3d& spacing, const Posed& X_WG,
                     double outside) {
  itk::ImageIORegion region(3);
  io.SetNumberOfDimensions(3);
  for (unsigned a = 0; a < 3; ++a) {
    const auto n = static_cast<itk::SizeValueType>(size[a]);
    io.SetDimensions(a, n);
    region.SetSize(a, n);
    io.SetSpacing(a, 1e3 * spacing[a]);
    io.SetOrigin(a, 1e3 * X_WG.translation()[a]);
    const auto axis = X_WG.linear().col(static_cast<int>(a));
    io.SetDirection(a, std::vector<double>{axis.x(), axis.y(), axis.z()});
  }
  io.SetIORegion(region);
  io.SetPixelType(itk::IOPixelEnum::SCALAR);
  io.SetNumberOfComponents(1);
  itk::EncapsulateMetaData<std::string>(io.GetMetaDataDictionary(), kOutsideKey, to_exact_text(outside));
}

}  // namespace itk_detail

/// Writes the present bone to `path`, an NRRD (.nrrd) or MetaImage (.mha) file: a short text header, then the voxels,
/// uncompressed, in their own type. The header holds size, spacing and pose in millimetres and the patient's axes (as
/// in `read_volume`), and the density outside the grid. An existing file is replaced once the new file is complete; on
/// failure it stays.
///
/// Any thread may save while the haptic thread drills, with a `bone` reader of its own, which is not polled. `X_WG` is
/// the grid's pose, which readers do not hold. The file may contain part of an edit that is made during writing; pause
/// the drilling for a consistent state. Needs memory for a second copy of the voxels.
///
/// Throws VolumeError with the reason: another ending, a single slice (which `read_volume` refuses), a non-finite pose,
/// a missing or write-protected folder, a full disk.
template <VoxelDensity Density>
void save_volume(const std::filesystem::path& path, const GridReader<Density>& bone, const Posed& X_WG) {
  using itk_detail::refuse_saving;
  const auto& n = bone.size();
  const itk::ImageIOBase::Pointer io = itk_detail::writer_for(path);
  if (n[2] < 2) refuse_saving(path, "a single slice is no volume");
  if (!X_WG.matrix().allFinite()) refuse_saving(path, "the bone's pose is not finite");
  itk_detail::check_folder(path);

  std::vector<Density> voxels;
  voxels.reserve(static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(n[2]));
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) voxels.push_back(bone.voxel(i, j, k));

  itk_detail::describe(*io, n, bone.spacing(), X_WG, static_cast<double>(bone.voxel(-1, -1, -1)));
  io->SetComponentType(itk_detail::component_of<Density>());
  itk_detail::write_and_replace(path, *io, voxels.data(), [&voxels](const std::filesystem::path& file) {
    std::error_code error;
    const auto written = std::filesystem::file_size(file, error);
    return !error && written >= voxels.size() * sizeof(Density);
  });
}

/// The same on the haptic thread between ticks, or while no scene ticks.
template <VoxelDensity Density>
void save_volume(const std::filesystem::path& path, const VoxelGrid<Density>& bone) {
  save_volume(path, GridReader<Density>(bone), bone.X_WG());
}

/// Reads a file of `save_volume` as `read_volume_as` does, with the saved density outside unless `options` set it. The
/// new grid's original includes the earlier drilling: to restore the bone from before the first session, read that
/// volume. Files without a saved density outside are read too. Throws VolumeError.
template <VoxelDensity Density>
[[nodiscard]] VoxelGrid<Density> load_volume(const std::filesystem::path& path, VolumeOptions options = {}) {
  const itk::ImageIOBase::Pointer io =
      std::filesystem::is_regular_file(path) ? itk_detail::reader_for(path.string()) : nullptr;
  if (io != nullptr && !options.outside) {
    std::string text;
    try {
      io->SetFileName(path.string());
      io->ReadImageInformation();
      itk::ExposeMetaData(io->GetMetaDataDictionary(), itk_detail::kOutsideKey, text);
    } catch (const itk::ExceptionObject&) {
      text.clear();  // `read_volume_as` below reports the error
    }
    if (!text.empty()) {
      char* end = nullptr;
      const double outside = std::strtod(text.c_str(), &end);
      if (*end != '\0' || !std::isfinite(outside))
        itk_detail::refuse_volume(path.string(), "its saved density outside is no number: '" + text + "'");
      options.outside = outside;
    }
  }
  return read_volume_as<Density>(path, options);
}

}  // namespace trephine
