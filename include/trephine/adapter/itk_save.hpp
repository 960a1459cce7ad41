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

/// Saves the drilled bone to go on with it later, in files that other programs read too. Not for the haptic thread.
namespace trephine {

namespace itk_detail {

inline constexpr const char* kOutsideNote = "trephine_outside";

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

inline itk::ImageIOBase::Pointer writer_for(const std::filesystem::path& path) {
  if (path.extension() == ".nrrd") return itk::NrrdImageIO::New().GetPointer();
  if (path.extension() == ".mha") return itk::MetaImageIO::New().GetPointer();
  refuse_saving(path, "the name must end in .nrrd or .mha");
}

inline std::string in_full(double v) {
  std::ostringstream text;
  text.precision(17);
  text << v;
  return text.str();
}

/// A file that goes with the object unless it was moved to its place.
class Draft {
 public:
  explicit Draft(const std::filesystem::path& place) : place_(place), file_(place) {
    file_.replace_filename(place.stem().string() + ".part" + place.extension().string());
  }
  ~Draft() {
    std::error_code ignored;
    if (!moved_) std::filesystem::remove(file_, ignored);
  }
  Draft(const Draft&) = delete;
  Draft& operator=(const Draft&) = delete;

  [[nodiscard]] const std::filesystem::path& file() const noexcept { return file_; }
  void move_to_place() {
    std::error_code error;
    std::filesystem::rename(file_, place_, error);
    if (error) refuse_saving(place_, "cannot be replaced (" + error.message() + ")");
    moved_ = true;
  }

 private:
  std::filesystem::path place_;
  std::filesystem::path file_;
  bool moved_ = false;
};

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
  itk::EncapsulateMetaData<std::string>(io.GetMetaDataDictionary(), kOutsideNote, in_full(outside));
}

}  // namespace itk_detail

/// Writes the bone as it is to `path`, an NRRD (.nrrd) or MetaImage (.mha) file: a short header of text, then the
/// voxels, unpacked, in their own type. The header holds size, spacing and pose in millimetres and the patient's axes
/// (as `read_volume` has them) and notes the density outside the grid. An existing file is replaced once the new one is
/// complete; on failure it stays.
///
/// Any thread, while the haptic one drills: `bone` is that thread's own reader, of which nothing is polled, and `X_WG`
/// the grid's pose, which a reader does not know. An edit during the writing may be in it in part; for one moment's
/// bone pause the drilling. Takes a second copy of the voxels.
///
/// Throws VolumeError with the reason: another ending, a single slice (which `read_volume` refuses), a pose that is not
/// finite, a folder that is missing or cannot be written, no room on the disk.
template <VoxelDensity Density>
void save_volume(const std::filesystem::path& path, const GridReader<Density>& bone, const Posed& X_WG) {
  using itk_detail::refuse_saving;
  const auto& n = bone.size();
  const itk::ImageIOBase::Pointer io = itk_detail::writer_for(path);
  if (n[2] < 2) refuse_saving(path, "a single slice is no volume");
  if (!X_WG.matrix().allFinite()) refuse_saving(path, "the bone's pose is not finite");
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) refuse_saving(path, "there is no folder " + folder.string());

  std::vector<Density> voxels;
  voxels.reserve(static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(n[2]));
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) voxels.push_back(bone.voxel(i, j, k));

  itk_detail::Draft draft(path);
  itk_detail::describe(*io, n, bone.spacing(), X_WG, static_cast<double>(bone.voxel(-1, -1, -1)));
  io->SetComponentType(itk_detail::component_of<Density>());
  io->SetFileName(draft.file().string());
  try {
    io->Write(voxels.data());
  } catch (const itk::ExceptionObject& e) {
    refuse_saving(path, "cannot be written (" + itk_detail::last_line(e.GetDescription()) + ")");
  }
  // ITK's writers do not all notice a full disk.
  const auto written = std::filesystem::file_size(draft.file(), error);
  if (error || written < voxels.size() * sizeof(Density))
    refuse_saving(path, "cannot be written in full (is the disk full?)");
  draft.move_to_place();
}

/// The same on the haptic thread between ticks, or while nothing ticks.
template <VoxelDensity Density>
void save_volume(const std::filesystem::path& path, const VoxelGrid<Density>& bone) {
  save_volume(path, GridReader<Density>(bone), bone.X_WG());
}

/// Reads what `save_volume` wrote: as `read_volume_as`, with the density outside as it was unless `options` say
/// otherwise. What was drilled before belongs to the new grid's original: to restore the bone of before the first
/// session, read that volume. Files without the note are read all the same. Throws VolumeError.
template <VoxelDensity Density>
[[nodiscard]] VoxelGrid<Density> load_volume(const std::filesystem::path& path, VolumeOptions options = {}) {
  const itk::ImageIOBase::Pointer io =
      std::filesystem::is_regular_file(path) ? itk_detail::reader_for(path.string()) : nullptr;
  if (io != nullptr && !options.outside) {
    std::string note;
    try {
      io->SetFileName(path.string());
      io->ReadImageInformation();
      itk::ExposeMetaData(io->GetMetaDataDictionary(), itk_detail::kOutsideNote, note);
    } catch (const itk::ExceptionObject&) {
      note.clear();  // the reading below says what is wrong
    }
    if (!note.empty()) {
      char* end = nullptr;
      const double outside = std::strtod(note.c_str(), &end);
      if (*end != '\0' || !std::isfinite(outside))
        itk_detail::refuse_volume(path.string(), "its note on the density outside is no number: '" + note + "'");
      options.outside = outside;
    }
  }
  return read_volume_as<Density>(path, options);
}

}  // namespace trephine
