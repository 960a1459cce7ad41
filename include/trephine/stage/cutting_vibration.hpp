// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/stage/context.hpp>
#include <trephine/stage/cutting_force.hpp>
#include <trephine/tool/tooth_lines.hpp>

#include <cmath>
#include <concepts>
#include <numbers>
#include <utility>

namespace trephine::inline TREPHINE_ALIGNED {

/// A stage of cutting forces that reports them, such as CuttingForce.
template <class C>
concept ReportingCutting = Stage<C> && requires(const C& cutting) {
  { cutting.report() } noexcept -> std::same_as<const CuttingReport&>;
  { cutting.options() } noexcept -> std::same_as<const CuttingForce::Options&>;
};

/// A CuttingForce with the vibration of its teeth: lines at z times the spindle's frequency and its harmonics, in force
/// and torque, that grow with the load and follow the spindle as it slows.
/// \code
/// CuttingVibration law{CuttingForce({.edges = {.flutes = 8}, .speed = rpm(6'000)}), {.depth = 1}};
/// HapticScene scene{bone, 300, CoupledToolRenderer{MatchHead{}}, Cutting{PressureCut{}, law}};
/// \endcode
/// It takes the CuttingForce's place as the law of a `Cutting`. Each tick the edges' wrench
/// of that CuttingForce is multiplied by 1 + depth · ripple (`ToothLines`), so the mean stays. Depth 1 is the ripple of
/// teeth that cut one by one; helical teeth, and heads that cut all round, have less. Thrust, feed and cuts are the
/// CuttingForce's own. Grains of a diamond and unequal teeth add lines at each order of the spindle. Fast teeth are
/// beyond the band of a loop: at 1 kHz lines end at 400 Hz, at 10 kHz at 4 kHz, and none aliases. At stall the ripple
/// stands with the teeth.
///
/// *Energy.* Let u be the work of the edges' wrench, as the device gets it, in a tick. The vibration's work is at most
/// depth · `lines().peak` · Σ |u|: A |v| t for an amplitude A. While the spindle's speed is constant, it is also at
/// most depth · `lines().sum_bound` · (|u| + variation of u). So at constant load and hand speed it stays bounded for
/// ever. List the Cutting before stages that damp.
///
/// Haptic thread; no allocation. See `CuttingSound` for the same lines as sound.
template <ReportingCutting Cutting = CuttingForce>
class CuttingVibration : public Cutting {
 public:
  struct Options {
    double depth = 1;  ///< share of the ripple that is rendered, 0 to 1
    ToothPattern pattern{};

    /// Throws std::invalid_argument.
    void validate() const {
      pattern.validate();
      if (!(depth >= 0) || !(depth <= 1)) refuse("CuttingVibration", "depth must be in [0, 1]", depth);
    }
  };

  /// Throws std::invalid_argument.
  CuttingVibration(Cutting cutting, const Options& options) : Cutting(std::move(cutting)), vibration_(options) {
    vibration_.validate();
    update_lines();
  }

  [[nodiscard]] const Options& vibration() const noexcept { return vibration_; }
  using Cutting::adopt;
  /// Replaces the vibration's options by valid ones, between ticks on the haptic thread.
  void adopt(const Options& options) noexcept {
    vibration_ = options;
    update_lines();
  }

  void reset() noexcept {
    Cutting::reset();
    angle_ = 0;
    factor_ = 1;
  }

  /// Adds the ripple to the edges' wrench, which `apply` added. The scene calls it in the part's place in the list,
  /// after its bound on the wrench's change: a vibration is meant to change fast.
  void vibrate(const TickContext& context, Wrenchd& wrench) noexcept {
    if (lines_.teeth() != ToothLines::teeth_of(this->options().edges)) update_lines();
    const CuttingReport& mean = this->report();
    const double advance = mean.spindle * context.dt;
    angle_ = std::fmod(angle_ + advance, 2 * std::numbers::pi);
    const double ripple = vibration_.depth * lines_.sample(angle_, advance);
    factor_ = 1 + ripple;
    wrench += (this->options().force_scale * ripple) * mean.edges;
  }

  /// Lines of the present teeth.
  [[nodiscard]] const ToothLines& lines() const noexcept { return lines_; }
  /// Edges' wrench of the last tick over their mean, which `report().edges` is.
  [[nodiscard]] double factor() const noexcept { return factor_; }

 private:
  void update_lines() noexcept { lines_ = ToothLines(this->options().edges, vibration_.pattern); }

  Options vibration_;
  ToothLines lines_;
  double angle_ = 0;  // of the spindle, in [0, 2π)
  double factor_ = 1;
};

template <class Cutting>
CuttingVibration(Cutting, const typename CuttingVibration<Cutting>::Options&) -> CuttingVibration<Cutting>;

}  // namespace trephine
