// SPDX-License-Identifier: MIT
// What the window reads from files.
#include "loaded.hpp"
#include "script.hpp"

#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace live {

Loaded load(const drill::Options& options) {
  if (options.skull.empty() && options.ct.empty()) return made(options);
  return placed(drill::load_bone(options), options);
}

void load_structures(Loaded& loaded, const LiveOptions& options) {
  if (!options.labels.empty()) loaded.guarded = guard_read_structures(loaded.bone, options.labels, options.margin);
  if (options.bone.phantom == drill::Phantom::kTemporalBone)
    loaded.guarded = guard_temporal_bone(loaded.bone, options.margin);
  if (options.bone.structures) loaded.guarded = guard_made_structures(loaded.bone, loaded.spot, options.margin);
}

std::shared_ptr<const GuardedBone> guard_read_structures(const drill::Bone& bone, const std::string& path,
                                                         double margin) {
  std::vector<std::string> notes;
  const drill::AnyLabels labels = drill::load_labels(path, notes);
  return guard_bone(bone, labels, margin, std::move(notes));
}

std::vector<Event> read_events(const std::string& path) {
  std::ifstream in(path);
  if (!in) throw std::runtime_error(path + ": cannot be read");
  return read_events(in, path);
}

}  // namespace live
