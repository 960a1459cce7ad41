// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/compiled/any_scene.hpp>

#include <limits>
#include <type_traits>
#include <utility>

namespace trephine::inline TREPHINE_ALIGNED::compiled {

/// The density of a contiguous range of voxels.
template <class Voxels>
using DensityOf = std::remove_cv_t<std::remove_pointer_t<decltype(std::declval<const Voxels&>().data())>>;

class BoneReader;
class Structures;
class Protection;

/// The bone. Copies of a Bone are the same bone, which lives as long as a copy, a scene or a reader of it does.
/// \code
/// Bone bone({.size = {256, 256, 108}, .spacing = {0.957_mm, 0.957_mm, 1.5_mm}}, hounsfield);
/// \endcode
/// Threads: members belong to the haptic thread, between ticks; any other thread uses a BoneReader.
class Bone {
 public:
  using Reader = BoneReader;  ///< for a SessionLog that follows the bone

  /// Copies the voxels (x fastest) of a contiguous range: a vector, an array or a span of uint8, int8, uint16, int16 or
  /// float. Throws std::invalid_argument as `VoxelGrid` does.
  template <class Voxels>
    requires VoxelDensity<DensityOf<Voxels>>
  Bone(const GridGeometry& geometry, const Voxels& voxels, const GridOptions& options = {})
      : bone_(BoneMaker<DensityOf<Voxels>>::make(
            geometry, std::span<const DensityOf<Voxels>>(voxels.data(), voxels.size()), options)) {}

  [[nodiscard]] DensityType density_type() const noexcept { return bone_->density_type(); }
  [[nodiscard]] const std::array<int, 3>& size() const noexcept { return bone_->size(); }
  [[nodiscard]] const Vec3d& spacing() const noexcept { return bone_->spacing(); }
  /// Bricks of 8³ voxels along x, y, z; brick b is (b % x, b / x % y, b / (x y)).
  [[nodiscard]] const std::array<int, 3>& bricks() const noexcept { return bone_->bricks(); }
  [[nodiscard]] const Posed& X_WG() const noexcept { return bone_->X_WG(); }
  /// Density beyond the voxels.
  [[nodiscard]] double outside() const noexcept { return bone_->outside(); }
  /// Moves the bone. Throws std::invalid_argument for a pose that is not rigid.
  void set_X_WG(const Posed& X_WG) { bone_->set_X_WG(X_WG); }
  /// Puts the original densities back in up to `max_bricks` edited bricks and returns how many are left. Throws
  /// std::invalid_argument without `keep_original`.
  std::size_t restore(std::size_t max_bricks = std::numeric_limits<std::size_t>::max()) {
    return bone_->restore(max_bricks);
  }
  /// The whole surface; see `bone_mesh`. Throws std::invalid_argument for an isovalue that is not finite.
  [[nodiscard]] Mesh mesh(double isovalue) const { return bone_->mesh(isovalue); }
  /// Another bone with the same densities, original and pose, for a scene of its own.
  [[nodiscard]] Bone copy() const { return Bone(bone_->copy()); }
  /// Takes densities and pose of a copy of this bone, or of what this is a copy of; some microseconds per edited
  /// brick. Throws std::invalid_argument for any other bone, and without `keep_original`.
  void take(const Bone& other) { bone_->take(*other.bone_); }
  /// All voxels, x fastest, for saving. Throws std::invalid_argument for another density or number of voxels.
  template <VoxelDensity Density>
  void copy_voxels(std::span<Density> out) const {
    bone_->copy_voxels({kDensityType<Density>, out.data(), out.size()});
  }
  /// The voxels that `restore` brings back, likewise; the present ones without `keep_original`.
  template <VoxelDensity Density>
  void copy_original(std::span<Density> out) const {
    bone_->copy_original({kDensityType<Density>, out.data(), out.size()});
  }
  /// Takes bone away as far as it is gone in `voxels`, x fastest: lowers each voxel to the density there, where that is
  /// lower. Throws std::invalid_argument likewise.
  template <VoxelDensity Density>
  void lower_to(std::span<Density> voxels) {
    bone_->lower_to({kDensityType<Density>, voxels.data(), voxels.size()});
  }

 private:
  friend class Scene;
  friend class BoneReader;
  explicit Bone(std::shared_ptr<AnyBone> bone) noexcept : bone_(std::move(bone)) {}

  std::shared_ptr<AnyBone> bone_;
};

/// Names the bricks that changed, for a mesher or a saver on another thread; see `trephine::GridReader`. One thread
/// uses a reader, and neither it nor the haptic thread waits. Every brick counts as changed at first.
class BoneReader {
 public:
  static constexpr int kBrick = 8;
  static constexpr int kHaloed = kBrick + 2;

