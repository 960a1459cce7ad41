// SPDX-License-Identifier: MIT
#include "player.hpp"

#include <trephine/render/coupled_tool_renderer.hpp>
#include <trephine/render/line_approx_renderer.hpp>
#include <trephine/render/surface_approx_renderer.hpp>

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <utility>

namespace pick {
namespace {

using namespace trephine;

template <class Renderer>
class RendererPlayer final : public Player {
 public:
  explicit RendererPlayer(Renderer renderer) : renderer_(std::move(renderer)) {}

  void play(const Bones& bones, const std::vector<Case>& cases, std::vector<float>& ns,
            std::vector<Wrenchd>* wrenches) override {
    using Clock = std::chrono::steady_clock;
    std::size_t tick = 0;
    for (const Case& c : cases) {
      renderer_.reset();
      for (const Posed& X_GT : c.X_GT) {
        const auto start = Clock::now();
        const Rendered<float> found = renderer_.render(field_of(bones, c.milled), X_GT.template cast<float>());
        const std::chrono::duration<float, std::nano> took = Clock::now() - start;
        ns[tick] = std::min(ns[tick], took.count());
        ++tick;
        if (wrenches) wrenches->push_back(found.wrench.template cast<double>());
      }
    }
  }

 private:
  /// A view of the grid a tick, as a scene makes it.
  [[nodiscard]] static auto field_of(const Bones& bones, bool milled) {
    if constexpr (requires(Renderer r) { r.depth_map(); })
      return DepthField<float>(milled ? *bones.milled_depth : *bones.whole_depth);
    else
      return DensityField<std::int16_t, float, typename Renderer::Gradient>(milled ? *bones.milled : *bones.whole,
                                                                            bones.isovalue);
  }

  Renderer renderer_;
};

template <class Renderer>
std::unique_ptr<Player> player_of(Renderer renderer) {
  return std::make_unique<RendererPlayer<Renderer>>(std::move(renderer));
}

std::unique_ptr<Player> make(const LineSetting& s, const Scene& scene, const Bones&) {
  const ToolDiscretization tool{scene.burr, LineCounts{.shaft = s.vertices}};
  const LineOptions options{.stiffness = scene.stiffness, .proxy = {.step = s.step, .iterations = s.iterations()}};
  if (s.ray_cast) return player_of(LineApproxRenderer{tool, options, RayCast{.stepping = {.step = s.step}}});
  return player_of(LineApproxRenderer{tool, options, TranslateRotate{.stepping = {.step = s.step}}});
}

std::unique_ptr<Player> make(const SurfaceSetting& s, const Scene& scene, const Bones&) {
  const SurfaceCounts counts{.sphere = s.sphere, .slices = s.slices, .per_slice = s.per_slice};
  const ToolDiscretization tool{scene.burr, counts};
  const SurfaceOptions options{.stiffness = scene.stiffness, .search_step = s.search_step};
  if (s.patches) return player_of(SurfaceApproxRenderer<float, PatchWeights>{tool, options});
  return player_of(SurfaceApproxRenderer<float, AreaWeights>{tool, options});
}

std::unique_ptr<Player> make(const CoupledSetting& s, const Scene& scene, const Bones& bones) {
  if (!bones.whole_depth || !bones.milled_depth) throw std::invalid_argument("make_player: the bones have no depths");
  const SurfaceCounts counts{.sphere = s.sphere, .slices = s.slices, .per_slice = s.per_slice};
  const ToolDiscretization tool{scene.burr, counts};
  const CoupledOptions options{.stiffness = scene.stiffness, .force = scene.max_force, .torque = scene.max_torque};
  return player_of(CoupledToolRenderer{tool, FromDepthMap(*bones.whole_depth), options});
}

}  // namespace

std::unique_ptr<Player> make_player(const Setting& setting, const Scene& scene, const Bones& bones) {
  return std::visit([&](const auto& s) { return make(s, scene, bones); }, setting);
}

}  // namespace pick
