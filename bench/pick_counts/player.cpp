// SPDX-License-Identifier: MIT
#include "player.hpp"

#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/stage/haptic_scene.hpp>

#include <algorithm>
#include <chrono>
#include <utility>

namespace pick {
namespace {

using namespace trephine;

/// What a renderer reads of the bones: of densities a view of the grid a tick, as a scene makes it …
template <class Renderer>
class Fields {
 public:
  Fields(Renderer&, const Bones&) {}
  [[nodiscard]] auto of(const Bones& bones, bool milled) const {
    return DensityField<std::int16_t, typename Renderer::Scalar, typename Renderer::Gradient>(
        milled ? *bones.milled : *bones.whole, bones.isovalue);
  }
};

/// … or their surfaces.
template <UsesBoneSurface Renderer>
class Fields<Renderer> {
 public:
  Fields(Renderer& renderer, const Bones& bones)
      : whole_(shared_bone_surface(*bones.whole, bones.isovalue)),
        milled_(shared_bone_surface(*bones.milled, bones.isovalue)) {
    renderer.prepare(whole_->view());
  }
  [[nodiscard]] auto of(const Bones&, bool milled) const { return (milled ? milled_ : whole_)->view(); }

 private:
  std::shared_ptr<BoneSurface<std::int16_t>> whole_, milled_;
};

template <class Renderer>
class RendererPlayer final : public Player {
 public:
  RendererPlayer(Renderer renderer, const Bones& bones) : renderer_(std::move(renderer)), fields_(renderer_, bones) {}

  void play(const Bones& bones, const std::vector<Case>& cases, std::vector<float>& ns,
            std::vector<Wrenchd>* wrenches) override {
    using Clock = std::chrono::steady_clock;
    std::size_t tick = 0;
    for (const Case& c : cases) {
      renderer_.reset();
      for (const Posed& X_GT : c.X_GT) {
        const auto start = Clock::now();
        const auto found = renderer_.render(fields_.of(bones, c.milled), X_GT.template cast<Scalar>());
        const std::chrono::duration<float, std::nano> took = Clock::now() - start;
        ns[tick] = std::min(ns[tick], took.count());
        ++tick;
        if (wrenches) wrenches->push_back(found.wrench.template cast<double>());
      }
    }
  }

 private:
  using Scalar = typename Renderer::Scalar;
  Renderer renderer_;
  Fields<Renderer> fields_;
};

template <class Renderer>
std::unique_ptr<Player> player_of(Renderer renderer, const Bones& bones) {
  return std::make_unique<RendererPlayer<Renderer>>(std::move(renderer), bones);
}

std::unique_ptr<Player> make(const LineSetting& s, const Scene& scene, const Bones& bones) {
  const ToolDiscretization tool{scene.burr, LineCounts{.shaft = s.vertices}};
  const LineOptions options{.stiffness = scene.stiffness, .proxy = {.step = s.step, .iterations = s.iterations()}};
  if (s.ray_cast) return player_of(LineApproxRenderer{tool, options, RayCast{.stepping = {.step = s.step}}}, bones);
  return player_of(LineApproxRenderer{tool, options, TranslateRotate{.stepping = {.step = s.step}}}, bones);
}

std::unique_ptr<Player> make(const SurfaceSetting& s, const Scene& scene, const Bones& bones) {
  const SurfaceCounts counts{.sphere = s.sphere, .slices = s.slices, .per_slice = s.per_slice};
  const ToolDiscretization tool{scene.burr, counts};
  const SurfaceOptions options{.stiffness = scene.stiffness, .search_step = s.search_step};
  if (s.patches) return player_of(SurfaceApproxRenderer<float, PatchWeights>{tool, options}, bones);
  return player_of(SurfaceApproxRenderer<float, AreaWeights>{tool, options}, bones);
}

std::unique_ptr<Player> make(const CoupledSetting&, const Scene& scene, const Bones& bones) {
  const CoupledOptions options{.stiffness = scene.stiffness, .force = scene.max_force, .torque = scene.max_torque};
  return player_of(CoupledToolRenderer{scene.burr, options}, bones);
}

}  // namespace

std::unique_ptr<Player> make_player(const Setting& setting, const Scene& scene, const Bones& bones) {
  return std::visit([&](const auto& s) { return make(s, scene, bones); }, setting);
}

}  // namespace pick