  explicit BoneReader(const Bone& bone) : bone_(bone.bone_), reader_(bone_->make_reader()) {}

  /// Calls `visit(brick index)` for every brick that changed since its last visit; returns how many there were.
  template <class Visit>
  std::size_t poll(Visit&& visit) {
    using Function = std::remove_reference_t<Visit>;
    return reader_->poll([](void* context, std::size_t brick) { (*static_cast<Function*>(context))(brick); },
                         const_cast<void*>(static_cast<const void*>(std::addressof(visit))));
  }
  /// Copies a brick with its halo of a voxel, x fastest, kHaloed³ voxels: voxel (0, 0, 0) of the brick is at (1, 1, 1).
  /// Throws std::invalid_argument for another density, number of voxels or a brick that is none.
  template <VoxelDensity Density>
  void copy_brick(std::size_t brick, std::span<Density> out) const {
    reader_->copy_brick(brick, {kDensityType<Density>, out.data(), out.size()});
  }
  /// Least and greatest density of a brick and its halo: the isosurface is elsewhere where the isovalue is outside.
  /// Throws std::invalid_argument for a brick that is none.
  [[nodiscard]] std::array<double, 2> brick_range(std::size_t brick) const { return reader_->brick_range(brick); }
  /// A brick's share of the surface, and its normals; see `brick_mesh`. Throws std::invalid_argument for a brick that
  /// is none and an isovalue that is not finite.
  [[nodiscard]] Mesh mesh(std::size_t brick, double isovalue,
                          std::vector<std::array<float, 3>>* normals = nullptr) const {
    return reader_->mesh(brick, isovalue, normals);
  }

 private:
  std::shared_ptr<const AnyBone> bone_;
  std::unique_ptr<AnyReader> reader_;
};

/// The easy API: a scene whose renderer and stages are chosen at run time, by the same options as a HapticScene's. The
/// library `trephine::compiled` holds its templates, so a program that uses it compiles in seconds.
/// \code
/// Scene scene(bone, 300, Burr{.tip_radius = 1.5_mm}, {.coupled = {.stiffness = 800, .force = 3.3, .torque = 0.1}},
///             {.cut = GeometricCut{}, .limits = {.force = 3.3, .torque = 0.1}});
/// TickResult r = scene.tick({.X_WT = pose, .spindle_on = true}, dt);
/// \endcode
/// Results equal those of the `HapticScene` that lists the same parts, bit for bit, under the same compiler and flags.
/// Statuses, frames and the rule for threads are that scene's too; `ServoLoop` takes either. A scene keeps its bone
/// alive. Cost: a virtual call a tick, and the last two poses where no stage asks for them.
class Scene {
 public:
  static constexpr bool kHasTorque = true;

  /// Throws std::invalid_argument where an option is out of range, friction is asked of Surface, the isovalue is not
  /// finite or the burr is larger than the bone.
  Scene(const Bone& bone, double isovalue, const Burr& burr, const RendererOptions& renderer = {},
        const StageOptions& stages = {})
      : bone_(bone), scene_(bone_.bone_->make_scene(isovalue, burr, renderer, stages)), stages_(stages) {}
  /// With a tool of another shape, for the coupled tool alone: include tool/named_tools.hpp or a header of
  /// tool/shapes/. \code Scene scene(bone, 300, tool_by_name("match-head-3").tool); \endcode Throws
  /// std::invalid_argument likewise, and for another renderer.
  Scene(const Bone& bone, double isovalue, const RevolvedTool& tool, const RendererOptions& renderer = {},
        const StageOptions& stages = {})
      : bone_(bone), scene_(bone_.bone_->make_scene(isovalue, tool, renderer, stages)), stages_(stages) {}

  /// One step of the loop; `dt` is the measured time since the last tick [s]. No memory, lock, file or clock.
  [[nodiscard]] TickResult tick(const TickInput& input, double dt) noexcept { return scene_->tick(input, dt); }
  /// Forgets contact, velocity and the state of stages; the bone and all options stay.
  void reset() noexcept { scene_->reset(); }
  /// A scene with the same state in a copy of the bone: both go on with the same bits. Between ticks; not for the
  /// haptic thread. Protections that were made for this scene are not for the copy.
  [[nodiscard]] Scene copy() const {
    Bone bone = bone_.copy();
    std::unique_ptr<AnyScene> scene = scene_->copy(*bone.bone_, stages_);
    return Scene(std::move(bone), std::move(scene), stages_);
  }
  /// Puts bone and state to those of a copy of this scene, or of what this is a copy of, as an undo does. Between
  /// ticks; some microseconds per edited brick, and it may allocate. Protections that were made for this scene are for
  /// it no more. Throws std::invalid_argument for any other scene, and for bone without `keep_original`.
  void take(const Scene& other) {
    bone_.take(other.bone_);
    scene_->take(*other.scene_);
    stages_ = other.stages_;
  }
  /// Takes it that no wrench acts on the hand: see `HapticScene::forget_wrench`.
  void forget_wrench() noexcept { scene_->forget_wrench(); }
  /// True if the wrench never steps: see `HapticScene::bounds_wrench`.
  [[nodiscard]] bool bounds_wrench() const noexcept { return scene_->bounds_wrench(); }

