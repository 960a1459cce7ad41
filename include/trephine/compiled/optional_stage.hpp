// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/compiled/options.hpp>
#include <trephine/stage/context.hpp>
#include <trephine/stage/milling.hpp>

#include <optional>
#include <variant>

/// Parts of a scene that are there or not by choice at run time.
namespace trephine::compiled {

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
  void begin_tick() noexcept requires requires(S& stage) { stage.begin_tick(); }
  {
    if (stage_) stage_->begin_tick();
  }
  void sent(const Wrenchd& wrench) noexcept requires requires(S& stage) { stage.sent(wrench); }
  {
    if (stage_) stage_->sent(wrench);
  }
  void reset() noexcept requires requires(S& stage) { stage.reset(); }
  {
    if (stage_) stage_->reset();
  }

 private:
  std::optional<S> stage_;
};

/// Milling whose policy is chosen at run time; absent, it removes nothing.
class OptionalMilling {
 public:
  /// Throws std::invalid_argument where an option is out of range.
  explicit OptionalMilling(const std::optional<Milling>& options) : options_(options), milling_(make(options)) {}

  /// Takes another policy; the state stays where only numbers of the policy differ.
  void adopt(const OptionalMilling& other) noexcept {
    if (options_ && other.options_ && options_->cut == other.options_->cut &&
        options_->slope == other.options_->slope && options_->follow_probe == other.options_->follow_probe)
      std::visit(
          [&]<class M>(M& milling) {
            if constexpr (requires { milling.policy(); }) milling.adopt(std::get_if<M>(&other.milling_)->policy());
          },
          milling_);
    else
      milling_ = other.milling_;
    options_ = other.options_;
  }

  [[nodiscard]] bool follow_probe() const noexcept { return options_ && options_->follow_probe; }

  template <class Grid>
  double carve(Grid& grid, double isovalue, const Posed& X_GT_previous, const Posed& X_GT, const Burr& burr,
               const CarveContext& context) noexcept {
    if (auto* at_once = std::get_if<Geometric>(&milling_))
      return at_once->carve(grid, isovalue, X_GT_previous, X_GT, burr, context);
    if (auto* limited = std::get_if<RateLimited>(&milling_))
      return limited->carve(grid, isovalue, X_GT_previous, X_GT, burr, context);
    if (auto* advancing = std::get_if<Advancing>(&milling_))
      return advancing->carve(grid, isovalue, X_GT_previous, X_GT, burr, context);
    return 0;
  }

  void reset() noexcept {
    std::visit(
        [](auto& milling) {
          if constexpr (requires { milling.reset(); }) milling.reset();
        },
        milling_);
  }

 private:
  using Geometric = trephine::Milling<GeometricCut>;
  using RateLimited = trephine::Milling<RateLimitedCut<>>;
  using Advancing = trephine::Milling<AdvancingCut>;
  using Any = std::variant<std::monostate, Geometric, RateLimited, Advancing>;

  static Any make(const std::optional<Milling>& options) {
    if (!options) return {};
    const Milling& o = *options;
    const MillingOptions common{.slope = o.slope, .follow_probe = o.follow_probe};
    switch (o.cut) {
      case Cut::kGeometric:
        return Geometric(GeometricCut{}, common);
      case Cut::kRateLimited:
        return RateLimited(
            {.rate = o.rate, .reference_force = o.reference_force, .most_force_factor = o.most_force_factor}, common);
      case Cut::kAdvancing:
        return Advancing(
            {.speed = o.speed, .reference_force = o.reference_force, .most_force_factor = o.most_force_factor}, common);
    }
    refuse("compiled::Milling", "cut must be one of Cut's", static_cast<int>(o.cut));
  }

  std::optional<Milling> options_;
  Any milling_;
};

}  // namespace trephine::compiled
