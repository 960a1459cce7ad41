// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/compiled/any_scene.hpp>
#include <trephine/compiled/optional_stage.hpp>
#include <trephine/guide/guides.hpp>
#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/stage/passivity_controller.hpp>
#include <trephine/structure/structure_veto.hpp>
#include <trephine/tool/any_tool.hpp>
#include <trephine/voxel/brick_mesh.hpp>
#include <trephine/voxel/grid_reader.hpp>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

/// Bodies of the compiled library. CMake compiles them, a unit a density; without CMake a unit reads
/// `#include <trephine/compiled/library.hpp>` and `template struct trephine::compiled::BoneMaker<std::int16_t>;`.
namespace trephine::inline TREPHINE_ALIGNED::compiled {

/// Totals of a guard and a floor, each of which may be absent.
template <VoxelDensity Density>
[[nodiscard]] StructureTotals totals_of(int breaches, const CutFloor<Density>* floor, int structure) noexcept {
  if (floor == nullptr) return {.breaches = breaches};
  return {breaches, floor->refused_mm3(structure), floor->taken_mm3(structure)};
}

template <VoxelDensity Density>
class ProtectionOf final : public AnyProtection {
 public:
  explicit ProtectionOf(std::uint64_t scene) : of_scene(scene) {}

  StructureTotals totals(int structure) const noexcept override {
    return totals_of(guard ? guard->breaches(structure) : 0, floor.get(), structure);
  }

  std::uint64_t of_scene;
  std::shared_ptr<AnyGuard> guard{};
  std::shared_ptr<CutFloor<Density>> floor{};
};

template <VoxelDensity Density, class ContactRenderer>
class SceneOf final : public AnyScene {
  static constexpr bool kLoads = CutsByPressure<ContactRenderer>;  // the coupled tool
  using ProtectionPart = std::conditional_t<kLoads, LoadingProtection<Density>, OptionalProtection<Density>>;

 public:
  SceneOf(VoxelGrid<Density>& grid, double isovalue, const AnyTool& tool, ContactRenderer renderer,
          const StageOptions& o)
      : tool_(tool),
        scene_(grid, isovalue, std::move(renderer), Cut(o.cut, OptionalLaw(o.law), o.cutting),
               OptionalStage<ReleaseLimit>(o.release_limit), OptionalStage<HuntCrossley>(o.hunt_crossley),
               OptionalStage<MillingVibration>(o.vibration), OptionalStage<Damping>(o.damping),
               OptionalStage<FirstOrderFilter>(o.filter), OptionalStage<AxisGuide>(o.axis_guide),
               OptionalStage<DepthStop>(o.depth_stop), ProtectionPart{},
               OptionalStage<PassivityController>(o.passivity), OptionalStage<WrenchRateLimit>(o.rate_limit),
               o.limits) {
    check_cut(o);
  }

