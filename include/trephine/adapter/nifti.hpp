// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/adapter/itk_image.hpp>
#include <trephine/adapter/stored_image.hpp>
#include <trephine/adapter/volume_bytes.hpp>
#include <trephine/adapter/volume_text.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

/// Reads headers of NIfTI files, versions 1 and 2 (https://nifti.nimh.nih.gov), of either byte order.
namespace trephine::inline TREPHINE_ALIGNED::itk_detail {

/// Where a version keeps its numbers.
struct NiftiLayout {
  std::size_t dim, datatype, pixdim, vox_offset, scl_slope, qform_code, quatern_b, srow_x, units;
};
inline constexpr std::array<NiftiLayout, 2> kNiftiLayouts{
    {{40, 70, 76, 108, 112, 252, 256, 280, 123}, {16, 12, 104, 168, 176, 344, 352, 400, 500}}};
inline constexpr std::size_t kNiftiHeader = 540;  // the longer one's bytes

/// A header's bytes, and how to read them.
struct NiftiHeader {
  std::string bytes;
  bool second = false;  // version 2
  bool big_endian = false;
  bool pair = false;  // the voxels are in an .img file

  [[nodiscard]] const NiftiLayout& at() const noexcept { return kNiftiLayouts[second ? 1 : 0]; }
  template <class T>
  [[nodiscard]] T raw(std::size_t offset) const {
    return from_bytes<T>(bytes.data() + offset, big_endian);
  }
  /// Returns the number i of a list of reals: float in version 1, double in version 2.
  [[nodiscard]] double real(std::size_t offset, std::size_t i = 0) const {
    return second ? raw<double>(offset + 8 * i) : static_cast<double>(raw<float>(offset + 4 * i));
  }
  [[nodiscard]] std::int64_t dim(std::size_t i) const {
    return second ? raw<std::int64_t>(at().dim + 8 * i) : raw<std::int16_t>(at().dim + 2 * i);
  }
  [[nodiscard]] std::int32_t code(std::size_t offset, std::size_t i = 0) const {
    return second ? raw<std::int32_t>(offset + 4 * i) : raw<std::int16_t>(offset + 2 * i);
  }
};

/// Returns the header whose bytes these are, or nothing.
inline std::optional<NiftiHeader> nifti_header(const std::string& bytes) {
  if (bytes.size() < 348) return std::nullopt;
  for (const bool big : {false, true}) {
    NiftiHeader h{.bytes = bytes, .big_endian = big};
    h.bytes.resize(kNiftiHeader);
    const auto length = h.raw<std::int32_t>(0);
    h.second = length == 540;
    const std::string mark = bytes.substr(h.second ? 4 : 344, 3);
    const std::string version = h.second ? "2" : "1";
    if (length != 348 && !(h.second && bytes.size() >= kNiftiHeader)) continue;
    h.pair = mark == "ni" + version;
    if (h.pair || mark == "n+" + version) return h;
  }
  return std::nullopt;
}

/// Returns true for the older format of the same length that has no orientation.
inline bool is_analyze(const std::string& bytes, const std::filesystem::path& file) {
  const std::string ending = lower_case(file.extension().string());
  if (bytes.size() < 348 || (ending != ".hdr" && ending != ".img")) return false;
  return from_bytes<std::int32_t>(bytes.data(), false) == 348 || from_bytes<std::int32_t>(bytes.data(), true) == 348;
}

inline std::optional<Number> nifti_type(std::int32_t code) {
  constexpr std::array<std::pair<int, Number>, 10> kTypes{{{2, Number::kU8},
                                                           {256, Number::kI8},
                                                           {512, Number::kU16},
                                                           {4, Number::kI16},
                                                           {768, Number::kU32},
                                                           {8, Number::kI32},
                                                           {1280, Number::kU64},
                                                           {1024, Number::kI64},
                                                           {16, Number::kF32},
                                                           {64, Number::kF64}}};
  for (const auto& [value, type] : kTypes)
    if (code == value) return type;
  return std::nullopt;
}

/// Sets the geometry from the sform, else the qform, else the spacing alone: of two that disagree the sform is the one
/// that programs keep up to date, and the only one that holds a tilted gantry's shear, which is refused later on.
inline void set_nifti_geometry(const NiftiHeader& h, ImageGeometry& geometry) {
  const NiftiLayout& at = h.at();
  const auto code = [&h, &at](std::size_t i) { return h.code(at.qform_code, i); };
  Mat3d steps = Mat3d::Zero();
  Vec3d origin = Vec3d::Zero();
  const Vec3d spacing(h.real(at.pixdim, 1), h.real(at.pixdim, 2), h.real(at.pixdim, 3));
  if (code(1) > 0) {
    for (std::size_t row = 0; row < 3; ++row) {
      const auto r = static_cast<int>(row);
      for (std::size_t a = 0; a < 3; ++a) steps(r, static_cast<int>(a)) = h.real(at.srow_x, 4 * row + a);
      origin[r] = h.real(at.srow_x, 4 * row + 3);
    }
  } else {
    Mat3d axes = Vec3d(-1, -1, 1).asDiagonal();  // no transform: as ITK has it, along the patient's axes
    if (code(0) > 0) {
      const Vec3d v(h.real(at.quatern_b, 0), h.real(at.quatern_b, 1), h.real(at.quatern_b, 2));
      const double w = std::sqrt(std::max(0.0, 1 - v.squaredNorm()));
      axes = Eigen::Quaterniond(w, v.x(), v.y(), v.z()).normalized().toRotationMatrix();
      if (h.real(at.pixdim, 0) < 0) axes.col(2) = -axes.col(2);
      origin << h.real(at.quatern_b, 3), h.real(at.quatern_b, 4), h.real(at.quatern_b, 5);
    }
    steps = axes * spacing.cwiseAbs().asDiagonal();
  }
  constexpr int kUnitsOfLength = 7;
  const int unit = (h.second ? h.raw<std::int32_t>(at.units) : h.bytes[at.units]) & kUnitsOfLength;
  const double mm = unit == 1 ? 1e3 : unit == 3 ? 1e-3 : 1;
  const Vec3d to_lps(-mm, -mm, mm);  // from axes to the right, front and head
  geometry.origin_mm = to_lps.cwiseProduct(origin);
  set_axes(geometry, to_lps.asDiagonal() * steps);
}

/// Returns the file of the voxels that belongs to a header's, .img or .img.gz beside .hdr.
inline std::filesystem::path nifti_voxels(const std::filesystem::path& file) {
  namespace fs = std::filesystem;
  fs::path plain = lower_case(file.extension().string()) == ".gz" ? file.parent_path() / file.stem() : file;
  plain.replace_extension(".img");
  const fs::path packed = plain.string() + ".gz";
  std::error_code error;
  return !fs::exists(plain, error) && fs::exists(packed, error) ? packed : plain;
}

inline StoredImage open_nifti(const std::string& file, const NiftiHeader& h) {
  const NiftiLayout& at = h.at();
  StoredImage image{.where = file};
  const std::int64_t dimensions = h.dim(0);
  if (dimensions < 1 || dimensions > 7) refuse_volume(file, "its header's sizes are wrong; fetch it again");
  for (std::size_t a = 1; a <= static_cast<std::size_t>(dimensions); ++a)
    image.size.push_back(h.dim(a) > 0 ? static_cast<std::uint64_t>(h.dim(a)) : a > 3 ? 1 : 0);
  check_sizes(image);
  set_nifti_geometry(h, image.geometry);
  const std::int32_t code = h.second ? h.raw<std::int16_t>(at.datatype) : h.code(at.datatype);
  const auto type = nifti_type(code);
  if (!type) refuse_volume(file, "its voxels are no plain numbers (datatype " + std::to_string(code) + ")");
  image.type = *type;
  image.big_endian = h.big_endian;
  const double slope = h.real(at.scl_slope, 0);
  if (slope != 0 && std::isfinite(slope)) {
    image.slope = slope;
    image.intercept = h.real(at.scl_slope, 1);
    if (!std::isfinite(image.intercept)) refuse_volume(file, "its header's intercept is no number; mend it");
  }
  const double offset = h.second ? static_cast<double>(h.raw<std::int64_t>(at.vox_offset)) : h.real(at.vox_offset, 0);
  const double header = h.pair ? 0 : h.second ? 544 : 352;
  if (!(offset < 1e15) || (offset > 0 && offset < header && !h.pair))
    refuse_volume(file, "its header's offset of the voxels is wrong; fetch it again");
  image.voxels.file = h.pair ? nifti_voxels(file) : std::filesystem::path(file);
  (is_gzip(image.voxels.file) ? image.voxels.skip : image.voxels.offset) =
      static_cast<std::uint64_t>(std::max(offset, header));
  if (is_gzip(image.voxels.file)) image.voxels.packing = Packing::kGzip;
  return image;
}

}  // namespace trephine::itk_detail
