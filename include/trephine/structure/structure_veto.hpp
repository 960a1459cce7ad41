// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/number.hpp>
#include <trephine/core/tolerances.hpp>
#include <trephine/structure/protected_structure.hpp>
#include <trephine/structure/structure_field.hpp>
#include <trephine/voxel/cut_floor.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <memory>
#include <span>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// Returns the reach that a field's bands need for the floors of a bone [m].
template <VoxelDensity Density>
[[nodiscard]] double required_veto_reach(const VoxelGrid<Density>& bone, double widest_margin) {
  return widest_margin + CutFloor<Density>::reach_of(bone.spacing());
}

namespace detail {
/// Protects everything outside of cavities. Bricks far outside are frozen whole.
template <VoxelDensity Density>
void keep_in(const StructureField& field, const Posed& X_SG, const VoxelGrid<Density>& bone,
             std::span<const StructureVeto> vetoes, std::span<const int> cavities, CutFloor<Density>& floor) {
  struct Outside {
    int owner;
    double distance;  // how far outside [m], negative inside; clamped by the field's reach
  };
  const auto outside = [&](const Vec3d& p_S) {
    Outside least{0, std::numeric_limits<double>::infinity()};
    for (const int s : cavities) {
      const double d = field.distance(s, p_S) + vetoes[static_cast<std::size_t>(s)].margin;
      if (d < least.distance) least = {s, d};
    }
    return least;
  };
  constexpr int kBrick = VoxelGrid<Density>::kBrick;
  const Vec3d& h = bone.spacing();
  const double half = 0.5 * (kBrick - 1) * h.norm() + field.slack();
  for (std::size_t brick = 0; brick < bone.brick_count(); ++brick) {
    std::array<int, 3> lo = bone.brick_coordinates(brick), hi{};
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] *= kBrick;
      hi[a] = lo[a] + kBrick - 1;
    }
    const Vec3d middle = h.cwiseProduct(Vec3d(lo[0], lo[1], lo[2]) + Vec3d::Constant(0.5 * (kBrick - 1)));
    const Outside here = outside(X_SG * middle);
    // Distances to one structure are clamped; that to the nearest of all is a bound that is not.
    const double outside_by = std::max(here.distance, field.nearest(X_SG * middle).distance);
    if (outside_by - half > floor.reach()) {
      floor.freeze_brick(here.owner, brick);
    } else if (here.distance + half > -floor.reach()) {
      floor.protect(here.owner, {lo, hi}, [&](int i, int j, int k) {
        return -outside(X_SG * Vec3d(h.cwiseProduct(Vec3d(i, j, k)))).distance;
      });
    }
  }
}
}  // namespace detail

/// Makes the floors of a bone for structures: a `Veto` in the scene then spares them, whatever cuts.
/// \code
/// auto floor = make_cut_floor(*field, X_GS, bone, 300, vetoes);
/// HapticScene{bone, 300, renderer, Cutting{}, Veto{floor}};
/// floor->refused_mm3(structure);   // bone that the drill would have taken
/// \endcode
/// `vetoes` has an entry for each structure of the field, whose number is the owner of its floors. Several cavities to
/// keep in are one, their union, and the nearest owns what lies outside. X_GS is the pose of the structures' frame in
/// the bone's. Distances are taken at the bone's voxels: the wall is off by the field's error.
///
/// Throws std::invalid_argument for another number of entries, a margin out of range, a pose that is not rigid, or a
/// field whose bands do not reach `required_veto_reach`. Not for the haptic thread: it allocates, and takes about
/// a tenth of a second for a million voxels near structures. Any other thread may make one while the bone is cut. Where
/// cuts then go on before the floor takes effect, interpolated bone may lose up to a cell; protected voxels do not.
template <VoxelDensity Density>
[[nodiscard]] std::shared_ptr<CutFloor<Density>> make_cut_floor(const StructureField& field, const Posed& X_GS,
                                                                const VoxelGrid<Density>& bone, double isovalue,
                                                                std::span<const StructureVeto> vetoes) {
  if (vetoes.size() != static_cast<std::size_t>(field.structures()))
    refuse("make_cut_floor", "vetoes must have one entry for each of the field's structures",
           static_cast<double>(vetoes.size()));
  const Mat3d R = X_GS.linear();
  if (!is_finite(X_GS) || !((R.transpose() * R - Mat3d::Identity()).norm() < kRotationTolerance))
    refuse("make_cut_floor", "X_GS must be rigid", "not so");
  auto floor = std::make_shared<CutFloor<Density>>(bone, isovalue);
  const Posed X_SG = inverse(X_GS);
  const Vec3d& h = bone.spacing();
  const auto place = [&](double i, double j, double k) { return Vec3d(X_SG * h.cwiseProduct(Vec3d(i, j, k))); };
  std::vector<int> cavities;
  for (int s = 0; s < field.structures(); ++s) {
    const StructureVeto& veto = vetoes[static_cast<std::size_t>(s)];
    veto.validate();
    using enum StructureVeto::Mode;
    if (veto.mode == kFree) continue;
    const double margin = veto.mode == kWatch ? 0 : veto.margin;
    const double needed = veto.mode == kWatch ? 0 : margin + floor->reach();
    if (field.reach() < needed)
      refuse(
          "make_cut_floor",
          "the field's bands must reach the margin and a voxel's diagonal more, " + number_text(1e3 * needed) + " mm",
          1e3 * field.reach());
    if (veto.mode == kKeepIn) {
      cavities.push_back(s);
      continue;
    }
    // Blocks of voxels whose middle is farther than half their diagonal from what is near are left out.
    constexpr int kBlock = 4;
    const double half = 0.5 * (kBlock - 1) * h.norm();
    const auto& n = bone.size();
    for (int k = 0; k < n[2]; k += kBlock)
      for (int j = 0; j < n[1]; j += kBlock)
        for (int i = 0; i < n[0]; i += kBlock) {
          constexpr double kMiddle = 0.5 * (kBlock - 1);
          const Vec3d middle = place(i + kMiddle, j + kMiddle, k + kMiddle);
          const double d = field.distance(s, middle);
          if (d < field.reach() ? d - half > needed : field.nearest(middle).distance - half > needed) continue;
          const VoxelBox box{{i, j, k}, {i + kBlock - 1, j + kBlock - 1, k + kBlock - 1}};
          const auto distance = [&](int x, int y, int z) { return field.distance(s, place(x, y, z)) - margin; };
          if (veto.mode == kProtect)
            floor->protect(s, box, distance);
          else
            floor->watch(s, box, [&](int x, int y, int z) { return distance(x, y, z) < 0; });
        }
  }
  if (!cavities.empty()) detail::keep_in(field, X_SG, bone, vetoes, cavities, *floor);
  floor->seal(bone);
  return floor;
}

}  // namespace trephine
