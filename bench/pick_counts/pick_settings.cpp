// SPDX-License-Identifier: MIT
#include "pick_study.hpp"
#include "pick_text.hpp"

#include <trephine/device/presets.hpp>
#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/tool/named_tools.hpp>
#include <trephine/tool/revolved_vertices.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace pick {
namespace {

constexpr int kDefaultIterations = 16;
constexpr double kReach = 8;  // voxels that the default 16 moves of half a voxel cover

using namespace trephine;

/// What a renderer reads of the bone: of densities a view of the grid a tick, as a scene makes it …
template <class Renderer>
class Bone {
 public:
  Bone(Renderer&, const Grid& grid, double isovalue) : grid_(&grid), isovalue_(isovalue) {}
  [[nodiscard]] auto field() const {
    return DensityField<std::int16_t, typename Renderer::Scalar, typename Renderer::Gradient>(*grid_, isovalue_);
  }

 private:
  const Grid* grid_;
  double isovalue_;
};

/// … or its surface.
template <AttachesToBone<const Grid> Renderer>
class Bone<Renderer> {
 public:
  Bone(Renderer& renderer, const Grid& grid, double isovalue) : surface_(renderer.attach(grid, isovalue)) {}
  [[nodiscard]] auto field() const { return surface_->view(); }

 private:
  std::shared_ptr<BoneSurface<std::int16_t>> surface_;
};

template <class Renderer>
class RendererPlayer final : public Player {
 public:
  RendererPlayer(Renderer renderer, const Grid& bone, const Scene& scene)
      : renderer_(std::move(renderer)), bone_(renderer_, bone, scene.isovalue), gives_torque_(scene.max_torque > 0) {}

  void play(const std::vector<Case>& cases, std::vector<float>& ns, std::vector<Wrenchd>* wrenches) override {
    using Clock = std::chrono::steady_clock;
    std::size_t tick = 0;
    for (const Case& c : cases) {
      renderer_.reset();
      for (const Posed& X_GT : c.X_GT) {
        const auto start = Clock::now();
        const auto found = renderer_.render(bone_.field(), X_GT.template cast<Scalar>());
        const std::chrono::duration<float, std::nano> took = Clock::now() - start;
        ns[tick] = std::min(ns[tick], took.count());
        ++tick;
        if (!wrenches) continue;
        wrenches->push_back(found.wrench.template cast<double>());
        if (!gives_torque_) wrenches->back().torque.setZero();
      }
    }
  }

 private:
  using Scalar = typename Renderer::Scalar;
  Renderer renderer_;
  Bone<Renderer> bone_;
  bool gives_torque_;
};

template <class Renderer>
std::unique_ptr<Player> player_of(Renderer renderer, const Scene& scene, const Grid& bone) {
  return std::make_unique<RendererPlayer<Renderer>>(std::move(renderer), bone, scene);
}

/// Calls `make` with the tool named, or with the burr.
template <class Make>
std::unique_ptr<Player> with_tool(const Scene& scene, const Make& make) {
  const std::optional<RevolvedTool> tool = scene.tool();
  return tool ? make(*tool) : make(scene.burr);
}

std::unique_ptr<Player> make(const LineSetting& s, const Scene& scene, const Grid& bone) {
  return with_tool(scene, [&](const auto& shape) {
    const ToolDiscretization tool{shape, LineCounts{.shaft = s.vertices}};
    const LineOptions options{.stiffness = scene.stiffness, .proxy = {.step = s.step, .iterations = s.iterations()}};
    return player_of(LineApproxRenderer{tool, options, TranslateRotate{.stepping = {.step = s.step}}}, scene, bone);
  });
}

std::unique_ptr<Player> make(const SurfaceSetting& s, const Scene& scene, const Grid& bone) {
  return with_tool(scene, [&](const auto& shape) {
    const SurfaceCounts counts{.sphere = s.sphere, .slices = s.slices, .per_slice = s.per_slice};
    const ToolDiscretization tool{shape, counts};
    const SurfaceOptions options{.stiffness = scene.stiffness, .search_step = s.search_step, .budget = scene.budget()};
    return player_of(SurfaceApproxRenderer{tool, options}, scene, bone);
  });
}

std::unique_ptr<Player> make(const CoupledSetting&, const Scene& scene, const Grid& bone) {
  return with_tool(scene, [&](const auto& shape) {
    return player_of(CoupledToolRenderer{shape, scene.coupled_options()}, scene, bone);
  });
}

}  // namespace

