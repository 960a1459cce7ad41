// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/compiled/any_scene.hpp>
#include <trephine/stage/context.hpp>
#include <trephine/stage/cutting_force.hpp>
#include <trephine/stage/milling.hpp>
#include <trephine/voxel/pressure_cut.hpp>
#include <trephine/voxel/protected_cut.hpp>

#include <cstddef>
#include <memory>
#include <optional>
#include <utility>
#include <variant>

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
  void forget_wrench() noexcept requires requires(S& stage) { stage.forget_wrench(); }
  {
    if (stage_) stage_->forget_wrench();
  }
  [[nodiscard]] bool bounds_wrench() const noexcept requires requires(const S& stage) { stage.bounds_wrench(); }
  { return stage_.has_value(); }

 private:
  std::optional<S> stage_;
};

/// A law of cutting that is there or not. Its stage is always made: the scene prepares it for the tool's head at once.
class OptionalCutting : private trephine::CuttingForce {
 public:
  using Options = std::optional<trephine::CuttingForce::Options>;
  static constexpr bool kUsesTwist = trephine::CuttingForce::kUsesTwist;
  static constexpr bool kDecidesCuts = true;
  using trephine::CuttingForce::prepare;
  using trephine::CuttingForce::reset;

  /// Throws std::invalid_argument where an option is out of range.
  explicit OptionalCutting(const Options& options)
      : trephine::CuttingForce(options.value_or(Options::value_type{})), is_there_(options.has_value()) {}

  /// Takes options that `validate` accepted; between ticks, haptic thread.
  void adopt(const Options& options) noexcept {
    if (!options || !is_there_) reset();
    is_there_ = options.has_value();
    if (options) trephine::CuttingForce::adopt(*options);
  }

  template <VoxelDensity Density, class ContactRenderer>
  PressedCut engage(const VoxelGrid<Density>& bone, double isovalue, const ContactRenderer& renderer, double dt,
                    bool spindle_on) noexcept {
    if (!is_there_) return {};
    return trephine::CuttingForce::engage(bone, isovalue, renderer, dt, spindle_on);
  }
  void apply(const TickContext& context, Wrenchd& wrench) noexcept {
    if (is_there_) trephine::CuttingForce::apply(context, wrench);
  }
  void add_to(CuttingSummary& summary) const noexcept {
    if (is_there_) trephine::CuttingForce::add_to(summary);
  }

 private:
  bool is_there_;
};

/// A guard that is there or not.
class OptionalGuard {
 public:
  [[nodiscard]] bool is_set() const noexcept { return guard_ != nullptr; }
  void swap(std::shared_ptr<AnyGuard>& guard) noexcept { guard_.swap(guard); }
  [[nodiscard]] int breaches(int structure) const noexcept { return guard_ ? guard_->breaches(structure) : 0; }
  void set_push(bool on) noexcept {
    if (guard_) guard_->set_push(on);
  }

  void apply(const TickContext& context, Wrenchd& wrench) noexcept {
    if (guard_) guard_->apply(context, wrench);
  }
  void add_to(StructureSummary& summary) const noexcept {
    if (guard_) guard_->add_to(summary);
  }
  void reset() noexcept {
    if (guard_) guard_->reset();
  }

 private:
  std::shared_ptr<AnyGuard> guard_;
};

/// Milling whose policy is chosen at run time, with a floor or without; absent, it removes nothing.
template <VoxelDensity Density>
class OptionalMilling {
 public:
  using Floor = std::shared_ptr<CutFloor<Density>>;
  static constexpr bool kCutsAtOnce = true, kCutsUnderPressure = true;  // may, by choice

  /// Throws std::invalid_argument where an option is out of range.
  explicit OptionalMilling(const std::optional<Milling>& options, Floor floor = {})
      : options_(options), floor_(std::move(floor)), milling_(make(options, floor_)) {}

  [[nodiscard]] const std::optional<Milling>& options() const noexcept { return options_; }
  [[nodiscard]] const Floor& floor() const noexcept { return floor_; }

