// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/adapter/itk_image.hpp>
#include <trephine/adapter/volume_bytes.hpp>
#include <trephine/adapter/volume_text.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <limits>
#include <locale>
#include <map>
#include <string>
#include <type_traits>
#include <vector>

/// An image in a file of one of the plain formats (NRRD, NIfTI, MetaImage), as its header describes it.
namespace trephine::inline TREPHINE_ALIGNED::itk_detail {

/// Types of stored numbers.
enum class Number : std::uint8_t { kU8, kI8, kU16, kI16, kU32, kI32, kU64, kI64, kF32, kF64 };

/// Calls f with a number of the type and returns its result.
template <class F>
decltype(auto) with_number(Number type, F&& f) {
  switch (type) {
    case Number::kU8:
      return f(std::uint8_t{});
    case Number::kI8:
      return f(std::int8_t{});
    case Number::kU16:
      return f(std::uint16_t{});
    case Number::kI16:
      return f(std::int16_t{});
    case Number::kU32:
      return f(std::uint32_t{});
    case Number::kI32:
      return f(std::int32_t{});
    case Number::kU64:
      return f(std::uint64_t{});
    case Number::kI64:
      return f(std::int64_t{});
    case Number::kF32:
      return f(float{});
    default:
      return f(double{});
  }
}

inline std::size_t width_of(Number type) {
  return with_number(type, [](auto v) { return sizeof(v); });
}

struct StoredImage {
  std::string where;                  // path, for messages
  std::vector<std::uint64_t> size{};  // of each axis; the first three are space's
  std::uint64_t numbers = 1;          // per voxel, side by side
  ImageGeometry geometry{};           // without its size until `check_sizes`
  Number type = Number::kU8;
  bool big_endian = false;
  bool as_text = false;  // numbers are decimal text
  double slope = 1;      // density = slope * number + intercept
  double intercept = 0;
  VoxelBytes voxels{};
  std::map<std::string, std::string> notes{};  // texts by key that the format has no meaning for

  [[nodiscard]] std::uint64_t voxel_count() const { return size[0] * size[1] * size[2]; }
  /// Returns the number of volumes, one after the other.
  [[nodiscard]] std::uint64_t volumes() const {
    std::uint64_t n = 1;
    for (std::size_t a = 3; a < size.size(); ++a) n *= size[a];
    return n;
  }
};

/// Completes the sizes to three axes. Throws VolumeError for sizes that no file has.
inline void check_sizes(StoredImage& image) {
  constexpr std::uint64_t kMaxNumbers = std::uint64_t{1} << 48;
  if (image.size.empty()) refuse_volume(image.where, "its header tells no size");
  std::uint64_t all = image.numbers;
  for (const std::uint64_t n : image.size) {
    if (n < 1) refuse_volume(image.where, "has no voxels");
    if (n > static_cast<std::uint64_t>(kMaxGridSize))
      refuse_volume(image.where, "is larger than 2^20 voxels along an axis");
    all = all > kMaxNumbers ? all : all * n;
  }
  if (all > kMaxNumbers || all < 1) refuse_volume(image.where, "its header's sizes are wrong");
}

/// Sets the first three axes from their vectors, each from a voxel to the next.
inline void set_axes(ImageGeometry& geometry, const Mat3d& steps_mm) {
  if (!(steps_mm.colwise().norm().minCoeff() > 0)) {
    geometry.no_spacing = "its header tells no spacing of the voxels";
    return;
  }
  for (int a = 0; a < 3; ++a) {
    geometry.spacing_mm[a] = steps_mm.col(a).norm();
    geometry.direction.col(a) = steps_mm.col(a) / geometry.spacing_mm[a];
  }
}

/// Reads numbers of decimal text into the bytes of their type.
inline std::vector<std::byte> read_text_numbers(const StoredImage& image, std::size_t count) {
  std::ifstream in(image.voxels.file, std::ios::binary);
  if (!in) refuse_volume(image.where, "its voxels cannot be read: there is no file " + image.voxels.file.string());
  in.seekg(static_cast<std::streamoff>(image.voxels.offset + image.voxels.skip));
  in.imbue(std::locale::classic());
  std::vector<std::byte> bytes;
  for (std::size_t i = 0; i < count; ++i) {
    double v = 0;
    if (!(in >> v)) refuse_cut(image.where);
    while (in.peek() == ',') in.get();
    with_number(image.type, [&bytes, v]<class Pixel>(Pixel) {
      constexpr Pixel kLowest = std::numeric_limits<Pixel>::lowest();
      constexpr Pixel kHighest = std::numeric_limits<Pixel>::max();
      const Pixel n = v <= static_cast<double>(kLowest)    ? kLowest
                      : v >= static_cast<double>(kHighest) ? kHighest
                                                           : static_cast<Pixel>(v);
      const auto* const from = reinterpret_cast<const std::byte*>(&n);
      bytes.insert(bytes.end(), from, from + sizeof(Pixel));
    });
  }
  if (!(in >> std::ws).eof()) refuse_surplus(image.where);
  return bytes;
}

/// Calls `visit(const Pixel*, count)` with densities: stored numbers themselves, or scaled. Whole numbers stay whole if
/// slope and intercept are.
template <class Stored, class Visit>
void visit_scaled(const Stored* numbers, std::size_t count, double slope, double intercept, Visit&& visit) {
  if (slope == 1 && intercept == 0) return visit(numbers, count);
  constexpr double kLargest = 1 << 14;  // so that a product of 16 bits and a sum fit 32 bits
  const auto scale = [&]<class Scaled>(Scaled) {
    std::vector<Scaled> densities(count);
    for (std::size_t i = 0; i < count; ++i)
      densities[i] = static_cast<Scaled>(slope * static_cast<double>(numbers[i]) + intercept);
    visit(static_cast<const Scaled*>(densities.data()), count);
  };
  if (std::is_integral_v<Stored> && sizeof(Stored) <= 2 && slope == std::trunc(slope) && std::abs(slope) <= kLargest &&
      intercept == std::trunc(intercept) && std::abs(intercept) <= std::numeric_limits<std::int32_t>::max() / 2)
    scale(std::int32_t{});
  else
    scale(double{});
}

/// Reads an image's voxels and calls `visit(const Pixel*, count)` with their densities.
template <class Visit>
void read_voxels(const StoredImage& image, Visit&& visit) {
  const std::uint64_t count = image.voxel_count() * image.volumes() * image.numbers;
  const std::size_t width = width_of(image.type);
  std::vector<std::byte> bytes = image.as_text ? read_text_numbers(image, static_cast<std::size_t>(count))
                                               : read_bytes(image.voxels, count * width, image.where);
  if (!image.as_text) to_native_order(bytes, width, image.big_endian);
  with_number(image.type, [&]<class Pixel>(Pixel) {
    visit_scaled(reinterpret_cast<const Pixel*>(bytes.data()), static_cast<std::size_t>(count), image.slope,
                 image.intercept, visit);
  });
}

}  // namespace trephine::itk_detail
