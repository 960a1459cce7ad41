// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/adapter/volume_text.hpp>
#include <trephine/structure/label_grid.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <vector>

/// Segments in a file's header, as 3D Slicer writes them into .seg.nrrd files: `Segment0_Name`, `Segment0_LabelValue`,
/// `Segment0_Layer`, `Segment0_Color`. Each layer is an image of its own, and segments of one layer do not overlap.
namespace trephine::inline TREPHINE_ALIGNED::itk_detail {

/// A segment in a header: the voxels that hold `value` in a layer.
struct Segment {
  std::size_t layer = 0;
  std::uint16_t value = 1;
  Structure structure{};  // its label is not set yet
};

/// Returns a colour for structures without any, the same for the same label (Okabe and Ito 2008: seven hues that
/// colour-blind readers tell apart).
inline std::array<float, 3> palette_colour(std::uint16_t label) noexcept {
  constexpr std::array<std::array<float, 3>, 7> kPalette{{{0.90F, 0.62F, 0.00F},
                                                          {0.34F, 0.71F, 0.91F},
                                                          {0.00F, 0.62F, 0.45F},
                                                          {0.94F, 0.89F, 0.26F},
                                                          {0.00F, 0.45F, 0.70F},
                                                          {0.84F, 0.37F, 0.00F},
                                                          {0.80F, 0.47F, 0.65F}}};
  return kPalette[(label + kPalette.size() - 1) % kPalette.size()];
}

inline std::string default_name(std::uint16_t label) { return "label " + std::to_string(label); }

/// Texts in a header by key.
using HeaderNotes = std::map<std::string, std::string>;

/// Returns the header's text of a key, or "".
inline std::string header_text(const HeaderNotes& notes, const std::string& key) {
  const auto found = notes.find(key);
  return found == notes.end() ? "" : trimmed(found->second);
}

/// Returns three numbers from 0 to 1, or the palette's colour for any other text.
inline std::array<float, 3> colour_from(const std::string& text, std::uint16_t label) {
  const auto numbers = numbers_of(text);
  if (!numbers || numbers->size() < 3) return palette_colour(label);
  std::array<float, 3> colour{};
  for (std::size_t i = 0; i < 3; ++i) {
    if (!((*numbers)[i] >= 0 && (*numbers)[i] <= 1)) return palette_colour(label);
    colour[i] = static_cast<float>((*numbers)[i]);
  }
  return colour;
}

/// Returns a whole number from `lowest` to 65535. Throws VolumeError for any other text.
inline std::uint16_t segment_number(const std::string& text, const std::string& key, long lowest,
                                    const std::string& where) {
  char* end = nullptr;
  const long n = std::strtol(text.c_str(), &end, 10);
  if (text.empty() || *end != '\0' || n < lowest || n > std::numeric_limits<std::uint16_t>::max())
    refuse_volume(where, "its header holds " + key + " '" + text + "', which must be a whole number from " +
                             std::to_string(lowest) + " to 65535; save it again");
  return static_cast<std::uint16_t>(n);
}

/// Returns the numbers of the segments that a header names, in ascending order.
inline std::vector<int> segment_numbers(const HeaderNotes& notes) {
  std::map<int, bool> found;
  for (const auto& [key, text] : notes) {
    constexpr std::string_view kSegment = "Segment";
    if (!key.starts_with(kSegment)) continue;
    const char* const digits = key.c_str() + kSegment.size();
    char* end = nullptr;
    const long n = std::strtol(digits, &end, 10);
    if (end != digits && *end == '_' && n >= 0 && n < std::numeric_limits<int>::max())
      found[static_cast<int>(n)] = true;
  }
  std::vector<int> numbers;
  for (const auto& [n, named] : found) numbers.push_back(n);
  return numbers;
}

/// Returns the segments of a header; none for a plain image. Files without layers and values are older: each of their
/// segments is a layer of its own, and holds ones. Throws VolumeError for a header that contradicts itself.
inline std::vector<Segment> segments_of(const HeaderNotes& notes, std::size_t layers, const std::string& where) {
  for (const char* const key : {"Segmentation_SourceRepresentation", "Segmentation_MasterRepresentation"})
    if (header_text(notes, key).starts_with("Fractional"))
      refuse_volume(where, "holds fractions, not labels; convert it to a binary labelmap first");
  std::vector<Segment> segments;
  for (const int n : segment_numbers(notes)) {
    const std::string key = "Segment" + std::to_string(n) + "_";
    const std::string value = header_text(notes, key + "LabelValue");
    const std::string layer = header_text(notes, key + "Layer");
    Segment s;
    if (!value.empty()) s.value = segment_number(value, key + "LabelValue", 1, where);
    if (!layer.empty())
      s.layer = segment_number(layer, key + "Layer", 0, where);
    else if (layers > 1)
      s.layer = segments.size();
    s.structure.name = header_text(notes, key + "Name");
    if (s.structure.name.empty()) s.structure.name = header_text(notes, key + "ID");
    if (s.structure.name.empty()) s.structure.name = default_name(s.value);
    s.structure.colour =
        colour_from(header_text(notes, key + "Color"), static_cast<std::uint16_t>(segments.size() + 1));
    const std::string own = "segment '" + s.structure.name + "'";
    if (s.layer >= layers)
      refuse_volume(where, own + " lies in layer " + std::to_string(s.layer) + ", and the last one is " +
                               std::to_string(layers - 1) + "; save it again");
    for (const Segment& other : segments) {
      if (other.structure.name == s.structure.name) refuse_volume(where, "holds " + own + " twice; rename one");
      if (other.layer == s.layer && other.value == s.value)
        refuse_volume(where, own + " and '" + other.structure.name + "' have the same value " +
                                 std::to_string(s.value) + "; save it again");
    }
    segments.push_back(s);
  }
  return segments;
}

/// Sets each segment's label: its value, if no two have the same, else 1 and up in the file's order.
inline void number_labels(std::vector<Segment>& segments) {
  std::map<std::uint16_t, int> uses;
  bool unique = true;
  for (const Segment& s : segments) unique = ++uses[s.value] == 1 && unique;
  std::uint16_t next = 0;
  for (Segment& s : segments) s.structure.label = unique ? s.value : ++next;
}

/// Adds the structures to a header's texts, all in one layer.
template <VoxelLabel Label>
void describe_segments(HeaderNotes& notes, const LabelGrid<Label>& labels) {
  const auto set = [&notes](const std::string& key, const std::string& text) { notes[key] = text; };
  set("Segmentation_ContainedRepresentationNames", "Binary labelmap|");
  set("Segmentation_MasterRepresentation", "Binary labelmap");  // 3D Slicer before 5.2
  set("Segmentation_SourceRepresentation", "Binary labelmap");
  set("Segmentation_ReferenceImageExtentOffset", "0 0 0");
  int n = 0;
  for (const Structure& s : labels.structures()) {
    const std::string key = "Segment" + std::to_string(n++) + "_";
    const VoxelBox box = labels.box_of(s.label);
    Text extent;
    for (std::size_t a = 0; a < 3; ++a) extent << (a > 0 ? " " : "") << box.lo[a] << ' ' << box.hi[a];
    Text colour;
    colour.precision(std::numeric_limits<float>::max_digits10);
    colour << s.colour[0] << ' ' << s.colour[1] << ' ' << s.colour[2];
    set(key + "ID", "Segment_" + std::to_string(s.label));
    set(key + "Name", s.name);
    set(key + "NameAutoGenerated", "0");
    set(key + "Color", colour.str());
    set(key + "ColorAutoGenerated", "0");
    set(key + "Extent", extent.str());
    set(key + "LabelValue", std::to_string(s.label));
    set(key + "Layer", "0");
  }
}

}  // namespace trephine::itk_detail
