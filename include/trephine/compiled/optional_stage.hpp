// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/compiled/any_scene.hpp>
#include <trephine/render/tool_load.hpp>
#include <trephine/stage/context.hpp>
#include <trephine/stage/cutting_force.hpp>
#include <trephine/stage/members.hpp>
#include <trephine/stage/veto.hpp>

#include <limits>
#include <memory>
#include <optional>
#include <utility>

/// Parts of a scene that are there or not by choice at run time.
namespace trephine::inline TREPHINE_ALIGNED::compiled {

/// A stage that changes nothing where it is absent.
template <Stage S>
class OptionalStage {
 public:
  using Options = std::optional<typename S::Options>;
  static constexpr bool kUsesTwist = kStageUsesTwist<S>;

  /// Throws std::invalid_argument where an option is out of range.
  explicit OptionalStage(const Options& options) {
    if (options) stage_.emplace(*options);
  }

  /// Takes options that `validate` accepted; between ticks, haptic thread.
  void adopt(const Options& options) {
    if (!options)
      stage_.reset();
    else if (stage_)
      stage_->adopt(*options);
    else
      stage_.emplace(*options);
  }

  void apply(const TickContext& context, Wrenchd& wrench) noexcept {
    if (stage_) stage_->apply(context, wrench);
  }
  void begin_tick() noexcept
    requires BeginsTick<S>
  {
    if (stage_) stage_->begin_tick();
  }
  void sent(const Wrenchd& wrench) noexcept
    requires HearsSent<S>
  {
    if (stage_) stage_->sent(wrench);
  }
  void reset() noexcept
    requires Resets<S>
  {
    if (stage_) stage_->reset();
  }
  void forget_wrench() noexcept
    requires ForgetsWrench<S>
  {
    if (stage_) stage_->forget_wrench();
  }
  [[nodiscard]] bool bounds_wrench() const noexcept
    requires SaysBoundsWrench<S>
  {
    return stage_.has_value();
  }

 private:
  std::optional<S> stage_;
};

/// A law of cutting that is there or not. It is always made: the scene prepares it for the tool's head at once.
class OptionalLaw : private CuttingForce {
 public:
  using Options = std::optional<CuttingForceOptions>;
  static constexpr bool kUsesTwist = CuttingForce::kUsesTwist;
  using CuttingForce::prepare;
  using CuttingForce::reset;

  /// Throws std::invalid_argument where an option is out of range.
  explicit OptionalLaw(const Options& options)
      : CuttingForce(options.value_or(CuttingForceOptions{})), is_there_(options.has_value()) {}

  /// Takes options that `validate` accepted; between ticks, haptic thread.
  void adopt(const Options& options) noexcept {
    if (!options || !is_there_) reset();
    is_there_ = options.has_value();
    if (options) CuttingForce::adopt(*options);
  }

  template <VoxelDensity Density, class ContactRenderer>
  PressedCut engage(const VoxelGrid<Density>& bone, double isovalue, const ContactRenderer& renderer, double dt,
                    bool spindle_on) noexcept {
    if (!is_there_) return {};
    return CuttingForce::engage(bone, isovalue, renderer, dt, spindle_on);
  }
  void apply(const TickContext& context, Wrenchd& wrench) noexcept {
    if (is_there_) CuttingForce::apply(context, wrench);
  }
  void add_to(CuttingSummary& summary) const noexcept {
    if (is_there_) CuttingForce::add_to(summary);
  }

 private:
  bool is_there_;
};

/// Guard and floor that are there or not: what a `Protection` is in a header scene.
template <VoxelDensity Density>
class OptionalProtection {
 public:
  [[nodiscard]] bool has_guard() const noexcept { return guard_ != nullptr; }
  /// Exchanges guard and floor.
  void swap(std::shared_ptr<AnyGuard>& guard, std::shared_ptr<CutFloor<Density>>& floor) noexcept {
    guard_.swap(guard);
    std::shared_ptr<CutFloor<Density>> before;
    if (veto_) before = veto_->floor();
    veto_.reset();
    if (floor != nullptr) veto_.emplace(std::move(floor));
    floor = std::move(before);
  }
  /// Takes a copy of another scene's guard, and the counts of its floor.
  void take(const OptionalProtection& other, const TakenBone& bones) {
    guard_ = other.guard_ ? other.guard_->copy() : nullptr;
    if (!other.veto_)
      veto_.reset();
    else if (veto_)
      veto_->take(*other.veto_, bones);
    else
      veto_ = other.veto_->with_own_floor();
  }
  [[nodiscard]] int breaches(int structure) const noexcept { return guard_ ? guard_->breaches(structure) : 0; }
  void set_push(bool on) noexcept {
    if (guard_) guard_->set_push(on);
  }

  [[nodiscard]] CutFloor<Density>* cut_floor() const noexcept { return veto_ ? veto_->cut_floor() : nullptr; }
  void begin_tick() noexcept {
    if (guard_) guard_->begin_tick();
    if (veto_) veto_->begin_tick();
  }
  void heal() noexcept {
    if (guard_) guard_->heal();
  }
  void apply(const TickContext& context, Wrenchd& wrench) noexcept {
    if (guard_) guard_->apply(context, wrench);
  }
  void add_to(StructureSummary& summary) const noexcept {
    if (guard_) guard_->add_to(summary);
    if (veto_) veto_->add_to(summary);
  }
  void reset() noexcept {
    if (guard_) guard_->reset();
  }

 protected:
  std::shared_ptr<AnyGuard> guard_;

 private:
  std::optional<Veto<Density>> veto_;
};

/// The same with the guard's soft structures, for a renderer that carries loads.
template <VoxelDensity Density>
class LoadingProtection : public OptionalProtection<Density> {
 public:
  [[nodiscard]] LoadingProtection& tool_load() noexcept { return *this; }
  [[nodiscard]] LoadSum press(const Posed& X_GT) noexcept { return guard_ ? guard_->press(X_GT) : LoadSum{}; }
  [[nodiscard]] double clearance(const Posed& X_GT) noexcept {
    return guard_ ? guard_->clearance(X_GT) : std::numeric_limits<double>::infinity();
  }
  void settle(const Posed& X_GT, double dt) noexcept {
    if (guard_) guard_->settle(X_GT, dt);
  }

 private:
  using OptionalProtection<Density>::guard_;
};

}  // namespace trephine::compiled
