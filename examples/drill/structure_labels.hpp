// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/structure/label_grid.hpp>

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

namespace drill {

/// A segmentation of either type of label.
using AnyLabels = std::variant<trephine::LabelGrid<std::uint8_t>, trephine::LabelGrid<std::uint16_t>>;

/// Reads a segmentation: 3D Slicer's .seg.nrrd, or labels in NRRD, NIfTI or MetaImage. Segments without a voxel are
/// left out, and `notes` names them. Throws std::exception with one clear line, also in builds without ITK.
[[nodiscard]] AnyLabels load_labels(const std::string& path, std::vector<std::string>& notes);

}  // namespace drill