  TickResult tick(const TickInput& input, double dt) noexcept override { return scene_.tick(input, dt); }
  void reset() noexcept override { scene_.reset(); }
  void forget_wrench() noexcept override { scene_.forget_wrench(); }
  bool bounds_wrench() const noexcept override { return scene_.bounds_wrench(); }
  void take(const AnyScene& other) override {
    const auto* const same = dynamic_cast<const SceneOf*>(&other);
    if (same == nullptr)
      refuse("compiled::Scene", "take needs a scene with the same renderer and density type", "another scene");
    scene_.take(same->scene_);
    tool_ = same->tool_;
    number_ = trephine::detail::unique_number();  // protections were made for another tool, maybe
  }
  std::unique_ptr<AnyScene> copy(AnyBone& bone, const StageOptions& stages) const override;
  void set_stages(const StageOptions& o) override {
    o.validate();
    check_cut(o);
    if (!o.cut.is_none()) check_slope(scene_.bone(), scene_.isovalue(), o.cutting.slope);
    auto& cutting = scene_.cutting();
    cutting.adopt(o.cut);
    cutting.adopt(o.cutting);
    cutting.law().adopt(o.law);
    part<OptionalStage<ReleaseLimit>>().adopt(o.release_limit);
    part<OptionalStage<HuntCrossley>>().adopt(o.hunt_crossley);
    part<OptionalStage<MillingVibration>>().adopt(o.vibration);
    part<OptionalStage<Damping>>().adopt(o.damping);
    part<OptionalStage<FirstOrderFilter>>().adopt(o.filter);
    part<OptionalStage<AxisGuide>>().adopt(o.axis_guide);
    part<OptionalStage<DepthStop>>().adopt(o.depth_stop);
    part<OptionalStage<PassivityController>>().adopt(o.passivity);
    part<OptionalStage<WrenchRateLimit>>().adopt(o.rate_limit);
    part<DeviceLimits>().adopt(o.limits);
  }
  void set_tool(const Burr& burr) override { set_any_tool(burr); }
  void set_tool(const RevolvedTool& tool) override { set_any_tool(tool); }
  std::unique_ptr<AnyProtection> make_protection(const AnyStructures* structures,
                                                 std::span<const ProtectedStructure> each,
                                                 const ProtectionOptions& options) const override {
    auto made = std::make_unique<ProtectionOf<Density>>(number_);
    if (structures == nullptr) return made;
    made->guard = structures->make_guard(tool_, each, options);
    if constexpr (!kLoads)
      if (made->guard->is_soft())
        refuse("compiled::Scene", "soft structures are for the coupled tool", "another renderer");
    std::vector<StructureVeto> vetoes;
    bool any = false;
    for (const ProtectedStructure& s : each) {
      vetoes.push_back(s.veto);
      any = any || vetoes.back().mode != StructureVeto::Mode::kFree;
    }
    if (any)
      made->floor = make_cut_floor(structures->field(), structures->X_GS(), scene_.bone(), scene_.isovalue(), vetoes);
    return made;
  }
  void exchange(AnyProtection& protection) override {
    auto* const other = dynamic_cast<ProtectionOf<Density>*>(&protection);
    if (other == nullptr || other->of_scene != number_)
      refuse("compiled::Scene", "exchange needs a protection made for this scene", "another scene's");
    take(*other);
  }
  void clear_structures() noexcept override {
    ProtectionOf<Density> none(number_);
    take(none);
  }
  StructureTotals totals(int structure) const noexcept override {
    const auto& protection = part<ProtectionPart>();
    return totals_of(protection.breaches(structure), protection.cut_floor(), structure);
  }
  void set_push(bool on) noexcept override { part<ProtectionPart>().set_push(on); }
  void heal() noexcept override { part<ProtectionPart>().heal(); }
  double stiffness() const noexcept override { return scene_.stiffness(); }
  double tangent_stiffness(double force) const override {
    if constexpr (requires { scene_.tangent_stiffness(force); })
      return scene_.tangent_stiffness(force);
    else
      return scene_.stiffness();
  }
  Posed proxy_pose_W() const noexcept override { return scene_.proxy_pose_W(); }
  Posed visual_pose_W() const noexcept override { return scene_.visual_pose_W(); }
  Posed cutting_pose_W() const noexcept override { return scene_.cutting_pose_W(); }
  std::size_t contacts_W(std::span<ContactPoint<double>> out) const noexcept override { return scene_.contacts_W(out); }
  std::vector<std::string> warnings() const override { return scene_.warnings(); }

 private:
  template <class Part>
  Part& part() noexcept {
    return scene_.template part<Part>();
  }
  template <class Part>
  const Part& part() const noexcept {
    return scene_.template part<Part>();
  }

  /// Throws std::invalid_argument for a cut by pressure with a renderer that does not tell where bone presses.
  static void check_cut(const StageOptions& o) {
    if constexpr (!CutsByPressure<ContactRenderer>)
      if (o.cut.kind() == CutKind::kByPressure)
        refuse("compiled::StageOptions", "a PressureCut is for the coupled tool", "another renderer");
  }

  /// Exchanges guard and floor.
  void take(ProtectionOf<Density>& other) noexcept {
    auto& protection = part<ProtectionPart>();
    if (protection.cut_floor() != other.floor.get()) scene_.cutting().forget_path();
    if (other.guard) other.guard->reset();
    protection.swap(other.guard, other.floor);
  }

  void set_any_tool(const AnyTool& tool) {
    if constexpr (!ChangesTool<ContactRenderer>) {
      refuse("compiled::Scene", "set_tool is for the coupled tool", "another renderer");
    } else {
      if (part<ProtectionPart>().has_guard())
        refuse("compiled::Scene", "set_tool must be between clear_structures and set_structures", "a guarded scene");
      check_tool_size(scene_.bone(), tool.burr());
      scene_.renderer().set_tool(tool);
      tool_ = tool;
      number_ = trephine::detail::unique_number();  // protections made for the last tool are of another scene now
    }
  }

  using Cut = Cutting<AnyCut, OptionalLaw>;

