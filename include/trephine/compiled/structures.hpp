// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/compiled/scene.hpp>
#include <trephine/structure/label_volume.hpp>
#include <trephine/structure/membrane.hpp>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>

/// Structures that a compiled scene keeps tool and cuts from.
namespace trephine::inline TREPHINE_ALIGNED::compiled {

/// Labels of structures: a segmentation of the bone.
struct LabelGeometry {
  std::array<int, 3> size{};       ///< voxels along x (fastest in memory), y, z; each >= 1
  Vec3d spacing = Vec3d::Zero();   ///< [m], each > 0
  Posed X_GS = Posed::Identity();  ///< pose of the labels' frame in the bone's: identity where both share a grid
  StructureFieldOptions field{.reach = 6e-3};  ///< surfaces, the bands' reach, and the threads that build
};

/// Makes distances to structures. The library defines `make`; the alignment is part of its name, as for BoneMaker.
template <int kAlignment = EIGEN_MAX_ALIGN_BYTES>
struct StructuresMaker {
  [[nodiscard]] static std::shared_ptr<const AnyStructures> make(const LabelGeometry& geometry,
                                                                 std::span<const std::uint8_t> labels);
  [[nodiscard]] static std::shared_ptr<const AnyStructures> soften(const AnyStructures& structures,
                                                                   std::span<const std::optional<Membrane>> membranes,
                                                                   const SoftOptions& options);
};

/// Distances to the structures of a segmentation. Copies are the same; immutable, for any number of scenes and threads.
/// \code
/// const Structures nerves({.size = {256, 256, 108}, .spacing = {0.957_mm, 0.957_mm, 1.5_mm}}, labels);
/// scene.set_structures(nerves, std::vector<ProtectedStructure>{{.guard = {.margin = 2_mm}}});
/// scene.tick(input, dt).structures.distance;  // of the whole tool
/// \endcode
class Structures {
 public:
  /// Builds the distances: seconds, on `field.threads` threads; not for the haptic thread. A label is 0 for none and s
  /// + 1 for structure s, x fastest. `field.reach` must be at least a margin and the tool's largest radius, and 2.6
  /// times the guard's smoothing more, and for a veto its margin and a bone voxel's diagonal. Throws
  /// std::invalid_argument as `build_structure_field` does, and for a pose that is not rigid.
  Structures(const LabelGeometry& geometry, std::span<const std::uint8_t> labels)
      : structures_(StructuresMaker<>::make(geometry, labels)) {}

  /// Number of structures: the highest label.
  [[nodiscard]] int count() const noexcept { return structures_->count(); }

  /// The same structures, of which those with a membrane are felt where no bone is over them (`SoftStructures`). There
  /// is an entry for each. `field.reach` must be at least `SoftStructures::required_reach`: a scene refuses less, and
  /// another tool than the coupled one. Throws std::invalid_argument for options out of range.
  /// \code
  /// const Structures soft = structures.soft(std::vector<std::optional<Membrane>>{dura(), std::nullopt});
  /// scene.set_structures(soft, each);
  /// scene.tick(input, dt).structures.soft_force;
  /// \endcode
  [[nodiscard]] Structures soft(std::span<const std::optional<Membrane>> membranes,
                                const SoftOptions& options = {}) const {
    return Structures(StructuresMaker<>::soften(*structures_, membranes, options));
  }

 private:
  friend class Scene;
  explicit Structures(std::shared_ptr<const AnyStructures> structures) noexcept : structures_(std::move(structures)) {}

  std::shared_ptr<const AnyStructures> structures_;
};

/// Guard and vetoes that were made for a scene and are not in it. Structures, margins and modes so change while a scene
/// ticks: one thread makes and frees, and the haptic thread exchanges.
/// \code
/// Protection next = scene.make_protection(nerves, each);  // seconds, on another thread
/// scene.exchange(next);                                   // between ticks: no memory, no lock, microseconds
/// next.totals(0);                                         // of those before, until another thread frees them
/// \endcode
class Protection {
 public:
  /// What was counted of a structure until its protection left the scene.
  [[nodiscard]] StructureTotals totals(int structure) const noexcept { return protection_->totals(structure); }

 private:
  friend class Scene;
  explicit Protection(std::unique_ptr<AnyProtection> protection) noexcept : protection_(std::move(protection)) {}

  std::unique_ptr<AnyProtection> protection_;
};

/// `each` has an entry for each structure. Takes memory and up to seconds. The scene must outlive the call, and may
/// tick meanwhile on its own thread. Bone that cuts take between this and `exchange` is as for `make_cut_floor`. Throws
/// std::invalid_argument for options out of range, another number of entries, or a reach that is too short.
inline Protection Scene::make_protection(const Structures& structures, std::span<const ProtectedStructure> each,
                                         const ProtectionOptions& options) const {
  return Protection(scene_->make_protection(structures.structures_.get(), each, options));
}
inline Protection Scene::make_protection() const { return Protection(scene_->make_protection(nullptr, {}, {})); }

/// The cut's state begins anew, and a push fades in where the tool already is in a margin. The push before ends at
/// once, unless `set_push` has faded it out. Exchanged back, a protection goes on with its counts. Throws
/// std::invalid_argument for another scene's; takes no memory otherwise.
inline void Scene::exchange(Protection& protection) { scene_->exchange(*protection.protection_); }

/// As `make_protection` and `exchange`, with memory and up to seconds on the haptic thread, between ticks. Where it
/// throws, all stays as it was.
inline void Scene::set_structures(const Structures& structures, std::span<const ProtectedStructure> each,
                                  const ProtectionOptions& options) {
  Protection protection = make_protection(structures, each, options);
  exchange(protection);
}

}  // namespace trephine::compiled
