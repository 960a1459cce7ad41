// SPDX-License-Identifier: MIT
#pragma once

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
  explicit Ticked(Scene scene) : scene_(std::move(scene)) {}
  TickResult tick(const TickInput& input, double dt) noexcept override { return scene_.tick(input, dt); }
  void reset() noexcept override {
    scene_.reset();
    scene_.forget_wrench();
  }

 private:
  Scene scene_;
};

template <class R>
[[nodiscard]] std::unique_ptr<AnyTool> wrapped(R renderer, const Setup& setup, Bone& bone, double isovalue) {
  const Stack& s = setup.stack;
  std::optional<ReleaseLimit::Options> release = s.release;
  if (release) release->stiffness = 2 * setup.stiffness;  // tip and shaft
  constexpr double kSpeed = 1e-3;                         // of an advancing cut [m/s]
  HapticScene scene{bone,
                    isovalue,
                    std::move(renderer),
                    Cutting{cut_of(setup.cut, setup.mill_rate, kSpeed)},
                    Switched<ReleaseLimit>(release),
                    Switched<HuntCrossley>(s.hunt_crossley),
                    Switched<Damping>(s.damping),
                    Switched<FirstOrderFilter>(s.filter),
                    Switched<PassivityController>(s.passivity),
                    Switched<WrenchRateLimit>(s.rate),
                    s.limits};
  return std::make_unique<Ticked<decltype(scene)>>(std::move(scene));
}

}  // namespace trephine::bench
