// SPDX-License-Identifier: MIT
#include "player.hpp"

#include <trephine/render/line_approx_renderer.hpp>
#include <trephine/render/surface_approx_renderer.hpp>

#include <algorithm>
#include <chrono>
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
        // A view of the grid a tick, as a scene makes it.
        const DensityField<std::int16_t, float, typename Renderer::Gradient> field(
            c.milled ? *bones.milled : *bones.whole, bones.isovalue);
        const Rendered<float> found = renderer_.render(field, X_GT.template cast<float>());
        const std::chrono::duration<float, std::nano> took = Clock::now() - start;
        ns[tick] = std::min(ns[tick], took.count());
        ++tick;
        if (wrenches) wrenches->push_back(found.wrench.template cast<double>());
      }
    }
  }

 private:
  Renderer renderer_;
};

template <class Renderer>
std::unique_ptr<Player> player_of(Renderer renderer) {
  return std::make_unique<RendererPlayer<Renderer>>(std::move(renderer));
}

std::unique_ptr<Player> make(const LineSetting& s, const Scene& scene) {
  const ToolDiscretization tool{scene.burr, LineCounts{.shaft = s.vertices}};
  const LineOptions options{.stiffness = scene.stiffness, .proxy = {.step = s.step, .iterations = s.iterations()}};
  if (s.ray_cast) return player_of(LineApproxRenderer{tool, options, RayCast{.stepping = {.step = s.step}}});
  return player_of(LineApproxRenderer{tool, options, TranslateRotate{.stepping = {.step = s.step}}});
}

std::unique_ptr<Player> make(const SurfaceSetting& s, const Scene& scene) {
  const SurfaceCounts counts{.sphere = s.sphere, .slices = s.slices, .per_slice = s.per_slice};
  const ToolDiscretization tool{scene.burr, counts};
  const SurfaceOptions options{.stiffness = scene.stiffness, .search_step = s.search_step};
  if (s.patches) return player_of(SurfaceApproxRenderer<float, PatchWeights>{tool, options});
  return player_of(SurfaceApproxRenderer{tool, options});
}

}  // namespace

std::unique_ptr<Player> make_player(const Setting& setting, const Scene& scene) {
  return std::visit([&](const auto& s) { return make(s, scene); }, setting);
}

}  // namespace pick
