// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/structure/build_structure_field.hpp>
#include <trephine/structure/label_grid.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// Builds the distances to all structures of a segmentation. Structure s of the field is `labels.structures()[s]`, and
/// the field's frame S is the segmentation's. Errors, cost and exceptions are those of the other overload.
template <VoxelLabel Label>
[[nodiscard]] std::unique_ptr<const StructureField> build_structure_field(const LabelGrid<Label>& labels,
                                                                          const StructureFieldOptions& options = {},
                                                                          BuildProgress* progress = nullptr) {
  std::vector<std::uint8_t> number_of(std::size_t{1} << (8 * sizeof(Label)));
  for (std::size_t s = 0; s < labels.structures().size(); ++s)
    number_of[labels.structures()[s].label] = static_cast<std::uint8_t>(s + 1);
  std::vector<std::uint8_t> numbers;
  numbers.reserve(labels.voxels().size());
  for (const Label label : labels.voxels()) numbers.push_back(number_of[label]);
  return build_structure_field(LabelVolume{labels.size(), labels.spacing(), numbers}, options, progress);
}

}  // namespace trephine