std::optional<RevolvedTool> Scene::tool() const {
  if (tool_name.empty()) return std::nullopt;
  return tool_by_name(tool_name).tool;
}

CoupledOptions Scene::coupled_options() const {
  if (!device.empty()) return device_preset(device);
  return {.stiffness = stiffness, .force = max_force, .torque = max_torque};
}

std::optional<StiffnessBudget> Scene::budget() const {
  if (device.empty()) return std::nullopt;
  return device_preset(device).budget;
}

int LineSetting::iterations() const {
  return std::clamp(static_cast<int>(std::ceil(kReach / step)), kDefaultIterations, 1000);
}

Algorithm algorithm_of(const Setting& setting) { return kAlgorithms[setting.index()]; }

std::string describe(const Setting& setting) {
  if (const auto* l = std::get_if<LineSetting>(&setting))
    return text("%d vertices, steps of %.4g voxel", l->vertices, l->step);
  if (std::holds_alternative<CoupledSetting>(setting)) return "nothing to choose";
  const auto& s = std::get<SurfaceSetting>(setting);
  return text("sphere %d, %d slices of %d, search in steps of %.4g voxel", s.sphere, s.slices, s.per_slice,
              s.search_step);
}

std::vector<Setting> settings_to_try(Algorithm algorithm, bool quick) {
  using Ints = std::vector<int>;
  using Steps = std::vector<double>;
  std::vector<Setting> all;
  if (algorithm == Algorithm::kLine) {
    const Ints vertices =
        quick ? Ints{20, 50, 100, 200, 400} : Ints{10, 20, 35, 50, 75, 100, 150, 200, 300, 400, 600, 1000};
    const Steps steps = {1, 0.5, 0.25};
    for (const int n : vertices)
      for (const double step : steps) all.emplace_back(LineSetting{n, step});
    return all;
  }
  if (algorithm == Algorithm::kCoupled) return {CoupledSetting{}};
  const Ints sphere = quick ? Ints{26, 100, 400} : Ints{26, 50, 100, 200, 400, 800};
  const Ints slices = quick ? Ints{20, 40, 80, 160} : Ints{10, 20, 40, 80, 160, 320};
  const Ints per_slice = quick ? Ints{8, 16, 32} : Ints{4, 8, 16, 32};
  const Steps steps = quick ? Steps{0.5} : Steps{1, 0.5};
  for (const int a : sphere)
    for (const int b : slices)
      for (const int c : per_slice) {
        // Fine along the shaft and coarse round it, or the other way, is waste.
        if (c > 2 * b || b > 20 * c) continue;
        for (const double step : steps) all.emplace_back(SurfaceSetting{a, b, c, step});
      }
  return all;
}

Setting truth_setting(Algorithm algorithm, bool quick) {
  if (algorithm == Algorithm::kLine) return LineSetting{quick ? 2000 : 4000, quick ? 0.0625 : 0.03125};
  if (algorithm == Algorithm::kCoupled) return CoupledSetting{};
  return quick ? SurfaceSetting{2000, 160, 32, 0.125} : SurfaceSetting{4000, 320, 64, 0.0625};
}

Setting check_setting(Algorithm algorithm, bool quick) {
  if (algorithm == Algorithm::kLine) return LineSetting{quick ? 1000 : 2000, quick ? 0.125 : 0.0625};
  if (algorithm == Algorithm::kCoupled) return CoupledSetting{};
  return quick ? SurfaceSetting{1000, 80, 16, 0.25} : SurfaceSetting{2000, 160, 32, 0.125};
}

std::unique_ptr<Player> make_player(const Setting& setting, const Scene& scene, const Grid& bone) {
  return std::visit([&](const auto& s) { return make(s, scene, bone); }, setting);
}

}  // namespace pick
