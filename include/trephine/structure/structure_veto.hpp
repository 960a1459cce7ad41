// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tolerances.hpp>
#include <trephine/structure/structure_field.hpp>
#include <trephine/voxel/cut_floor.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace trephine {

/// What cuts may do to one structure.
struct StructureVeto {
  enum class Mode : std::uint8_t {
    kFree,     ///< cuts take it, and nobody counts
    kWatch,    ///< cuts take it, and what they take of it is counted: a structure that may break
    kProtect,  ///< no cut takes bone in it or within its margin
  };
  Mode mode = Mode::kProtect;
  double margin = 0;  ///< [m], >= 0

  /// Throws std::invalid_argument if the margin is out of range.
  void validate() const {
    if (!(margin >= 0) || !(margin <= 0.05)) refuse("StructureVeto", "margin must be 0 to 0.05 m", margin);
  }
};

/// Returns the reach that a field's bands need for the floors of a bone [m].
template <VoxelDensity Density>
[[nodiscard]] double required_veto_reach(const VoxelGrid<Density>& bone, double widest_margin) {
  return widest_margin + CutFloor<Density>::reach_of(bone.spacing());
}

/// Makes the floors of a bone for structures: the cut policy `ProtectedCut` then spares them, whatever cuts.
/// \code
/// auto floor = make_cut_floor(*field, X_GS, bone, 300, vetoes);
/// HapticScene{bone, 300, renderer, Milling{ProtectedCut{RateLimitedCut<>{}, floor}}};
/// floor->refused_mm3(structure);   // bone that the drill would have taken
/// \endcode
/// `vetoes` has an entry for each structure of the field, whose number is the owner of its floors. X_GS is the pose of
/// the structures' frame in the bone's. Distances are taken at the bone's voxels: the wall is off by the field's error.
///
/// Throws std::invalid_argument for another number of entries, a margin out of range, a pose that is not rigid, or a
/// field whose bands do not reach `required_veto_reach`. Not for the haptic thread: it allocates, and takes about
/// a tenth of a second for a million voxels near structures.
template <VoxelDensity Density>
[[nodiscard]] std::shared_ptr<CutFloor<Density>> make_cut_floor(const StructureField& field, const Posed& X_GS,
                                                                const VoxelGrid<Density>& bone, double isovalue,
                                                                std::span<const StructureVeto> vetoes) {
  if (vetoes.size() != static_cast<std::size_t>(field.structures()))
    refuse("make_cut_floor", "vetoes must have one entry for each of the field's structures",
           static_cast<double>(vetoes.size()));
  const Mat3d R = X_GS.linear();
  if (!X_GS.matrix().allFinite() || !((R.transpose() * R - Mat3d::Identity()).norm() < kRotationTolerance))
    refuse("make_cut_floor", "X_GS must be rigid", "not so");
  auto floor = std::make_shared<CutFloor<Density>>(bone, isovalue);
  const Posed X_SG = X_GS.inverse();
  const Vec3d& h = bone.spacing();
  // Blocks of voxels whose middle is farther than half their diagonal from what is near are left out.
  constexpr int kBlock = 4;
  const double half = 0.5 * (kBlock - 1) * h.norm();
  for (int s = 0; s < field.structures(); ++s) {
    const StructureVeto& veto = vetoes[static_cast<std::size_t>(s)];
    veto.validate();
    if (veto.mode == StructureVeto::Mode::kFree) continue;
    const bool protects = veto.mode == StructureVeto::Mode::kProtect;
    const double margin = protects ? veto.margin : 0, near = protects ? margin + floor->reach() : 0;
    if (field.reach() < near)
      refuse(
          "make_cut_floor",
          "the field's bands must reach the margin and a voxel's diagonal more, " + std::to_string(1e3 * near) + " mm",
          1e3 * field.reach());
    const auto& n = bone.size();
    for (int k = 0; k < n[2]; k += kBlock)
      for (int j = 0; j < n[1]; j += kBlock)
        for (int i = 0; i < n[0]; i += kBlock) {
          const Vec3d middle = h.cwiseProduct(Vec3d(i, j, k) + Vec3d::Constant(0.5 * (kBlock - 1)));
          const double d = field.distance(s, X_SG * middle);
          if (d < field.reach() ? d - half > near : field.nearest(X_SG * middle).distance - half > near) continue;
          const VoxelBox box{{i, j, k}, {i + kBlock - 1, j + kBlock - 1, k + kBlock - 1}};
          const auto distance = [&](int x, int y, int z) {
            return field.distance(s, X_SG * Vec3d(h.cwiseProduct(Vec3d(x, y, z)))) - margin;
          };
          if (protects)
            floor->protect(s, box, distance);
          else
            floor->watch(s, box, [&](int x, int y, int z) { return distance(x, y, z) < 0; });
        }
  }
  floor->seal(bone);
  return floor;
}

}  // namespace trephine
