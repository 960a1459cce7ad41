// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/compiled/any_scene.hpp>
#include <trephine/compiled/optional_stage.hpp>
#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/stage/damping.hpp>
#include <trephine/stage/first_order_filter.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/stage/hunt_crossley.hpp>
#include <trephine/stage/milling_vibration.hpp>
#include <trephine/stage/passivity_controller.hpp>
#include <trephine/stage/release_limit.hpp>
#include <trephine/stage/wrench_rate_limit.hpp>
#include <trephine/structure/structure_veto.hpp>
#include <trephine/voxel/grid_reader.hpp>

#include <atomic>
#include <concepts>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

/// Bodies of the compiled library. CMake compiles them, a unit a density; without CMake a unit reads
/// `#include <trephine/compiled/library.hpp>` and `template struct trephine::compiled::BoneMaker<std::int16_t>;`.
namespace trephine::inline TREPHINE_ALIGNED::compiled {

/// The stages of a header scene, of the options of a compiled scene; each scene makes its own milling.
struct SceneParts {
  std::optional<Milling> milling;
  OptionalStage<trephine::ReleaseLimit>::Options release_limit{};
  OptionalStage<trephine::HuntCrossley>::Options hunt_crossley{};
  OptionalCutting::Options cutting{};
  OptionalStage<trephine::MillingVibration>::Options vibration{};
  OptionalStage<trephine::Damping>::Options damping{};
  OptionalStage<trephine::FirstOrderFilter>::Options filter{};
  OptionalStage<trephine::PassivityController>::Options passivity{};
  OptionalStage<trephine::WrenchRateLimit>::Options rate_limit{};
  trephine::DeviceLimits limits{};

  /// Throws std::invalid_argument where an option is out of range.
  explicit SceneParts(const StageOptions& o) : milling(o.milling) {
    if (const auto& s = o.release_limit)
      release_limit = {
          .stiffness = s->stiffness, .rotational_stiffness = s->rotational_stiffness, .release = s->release};
    if (const auto& s = o.hunt_crossley)
      hunt_crossley = {.lambda = s->lambda, .max_factor = s->max_factor, .lever = s->lever};
    if (const auto& s = o.cutting)
      cutting = {.edges = s->edges,
                 .speed = s->speed,
                 .clockwise = s->clockwise,
                 .stall_torque = s->stall_torque,
                 .strength = {.soft = s->soft, .cortical = s->cortical},
                 .felt = s->felt};
    if (milling && milling->cut == Cut::kPressure && !cutting)
      refuse("compiled::Milling", "Cut::kPressure needs a law: give StageOptions::cutting", "none");
    if (const auto& s = o.vibration)
      vibration = {.frequency = s->frequency,
                   .per_force = s->per_force,
                   .per_removal = s->per_removal,
                   .amplitude_limit = s->amplitude_limit};
    if (const auto& s = o.damping)
      damping = {.linear = s->linear, .angular = s->angular, .only_in_contact = s->only_in_contact};
    if (const auto& s = o.filter) filter = {.cutoff = s->cutoff};
    if (const auto& s = o.passivity)
      passivity = {.stiffness = s->stiffness,
                   .angular_stiffness = s->angular_stiffness,
                   .delay = s->delay,
                   .quantum = s->quantum,
                   .angular_quantum = s->angular_quantum,
                   .contact_stiffness = s->contact_stiffness,
                   .contact_angular_stiffness = s->contact_angular_stiffness,
                   .damping = s->damping,
                   .angular_damping = s->angular_damping,
                   .force = s->force,
                   .torque = s->torque,
                   .force_rate = s->force_rate,
                   .torque_rate = s->torque_rate,
                   .reserve = s->reserve,
                   .memory = s->memory};
    if (const auto& s = o.rate_limit) rate_limit = {.force = s->force, .torque = s->torque};
    if (const auto& s = o.limits) limits = {.force = s->force, .torque = s->torque};
    const auto validate_given = [](const auto& options) {
      if (options) options->validate();
    };
    validate_given(release_limit);
    validate_given(hunt_crossley);
    validate_given(cutting);
    validate_given(vibration);
    validate_given(damping);
    validate_given(filter);
    validate_given(passivity);
    validate_given(rate_limit);
    limits.validate();
  }
};

/// Throws std::invalid_argument for a mode that is none.
inline StructureVeto veto_of(const Structure& s) {
  switch (s.veto) {
    case VetoMode::kFree:
      return {.mode = StructureVeto::Mode::kFree, .margin = s.veto_margin};
    case VetoMode::kWatch:
      return {.mode = StructureVeto::Mode::kWatch, .margin = s.veto_margin};
    case VetoMode::kProtect:
      return {.mode = StructureVeto::Mode::kProtect, .margin = s.veto_margin};
    case VetoMode::kKeepIn:
      return {.mode = StructureVeto::Mode::kKeepIn, .margin = s.veto_margin};
  }
  refuse("compiled::Structure", "veto must be one of VetoMode's", static_cast<int>(s.veto));
}

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

/// Returns a number that no other scene of the program has.
[[nodiscard]] inline std::uint64_t number_of_scene() noexcept {
  static std::atomic<std::uint64_t> last{0};
  return last.fetch_add(1, std::memory_order_relaxed) + 1;
}

/// `Tool` is the Burr or the RevolvedTool that the scene was made with.
template <VoxelDensity Density, class ContactRenderer, class Tool>
class SceneOf final : public AnyScene {
 public:
  SceneOf(VoxelGrid<Density>& grid, double isovalue, const Tool& tool, ContactRenderer renderer, const SceneParts& p)
      : tool_(tool),
        scene_(grid, isovalue, std::move(renderer), OptionalMilling<Density>(p.milling),
               OptionalStage<trephine::ReleaseLimit>(p.release_limit),
               OptionalStage<trephine::HuntCrossley>(p.hunt_crossley), OptionalCutting(p.cutting),
               OptionalStage<trephine::MillingVibration>(p.vibration), OptionalStage<trephine::Damping>(p.damping),
               OptionalStage<trephine::FirstOrderFilter>(p.filter), OptionalGuard{},
               OptionalStage<trephine::PassivityController>(p.passivity),
               OptionalStage<trephine::WrenchRateLimit>(p.rate_limit), p.limits) {
    check_cut(p);
  }

