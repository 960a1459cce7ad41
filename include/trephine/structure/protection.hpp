// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/stage/veto.hpp>
#include <trephine/structure/labelled_field.hpp>
#include <trephine/structure/structure_guard.hpp>
#include <trephine/structure/structure_veto.hpp>

#include <algorithm>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// The part of a scene that spares the structures of a segmentation: a guard pushes the tool out of their margins, and
/// no cut takes them. It makes the distances, the guard's potential and the floors of the cuts at once.
/// \code
/// const std::vector<ProtectedStructure> spared{{.guard = {.margin = 1_mm}, .veto = {.margin = 0.3_mm}}};
/// HapticScene scene{bone, 300, CoupledToolRenderer{burr}, Cutting{}, Protection{labels, bone, 300, burr, spared}};
/// scene.tick(input, dt).structures.distance;   // of the whole tool
/// \endcode
/// List it where its push belongs among the stages. Those who need the pieces, to share a field between scenes or to
/// exchange one while a scene ticks, list a StructureGuard and a Veto instead.
///
/// Haptic thread; allocates at construction only.
template <VoxelDensity Density>
class Protection {
 public:
  /// `structures` has an entry for each structure of the labels. Takes seconds: it builds the distances as far as
  /// margins and tool need. Throws std::invalid_argument as `build_structure_field`, `GuardPotential` and
  /// `make_cut_floor` do.
  template <VoxelLabel Label, class Tool>
  Protection(const LabelGrid<Label>& labels, const VoxelGrid<Density>& bone, double isovalue, const Tool& tool,
             std::span<const ProtectedStructure> structures, const ProtectionOptions& options = {})
      : Protection(build_structure_field(labels, {.reach = required_reach(bone, tool, structures, options)}),
                   relative_pose(bone.X_WG(), labels.X_WS()), bone, isovalue, tool, structures, options) {}
  /// With distances that are there already, in a frame of their own.
  template <class Tool>
  Protection(std::shared_ptr<const StructureField> field, const Posed& X_GS, const VoxelGrid<Density>& bone,
             double isovalue, const Tool& tool, std::span<const ProtectedStructure> structures,
             const ProtectionOptions& options = {})
      : field_(std::move(field)),
        guard_(std::make_shared<const GuardPotential>(field_, X_GS, tool, guards_of(structures), options.potential),
               options.guard),
        veto_(make_cut_floor(*field_, X_GS, bone, isovalue, vetoes_of(structures))) {}

  /// Returns the reach that the distances need for this tool in this bone [m].
  template <class Tool>
  [[nodiscard]] static double required_reach(const VoxelGrid<Density>& bone, const Tool& tool,
                                             std::span<const ProtectedStructure> structures,
                                             const ProtectionOptions& options = {}) {
    double guarded = 0, spared = 0;
    for (const ProtectedStructure& s : structures) {
      if (s.guard.mode != GuardMode::kOff) guarded = std::max(guarded, s.guard.margin);
      if (s.veto.mode != StructureVeto::Mode::kFree) spared = std::max(spared, s.veto.margin);
    }
    return std::max(GuardPotential::required_reach(tool, guarded, options.potential.smoothing),
                    required_veto_reach(bone, spared));
  }

  [[nodiscard]] const StructureField& field() const noexcept { return *field_; }
  [[nodiscard]] StructureGuard& guard() noexcept { return guard_; }
  [[nodiscard]] const StructureGuard& guard() const noexcept { return guard_; }
  /// Returns the floor of the scene's cuts, with what it refused and what was taken of watched structures.
  [[nodiscard]] CutFloor<Density>* cut_floor() const noexcept { return veto_.cut_floor(); }

  void validate_for(const VoxelGrid<Density>& bone, double isovalue) const { veto_.validate_for(bone, isovalue); }
  void take(const Protection& other, const TakenBone& bones) {
    field_ = other.field_;
    guard_ = other.guard_;
    veto_.take(other.veto_, bones);
  }
  void begin_tick() noexcept { veto_.begin_tick(); }
  void apply(const TickContext& context, Wrenchd& wrench) noexcept { guard_.apply(context, wrench); }
  void add_to(StructureSummary& summary) const noexcept {
    guard_.add_to(summary);
    veto_.add_to(summary);
  }
  void reset() noexcept { guard_.reset(); }

 private:
  [[nodiscard]] static std::vector<GuardedStructure> guards_of(std::span<const ProtectedStructure> structures) {
    std::vector<GuardedStructure> guards;
    for (const ProtectedStructure& s : structures) guards.push_back(s.guard);
    return guards;
  }
  [[nodiscard]] static std::vector<StructureVeto> vetoes_of(std::span<const ProtectedStructure> structures) {
    std::vector<StructureVeto> vetoes;
    for (const ProtectedStructure& s : structures) vetoes.push_back(s.veto);
    return vetoes;
  }

  std::shared_ptr<const StructureField> field_;
  StructureGuard guard_;
  Veto<Density> veto_;
};

}  // namespace trephine