  std::uint64_t number_ = trephine::detail::unique_number();
  AnyTool tool_;  // a renderer's own may be wider
  HapticScene<Density, ContactRenderer, Cut, OptionalStage<ReleaseLimit>, OptionalStage<HuntCrossley>,
              OptionalStage<MillingVibration>, OptionalStage<Damping>, OptionalStage<FirstOrderFilter>,
              OptionalStage<AxisGuide>, OptionalStage<DepthStop>, ProtectionPart, OptionalStage<PassivityController>,
              OptionalStage<WrenchRateLimit>, DeviceLimits>
      scene_;
};

inline void check_isovalue(double isovalue) {
  if (!is_finite(isovalue)) refuse("compiled::Bone", "the isovalue of a mesh must be finite", isovalue);
}

/// Throws std::invalid_argument for a brick that is none.
inline void check_brick(std::size_t brick, std::size_t count) {
  if (!(brick < count)) refuse("compiled::BoneReader", "there is no such brick", brick);
}

template <VoxelDensity Density>
class ReaderOf final : public AnyReader {
 public:
  explicit ReaderOf(const VoxelGrid<Density>& grid) : reader_(grid) {}

  std::size_t poll(Visit visit, void* context) override {
    return reader_.poll([&](std::size_t brick) { visit(context, brick); });
  }
  void copy_brick(std::size_t brick, const VoxelBuffer& out) const override {
    constexpr auto kSide = static_cast<std::size_t>(GridReader<Density>::kHaloed);
    constexpr std::size_t kCount = kSide * kSide * kSide;
    check_brick(brick, reader_.brick_count());
    if (out.type != kDensityType<Density>)
      refuse("compiled::BoneReader", "copy_brick needs the bone's own density", static_cast<int>(out.type));
    if (out.count != kCount) refuse("compiled::BoneReader", "copy_brick needs room for 1000 voxels", out.count);
    static_cast<void>(reader_.copy_brick(brick, std::span<Density, kCount>(static_cast<Density*>(out.voxels), kCount)));
  }
  std::array<double, 2> brick_range(std::size_t brick) const override {
    check_brick(brick, reader_.brick_count());
    const DensityRange<Density> range = reader_.brick_range(brick);
    return {static_cast<double>(range.min), static_cast<double>(range.max)};
  }
  Mesh mesh(std::size_t brick, double isovalue, std::vector<std::array<float, 3>>* normals) const override {
    check_brick(brick, reader_.brick_count());
    check_isovalue(isovalue);
    return brick_mesh(reader_, brick, isovalue, normals);
  }

 private:
  GridReader<Density> reader_;
};

template <VoxelDensity Density>
class BoneOf final : public AnyBone {
 public:
  BoneOf(const GridGeometry& geometry, std::span<const Density> voxels, const GridOptions& options)
      : grid_(geometry, voxels, options) {}
  explicit BoneOf(VoxelGrid<Density> grid) : grid_(std::move(grid)) {}

