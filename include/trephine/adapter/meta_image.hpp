// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/adapter/itk_image.hpp>
#include <trephine/adapter/stored_image.hpp>
#include <trephine/adapter/volume_bytes.hpp>
#include <trephine/adapter/volume_text.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

/// Reads headers of MetaImage files (.mha, and .mhd with a file of voxels).
namespace trephine::inline TREPHINE_ALIGNED::itk_detail {

inline bool is_meta_image(const std::filesystem::path& file, const std::string& first_bytes) {
  const std::string ending = lower_case(file.extension().string());
  return (ending == ".mha" || ending == ".mhd") && first_bytes.find("NDims") != std::string::npos;
}

/// A header's lines, "key = value".
struct MetaHeader {
  std::string where;
  std::map<std::string, std::string> lines{};
  std::uint64_t length = 0;

  /// Returns the value of the first of these keys that the header has, or "".
  [[nodiscard]] std::string value(const std::vector<std::string>& keys) const {
    for (const std::string& key : keys)
      if (const auto found = lines.find(key); found != lines.end()) return found->second;
    return "";
  }
  [[nodiscard]] bool is_true(const std::vector<std::string>& keys) const {
    const std::string v = lower_case(value(keys));
    return v == "true" || v == "1";
  }
  /// Returns `count` numbers of the first of these keys; nothing if the header has none of them.
  [[nodiscard]] std::optional<std::vector<double>> numbers(const std::vector<std::string>& keys,
                                                           std::size_t count) const {
    const std::string text = value(keys);
    if (text.empty()) return std::nullopt;
    auto v = numbers_of(text);
    if (!v || v->size() < count)
      refuse_volume(where, "its header cannot be read: '" + keys[0] + " = " + text + "'; mend it or save it again");
    return v;
  }
};

inline MetaHeader read_meta_header(const std::string& file) {
  MetaHeader header{.where = file};
  std::ifstream in(file, std::ios::binary);
  std::string line;
  while (std::getline(in, line)) {
    header.length += line.size() + 1;
    const auto equals = line.find('=');
    const std::string key = trimmed(line.substr(0, equals));
    if (key.empty()) continue;
    if (equals == std::string::npos)
      refuse_volume(file,
                    "its header cannot be read: '" + key.substr(0, 40) + "' has no '='; mend it or save it again");
    header.lines[key] = trimmed(line.substr(equals + 1));
    if (key == "ElementDataFile") return header;
  }
  refuse_volume(file, "its header tells no ElementDataFile; fetch it again");
}

inline std::optional<Number> meta_type(const std::string& name) {
  constexpr std::array<std::pair<const char*, Number>, 12> kTypes{{{"MET_UCHAR", Number::kU8},
                                                                   {"MET_CHAR", Number::kI8},
                                                                   {"MET_USHORT", Number::kU16},
                                                                   {"MET_SHORT", Number::kI16},
                                                                   {"MET_UINT", Number::kU32},
                                                                   {"MET_INT", Number::kI32},
                                                                   {"MET_ULONG", Number::kU32},
                                                                   {"MET_LONG", Number::kI32},
                                                                   {"MET_ULONG_LONG", Number::kU64},
                                                                   {"MET_LONG_LONG", Number::kI64},
                                                                   {"MET_FLOAT", Number::kF32},
                                                                   {"MET_DOUBLE", Number::kF64}}};
  for (const auto& [text, type] : kTypes)
    if (name == text) return type;
  return std::nullopt;
}

inline void set_meta_geometry(const MetaHeader& header, std::size_t dimensions, ImageGeometry& geometry) {
  const auto spacing = header.numbers({"ElementSpacing", "ElementSize"}, dimensions);
  const auto origin = header.numbers({"Offset", "Position", "Origin"}, dimensions);
  const auto axes = header.numbers({"TransformMatrix", "Rotation", "Orientation"}, dimensions * dimensions);
  const std::string unit = header.value({"DistanceUnits"});
  const auto mm = millimetres_of(unit);
  if (!spacing)
    geometry.no_spacing = "its header tells no spacing of the voxels (ElementSpacing)";
  else if (!mm)
    geometry.no_spacing = "its unit of length '" + unit + "' is unknown";
  for (std::size_t a = 0; a < 3; ++a) {
    const auto i = static_cast<int>(a);
    if (spacing) geometry.spacing_mm[i] = (*spacing)[a] * mm.value_or(1);
    if (origin) geometry.origin_mm[i] = (*origin)[a] * mm.value_or(1);
    for (std::size_t b = 0; axes && b < 3; ++b)
      geometry.direction(static_cast<int>(b), i) = (*axes)[a * dimensions + b];
  }
}

inline StoredImage open_meta_image(const std::string& file) {
  namespace fs = std::filesystem;
  const MetaHeader header = read_meta_header(file);
  StoredImage image{.where = file};
  image.notes = header.lines;
  const auto sizes = header.numbers({"DimSize"}, 1);
  for (const double n : sizes.value_or(std::vector<double>{}))
    image.size.push_back(n >= 1 && n < 1e15 ? static_cast<std::uint64_t>(n) : 0);
  check_sizes(image);
  if (image.size.size() >= 3) set_meta_geometry(header, image.size.size(), image.geometry);
  if (const auto n = header.numbers({"ElementNumberOfChannels"}, 1))
    image.numbers = (*n)[0] >= 1 && (*n)[0] < 1e6 ? static_cast<std::uint64_t>((*n)[0]) : 0;
  check_sizes(image);

  const auto type = meta_type(header.value({"ElementType"}));
  if (!type) refuse_volume(file, "its voxels are no plain numbers but '" + header.value({"ElementType"}) + "'");
  image.type = *type;
  image.big_endian = header.is_true({"BinaryDataByteOrderMSB", "ElementByteOrderMSB"});
  image.as_text = !header.value({"BinaryData"}).empty() && !header.is_true({"BinaryData"});
  if (const auto v = header.numbers({"ElementToIntensityFunctionSlope"}, 1); v && (*v)[0] != 0) image.slope = (*v)[0];
  if (const auto v = header.numbers({"ElementToIntensityFunctionOffset"}, 1)) image.intercept = (*v)[0];
  if (header.is_true({"CompressedData"})) image.voxels.packing = Packing::kGzip;

  const std::string data = header.value({"ElementDataFile"});
  image.voxels.file = file;
  image.voxels.offset = header.length;
  if (lower_case(data) != "local") {
    if (data.find('%') != std::string::npos || data.starts_with("LIST"))
      refuse_volume(file, "keeps its voxels in several files; store it in one");
    image.voxels.file = fs::path(file).parent_path() / data;
    image.voxels.offset = 0;
  }
  if (const auto skip = header.numbers({"HeaderSize"}, 1)) {
    image.voxels.at_end = (*skip)[0] < 0;
    image.voxels.skip = (*skip)[0] > 0 ? static_cast<std::uint64_t>((*skip)[0]) : 0;
  }
  // The header's count of compressed bytes tells a file that was cut short before it is read, and bytes that follow.
  std::error_code error;
  const auto packed = header.numbers({"CompressedDataSize"}, 1);
  if (image.voxels.packing != Packing::kNone && packed && (*packed)[0] > 0) {
    const auto length = static_cast<double>(fs::file_size(image.voxels.file, error));
    if (!error && length < static_cast<double>(image.voxels.offset) + (*packed)[0]) refuse_cut(file);
  }
  return image;
}

}  // namespace trephine::itk_detail
