// SPDX-License-Identifier: MIT
#pragma once

#include "render/coupled_helpers.hpp"

#include <trephine/stage/cutting.hpp>
#include <trephine/stage/cutting_force.hpp>
#include <trephine/tool/named_tools.hpp>
#include <trephine/voxel/pressure_cut.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

/// Burrs that a hand pushes along their axis through layers of bone, in whole scenes.
namespace trephine::test::cutting {

using namespace trephine::test::coupled;

/// A layer of bone below the one before.
struct Layer {
  double thickness;  // [m]
  double density;    // [HU]
};

/// Layers from a plane down, in air.
struct LayeredBone {
  std::vector<Layer> layers;
  Vec3d up = Vec3d::UnitZ();
  Vec3d offset = Vec3d::Zero();  // of the top from 4.5 mm above the volume's middle
  static constexpr double kIso = 300, kAir = -1000, kSpacing = 2.5e-4, kBlur = 0.7;
  static constexpr std::array<int, 3> kSize{36, 36, 52};

  [[nodiscard]] ImageOptions options() const { return {.size = kSize, .spacing = Vec3d::Constant(kSpacing)}; }
  [[nodiscard]] Vec3d top() const { return options().middle() + 4.5e-3 * up + offset; }
  [[nodiscard]] Bone image() const {
    const double width = kBlur * kSpacing * std::sqrt(2.0);
    return make_bone(options(), [&](int i, int j, int k) {
      const double deep = (top() - kSpacing * Vec3d(i, j, k)).dot(up);
      double density = kAir, from = 0;
      for (const Layer& l : layers) {
        const double to = from + l.thickness;
        density += (l.density - kAir) / 2 * (std::erf((deep - from) / width) - std::erf((deep - to) / width));
        from = to;
      }
      return density;
    });
  }
};

/// A hand that pushes with up to a force, and moves no faster than `fastest`. The tool hangs behind it by the force
/// over its stiffness.
struct Push {
  double force = 5;         // [N]
  double fastest = 2e-3;    // [m/s]
  double stiffness = 8000;  // [N/m]
};

/// Cuts down from just above the top of layers.
template <class Law>
class PushedCut {
 public:
  PushedCut(const LayeredBone& layers, const RevolvedTool& tool, const Law& law, const Push& push)
      : up_(layers.up),
        top_(layers.top()),
        radius_(tool.burr().tip_radius),
        R_(tool_at(Vec3d::Zero(), up_).linear()),
        push_(push),
        bone_(layers.image()),
        scene_(bone_, LayeredBone::kIso,
               CoupledToolRenderer{tool, CoupledOptions{.stiffness = push.stiffness, .force = 100}},
               Cutting{PressureCut{}, law}) {}

  TickResult tick(double dt) {
    const TickResult r = scene_.tick({.X_WT = make_pose<double>(R_, top_ + height_ * up_), .spindle_on = true}, dt);
    status_ = worse(status_, r.status);
    const double wanted = radius_ - tip() - push_.force / push_.stiffness;
    height_ += std::clamp(wanted - height_, -push_.fastest * dt, push_.fastest * dt);
    return r;
  }
  /// Ticks of 1 ms until the tip is so deep [m], in ten seconds.
  void go(double deep) {
    int ticks = 0;
    do static_cast<void>(tick(1e-3));
    while (++ticks < 10'000 && tip() < deep);
    REQUIRE(tip() >= deep);
  }
  /// Depth of the tool's tip below the top [m], after a tick.
  [[nodiscard]] double tip() const {
    return radius_ - (scene_.renderer().proxy_pose().translation().template cast<double>() - top_).dot(up_);
  }
  [[nodiscard]] const Law& law() const { return scene_.cutting().law(); }
  [[nodiscard]] const CuttingReport& report() const { return law().report(); }
  [[nodiscard]] const Vec3d& up() const { return up_; }
  [[nodiscard]] Status status() const { return status_; }

 private:
  using Scene = HapticScene<std::int16_t, CoupledToolRenderer<RevolvedTool>, Cutting<PressureCut, Law>>;
  Vec3d up_, top_;
  double radius_, height_ = radius_ + 1e-4;
  Mat3d R_;
  Push push_;
  Bone bone_;
  Scene scene_;
  Status status_ = Status::kOk;
};

/// A round burr whose neck is as long as the layers are deep.
[[nodiscard]] inline RevolvedTool long_round(double radius) {
  return RoundBurr{.radius = radius, .shank = {.neck_radius = 0.6 * radius, .neck_length = 12e-3}};
}

}  // namespace trephine::test::cutting
