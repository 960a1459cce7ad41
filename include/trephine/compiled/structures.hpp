// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/compiled/scene.hpp>

#include <array>
#include <cstdint>
#include <memory>
#include <span>

/// Structures that a compiled scene keeps tool and cuts from.
namespace trephine::compiled {

/// Labels of structures: a segmentation of the bone.
struct LabelGeometry {
  std::array<int, 3> size{};       ///< voxels along x (fastest in memory), y, z; each >= 1
  Vec3d spacing = Vec3d::Zero();   ///< [m], each > 0
  Posed X_GS = Posed::Identity();  ///< pose of the labels' frame in the bone's: identity where both share a grid
  double reach = 6e-3;             ///< half width of the bands with distances of each structure [m]
  int threads = 0;                 ///< that build; 0: as many as the machine has
};

/// Makes distances to structures. The library defines `make`; the alignment is part of its name, as for BoneMaker.
template <int kAlignment = EIGEN_MAX_ALIGN_BYTES>
struct StructuresMaker {
  [[nodiscard]] static std::shared_ptr<const AnyStructures> make(const LabelGeometry& geometry,
                                                                 std::span<const std::uint8_t> labels);
};

/// Distances to the structures of a segmentation. Copies are the same; immutable, for any number of scenes and threads.
/// \code
/// const Structures nerves({.size = {256, 256, 108}, .spacing = {0.957_mm, 0.957_mm, 1.5_mm}}, labels);
/// scene.set_structures(nerves, std::vector<Structure>{{.margin = 2_mm, .veto_margin = 0.5_mm}});
/// scene.tick(input, dt).structures.distance;  // of the whole tool
/// \endcode
class Structures {
 public:
  /// Builds the distances: seconds, on `threads` threads; not for the haptic thread. A label is 0 for none and s + 1
  /// for structure s, x fastest. `reach` must be at least a margin and the tool's largest radius, and 2.6 times the
  /// guard's smoothing more, and for a veto its margin and a bone voxel's diagonal. Throws std::invalid_argument as
  /// `build_structure_field` does, and for a pose that is not rigid.
  Structures(const LabelGeometry& geometry, std::span<const std::uint8_t> labels)
      : structures_(StructuresMaker<>::make(geometry, labels)) {}

  /// Number of structures: the highest label.
  [[nodiscard]] int count() const noexcept { return structures_->count(); }

 private:
  friend class Scene;

  std::shared_ptr<const AnyStructures> structures_;
};

/// `each` has an entry for each structure. Between ticks, on the haptic thread: it takes memory and tenths of a second,
/// and the cut's state begins anew. Counts of earlier vetoes are forgotten. A push fades in where the tool already is
/// in a margin. Throws std::invalid_argument for options out of range, another number of entries, or a reach that is
/// too short, and then all stays as it was.
inline void Scene::set_structures(const Structures& structures, std::span<const Structure> each,
                                  const GuardOptions& options) {
  scene_->set_structures(*structures.structures_, each, options);
}

}  // namespace trephine::compiled
