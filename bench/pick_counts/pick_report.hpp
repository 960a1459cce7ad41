// SPDX-License-Identifier: MIT
#pragma once

#include "pick_study.hpp"

#include <string>

namespace pick {

/// What a report is about, beside the study.
struct Subject {
  std::string bone;                ///< its name
  std::string unit;                ///< of its densities
  std::vector<std::string> notes;  ///< about how it was read
  Scene scene;
  Vec3d spacing;  ///< of its voxels [m]
  std::array<int, 3> size;
  StudyOptions options;
};

/// Tables, the recommendation and its code, for people.
[[nodiscard]] std::string as_text(const Subject& subject, const Study& study);
/// A row a setting, with a header line.
[[nodiscard]] std::string as_csv(const Study& study);

}  // namespace pick
