// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/adapter/itk_image.hpp>
#include <trephine/adapter/stored_image.hpp>
#include <trephine/adapter/volume_bytes.hpp>
#include <trephine/adapter/volume_text.hpp>

#include <algorithm>
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

/// Reads headers of NRRD files (https://teem.sourceforge.net/nrrd/format.html), attached and detached.
namespace trephine::inline TREPHINE_ALIGNED::itk_detail {

inline bool is_nrrd(const std::string& first_bytes) { return first_bytes.starts_with("NRRD0"); }

/// Fields of a header by name, in lower case without spaces, and its other key/value pairs.
struct NrrdHeader {
  std::string where;
  std::map<std::string, std::string> fields{};
  std::map<std::string, std::string> notes{};
  std::uint64_t length = 0;

  [[nodiscard]] std::string field(const std::string& name, const std::string& other_name = "") const {
    for (const std::string& n : {name, other_name})
      if (const auto found = fields.find(n); found != fields.end()) return found->second;
    return "";
  }
  [[noreturn]] void refuse(const std::string& name) const {
    refuse_volume(where, "its header cannot be read: '" + name + ": " + field(name) + "'; mend it or save it again");
  }
};

inline NrrdHeader read_nrrd_header(const std::string& file) {
  NrrdHeader header{.where = file};
  std::ifstream in(file, std::ios::binary);
  std::string line;
  while (std::getline(in, line)) {
    header.length += line.size() + 1;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty()) break;
    const auto colon = line.find(':');
    if (line[0] == '#' || colon == std::string::npos) continue;
    if (line.compare(colon, 2, ":=") == 0) {
      header.notes[line.substr(0, colon)] = line.substr(colon + 2);
      continue;
    }
    std::string name = lower_case(line.substr(0, colon));
    name.erase(std::remove(name.begin(), name.end(), ' '), name.end());
    header.fields[name] = trimmed(line.substr(colon + 1));
    if (name == "datafile" && header.fields[name].starts_with("LIST")) break;
  }
  // Escapes of key/value pairs.
  for (auto& [key, text] : header.notes)
    for (std::size_t at = text.find('\\'); at != std::string::npos && at + 1 < text.size();
         at = text.find('\\', at + 1))
      if (text[at + 1] == 'n' || text[at + 1] == '\\') text.replace(at, 2, text[at + 1] == 'n' ? "\n" : "\\");
  return header;
}

inline std::optional<Number> nrrd_type(const std::string& name) {
  const std::array<std::pair<Number, std::vector<const char*>>, 10> types{{
      {Number::kU8, {"uchar", "unsigned char", "uint8", "uint8_t"}},
      {Number::kI8, {"signed char", "int8", "int8_t"}},
      {Number::kU16, {"ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"}},
      {Number::kI16, {"short", "short int", "signed short", "signed short int", "int16", "int16_t"}},
      {Number::kU32, {"uint", "unsigned int", "uint32", "uint32_t"}},
      {Number::kI32, {"int", "signed int", "int32", "int32_t"}},
      {Number::kU64, {"ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"}},
      {Number::kI64,
       {"longlong", "long long", "long long int", "signed long long", "signed long long int", "int64", "int64_t"}},
      {Number::kF32, {"float"}},
      {Number::kF64, {"double"}},
  }};
  for (const auto& [type, names] : types)
    if (std::find(names.begin(), names.end(), name) != names.end()) return type;
  return std::nullopt;
}

/// Returns vectors in brackets, "(1,0,0) (0,1,0) none"; an empty one for other words.
inline std::vector<std::vector<double>> nrrd_vectors(const NrrdHeader& header, const std::string& name) {
  const std::string text = header.field(name);
  std::vector<std::vector<double>> vectors;
  for (std::size_t at = 0; at < text.size();) {
    if (text[at] == ' ' || text[at] == '\t') {
      ++at;
      continue;
    }
    const bool brackets = text[at] == '(';
    const std::size_t end = std::min(text.find(brackets ? ')' : ' ', at), text.size());
    vectors.emplace_back();
    if (brackets) {
      const auto numbers = numbers_of(text.substr(at + 1, end - at - 1), ",");
      if (!numbers || numbers->size() != 3 || end == text.size()) header.refuse(name);
      vectors.back() = *numbers;
    }
    at = end + 1;
  }
  return vectors;
}

