// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/finite.hpp>
#include <trephine/core/refuse.hpp>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

namespace trephine::inline TREPHINE_ALIGNED {

/// The force that scores judge.
enum class ScoredForce : std::uint8_t {
  kHand = 0,    ///< the scene's force without the push of guards: what the hand felt of the bone
  kThrust = 1,  ///< `CuttingSummary::thrust`, the true force before the device's share; needs a `CuttingForce`
};

/// Options of Scores: where a stroke ends, what a limit is, and how much is stored.
struct ScoreOptions {
  /// Opening of the dividers that walk along the path [m], > 0. A path that turns by more than a right angle within it
  /// reverses, and lengths are sums of such chords. An arc of radius R comes out short by the share chord²/(24 R²). The
  /// sway of a hand at rest must stay below: a braced instrument's was 0.25 mm rms in one axis, which is 0.7 mm from
  /// end to end (PMC3032442, figure 4).
  double chord = 1e-3;
  /// Contact or spindle that is missing for no longer than this does not end a stroke [s], >= 0: contact of a burr that
  /// removes its own bone flickers. It is half a period of 10 Hz, for hands tremble at 6 to 12 Hz (Lakie et al. 2015,
  /// J Physiol 593:4411) and lift and return more slowly.
  double lift_off = 0.05;
  /// Breaches and forces over the limit that follow within this are one event [s], >= 0. The mean response to touch,
  /// sound and light at once took 0.32 s (Exploring Human Response Times..., World Haptics 2023), so no trainee has
  /// stopped the first and begun another.
  double event_gap = 0.25;
  ScoredForce force = ScoredForce::kHand;
  double force_limit = std::numeric_limits<double>::infinity();  ///< [N], >= 0; no force is over infinity
  double limit_distance = 4e-3;  ///< distance from a structure where forces over the limit count besides [m], >= 0
  std::size_t strokes = 4096;    ///< that are stored, each of about 100 bytes; later ones count in the totals alone
  std::size_t structures = 16;   ///< that have scores of their own, by number from 0; others count in the sum alone
  std::size_t tools = 16;        ///< likewise

  /// Throws std::invalid_argument if an option is out of range.
  void validate() const {
    constexpr std::string_view kType = "ScoreOptions";
    if (!(chord > 0) || !is_finite(chord)) refuse(kType, "chord must be finite and > 0 m", chord);
    refuse_beyond(kType, "chord", 0.05, chord);
    const auto at_least_zero = [&](const char* name, const char* unit, double v) {
      if (!(v >= 0) || !is_finite(v)) refuse(kType, std::string(name) + " must be finite and >= 0 " + unit, v);
    };
    at_least_zero("lift_off", "s", lift_off);
    at_least_zero("event_gap", "s", event_gap);
    at_least_zero("limit_distance", "m", limit_distance);
    if (!(force_limit >= 0)) refuse(kType, "force_limit must be >= 0 N", force_limit);
    if (force != ScoredForce::kHand && force != ScoredForce::kThrust)
      refuse(kType, "force must be kHand or kThrust", static_cast<int>(force));
    constexpr std::size_t kMaxStrokes = 1U << 24;
    if (strokes > kMaxStrokes) refuse(kType, "strokes must be at most 2^24", strokes);
    if (structures > 255) refuse(kType, "structures must be at most 255", structures);
    if (tools > 255) refuse(kType, "tools must be at most 255", tools);
  }
};

}  // namespace trephine