  TickResult tick(const TickInput& input, double dt) noexcept override { return scene_.tick(input, dt); }
  void reset() noexcept override { scene_.reset(); }
  void forget_wrench() noexcept override { scene_.forget_wrench(); }
  bool bounds_wrench() const noexcept override { return scene_.bounds_wrench(); }
  void set_stages(const StageOptions& stages) override {
    const SceneParts p(stages);
    check_cut(p);
    auto& milling = part<OptionalMilling<Density>>();
    const OptionalMilling<Density> next(p.milling, milling.floor());
    next.validate_for(scene_.bone(), scene_.isovalue());
    milling.adopt(next);
    part<OptionalStage<trephine::ReleaseLimit>>().adopt(p.release_limit);
    part<OptionalStage<trephine::HuntCrossley>>().adopt(p.hunt_crossley);
    part<OptionalCutting>().adopt(p.cutting);
    part<OptionalStage<trephine::MillingVibration>>().adopt(p.vibration);
    part<OptionalStage<trephine::Damping>>().adopt(p.damping);
    part<OptionalStage<trephine::FirstOrderFilter>>().adopt(p.filter);
    part<OptionalStage<trephine::PassivityController>>().adopt(p.passivity);
    part<OptionalStage<trephine::WrenchRateLimit>>().adopt(p.rate_limit);
    part<trephine::DeviceLimits>().adopt(p.limits);
  }
  void set_tool(const Burr& burr) override { set_tool_of_kind(burr); }
  void set_tool(const RevolvedTool& tool) override { set_tool_of_kind(tool); }
  std::unique_ptr<AnyProtection> make_protection(const AnyStructures* structures, std::span<const Structure> each,
                                                 const GuardOptions& options) const override {
    auto made = std::make_unique<ProtectionOf<Density>>(number_);
    if (structures == nullptr) return made;
    made->guard = structures->make_guard(tool_, each, options);
    std::vector<StructureVeto> vetoes;
    bool any = false;
    for (const Structure& s : each) {
      vetoes.push_back(veto_of(s));
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
    return totals_of(part<OptionalGuard>().breaches(structure), part<OptionalMilling<Density>>().floor().get(),
                     structure);
  }
  void set_push(bool on) noexcept override { part<OptionalGuard>().set_push(on); }
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
  static void check_cut(const SceneParts& p) {
    if constexpr (!requires(const ContactRenderer& r) { r.pressure_cutting_pose(0.0); })
      if (p.milling && p.milling->cut == Cut::kPressure)
        refuse("compiled::Milling", "Cut::kPressure is for the coupled tool", "another renderer");
  }

  /// Exchanges guard and floor.
  void take(ProtectionOf<Density>& other) noexcept {
    auto& milling = part<OptionalMilling<Density>>();
    if (milling.floor() != other.floor) {
      std::shared_ptr<CutFloor<Density>> before = milling.floor();
      milling = OptionalMilling<Density>(milling.options(), std::move(other.floor));
      other.floor = std::move(before);
    }
    if (other.guard) other.guard->reset();
    part<OptionalGuard>().swap(other.guard);
  }

  std::uint64_t number_ = number_of_scene();

  template <class Other>
  void set_tool_of_kind(const Other& tool) {
    if constexpr (!requires { scene_.renderer().take_tool_change(); }) {
      refuse("compiled::Scene", "set_tool is for the coupled tool", "another renderer");
    } else if constexpr (!std::same_as<Other, Tool>) {
      refuse("compiled::Scene", "set_tool takes the kind of tool that the scene was made with, Burr or RevolvedTool",
             "the other");
    } else {
      if (part<OptionalGuard>().is_set())
        refuse("compiled::Scene", "set_tool must be between clear_structures and set_structures", "a guarded scene");
      if constexpr (std::same_as<Tool, Burr>) {
        tool.validate();
        scene_.check_size(scene_.bone(), tool);
      } else {
        scene_.check_size(scene_.bone(), tool.burr());
      }
      scene_.renderer().set_tool(tool);
      tool_ = tool;
      number_ = number_of_scene();  // protections made for the last tool are of another scene now
    }
  }

  Tool tool_;  // a renderer's own may be wider
  HapticScene<Density, ContactRenderer, OptionalMilling<Density>, OptionalStage<trephine::ReleaseLimit>,
              OptionalStage<trephine::HuntCrossley>, OptionalCutting, OptionalStage<trephine::MillingVibration>,
              OptionalStage<trephine::Damping>, OptionalStage<trephine::FirstOrderFilter>, OptionalGuard,
              OptionalStage<trephine::PassivityController>, OptionalStage<trephine::WrenchRateLimit>,
              trephine::DeviceLimits>
      scene_;
};

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

