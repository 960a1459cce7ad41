// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

/// Questions that one factor of a sweep does not answer. Each writes a table to `folder`; `quick`: fewer cases.
namespace trephine::bench {

struct StudyOptions {
  std::string folder;
  bool quick = false;
  std::string skull{};  ///< where examples/run left it; empty: the phantom instead
};

struct Study {
  const char* name;
  const char* asks;
  void (*run)(const StudyOptions&);
};

void study_first_contact(const StudyOptions& options);
void study_convergence(const StudyOptions& options);
void study_ridge_spacing(const StudyOptions& options);
void study_ripple(const StudyOptions& options);
void study_holes(const StudyOptions& options);
void study_force_depth(const StudyOptions& options);
void study_image_floor(const StudyOptions& options);

[[nodiscard]] inline std::vector<Study> studies() {
  return {
      {"first_contact", "how far are first contacts off, and how many are missed?", study_first_contact},
      {"convergence", "with which order do errors fall as vertices, slices and steps become more?", study_convergence},
      {"ridge_spacing", "how are ridges between vertices or slices placed, and which are unseen?", study_ridge_spacing},
      {"ripple", "how smooth is a slide?", study_ripple},
      {"holes", "which holes and slots does a tool fall into?", study_holes},
      {"force_depth", "how does each law's force grow with depth?", study_force_depth},
      {"image_floor", "what is left to the image, whatever the search?", study_image_floor}};
}

}  // namespace trephine::bench