/// Returns texts in quotation marks.
inline std::vector<std::string> nrrd_quoted(const std::string& text) {
  std::vector<std::string> texts;
  for (std::size_t at = text.find('"'); at != std::string::npos;) {
    const std::size_t end = std::min(text.find('"', at + 1), text.size());
    texts.push_back(text.substr(at + 1, end - at - 1));
    at = text.find('"', end + 1);
  }
  return texts;
}

/// Returns the factors from the header's axes of space to millimetres to the left, back and head. Spaces that are no
/// patient's are taken as they are.
inline Vec3d nrrd_space(const NrrdHeader& header, ImageGeometry& geometry) {
  std::string space = lower_case(header.field("space"));
  const std::map<std::string, std::string> long_names{
      {"lps", "left-posterior-superior"}, {"ras", "right-anterior-superior"}, {"las", "left-anterior-superior"}};
  if (const auto found = long_names.find(space); found != long_names.end()) space = found->second;
  Vec3d to_lps = Vec3d::Ones();
  if (space.starts_with("right-")) to_lps.x() = -1;
  if (space.find("-anterior-") != std::string::npos) to_lps.y() = -1;
  if (space.find("-inferior") != std::string::npos) to_lps.z() = -1;
  const auto units = nrrd_quoted(header.field("spaceunits"));
  for (std::size_t a = 0; a < std::min<std::size_t>(units.size(), 3); ++a) {
    const auto mm = millimetres_of(units[a]);
    if (!mm) geometry.no_spacing = "its unit of length '" + units[a] + "' is unknown";
    to_lps[static_cast<int>(a)] *= mm.value_or(1);
  }
  return to_lps;
}

/// Sets axes, spacing and origin. `axes` are the file's numbers of the first three axes of space.
inline void set_nrrd_geometry(const NrrdHeader& header, const std::vector<std::size_t>& axes, ImageGeometry& geometry) {
  if (axes.size() < 3) return;
  const auto directions = nrrd_vectors(header, "spacedirections");
  if (!directions.empty()) {
    const Vec3d to_lps = nrrd_space(header, geometry);
    Mat3d steps;
    for (int a = 0; a < 3; ++a) {
      const std::size_t axis = axes[static_cast<std::size_t>(a)];
      if (axis >= directions.size() || directions[axis].empty()) header.refuse("spacedirections");
      steps.col(a) = to_lps.cwiseProduct(Eigen::Map<const Vec3d>(directions[axis].data()));
    }
    set_axes(geometry, steps);
    const auto origins = nrrd_vectors(header, "spaceorigin");
    if (!origins.empty() && !origins[0].empty())
      geometry.origin_mm = to_lps.cwiseProduct(Eigen::Map<const Vec3d>(origins[0].data()));
    return;
  }
  const auto spacings = words_of(header.field("spacings"));
  const auto minima = words_of(header.field("axismins", "axis mins"));
  const auto centers = words_of(lower_case(header.field("centers", "centerings")));
  const auto units = nrrd_quoted(header.field("units"));
  for (int a = 0; a < 3; ++a) {
    const std::size_t axis = axes[static_cast<std::size_t>(a)];
    const auto spacing = axis < spacings.size() ? number_of(spacings[axis]) : std::nullopt;
    if (!spacing) {
      geometry.no_spacing = "its header tells no spacing of the voxels";
      return;
    }
    const auto mm = millimetres_of(axis < units.size() ? units[axis] : "");
    if (!mm) geometry.no_spacing = "its unit of length '" + units[axis] + "' is unknown";
    geometry.spacing_mm[a] = *spacing * mm.value_or(1);
    const auto minimum = axis < minima.size() ? number_of(minima[axis]) : std::nullopt;
    const bool at_nodes = axis < centers.size() && centers[axis] == "node";
    if (minimum) geometry.origin_mm[a] = mm.value_or(1) * (*minimum + (at_nodes ? 0 : 0.5) * *spacing);
  }
}

