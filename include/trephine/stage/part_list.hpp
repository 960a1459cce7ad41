// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/stage/members.hpp>
#include <trephine/stage/scene_parts.hpp>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <tuple>
#include <type_traits>
#include <utility>

namespace trephine::inline TREPHINE_ALIGNED::detail {

/// The parts of a scene, which it calls in listed order. Each call reaches the parts that have the member.
template <class Grid, class ContactRenderer, class... Parts>
class PartList {
 public:
  static constexpr bool kCuts = (CuttingPart<Parts, Grid, ContactRenderer> || ...);

  explicit PartList(Parts... parts) : parts_(std::move(parts)...) {}

  /// Throws std::invalid_argument.
  void validate(const Grid& bone, double isovalue) const {
    for_each(parts_, [&](const auto& part) {
      member::validate(part);
      member::validate_for(part, bone, isovalue);
    });
  }
  template <class Head>
  void prepare(const Head& head) noexcept {
    for_each(parts_, [&](auto& part) { member::prepare(part, head); });
  }
  void begin_tick() noexcept {
    for_each(parts_, [](auto& part) { member::begin_tick(part); });
  }
  void reset() noexcept {
    for_each(parts_, [](auto& part) { member::reset(part); });
  }
  void forget_wrench() noexcept {
    for_each(parts_, [](auto& part) { member::forget_wrench(part); });
  }
  [[nodiscard]] bool bounds_wrench() const noexcept {
    return std::apply([](const auto&... part) { return (false || ... || member::bounds_wrench(part)); }, parts_);
  }
  /// Runs the stages.
  void apply(const TickContext& context, Wrenchd& wrench) noexcept {
    for_each(parts_, [&](auto& part) {
      if constexpr (Stage<std::remove_cvref_t<decltype(part)>>) part.apply(context, wrench);
      member::vibrate(part, context, wrench);
    });
  }
  void add_to(TickResult& result) const noexcept {
    for_each(parts_, [&](const auto& part) {
      member::add_to(part, result.structures);
      member::add_to(part, result.cutting);
    });
  }
  void sent(const Wrenchd& wrench) noexcept {
    for_each(parts_, [&](auto& part) { member::sent(part, wrench); });
  }

  /// Floors first, because the cuts know theirs by its address.
  void take(const PartList& other, TakenBone bones) {
    const auto take_some = [&]<bool kFloors>(std::bool_constant<kFloors>) {
      const auto take_one = [&]<std::size_t kAt>(std::integral_constant<std::size_t, kAt>) {
        if constexpr (KeepsCutsOut<std::tuple_element_t<kAt, std::tuple<Parts...>>> == kFloors)
          member::take(std::get<kAt>(parts_), std::get<kAt>(other.parts_), bones);
      };
      [&]<std::size_t... kAt>(std::index_sequence<kAt...>) {
        (take_one(std::integral_constant<std::size_t, kAt>()), ...);
      }(std::index_sequence_for<Parts...>());
    };
    take_some(std::true_type());
    bones.floor = other.cut_floor();
    bones.own_floor = cut_floor();
    take_some(std::false_type());
  }

  /// Returns the part that is, or derives from, T.
  template <class T, class Self>
  [[nodiscard]] static auto& part(Self& self) noexcept {
    static_assert(kPartCount<T, Parts...> == 1, "trephine::HapticScene::part<T>: T must name exactly one listed part");
    return std::get<first_of({std::derived_from<Parts, T>...})>(self.parts_);
  }
  /// Returns the part that cuts.
  template <class Self>
  [[nodiscard]] static auto& cutting(Self& self) noexcept {
    return std::get<first_of({CuttingPart<Parts, Grid, ContactRenderer>...})>(self.parts_);
  }
  static constexpr bool kLoads = (LoadsTool<Parts> || ...);
  /// Returns what presses on the tool besides bone.
  [[nodiscard]] auto& load() noexcept
    requires kLoads
  {
    return std::get<first_of({LoadsTool<Parts>...})>(parts_).tool_load();
  }
  /// Returns the floor below which nothing is cut, or null.
  [[nodiscard]] auto cut_floor() const noexcept {
    if constexpr ((KeepsCutsOut<Parts> || ...))
      return std::get<first_of({KeepsCutsOut<Parts>...})>(parts_).cut_floor();
    else
      return nullptr;
  }

 private:
  static consteval std::size_t first_of(std::array<bool, sizeof...(Parts)> is) {
    return static_cast<std::size_t>(std::find(is.begin(), is.end(), true) - is.begin());
  }
  template <class Tuple, class Function>
  static void for_each(Tuple& parts, Function&& function) {
    std::apply([&](auto&... part) { (function(part), ...); }, parts);
  }

  [[no_unique_address]] std::tuple<Parts...> parts_;
};

}  // namespace trephine::detail