  /// Takes another policy; the state stays where only numbers of the policy differ.
  void adopt(const OptionalMilling& other) noexcept {
    if (options_ && other.options_ && options_->cut == other.options_->cut &&
        options_->slope == other.options_->slope && options_->follow_probe == other.options_->follow_probe &&
        floor_ == other.floor_)
      visit(milling_, [&]<class M>(M& milling) { milling.set_policy(std::get_if<M>(&other.milling_)->policy()); });
    else
      milling_ = other.milling_;
    options_ = other.options_;
    floor_ = other.floor_;
  }

  /// Throws std::invalid_argument for densities that cannot hold a cut's surface, as those of a mask of 0 and 1.
  void validate_for(const VoxelGrid<Density>& bone, double isovalue) const {
    if (options_) check_slope(bone, isovalue, options_->slope);
  }

  [[nodiscard]] bool follow_probe() const noexcept { return options_ && options_->follow_probe; }

  [[nodiscard]] bool cuts_at_once() const noexcept {
    bool cuts = false;
    visit(milling_, [&]<class M>(const M&) { cuts = M::kCutsAtOnce; });
    return cuts;
  }
  [[nodiscard]] bool cuts_under_pressure() const noexcept { return options_ && options_->cut == Cut::kPressure; }

  template <class Grid, class Head = Burr>
  double carve(Grid& grid, double isovalue, const Posed& X_GT_previous, const Posed& X_GT, const Head& head,
               const CarveContext& context) noexcept {
    double removed_mm3 = 0;
    visit(milling_,
          [&](auto& milling) { removed_mm3 = milling.carve(grid, isovalue, X_GT_previous, X_GT, head, context); });
    return removed_mm3;
  }

  void add_to(StructureSummary& summary) const noexcept {
    visit(milling_, [&](const auto& milling) {
      if constexpr (requires { milling.add_to(summary); }) milling.add_to(summary);
    });
  }

  void reset() noexcept {
    visit(milling_, [](auto& milling) { milling.reset(); });
  }

 private:
  template <class Policy>
  using Protected = trephine::Milling<ProtectedCut<Density, Policy>>;
  using Any = std::variant<std::monostate, trephine::Milling<GeometricCut>, trephine::Milling<RateLimitedCut<>>,
                           trephine::Milling<AdvancingCut>, trephine::Milling<PressureCut>, Protected<GeometricCut>,
                           Protected<RateLimitedCut<>>, Protected<AdvancingCut>, Protected<PressureCut>>;

  /// Calls `body` with the milling that is there; like std::visit, but never throws.
  template <std::size_t kAt = 1, class Variant, class Body>
  static void visit(Variant& any, Body&& body) noexcept {
    if (auto* milling = std::get_if<kAt>(&any))
      body(*milling);
    else if constexpr (kAt + 1 < std::variant_size_v<Any>)
      visit<kAt + 1>(any, body);
  }

  template <class Policy>
  static Any milling_with(const Policy& policy, const MillingOptions& options, const Floor& floor) {
    if (floor != nullptr) return Protected<Policy>(ProtectedCut<Density, Policy>(policy, floor), options);
    return trephine::Milling<Policy>(policy, options);
  }

  static Any make(const std::optional<Milling>& options, const Floor& floor) {
    if (!options) return {};
    const Milling& o = *options;
    const MillingOptions common{.slope = o.slope, .follow_probe = o.follow_probe};
    switch (o.cut) {
      case Cut::kGeometric:
        return milling_with(GeometricCut{}, common, floor);
      case Cut::kRateLimited:
        return milling_with(
            RateLimitedCut<>{
                .rate = o.rate, .reference_force = o.reference_force, .most_force_factor = o.most_force_factor},
            common, floor);
      case Cut::kAdvancing:
        return milling_with(
            AdvancingCut{
                .speed = o.speed, .reference_force = o.reference_force, .most_force_factor = o.most_force_factor},
            common, floor);
      case Cut::kPressure:
        return milling_with(PressureCut{}, common, floor);
    }
    refuse("compiled::Milling", "cut must be one of Cut's", static_cast<int>(o.cut));
  }

  std::optional<Milling> options_;
  Floor floor_;
  Any milling_;
};

}  // namespace trephine::compiled
