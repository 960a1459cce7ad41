// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/stage/context.hpp>
#include <trephine/stage/members.hpp>

#include <concepts>

/// What a scene knows of the part that cuts; the part itself is `Cutting`.
namespace trephine::inline TREPHINE_ALIGNED {

/// What a cut knows of its tick. Poses are the device's, in G.
struct CutTick {
  Posed X_GT_before = Posed::Identity();  ///< at the last tick; equals X_GT where no path joins them
  Posed X_GT = Posed::Identity();         ///< now
  bool continues = false;                 ///< a path joins both: neither a gap nor a jump lies between
  bool restarts = false;                  ///< contact starts anew
  bool spindle_on = false;                ///< as the input says
  bool cuts = false;                      ///< the spindle turns, contact is up to date and nothing starts anew
  double dt = 0;                          ///< since the last tick [s], within [kShortestDt, kLongestDt]
  double force_N = 0;  ///< magnitude of the contact's force, before any stage: the pressing force [N]
};

/// The part of a scene that removes bone and adds the forces of doing so. `cut` returns the removed volume [mm³],
/// finite and >= 0; `floor` is the CutFloor of the scene's Veto, or null. Haptic thread, once a tick, after contact.
template <class C, class Grid, class R>
concept CuttingPart = requires(C cutting, Grid& bone, double isovalue, const R& renderer, const CutTick& tick) {
  { cutting.cut(bone, isovalue, renderer, tick, nullptr) } noexcept -> std::same_as<double>;
};

/// A law that decides how much bone a tick removes under pressure, and gives the forces of the edges: `CuttingForce`.
/// `engage` is called after contact, before the cut, and `apply` after it.
template <class L>
concept FeedLaw = Stage<L> && CuttingReporter<L>;

/// What a law of cutting lets a tick's cut by pressure take.
struct PressedCut {
  double fraction = 1;  ///< of the bone in the head, 0 to 1
  double advance = 0;   ///< by which the head may go ahead [m]
};

}  // namespace trephine
