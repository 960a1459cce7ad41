// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/cut_policy.hpp>
#include <trephine/voxel/pressure_cut.hpp>

#include <concepts>
#include <cstddef>
#include <variant>

namespace trephine::inline TREPHINE_ALIGNED {

/// A cut that is chosen at run time, or none: for a compiled scene, another language or a window.
/// \code
/// AnyCut cut = AdvancingCut{.speed = 5e-3};
/// cut = GeometricCut{};
/// cut = {};                                  // removes nothing
/// \endcode
/// It owns no memory, so a Mailbox may carry it.
class AnyCut {
 public:
  AnyCut() = default;
  /// Takes one of the cuts, as it is.
  template <CutPolicy Policy>
    requires std::constructible_from<
        std::variant<std::monostate, GeometricCut, RateLimitedCut<>, AdvancingCut, PressureCut>, Policy>
  AnyCut(const Policy& cut) : cut_(cut) {}

  /// Throws std::invalid_argument where an option is out of range.
  void validate() const {
    visit([](const auto& cut) { cut.validate(); });
  }
  [[nodiscard]] bool is_none() const noexcept { return cut_.index() == 0; }
  /// Returns how it cuts; kAtRate for none.
  [[nodiscard]] CutKind kind() const noexcept {
    CutKind kind = CutKind::kAtRate;
    visit([&](const auto& cut) { kind = cut.kKind; });
    return kind;
  }
  /// Returns true if both cut in the same way, with whatever numbers.
  [[nodiscard]] bool is_like(const AnyCut& other) const noexcept { return cut_.index() == other.cut_.index(); }

  /// Calls `body` with the cut, if there is one.
  template <class Body>
  void visit(Body&& body) const {
    visit_from<1>(body);
  }

 private:
  // Unlike std::visit it has no path that throws.
  template <std::size_t kAt, class Body>
  void visit_from(Body& body) const {
    if (const auto* cut = std::get_if<kAt>(&cut_))
      body(*cut);
    else if constexpr (kAt + 1 < std::variant_size_v<decltype(cut_)>)
      visit_from<kAt + 1>(body);
  }

  std::variant<std::monostate, GeometricCut, RateLimitedCut<>, AdvancingCut, PressureCut> cut_;
};

}  // namespace trephine
