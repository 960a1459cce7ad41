// SPDX-License-Identifier: MIT
#pragma once

#include "bone.hpp"
#include "levels.hpp"
#include "structure_labels.hpp"

#include <string>
#include <vector>

namespace drill {

/// A DICOM folder, NRRD, NIfTI or MetaImage file. `series` picks one of several DICOM series by UID or number; empty:
/// the only one. Densities of any type become levels. Throws std::exception with one clear line. Defined only in builds
/// with ITK (TREPHINE_EXAMPLE_HAS_ITK).
[[nodiscard]] LevelGrid read_ct(const std::string& path, const std::string& series);
/// `load_labels`, likewise.
[[nodiscard]] AnyLabels read_label_file(const std::string& path, std::vector<std::string>& notes);

}  // namespace drill