  [[nodiscard]] const StageOptions& stages() const noexcept { return stages_; }
  /// Takes other stages between ticks, on the haptic thread, without memory from the heap. A stage that stays keeps its
  /// state; a stage that comes begins as in a new scene. Throws std::invalid_argument for options out of range, and
  /// then all stages stay as they were.
  void set_stages(const StageOptions& stages) {
    scene_->set_stages(stages);
    stages_ = stages;
  }

  /// Takes another tool between ticks, on the haptic thread, without memory from the heap: a burr or a revolved tool,
  /// whichever the scene was made with, for the coupled tool alone. From the next tick on the scene is as a new one
  /// with that tool. Throws std::invalid_argument for another renderer, a tool larger than the bone, or while
  /// structures are guarded: a guard is made for its tool.
  void set_tool(const RevolvedTool& tool) { scene_->set_tool(tool); }
  void set_tool(const Burr& burr) { scene_->set_tool(burr); }

  /// Guards structures and keeps cuts from them, instead of those before: include compiled/structures.hpp.
  void set_structures(const Structures& structures, std::span<const ProtectedStructure> each,
                      const ProtectionOptions& options = {});
  /// Takes guard and vetoes out; between ticks, haptic thread.
  void clear_structures() noexcept { scene_->clear_structures(); }
  /// Makes guard and vetoes for `exchange`, on any thread and while this scene ticks. Without arguments they protect
  /// nothing. Include compiled/structures.hpp.
  [[nodiscard]] Protection make_protection(const Structures& structures, std::span<const ProtectedStructure> each,
                                           const ProtectionOptions& options = {}) const;
  [[nodiscard]] Protection make_protection() const;
  /// Puts guard and vetoes in, and those before into `protection`; between ticks, haptic thread.
  void exchange(Protection& protection);
  /// What was counted of a structure since its protection came in; zeros for a number that is none. Between ticks,
  /// haptic thread; no memory.
  [[nodiscard]] StructureTotals totals(int structure) const noexcept { return scene_->totals(structure); }
  /// Switches the guard's push, which fades in or out within a margin; between ticks, haptic thread. No memory.
  void set_push(bool on) noexcept { scene_->set_push(on); }
  /// Mends what is torn of soft structures (`Structures::soft`); likewise.
  void heal() noexcept { scene_->heal(); }

  /// Stiffness of the renderer's contact, as felt [N/m].
  [[nodiscard]] double stiffness() const noexcept { return scene_->stiffness(); }
  /// The same as a tangent where the contact presses with `force` [N].
  [[nodiscard]] double tangent_stiffness(double force) const { return scene_->tangent_stiffness(force); }
  /// Poses as the last good tick left them: of the proxy, of the tool to draw, and of the burr that cuts.
  [[nodiscard]] Posed proxy_pose_W() const noexcept { return scene_->proxy_pose_W(); }
  [[nodiscard]] Posed visual_pose_W() const noexcept { return scene_->visual_pose_W(); }
  [[nodiscard]] Posed cutting_pose_W() const noexcept { return scene_->cutting_pose_W(); }
  /// Writes the last good tick's contact points as far as `out` has room; returns how many were written.
  std::size_t contacts_W(std::span<ContactPoint<double>> out) const noexcept { return scene_->contacts_W(out); }
  /// One sentence for each reason why results may be off; see `HapticScene::warnings`.
  [[nodiscard]] std::vector<std::string> warnings() const { return scene_->warnings(); }
  [[nodiscard]] const Bone& bone() const noexcept { return bone_; }
  [[nodiscard]] Bone& bone() noexcept { return bone_; }

 private:
  Scene(Bone bone, std::unique_ptr<AnyScene> scene, const StageOptions& stages)
      : bone_(std::move(bone)), scene_(std::move(scene)), stages_(stages) {}

  Bone bone_;
  std::unique_ptr<AnyScene> scene_;
  StageOptions stages_;
};

}  // namespace trephine::compiled
