// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/render/coupled/broad_phase.hpp>
#include <trephine/render/coupled/clearance.hpp>
#include <trephine/tool/tool_shape.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace trephine {

/// Surface elements that may come into contact while a tool stays within a small reach of a pose.
///
/// Newton's steps become small within a tick, and so does the motion of a slow tool from tick to tick. So most poses
/// are evaluated with these elements alone: a Verlet list within the broad phase's. A list that is full is not used.
class NearElements {
 public:
  struct Element {
    const NearBlock* block;
    std::size_t i;
  };

  /// At most `most` elements. Allocates.
  explicit NearElements(std::size_t most = 0) { elements_.reserve(most); }

  /// Returns whether the list serves a tool at X, of the last list of blocks.
  [[nodiscard]] bool serves(const BroadPhase& blocks, const Posed& X) const noexcept {
    return blocks_ == &blocks && generation_ == blocks.generation() && motion_between(X_, X).is_within(reach_);
  }
  /// Begins a list for poses within `reach` of X. Points begin contact `offset` [m] outside the tool.
  void start(const BroadPhase& blocks, const Posed& X, const ToolMotion& reach, float offset) noexcept {
    elements_.clear();
    blocks_ = elements_.capacity() > 0 ? &blocks : nullptr;
    generation_ = blocks.generation();
    X_ = X;
    reach_ = reach;
    shift_ = offset + static_cast<float>(reach.shift);
    turn_square_ = static_cast<float>(reach.turn * reach.turn);
  }
  /// Offers an element whose points lie no nearer than `distance` [m] at X. Returns false if the list leaves it out:
  /// then none of its points meets the tool within the reach. `arm_square` is the square of its distance from T's
  /// origin [m²].
  bool offer(const Element& element, float distance, float arm_square) noexcept {
    const float beyond = distance - shift_;
    if (beyond > 0 && beyond * beyond > turn_square_ * arm_square) return false;
    if (elements_.size() == elements_.capacity())
      blocks_ = nullptr;
    else
      elements_.push_back(element);
    return true;
  }
  /// Ends the list. `others` is the clearance of the elements left out, at X.
  void finish(const Clearance& others) noexcept { others_ = others; }

  [[nodiscard]] const std::vector<Element>& elements() const noexcept { return elements_; }
  /// Lower bound of the distance of the elements left out, for a tool at X [m].
  [[nodiscard]] double distance_of_others(const Posed& X) const noexcept {
    return others_.listed_distance - motion_between(X_, X).at(others_.listed_arm);
  }

 private:
  std::vector<Element> elements_;
  const BroadPhase* blocks_ = nullptr;  // nullptr: no list
  std::uint64_t generation_ = 0;
  Posed X_ = Posed::Identity();
  ToolMotion reach_;
  float shift_ = 0, turn_square_ = 0;
  Clearance others_;
};

}  // namespace trephine
