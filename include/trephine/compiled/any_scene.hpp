// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/compiled/options.hpp>
#include <trephine/core/tick.hpp>
#include <trephine/structure/protected_structure.hpp>
#include <trephine/tool/shape.hpp>
#include <trephine/voxel/density_type.hpp>
#include <trephine/voxel/grid_geometry.hpp>
#include <trephine/voxel/mesh.hpp>

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {
class AnyTool;
class RevolvedTool;
class StructureField;
struct LoadSum;
struct TickContext;
}  // namespace trephine

/// The border between a program and the compiled library: interfaces whose bodies the library holds.
namespace trephine::inline TREPHINE_ALIGNED::compiled {

using trephine::DensityType;
using trephine::kDensityType;

/// Voxels of a type that is known at run time.
struct VoxelBuffer {
  DensityType type;
  void* voxels;
  std::size_t count;
};

class Interface {
 public:
  Interface() = default;
  virtual ~Interface() = default;
  Interface(const Interface&) = delete;
  Interface& operator=(const Interface&) = delete;
};

/// A guard as a stage whose body another unit holds, and soft structures as a ToolLoad, which may be absent.
class AnyGuard : public Interface {
 public:
  [[nodiscard]] virtual bool is_soft() const noexcept = 0;
  virtual void begin_tick() noexcept = 0;
  [[nodiscard]] virtual LoadSum press(const Posed& X_GT) noexcept = 0;
  [[nodiscard]] virtual double clearance(const Posed& X_GT) noexcept = 0;
  virtual void settle(const Posed& X_GT, double dt) noexcept = 0;
  virtual void heal() noexcept = 0;
  virtual void apply(const TickContext& context, Wrenchd& wrench) noexcept = 0;
  virtual void add_to(StructureSummary& summary) const noexcept = 0;
  virtual void reset() noexcept = 0;
  virtual void set_push(bool on) noexcept = 0;
  [[nodiscard]] virtual int breaches(int structure) const noexcept = 0;
  [[nodiscard]] virtual std::shared_ptr<AnyGuard> copy() const = 0;
};

/// Guard and vetoes for one scene, while they are not in it.
class AnyProtection : public Interface {
 public:
  [[nodiscard]] virtual StructureTotals totals(int structure) const noexcept = 0;
};

class AnyStructures : public Interface {
 public:
  [[nodiscard]] virtual const StructureField& field() const noexcept = 0;
  [[nodiscard]] virtual const Posed& X_GS() const noexcept = 0;
  [[nodiscard]] virtual int count() const noexcept = 0;
  [[nodiscard]] virtual std::shared_ptr<AnyGuard> make_guard(const AnyTool& tool,
                                                             std::span<const ProtectedStructure> each,
                                                             const ProtectionOptions& options) const = 0;
};

class AnyBone;

class AnyScene : public Interface {
 public:
  [[nodiscard]] virtual TickResult tick(const TickInput& input, double dt) noexcept = 0;
  virtual void reset() noexcept = 0;
  virtual void forget_wrench() noexcept = 0;
  [[nodiscard]] virtual bool bounds_wrench() const noexcept = 0;
  virtual void take(const AnyScene& other) = 0;
  /// A scene with the same state in a copy of the bone.
  [[nodiscard]] virtual std::unique_ptr<AnyScene> copy(AnyBone& bone, const StageOptions& stages) const = 0;
  virtual void set_stages(const StageOptions& stages) = 0;
  virtual void set_tool(const Burr& burr) = 0;
  virtual void set_tool(const RevolvedTool& tool) = 0;
  /// Null structures: one that protects nothing.
  [[nodiscard]] virtual std::unique_ptr<AnyProtection> make_protection(const AnyStructures* structures,
                                                                       std::span<const ProtectedStructure> each,
                                                                       const ProtectionOptions& options) const = 0;
  virtual void exchange(AnyProtection& protection) = 0;
  virtual void clear_structures() noexcept = 0;
  [[nodiscard]] virtual StructureTotals totals(int structure) const noexcept = 0;
  virtual void set_push(bool on) noexcept = 0;
  virtual void heal() noexcept = 0;
  [[nodiscard]] virtual double stiffness() const noexcept = 0;
  [[nodiscard]] virtual double tangent_stiffness(double force) const = 0;
  [[nodiscard]] virtual Posed proxy_pose_W() const noexcept = 0;
  [[nodiscard]] virtual Posed visual_pose_W() const noexcept = 0;
  [[nodiscard]] virtual Posed cutting_pose_W() const noexcept = 0;
  virtual std::size_t contacts_W(std::span<ContactPoint<double>> out) const noexcept = 0;
  [[nodiscard]] virtual std::vector<std::string> warnings() const = 0;
};

class AnyReader : public Interface {
 public:
  using Visit = void (*)(void* context, std::size_t brick);
  virtual std::size_t poll(Visit visit, void* context) = 0;
  virtual void copy_brick(std::size_t brick, const VoxelBuffer& out) const = 0;
  [[nodiscard]] virtual std::array<double, 2> brick_range(std::size_t brick) const = 0;
  [[nodiscard]] virtual Mesh mesh(std::size_t brick, double isovalue,
                                  std::vector<std::array<float, 3>>* normals) const = 0;
};

class AnyBone : public Interface {
 public:
  [[nodiscard]] virtual DensityType density_type() const noexcept = 0;
  [[nodiscard]] virtual const std::array<int, 3>& size() const noexcept = 0;
  [[nodiscard]] virtual const std::array<int, 3>& bricks() const noexcept = 0;
  [[nodiscard]] virtual const Vec3d& spacing() const noexcept = 0;
  [[nodiscard]] virtual const Posed& X_WG() const noexcept = 0;
  virtual void set_X_WG(const Posed& X_WG) = 0;
  virtual std::size_t restore(std::size_t max_bricks) = 0;
  virtual void copy_voxels(const VoxelBuffer& out) const = 0;
  virtual void copy_original(const VoxelBuffer& out) const = 0;
  virtual void lower_to(const VoxelBuffer& voxels) = 0;
  [[nodiscard]] virtual std::shared_ptr<AnyBone> copy() const = 0;
  virtual void take(const AnyBone& other) = 0;
  [[nodiscard]] virtual double outside() const noexcept = 0;
  [[nodiscard]] virtual Mesh mesh(double isovalue) const = 0;
  [[nodiscard]] virtual std::unique_ptr<AnyReader> make_reader() const = 0;
  [[nodiscard]] virtual std::unique_ptr<AnyScene> make_scene(double isovalue, const Burr& burr,
                                                             const RendererOptions& renderer,
                                                             const StageOptions& stages) = 0;
  [[nodiscard]] virtual std::unique_ptr<AnyScene> make_scene(double isovalue, const RevolvedTool& tool,
                                                             const RendererOptions& renderer,
                                                             const StageOptions& stages) = 0;
};

/// Makes a bone. The library defines `make` for each density; the alignment is part of its name, so that a program
/// whose flags give Eigen another alignment than the library's does not link.
template <VoxelDensity Density, int kAlignment = EIGEN_MAX_ALIGN_BYTES>
struct BoneMaker {
  [[nodiscard]] static std::shared_ptr<AnyBone> make(const GridGeometry& geometry, std::span<const Density> voxels,
                                                     const GridOptions& options);
};

}  // namespace trephine::compiled