  DensityType density_type() const noexcept override { return kDensityType<Density>; }
  const std::array<int, 3>& size() const noexcept override { return grid_.size(); }
  const std::array<int, 3>& bricks() const noexcept override { return grid_.bricks(); }
  const Vec3d& spacing() const noexcept override { return grid_.spacing(); }
  const Posed& X_WG() const noexcept override { return grid_.X_WG(); }
  void set_X_WG(const Posed& X_WG) override { grid_.set_X_WG(X_WG); }
  std::size_t restore(std::size_t max_bricks) override { return grid_.restore(max_bricks); }
  VoxelGrid<Density>& grid() noexcept { return grid_; }
  double outside() const noexcept override { return static_cast<double>(grid_.outside()); }
  Mesh mesh(double isovalue) const override {
    check_isovalue(isovalue);
    return bone_mesh(grid_, isovalue);
  }
  std::shared_ptr<AnyBone> copy() const override { return std::make_shared<BoneOf>(grid_.copy()); }
  void take(const AnyBone& other) override {
    const auto* const same = dynamic_cast<const BoneOf*>(&other);
    if (same == nullptr) refuse("compiled::Bone", "take needs a copy of this bone", "another density type");
    grid_.take(same->grid_);
  }
  void copy_voxels(const VoxelBuffer& out) const override { grid_.copy_voxels(checked("copy_voxels", out)); }
  void copy_original(const VoxelBuffer& out) const override {
    Density* to = checked("copy_original", out).data();
    for_each_row(
        [&](int j, int k) { to = std::copy_n(grid_.original_data() + grid_.index(0, j, k), grid_.size()[0], to); });
  }
  void lower_to(const VoxelBuffer& voxels) override {
    const Density* from = checked("lower_to", voxels).data();
    for_each_row(
        [&](int j, int k) { grid_.lower_row(j, k, 0, grid_.size()[0] - 1, [&](int, Density) { return *from++; }); });
    grid_.commit();
  }
  std::unique_ptr<AnyReader> make_reader() const override { return std::make_unique<ReaderOf<Density>>(grid_); }
  std::unique_ptr<AnyScene> make_scene(double isovalue, const Burr& burr, const RendererOptions& o,
                                       const StageOptions& stages) override {
    const auto scene = [&]<class R>(R renderer) { return scene_of(isovalue, burr, std::move(renderer), stages); };
    switch (o.renderer) {
      case RendererKind::kCoupled:
        return coupled_scene(isovalue, burr, o, stages);
      case RendererKind::kLine:
        return scene(LineApproxRenderer{ToolDiscretization{burr, o.line_counts}, o.line, TranslateRotate{},
                                        o.friction.value_or(frictionless())});
      case RendererKind::kSurface:
        if (o.friction) refuse("compiled::RendererOptions", "Surface has no friction", "Coulomb");
        return scene(SurfaceApproxRenderer{ToolDiscretization{burr, o.surface_counts}, o.surface});
    }
    refuse("compiled::RendererOptions", "renderer must be one of RendererKind's", static_cast<int>(o.renderer));
  }
  std::unique_ptr<AnyScene> make_scene(double isovalue, const RevolvedTool& tool, const RendererOptions& o,
                                       const StageOptions& stages) override {
    if (o.renderer != RendererKind::kCoupled)
      refuse("compiled::Scene", "only the coupled tool has another shape than a burr; line and surface take a Burr",
             o.renderer == RendererKind::kLine      ? "line"
             : o.renderer == RendererKind::kSurface ? "surface"
                                                    : "no renderer");
    return coupled_scene(isovalue, tool, o, stages);
  }

 private:
  /// Slides as without friction, bit for bit and at no cost.
  [[nodiscard]] static Coulomb frictionless() { return Coulomb{0, 0}; }

  /// The buffer as voxels. Throws std::invalid_argument for another density or number of them.
  [[nodiscard]] std::span<Density> checked(const std::string& member, const VoxelBuffer& buffer) const {
    if (buffer.type != kDensityType<Density>)
      refuse("compiled::Bone", member + " needs the bone's own density", static_cast<int>(buffer.type));
    const std::size_t count =
        static_cast<std::size_t>(size()[0]) * static_cast<std::size_t>(size()[1]) * static_cast<std::size_t>(size()[2]);
    if (buffer.count != count)
      refuse("compiled::Bone", member + " needs " + std::to_string(count) + " voxels", buffer.count);
    return {static_cast<Density*>(buffer.voxels), buffer.count};
  }
  template <class Visit>
  void for_each_row(Visit&& visit) const {
    for (int k = 0; k < size()[2]; ++k)
      for (int j = 0; j < size()[1]; ++j) visit(j, k);
  }
  [[nodiscard]] std::unique_ptr<AnyScene> coupled_scene(double isovalue, const AnyTool& tool, const RendererOptions& o,
                                                        const StageOptions& stages) {
    return scene_of(isovalue, tool, CoupledToolRenderer{tool, o.coupled, o.friction.value_or(frictionless())}, stages);
  }
  /// Checks stages after the renderer, whose options are refused first.
  template <class R>
  [[nodiscard]] std::unique_ptr<AnyScene> scene_of(double isovalue, const AnyTool& tool, R renderer,
                                                   const StageOptions& stages) {
    stages.validate();
    return std::make_unique<SceneOf<Density, R>>(grid_, isovalue, tool, std::move(renderer), stages);
  }

  VoxelGrid<Density> grid_;
};

template <VoxelDensity Density, class ContactRenderer>
std::unique_ptr<AnyScene> SceneOf<Density, ContactRenderer>::copy(AnyBone& bone, const StageOptions& stages) const {
  auto& grid = dynamic_cast<BoneOf<Density>&>(bone).grid();
  auto made = std::make_unique<SceneOf>(grid, scene_.isovalue(), tool_, scene_.renderer(), stages);
  made->scene_.take(scene_);
  return made;
}

template <VoxelDensity Density, int kAlignment>
std::shared_ptr<AnyBone> BoneMaker<Density, kAlignment>::make(const GridGeometry& geometry,
                                                              std::span<const Density> voxels,
                                                              const GridOptions& options) {
  return std::make_shared<BoneOf<Density>>(geometry, voxels, options);
}

}  // namespace trephine::compiled
