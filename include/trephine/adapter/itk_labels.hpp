// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/adapter/itk.hpp>
#include <trephine/adapter/itk_image.hpp>
#include <trephine/adapter/itk_layers.hpp>
#include <trephine/adapter/itk_save.hpp>
#include <trephine/adapter/itk_segments.hpp>
#include <trephine/adapter/label_options.hpp>
#include <trephine/adapter/volume_options.hpp>
#include <trephine/core/math.hpp>
#include <trephine/structure/label_grid.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

/// Reads and saves segmentations: .seg.nrrd files of 3D Slicer, and label images in NRRD, NIfTI and MetaImage files.
/// Not for the haptic thread: it reads files and allocates memory.
namespace trephine::inline TREPHINE_ALIGNED {

/// A grid of labels of either type, chosen by the largest label.
using AnyLabelGrid = std::variant<LabelGrid<std::uint8_t>, LabelGrid<std::uint16_t>>;

namespace itk_detail {

/// Calls `f`, and lets a VolumeError name `function` as the one that refuses.
template <class F>
auto in_the_name_of(const std::string& function, F&& f) {
  try {
    return f();
  } catch (const VolumeError& e) {
    const std::string what = e.what();
    throw VolumeError("trephine::" + function + what.substr(what.find(": ")));
  }
}

/// Returns the list of structures: the options', the file's, or a name for each label that occurs. Structures without a
/// voxel are refused, or left out and added to `dropped`.
inline std::vector<Structure> list_structures(const LabelSource& source, const MergedLabels& merged,
                                              const LabelFileOptions& options, std::vector<std::string>& dropped) {
  std::vector<Structure> all = options.structures;
  if (all.empty())
    for (const Segment& s : source.segments) all.push_back(s.structure);
  if (all.empty() && source.segments.empty())
    for (std::size_t v = 1; v < kLabelValues; ++v) {
      const auto label = static_cast<std::uint16_t>(v);
      if (merged.uses[v] > 0) all.push_back({label, default_name(label), palette_colour(label)});
    }
  if (all.size() > LabelGrid<std::uint16_t>::kMaxStructures)
    refuse_volume(source.file.where,
                  "holds " + std::to_string(all.size()) + " labels, and 255 structures fit at most; is it a CT?");
  std::vector<Structure> present;
  for (const Structure& s : all) {
    if (merged.uses[s.label] > 0 || s.label == 0)
      present.push_back(s);
    else if (options.drop_empty)
      dropped.push_back(s.name);
    else
      refuse_volume(source.file.where, "structure '" + s.name + "' has no voxel" +
                                           (merged.overlapped_voxels > 0 ? " that no later layer takes" : "") +
                                           "; segment it or delete it, or set drop_empty");
  }
  return present;
}

template <VoxelLabel Label>
LabelGrid<Label> make_labels(const GridGeometry& geometry, const std::vector<std::uint16_t>& voxels,
                             std::vector<Structure> structures, const LabelFileOptions& options,
                             const std::string& where) {
  try {
    const LabelGridOptions grid_options{.ignore_unlisted = options.ignore_unlisted};
    if constexpr (std::is_same_v<Label, std::uint16_t>) {
      return LabelGrid<Label>(geometry, voxels, std::move(structures), grid_options);
    } else {
      std::vector<Label> narrow(voxels.size());
      std::transform(voxels.begin(), voxels.end(), narrow.begin(),
                     [](std::uint16_t v) { return static_cast<Label>(v); });
      return LabelGrid<Label>(geometry, narrow, std::move(structures), grid_options);
    }
  } catch (const std::invalid_argument& e) {
    refuse_volume(where, e.what());
  }
}

/// Reads labels into a LabelGrid of one type, if all labels fit, or into an AnyLabelGrid.
template <class Labels>
Labels read_labels(const std::filesystem::path& path, const LabelFileOptions& options, LabelReport& report) {
  LabelSource source = open_labels(path);
  const std::string& where = source.file.where;
  // Names of our own replace the file's, which still tell the layers apart.
  if (!options.structures.empty() && source.layers == 1) source.segments.clear();
  number_labels(source.segments);
  const auto rigid = to_rigid(source.file.geometry, {.spacing_m = options.spacing_m}, where);
  MergedLabels merged = merge_layers(source);
  check_merged(source, merged, options);
  report = {.overlapped_voxels = merged.overlapped_voxels, .unlisted_voxels = merged.unlisted_voxels};
  auto structures = list_structures(source, merged, options, report.dropped);
  if (rigid.reverse_slices) reverse_slices(rigid.grid.size, merged.voxels);
  std::size_t labelled = 0;
  std::size_t largest = 0;
  for (std::size_t v = 1; v < kLabelValues; ++v) {
    labelled += merged.uses[v];
    if (merged.uses[v] > 0) largest = v;
  }
  const auto make = [&]<VoxelLabel Label>(Label) {
    auto labels = make_labels<Label>(rigid.grid, merged.voxels, std::move(structures), options, where);
    for (const Structure& s : labels.structures()) labelled -= labels.voxel_count(s.label);
    report.unlisted_voxels += labelled;
    return labels;
  };
  constexpr std::size_t kNarrow = std::numeric_limits<std::uint8_t>::max();
  if constexpr (std::is_same_v<Labels, AnyLabelGrid>) {
    if (largest > kNarrow) return make(std::uint16_t{});
    return make(std::uint8_t{});
  } else {
    using Label = decltype(std::declval<const Labels&>().at(0, 0, 0));
    if (sizeof(Label) == 1 && largest > kNarrow)
      refuse_volume(where, "holds label " + std::to_string(largest) + ", which 8 bits do not; read 16-bit labels");
    return make(Label{});
  }
}

/// Returns true if a file holds exactly these labels.
template <VoxelLabel Label>
bool holds_labels(const std::filesystem::path& file, const LabelGrid<Label>& labels) {
  bool same = false;
  read_pixels(open_labels(file).file, [&]<class Pixel>(const Pixel* in, std::size_t count) {
    if constexpr (std::is_same_v<Pixel, Label>)
      same = std::equal(in, in + count, labels.voxels().begin(), labels.voxels().end());
  });
  return same;
}

}  // namespace itk_detail

/// Reads a segmentation: 3D Slicer's .seg.nrrd, or any NRRD, NIfTI or MetaImage file whose voxels are labels, of any
/// number type. W is the patient's space as in `read_volume`, so bone and labels of one patient fit. Names and colours
/// come from the header, else from `options`. Labels are the file's numbers; if segments of two layers have the same
/// number, labels are 1, 2, 3 in the order of the segments.
///
/// Throws VolumeError with one line: no such file, not an image, not three dimensions, numbers that are negative,
/// fractional or beyond `Label`, more than 255 structures, two of the same name, or axes that are not perpendicular.
/// Segments that overlap, voxels of no segment and structures without a voxel are refused unless `options` allows them;
/// `report` then counts them, if given. Not for the haptic thread.
template <VoxelLabel Label>
[[nodiscard]] LabelGrid<Label> read_labels_as(const std::filesystem::path& path, const LabelFileOptions& options = {},
                                              LabelReport* report = nullptr) {
  LabelReport own;
  return itk_detail::in_the_name_of("read_labels", [&] {
    return itk_detail::read_labels<LabelGrid<Label>>(path, options, report != nullptr ? *report : own);
  });
}

/// The same, with 8-bit labels if all fit, and else with 16-bit labels.
[[nodiscard]] inline AnyLabelGrid read_labels(const std::filesystem::path& path, const LabelFileOptions& options = {},
                                              LabelReport* report = nullptr) {
  LabelReport own;
  return itk_detail::in_the_name_of("read_labels", [&] {
    return itk_detail::read_labels<AnyLabelGrid>(path, options, report != nullptr ? *report : own);
  });
}

/// Writes labels to `path`, an NRRD (.seg.nrrd, which 3D Slicer opens with names and colours, or .nrrd) or MetaImage
/// (.mha) file, compressed. `read_labels` reads the same voxels, names and colours back; lengths are rounded to
/// millimetres in text of 17 digits. `X_WS` is the pose to write, in place of the labels' own: for bone that moved, the
/// pose in the patient's space.
///
/// The new file is read back and compared before it replaces an old one; on failure the old one stays. Throws
/// VolumeError with the reason: another ending, a pose that is not finite, a single voxel in NRRD, a missing or
/// write-protected folder, a full disk. Not for the haptic thread.
template <VoxelLabel Label>
void save_labels(const std::filesystem::path& path, const LabelGrid<Label>& labels,
                 const std::optional<Posed>& X_WS = {}) {
  itk_detail::in_the_name_of("save_labels", [&] {
    using itk_detail::refuse_saving;
    itk_detail::check_ending(path);
    const Posed X = X_WS.value_or(labels.X_WS());
    if (!X.matrix().allFinite()) refuse_saving(path, "the labels' pose is not finite");
    if (labels.voxels().size() == 1 && path.extension() == ".nrrd")
      refuse_saving(path, "one voxel marks an empty segmentation in this format; save it as .mha");
    itk_detail::ImageToSave image{.size = labels.size(),
                                  .spacing = labels.spacing(),
                                  .X_WG = X,
                                  .type = itk_detail::number_type<Label>(),
                                  .bytes = std::as_bytes(labels.voxels()),
                                  .compressed = true};
    image.notes[itk_detail::kOutsideKey] = "0";
    itk_detail::describe_segments(image.notes, labels);
    itk_detail::write_and_replace(
        path, image, [&labels](const std::filesystem::path& file) { return itk_detail::holds_labels(file, labels); });
  });
}

/// The same for a grid of either type.
inline void save_labels(const std::filesystem::path& path, const AnyLabelGrid& labels,
                        const std::optional<Posed>& X_WS = {}) {
  std::visit([&](const auto& grid) { save_labels(path, grid, X_WS); }, labels);
}

}  // namespace trephine
