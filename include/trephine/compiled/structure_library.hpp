// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/compiled/structures.hpp>
#include <trephine/stage/context.hpp>
#include <trephine/stage/motion.hpp>
#include <trephine/structure/build_structure_field.hpp>
#include <trephine/structure/soft_structures.hpp>
#include <trephine/structure/structure_guard.hpp>
#include <trephine/tool/any_tool.hpp>

#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

/// Bodies of the compiled library's structures. CMake compiles them in a unit of their own; without CMake a unit reads
/// `#include <trephine/compiled/structure_library.hpp>` and `template struct trephine::compiled::StructuresMaker<>;`.
namespace trephine::inline TREPHINE_ALIGNED::compiled {

class GuardOf final : public AnyGuard {
 public:
  GuardOf(std::shared_ptr<const GuardPotential> potential, const StructureGuard::Options& options,
          std::optional<SoftStructures> soft)
      : guard_(std::move(potential), options), soft_(std::move(soft)) {}
  GuardOf(const GuardOf& other) : AnyGuard(), guard_(other.guard_), soft_(other.soft_) {}

  bool is_soft() const noexcept override { return soft_.has_value(); }
  void begin_tick() noexcept override {
    if (soft_) soft_->begin_tick();
  }
  LoadSum press(const Posed& X_GT) noexcept override { return soft_ ? soft_->press(X_GT) : LoadSum{}; }
  double clearance(const Posed& X_GT) noexcept override {
    return soft_ ? soft_->clearance(X_GT) : std::numeric_limits<double>::infinity();
  }
  void settle(const Posed& X_GT, double dt) noexcept override {
    if (soft_) soft_->settle(X_GT, dt);
  }
  void heal() noexcept override {
    if (soft_) soft_->heal();
  }
  void apply(const TickContext& context, Wrenchd& wrench) noexcept override { guard_.apply(context, wrench); }
  void add_to(StructureSummary& summary) const noexcept override {
    guard_.add_to(summary);
    if (soft_) soft_->add_to(summary);
  }
  void reset() noexcept override { guard_.reset(); }
  void set_push(bool on) noexcept override {
    StructureGuard::Options options = guard_.options();
    options.push = on;
    guard_.adopt(options);
  }
  int breaches(int structure) const noexcept override { return guard_.breaches(structure); }
  std::shared_ptr<AnyGuard> copy() const override { return std::make_shared<GuardOf>(*this); }

 private:
  StructureGuard guard_;
  std::optional<SoftStructures> soft_;
};

class StructuresOf final : public AnyStructures {
 public:
  StructuresOf(std::shared_ptr<const StructureField> field, const Posed& X_GS)
      : field_(std::move(field)), X_GS_(X_GS) {}
  StructuresOf(const StructuresOf& other, std::span<const std::optional<Membrane>> membranes,
               const SoftOptions& options)
      : field_(other.field_), X_GS_(other.X_GS_), membranes_(membranes.begin(), membranes.end()), soft_(options) {}

  const StructureField& field() const noexcept override { return *field_; }
  const Posed& X_GS() const noexcept override { return X_GS_; }
  int count() const noexcept override { return field_->structures(); }
  std::shared_ptr<AnyGuard> make_guard(const AnyTool& tool, std::span<const ProtectedStructure> each,
                                       const ProtectionOptions& options) const override {
    std::vector<GuardedStructure> guarded;
    for (const ProtectedStructure& s : each) guarded.push_back(s.guard);
    const auto make = [&](const auto& one) {
      std::optional<SoftStructures> soft;
      if (!membranes_.empty()) soft.emplace(field_, X_GS_, one, membranes_, soft_);
      return std::make_shared<GuardOf>(
          std::make_shared<const GuardPotential>(field_, X_GS_, one, guarded, options.potential), options.guard,
          std::move(soft));
    };
    return tool.visit([&](const auto& one) {
      if constexpr (requires { one.outline(); })
        return make(one);
      else
        return make(one.burr());
    });
  }

 private:
  std::shared_ptr<const StructureField> field_;
  Posed X_GS_;
  std::vector<std::optional<Membrane>> membranes_{};  // of each structure; empty: none is soft
  SoftOptions soft_{};
};

template <int kAlignment>
std::shared_ptr<const AnyStructures> StructuresMaker<kAlignment>::make(const LabelGeometry& geometry,
                                                                       std::span<const std::uint8_t> labels) {
  if (!is_usable_pose(geometry.X_GS)) refuse("compiled::Structures", "X_GS must be rigid", "not so");
  return std::make_shared<const StructuresOf>(
      build_structure_field(LabelVolume{geometry.size, geometry.spacing, labels}, geometry.field), geometry.X_GS);
}

template <int kAlignment>
std::shared_ptr<const AnyStructures> StructuresMaker<kAlignment>::soften(
    const AnyStructures& structures, std::span<const std::optional<Membrane>> membranes, const SoftOptions& options) {
  options.validate();
  for (const std::optional<Membrane>& m : membranes)
    if (m) m->validate();
  if (membranes.size() != static_cast<std::size_t>(structures.count()))
    refuse("compiled::Structures", "soft needs one entry for each structure", membranes.size());
  return std::make_shared<const StructuresOf>(dynamic_cast<const StructuresOf&>(structures), membranes, options);
}

}  // namespace trephine::compiled