/// Sets sizes and geometry. Numbers of one voxel lie along an axis that is none of space or time, the first or the
/// last.
inline void set_nrrd_axes(const NrrdHeader& header, StoredImage& image) {
  const auto sizes = numbers_of(header.field("sizes"));
  if (!sizes || sizes->empty()) header.refuse("sizes");
  const auto kinds = words_of(lower_case(header.field("kinds")));
  const auto directions = nrrd_vectors(header, "spacedirections");
  std::vector<std::size_t> axes;
  for (std::size_t a = 0; a < sizes->size(); ++a) {
    if (!((*sizes)[a] >= 1 && (*sizes)[a] < 1e15)) header.refuse("sizes");
    const auto n = static_cast<std::uint64_t>((*sizes)[a]);
    const bool of_space = kinds.size() <= a || kinds[a] == "domain" || kinds[a] == "space" || kinds[a] == "none" ||
                          kinds[a] == "???" || kinds[a] == "time";
    if (of_space && (directions.size() <= a || !directions[a].empty() || a > 0)) {
      axes.push_back(a);
      image.size.push_back(n);
    } else if (a == 0) {
      image.numbers = n;
    } else if (a + 1 == sizes->size()) {
      image.size.push_back(n);
    } else {
      refuse_volume(image.where, "keeps the numbers of a voxel along an axis between others; save it again");
    }
  }
  set_nrrd_geometry(header, axes, image.geometry);
}

inline StoredImage open_nrrd(const std::string& file) {
  const NrrdHeader header = read_nrrd_header(file);
  StoredImage image{.where = file};
  image.notes = header.notes;
  set_nrrd_axes(header, image);

  const auto type = nrrd_type(lower_case(header.field("type")));
  if (!type) refuse_volume(file, "its voxels are no plain numbers but '" + header.field("type") + "'");
  image.type = *type;
  const std::string encoding = lower_case(header.field("encoding"));
  image.as_text = encoding == "txt" || encoding == "text" || encoding == "ascii";
  if (encoding == "gz" || encoding == "gzip")
    image.voxels.packing = Packing::kGzip;
  else if (!image.as_text && encoding != "raw")
    refuse_volume(file, "its encoding '" + encoding + "' is not read; save it with raw or gzip");
  const std::string order = lower_case(header.field("endian"));
  image.big_endian = order == "big";
  if (order != "big" && order != "little" && !image.as_text && width_of(image.type) > 1)
    refuse_volume(file, "its header tells no order of bytes (endian: little or big); mend it");

  image.voxels.file = file;
  image.voxels.offset = header.length;
  if (const std::string data = header.field("datafile"); !data.empty()) {
    if (data.starts_with("LIST") || data.find('%') != std::string::npos)
      refuse_volume(file, "keeps its voxels in several files; store it in one");
    image.voxels.file = std::filesystem::path(file).parent_path() / data;
    image.voxels.offset = 0;
  }
  const auto lines = number_of<std::int64_t>(header.fields.contains("lineskip") ? header.field("lineskip") : "0");
  const auto skip = number_of<std::int64_t>(header.fields.contains("byteskip") ? header.field("byteskip") : "0");
  if (!lines || *lines < 0) header.refuse("lineskip");
  if (!skip || *skip < -1) header.refuse("byteskip");
  std::ifstream in(image.voxels.file, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(image.voxels.offset));
  std::string line;
  for (std::int64_t i = 0; i < *lines && std::getline(in, line); ++i) image.voxels.offset += line.size() + 1;
  image.voxels.at_end = *skip == -1;
  image.voxels.skip = *skip == -1 ? 0 : static_cast<std::uint64_t>(*skip);
  if (image.voxels.at_end && image.voxels.packing != Packing::kNone) header.refuse("byteskip");
  check_sizes(image);
  return image;
}

}  // namespace trephine::itk_detail
