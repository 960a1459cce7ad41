// SPDX-License-Identifier: MIT
#pragma once

#include "structures.hpp"

#include <trephine/core/tick.hpp>
#include <trephine/structure/structure_field.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace drill {

/// What keeps the drill from structures.
enum class Protection : std::uint8_t { kNothing, kGuard, kVeto };  ///< the veto comes on top of the guard
inline constexpr std::array kProtections{Protection::kNothing, Protection::kGuard, Protection::kVeto};
[[nodiscard]] const char* name_of(Protection protection);

/// One tick on the way to a structure.
struct ShowRow {
  double time = 0;       ///< [s]
  double distance = 0;   ///< of the drawn tool from that structure, negative inside; at most the field's reach [m]
  double contact_N = 0;  ///< without the guard's push
  double guard_N = 0;
  double removed_mm3 = 0, refused_mm3 = 0;  ///< since the run's start
  trephine::StructureSummary tick;          ///< as the scene returned it: at the device's pose, of all structures
  int drawn_nearest = -1;                   ///< structure nearest to the drawn tool; -1: none within the field's reach
  double drawn_distance = 0;                ///< of the drawn tool from that one [m]
};

/// One way to one structure.
struct ShowRun {
  int structure = 0;
  std::vector<ShowRow> rows;
  double swept_mm3 = 0;      ///< of the structure's labels, bone or not, where the turning burr was
  double taken_mm3 = 0;      ///< bone in the structure that is gone
  double watched_mm3 = 0;    ///< the same as the library counts it; 0 under a veto, which counts what it refuses
  trephine::Posed deepest;   ///< the drill as drawn where it was nearest to the structure
  double true_distance = 0;  ///< least one by the structure's formula, if there is one [m]

  [[nodiscard]] double least_distance() const;
  [[nodiscard]] double greatest_guard() const;
};

/// All ways with one protection, in one bone.
struct Show {
  Protection protection{};
  Grid bone;                                             ///< as the drill left it
  std::shared_ptr<const trephine::StructureField> left;  ///< structures without what the burr took
  std::vector<ShowRun> runs;                             ///< by structure
};

struct StructureShow {
  MadeStructures made;
  std::shared_ptr<const trephine::StructureField> field;  ///< of the whole structures, in the labels' frame
  std::vector<Show> shows;
};

/// Drills toward each structure with each protection; device, hand and renderer are the coupled algorithm's.
[[nodiscard]] StructureShow show_structures(const Bone& bone, const Options& options, MadeStructures made);

void print_table(const StructureShow& show);
/// Writes `time_s,structure,protection,...`, a row a tick. Throws std::runtime_error where the file cannot be written.
void write_csv(const StructureShow& show, const std::string& path);
/// Prints what must hold: nothing takes of each structure, the veto leaves it whole. Returns how much does not.
[[nodiscard]] int check(const StructureShow& show);

}  // namespace drill
