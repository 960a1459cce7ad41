// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/adapter/itk.hpp>
#include <trephine/adapter/stored_image.hpp>
#include <trephine/adapter/volume_bytes.hpp>
#include <trephine/adapter/volume_text.hpp>
#include <trephine/voxel/grid_reader.hpp>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <fstream>
#include <map>
#include <span>
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

template <class Pixel>
constexpr Number number_type() noexcept {
  if constexpr (std::is_same_v<Pixel, std::uint8_t>) return Number::kU8;
  if constexpr (std::is_same_v<Pixel, std::int8_t>) return Number::kI8;
  if constexpr (std::is_same_v<Pixel, std::uint16_t>) return Number::kU16;
  if constexpr (std::is_same_v<Pixel, std::int16_t>) return Number::kI16;
  return Number::kF32;
}

/// An image to be written: geometry, texts and voxels.
struct ImageToSave {
  std::array<int, 3> size{};
  Vec3d spacing = Vec3d::Ones();  // m
  Posed X_WG = Posed::Identity();
  Number type = Number::kU8;
  std::span<const std::byte> bytes{};
  bool compressed = false;
  std::map<std::string, std::string> notes{};
};

/// Throws VolumeError for other endings than .nrrd and .mha.
inline void check_ending(const std::filesystem::path& path) {
  if (path.extension() != ".nrrd" && path.extension() != ".mha")
    refuse_saving(path, "the name must end in .nrrd or .mha");
}

/// Returns v with 17 digits, which restore it bit by bit.
inline std::string to_exact_text(double v) {
  Text text;
  text.precision(17);
  text << v;
  return text.str();
}

/// Returns three numbers with a separator.
inline std::string to_exact_text(const Vec3d& v, const std::string& separator) {
  return to_exact_text(v.x()) + separator + to_exact_text(v.y()) + separator + to_exact_text(v.z());
}

inline std::string nrrd_text(const ImageToSave& image) {
  constexpr std::array<const char*, 10> kTypes{"uint8", "int8",   "uint16", "int16", "uint32",
                                               "int32", "uint64", "int64",  "float", "double"};
  const auto vector = [](const Vec3d& v) { return "(" + to_exact_text(v, ",") + ")"; };
  std::string directions;
  for (int a = 0; a < 3; ++a) directions += " " + vector(1e3 * image.spacing[a] * Vec3d(image.X_WG.linear().col(a)));
  std::string text = "NRRD0004\n# http://teem.sourceforge.net/nrrd/format.html\ntype: ";
  text += kTypes[static_cast<std::size_t>(image.type)];
  text += "\ndimension: 3\nspace: left-posterior-superior\nsizes:";
  for (const int n : image.size) text += " " + std::to_string(n);
  text += "\nspace directions:" + directions + "\nkinds: domain domain domain\nendian: ";
  text += std::endian::native == std::endian::big ? "big" : "little";
  text += "\nencoding: " + std::string(image.compressed ? "gzip" : "raw");
  text += "\nspace origin: " + vector(1e3 * image.X_WG.translation()) + "\n";
  for (const auto& [key, value] : image.notes) {
    text += key + ":=";
    for (const char c : value) text += c == '\n' ? "\\n" : c == '\\' ? "\\\\" : std::string(1, c);
    text += "\n";
  }
  return text + "\n";
}