 private:
  GridReader<Density> reader_;
};

template <VoxelDensity Density>
class BoneOf final : public AnyBone {
 public:
  BoneOf(const GridGeometry& geometry, std::span<const Density> voxels, const GridOptions& options)
      : grid_(geometry, voxels, options) {}

  DensityType density_type() const noexcept override { return kDensityType<Density>; }
  const std::array<int, 3>& size() const noexcept override { return grid_.size(); }
  const std::array<int, 3>& bricks() const noexcept override { return grid_.bricks(); }
  const Vec3d& spacing() const noexcept override { return grid_.spacing(); }
  const Posed& X_WG() const noexcept override { return grid_.X_WG(); }
  void set_X_WG(const Posed& X_WG) override { grid_.set_X_WG(X_WG); }
  std::size_t restore(std::size_t max_bricks) override { return grid_.restore(max_bricks); }
  void copy_voxels(const VoxelBuffer& out) const override {
    if (out.type != kDensityType<Density>)
      refuse("compiled::Bone", "copy_voxels needs the bone's own density", static_cast<int>(out.type));
    grid_.copy_voxels({static_cast<Density*>(out.voxels), out.count});
  }
  std::unique_ptr<AnyReader> make_reader() const override { return std::make_unique<ReaderOf<Density>>(grid_); }
  std::unique_ptr<AnyScene> make_scene(double isovalue, const Burr& burr, const RendererOptions& o,
                                       const StageOptions& stages) override {
    const auto scene = [&]<class R>(R renderer) { return scene_of(isovalue, burr, std::move(renderer), stages); };
    switch (o.renderer) {
      case RendererKind::kCoupled:
        burr.validate();
        if (o.friction) return scene(CoupledToolRenderer{burr, o.coupled, *o.friction});
        return scene(CoupledToolRenderer{burr, o.coupled});
      case RendererKind::kLine: {
        // Coulomb's law with coefficients of 0 slides as without friction, bit for bit.
        trephine::LineOptions options{.stiffness = o.line.stiffness, .shaft_stiffness = o.line.shaft_stiffness};
        options.budget = o.line.budget;
        return scene(LineApproxRenderer{ToolDiscretization{burr, LineCounts{.shaft = o.line.vertices}}, options,
                                        TranslateRotate{}, o.friction.value_or(Coulomb{0, 0})});
      }
      case RendererKind::kSurface: {
        if (o.friction) refuse("compiled::RendererOptions", "Surface has no friction", "Coulomb");
        trephine::SurfaceOptions options{.stiffness = o.surface.stiffness};
        options.budget = o.surface.budget;
        const SurfaceCounts counts{
            .sphere = o.surface.sphere, .slices = o.surface.slices, .per_slice = o.surface.per_slice};
        return scene(SurfaceApproxRenderer{ToolDiscretization{burr, counts}, options});
      }
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
    return scene_of(isovalue, tool, CoupledToolRenderer{tool, o.coupled, o.friction.value_or(Coulomb{0, 0})}, stages);
  }

 private:
  /// Makes the stages after the renderer, whose options are refused first.
  template <class Tool, class R>
  [[nodiscard]] std::unique_ptr<AnyScene> scene_of(double isovalue, const Tool& tool, R renderer,
                                                   const StageOptions& stages) {
    return std::make_unique<SceneOf<Density, R, Tool>>(grid_, isovalue, tool, std::move(renderer), SceneParts(stages));
  }

  VoxelGrid<Density> grid_;
};

template <VoxelDensity Density, int kAlignment>
std::shared_ptr<AnyBone> BoneMaker<Density, kAlignment>::make(const GridGeometry& geometry,
                                                              std::span<const Density> voxels,
                                                              const GridOptions& options) {
  return std::make_shared<BoneOf<Density>>(geometry, voxels, options);
}

}  // namespace trephine::compiled
