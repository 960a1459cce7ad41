// SPDX-License-Identifier: MIT
#pragma once

#include "stability/tool.hpp"

#include <utility>

namespace trephine::bench {

/// A stage that may be off.
template <class S>
struct Switched : S {
  bool on;
  explicit Switched(const std::optional<typename S::Options>& options)
      : S(options.value_or(typename S::Options{})), on(options.has_value()) {}
  void apply(const TickContext& context, Wrenchd& wrench) noexcept {
    if (on) S::apply(context, wrench);
  }
};

/// Wears what the burr covers at a rate, or lets the surface recede at a speed.
class EitherMilling {
 public:
  explicit EitherMilling(const Setup& s)
      : recedes_(s.mill_speed > 0),
        at_rate_(RateLimitedCut<>{.rate = s.mill_rate > 0 ? s.mill_rate : 1}),
        at_speed_(AdvancingCut{.speed = recedes_ ? s.mill_speed : 1}) {}
  void reset() noexcept {
    at_rate_.reset();
    at_speed_.reset();
  }
  template <class Grid>
  double carve(Grid& grid, double isovalue, const Posed& from, const Posed& to, const Burr& burr,
               const CarveContext& context) noexcept {
    return recedes_ ? at_speed_.carve(grid, isovalue, from, to, burr, context)
                    : at_rate_.carve(grid, isovalue, from, to, burr, context);
  }

 private:
  bool recedes_;
  Milling<RateLimitedCut<>> at_rate_;
  Milling<AdvancingCut> at_speed_;
};

template <class R>
[[nodiscard]] auto make_scene(R renderer, const Setup& setup, Bone& bone, double isovalue) {
  const Stack& s = setup.stack;
  return HapticScene{bone,
                     isovalue,
                     std::move(renderer),
                     EitherMilling(setup),
                     Switched<HuntCrossley>(s.hunt_crossley),
                     Switched<Damping>(s.damping),
                     Switched<FirstOrderFilter>(s.filter),
                     Switched<PassivityController>(s.passivity),
                     Switched<WrenchRateLimit>(s.rate),
                     s.limits};
}

template <class Scene>
class Ticked final : public AnyTool {
 public:
  Ticked(Scene scene, bool mills) : scene_(std::move(scene)), mills_(mills) {}
  TickResult tick(const TickInput& input, double dt) noexcept override {
    return scene_.tick({input.X_WT, input.spindle_on && mills_}, dt);
  }
  void reset() noexcept override { scene_.reset(); }

 private:
  Scene scene_;
  bool mills_;
};

template <class R>
[[nodiscard]] std::unique_ptr<AnyTool> wrapped(R renderer, const Setup& setup, Bone& bone, double isovalue) {
  auto scene = make_scene(std::move(renderer), setup, bone, isovalue);
  return std::make_unique<Ticked<decltype(scene)>>(std::move(scene), setup.mill_rate > 0 || setup.mill_speed > 0);
}

}  // namespace trephine::bench
