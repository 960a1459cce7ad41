// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/adapter/itk.hpp>
#include <trephine/adapter/itk_image.hpp>
#include <trephine/adapter/itk_segments.hpp>
#include <trephine/adapter/label_options.hpp>
#include <trephine/adapter/stored_image.hpp>
#include <trephine/adapter/volume_text.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

/// Opens a file of labels and merges its layers into one label a voxel.
namespace trephine::inline TREPHINE_ALIGNED::itk_detail {

/// Returns a voxel's number as a label. Throws VolumeError unless it is whole and from 0 to 65535.
template <class Pixel>
std::uint16_t to_label(Pixel value, const std::string& where) {
  constexpr auto kLargest = std::numeric_limits<std::uint16_t>::max();
  bool is_label = false;
  if constexpr (std::is_floating_point_v<Pixel>)
    is_label = value >= 0 && value <= kLargest && value == std::floor(value);
  else
    is_label = std::in_range<std::uint16_t>(value);
  if (!is_label) {
    Text s;
    s << "holds the number " << +value << ", and labels are whole numbers from 0 to 65535; is it a CT?";
    refuse_volume(where, s.str());
  }
  return static_cast<std::uint16_t>(value);
}

/// An opened file of labels. Layers are numbers of one voxel, or volumes one after the other.
struct LabelSource {
  Source file{};
  std::size_t count = 0;  // voxels of a layer
  std::size_t layers = 1;
  bool interleaved = false;  // the layers of a voxel lie side by side
  std::vector<Segment> segments{};
};

inline LabelSource open_labels(const std::filesystem::path& path) {
  const std::string where = path.string();
  std::error_code error;
  if (!std::filesystem::exists(path, error)) refuse_volume(where, "there is no such file");
  if (std::filesystem::is_directory(path))
    refuse_volume(where, "is a folder; give a file (.seg.nrrd), as 3D Slicer saves a DICOM segmentation");
  StoredImage image = open_image(where);
  if (image.size.size() < 3) refuse_volume(where, "is flat; labels need three dimensions");
  LabelSource source;
  source.count = static_cast<std::size_t>(image.voxel_count());
  const auto volumes = static_cast<std::size_t>(image.volumes());
  const auto numbers = static_cast<std::size_t>(image.numbers);
  source.layers = volumes * numbers;
  source.interleaved = numbers > 1;
  source.segments = segments_of(image.notes, source.layers, where);
  if (source.layers > 1 && source.segments.empty())
    refuse_volume(where, numbers > 1 ? "has several numbers per voxel and names no segments; a label is a single number"
                                     : "holds several volumes (a time series?); extract one");
  if (volumes > 1 && numbers > 1) refuse_volume(where, "holds layers in two ways; save it again in 3D Slicer");
  const bool slicer =
      !source.segments.empty() || !header_text(image.notes, "Segmentation_SourceRepresentation").empty();
  if (slicer && source.count == 1 && path.extension() == ".nrrd")
    refuse_volume(where, "holds no voxels, only names (one voxel marks an empty segmentation); segment it first");
  source.file = {.where = where, .geometry = geometry_of(image), .image = std::move(image)};
  return source;
}

/// Labels of all voxels, and what was met in reading them.
struct MergedLabels {
  std::vector<std::uint16_t> voxels{};
  std::vector<std::size_t> uses{};                                            // voxels of each label
  std::map<std::pair<std::uint16_t, std::uint16_t>, std::size_t> overlaps{};  // voxels of each pair of labels
  std::size_t overlapped_voxels = 0;
  std::size_t unlisted_voxels = 0;
  std::uint16_t unlisted_value = 0;  // the first of them
};

inline constexpr std::size_t kLabelValues = std::size_t{1} << 16;

/// Returns, for each layer, the label of each value; 0 for values that are none. Empty for layers without a segment.
inline std::vector<std::vector<std::uint16_t>> label_tables(const LabelSource& source) {
  std::vector<std::vector<std::uint16_t>> tables(source.layers);
  for (const Segment& s : source.segments) {
    tables[s.layer].resize(kLabelValues);
    tables[s.layer][s.value] = s.structure.label;
  }
  if (source.segments.empty()) {  // a plain image: values are labels
    tables[0].resize(kLabelValues);
    for (std::size_t v = 0; v < kLabelValues; ++v) tables[0][v] = static_cast<std::uint16_t>(v);
  }
  return tables;
}

/// Merges the layers; where segments overlap, the last layer's stays.
inline MergedLabels merge_layers(const LabelSource& source) {
  MergedLabels out;
  const auto tables = label_tables(source);
  const std::size_t step = source.interleaved ? source.layers : 1;
  const std::size_t layer_step = source.interleaved ? 1 : source.count;
  read_pixels(source.file, [&](const auto* in, std::size_t) {
    out.voxels.assign(source.count, 0);
    for (std::size_t voxel = 0; voxel < source.count; ++voxel) {
      std::uint16_t label = 0;
      bool overlapped = false;
      for (std::size_t layer = 0; layer < source.layers; ++layer) {
        const std::uint16_t value = to_label(in[voxel * step + layer * layer_step], source.file.where);
        if (value == 0) continue;
        const std::uint16_t next = tables[layer].empty() ? std::uint16_t{0} : tables[layer][value];
        if (next == 0) {
          if (out.unlisted_voxels++ == 0) out.unlisted_value = value;
          continue;
        }
        if (label != 0) ++out.overlaps[{label, next}];
        overlapped = overlapped || label != 0;
        label = next;
      }
      out.voxels[voxel] = label;
      if (overlapped) ++out.overlapped_voxels;
    }
  });
  out.uses.assign(kLabelValues, 0);
  for (const std::uint16_t label : out.voxels) ++out.uses[label];
  return out;
}

/// Refuses overlaps and values of no segment, unless the options allow them.
inline void check_merged(const LabelSource& source, const MergedLabels& merged, const LabelFileOptions& options) {
  const auto name_of = [&source](std::uint16_t label) {
    for (const Segment& s : source.segments)
      if (s.structure.label == label) return "'" + s.structure.name + "'";
    return std::string{};
  };
  if (!merged.overlaps.empty() && !options.later_layer_wins) {
    Text s;
    const auto& [pair, count] = *merged.overlaps.begin();
    s << "segments " << name_of(pair.first) << " and " << name_of(pair.second) << " overlap in " << count
      << (count == 1 ? " voxel" : " voxels");
    if (merged.overlaps.size() > 1) s << ", and so do " << merged.overlaps.size() - 1 << " more pairs";
    s << "; separate them in 3D Slicer (Masking: allow no overlap), or set later_layer_wins";
    refuse_volume(source.file.where, s.str());
  }
  if (merged.unlisted_voxels > 0 && !options.ignore_unlisted) {
    Text s;
    s << "holds the number " << merged.unlisted_value << ", which belongs to no segment (" << merged.unlisted_voxels
      << " such voxels in all); save it again, or set ignore_unlisted";
    refuse_volume(source.file.where, s.str());
  }
}

}  // namespace trephine::itk_detail
