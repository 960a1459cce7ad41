// SPDX-License-Identifier: MIT
#pragma once

#include "common/any_milling.hpp"
#include "stability/places.hpp"

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
  const Stack& s = setup.stack;
  const bool recedes = setup.mill_speed > 0, wears = setup.mill_rate > 0;
  const AnyMilling milling(recedes ? Cut::kAdvancing : Cut::kByRate, wears ? setup.mill_rate : 1,
                           recedes ? setup.mill_speed : 1);
  HapticScene scene{bone,
                    isovalue,
                    std::move(renderer),
                    milling,
                    Switched<HuntCrossley>(s.hunt_crossley),
                    Switched<Damping>(s.damping),
                    Switched<FirstOrderFilter>(s.filter),
                    Switched<PassivityController>(s.passivity),
                    Switched<WrenchRateLimit>(s.rate),
                    s.limits};
  return std::make_unique<Ticked<decltype(scene)>>(std::move(scene), wears || recedes);
}

}  // namespace trephine::bench
