// SPDX-License-Identifier: MIT
// Compiled only where ITK is; see bone.cpp for what stands in.
#include "read_itk.hpp"

#include <trephine/adapter/itk.hpp>
#include <trephine/adapter/itk_labels.hpp>

#include <variant>

namespace drill {

LevelGrid read_ct(const std::string& path, const std::string& series) {
  trephine::VolumeOptions options;
  options.series = series;
  return std::visit([](const auto& grid) { return to_levels(grid); }, trephine::read_volume(path, options));
}

AnyLabels read_label_file(const std::string& path, std::vector<std::string>& notes) {
  trephine::LabelFileOptions options;
  options.drop_empty = true;
  trephine::LabelReport report;
  AnyLabels labels = trephine::read_labels(path, options, &report);
  for (const std::string& name : report.dropped) notes.push_back("left out: structure '" + name + "', without a voxel");
  return labels;
}

}  // namespace drill