inline std::string meta_text(const ImageToSave& image, std::size_t packed_bytes) {
  constexpr std::array<const char*, 10> kTypes{"MET_UCHAR", "MET_CHAR",  "MET_USHORT",     "MET_SHORT",
                                               "MET_UINT",  "MET_INT",   "MET_ULONG_LONG", "MET_LONG_LONG",
                                               "MET_FLOAT", "MET_DOUBLE"};
  std::string text = "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = ";
  text += std::endian::native == std::endian::big ? "True" : "False";
  text += "\nCompressedData = " + std::string(image.compressed ? "True" : "False");
  if (image.compressed) text += "\nCompressedDataSize = " + std::to_string(packed_bytes);
  text += "\nTransformMatrix =";
  for (int a = 0; a < 3; ++a) text += " " + to_exact_text(image.X_WG.linear().col(a), " ");
  text += "\nOffset = " + to_exact_text(1e3 * image.X_WG.translation(), " ");
  text += "\nCenterOfRotation = 0 0 0\nElementSpacing = " + to_exact_text(1e3 * image.spacing, " ") + "\nDimSize =";
  for (const int n : image.size) text += " " + std::to_string(n);
  text += "\n";
  for (const auto& [key, value] : image.notes) text += key + " = " + value + "\n";
  return text + "ElementType = " + kTypes[static_cast<std::size_t>(image.type)] + "\nElementDataFile = LOCAL\n";
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

/// Returns true if the header of a file says the same as `image`, and its voxels' bytes are all there.
inline bool has_header_of(const std::filesystem::path& file, const ImageToSave& image) {
  constexpr double kSame = 1e-9;  // m; text of 17 digits rounds far below
  const StoredImage read = open_image(file.string());
  const auto rigid = to_rigid(geometry_of(read), {}, file.string()).grid;
  return rigid.size == image.size && read.type == image.type && (rigid.spacing - image.spacing).norm() < kSame &&
         (rigid.X_WG.matrix() - image.X_WG.matrix()).norm() < kSame + 1e-3 * kSame * image.X_WG.translation().norm();
}

/// Writes an image to a temporary file, and replaces `path` by it if its header reads back and `is_complete(file)` is
/// true.
template <class IsComplete>
void write_and_replace(const std::filesystem::path& path, const ImageToSave& image, IsComplete&& is_complete) {
  check_folder(path);
  const bool nrrd = path.extension() == ".nrrd";
  std::vector<std::byte> packed;
  if (image.compressed) packed = deflated(image.bytes.data(), image.bytes.size(), nrrd);
  const std::span<const std::byte> bytes = image.compressed ? std::span<const std::byte>(packed) : image.bytes;
  TemporaryFile temporary(path);
  {
    std::ofstream out(temporary.file(), std::ios::binary);
    const std::string header = nrrd ? nrrd_text(image) : meta_text(image, bytes.size());
    out.write(header.data(), static_cast<std::streamsize>(header.size()));
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    out.close();
    if (!out) refuse_saving(path, "cannot be written in full (is the disk full, the folder write-protected?)");
  }
  bool whole = false;
  try {
    whole = has_header_of(temporary.file(), image) && is_complete(temporary.file());
  } catch (const std::exception&) {
    whole = false;
  }
  if (!whole) refuse_saving(path, "cannot be written: it does not read back as it was written");
  temporary.replace_target();
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
  itk_detail::check_ending(path);
  if (n[2] < 2) refuse_saving(path, "a single slice is no volume");
  if (!X_WG.matrix().allFinite()) refuse_saving(path, "the bone's pose is not finite");
  itk_detail::check_folder(path);

  std::vector<Density> voxels;
  voxels.reserve(static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(n[2]));
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) voxels.push_back(bone.voxel(i, j, k));

  const auto outside = static_cast<double>(bone.voxel(-1, -1, -1));
  const itk_detail::ImageToSave image{.size = n,
                                      .spacing = bone.spacing(),
                                      .X_WG = X_WG,
                                      .type = itk_detail::number_type<Density>(),
                                      .bytes = std::as_bytes(std::span<const Density>(voxels)),
                                      .notes = {{itk_detail::kOutsideKey, itk_detail::to_exact_text(outside)}}};
  itk_detail::write_and_replace(path, image, [&image](const std::filesystem::path& file) {
    const auto read = itk_detail::open_image(file.string());
    std::error_code error;
    return std::filesystem::file_size(file, error) == read.voxels.offset + image.bytes.size() &&
           read.notes.at(itk_detail::kOutsideKey) == image.notes.at(itk_detail::kOutsideKey);
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
  if (std::filesystem::is_regular_file(path) && !options.outside) {
    const auto image = itk_detail::find_image(path.string());
    const auto note = image ? image->notes.find(itk_detail::kOutsideKey) : decltype(image->notes.end()){};
    if (image && note != image->notes.end()) {
      options.outside = itk_detail::number_of(note->second);
      if (!options.outside)
        itk_detail::refuse_volume(path.string(), "its saved density outside is no number: '" + note->second + "'");
    }
  }
  return read_volume_as<Density>(path, options);
}

}  // namespace trephine
