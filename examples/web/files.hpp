// SPDX-License-Identifier: MIT
#pragma once

#include "../drill/bone.hpp"

#include <string>

/// The bone as it is now, as files. They read beside the haptic thread.
namespace web {

/// A binary STL file of the bone's surface, in millimetres.
[[nodiscard]] std::string stl_of(const drill::Bone& bone);
/// An NRRD file of the densities, raw, in millimetres.
[[nodiscard]] std::string nrrd_of(const drill::Bone& bone);
/// The same bone as it was loaded.
[[nodiscard]] drill::Bone as_loaded(const drill::Bone& bone);

}  // namespace web
