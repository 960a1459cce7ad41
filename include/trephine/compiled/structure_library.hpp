// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/compiled/structures.hpp>
#include <trephine/stage/context.hpp>
#include <trephine/stage/motion.hpp>
#include <trephine/structure/build_structure_field.hpp>
#include <trephine/structure/structure_guard.hpp>
#include <trephine/tool/any_tool.hpp>

#include <memory>
#include <span>
#include <utility>
#include <vector>

/// Bodies of the compiled library's structures. CMake compiles them in a unit of their own; without CMake a unit reads
/// `#include <trephine/compiled/structure_library.hpp>` and `template struct trephine::compiled::StructuresMaker<>;`.
namespace trephine::inline TREPHINE_ALIGNED::compiled {

class GuardOf final : public AnyGuard {
 public:
  GuardOf(std::shared_ptr<const GuardPotential> potential, const StructureGuard::Options& options)
      : guard_(std::move(potential), options) {}
  GuardOf(const GuardOf& other) : AnyGuard(), guard_(other.guard_) {}

  void apply(const TickContext& context, Wrenchd& wrench) noexcept override { guard_.apply(context, wrench); }
  void add_to(StructureSummary& summary) const noexcept override { guard_.add_to(summary); }
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
};

class StructuresOf final : public AnyStructures {
 public:
  StructuresOf(std::shared_ptr<const StructureField> field, const Posed& X_GS)
      : field_(std::move(field)), X_GS_(X_GS) {}

  const StructureField& field() const noexcept override { return *field_; }
  const Posed& X_GS() const noexcept override { return X_GS_; }
  int count() const noexcept override { return field_->structures(); }
  std::shared_ptr<AnyGuard> make_guard(const AnyTool& tool, std::span<const ProtectedStructure> each,
                                       const ProtectionOptions& options) const override {
    std::vector<GuardedStructure> guarded;
    for (const ProtectedStructure& s : each) guarded.push_back(s.guard);
    const auto potential = tool.visit([&](const auto& one) {
      if constexpr (requires { one.outline(); })
        return std::make_shared<const GuardPotential>(field_, X_GS_, one, guarded, options.potential);
      else
        return std::make_shared<const GuardPotential>(field_, X_GS_, one.burr(), guarded, options.potential);
    });
    return std::make_shared<GuardOf>(potential, options.guard);
  }

 private:
  std::shared_ptr<const StructureField> field_;
  Posed X_GS_;
};

template <int kAlignment>
std::shared_ptr<const AnyStructures> StructuresMaker<kAlignment>::make(const LabelGeometry& geometry,
                                                                       std::span<const std::uint8_t> labels) {
  if (!is_usable_pose(geometry.X_GS)) refuse("compiled::Structures", "X_GS must be rigid", "not so");
  return std::make_shared<const StructuresOf>(
      build_structure_field(LabelVolume{geometry.size, geometry.spacing, labels}, geometry.field), geometry.X_GS);
}

}  // namespace trephine::compiled
