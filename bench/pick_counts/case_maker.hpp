// SPDX-License-Identifier: MIT
#pragma once

#include "feeler.hpp"
#include "motion.hpp"
#include "surface_spot.hpp"

#include <functional>
#include <vector>

namespace pick {

struct CaseOptions {
  int per_kind = 60;       ///< cases of each kind, for each algorithm
  int holes = 12;          ///< milled for the rim cases
  double deepest = 0.004;  ///< farthest [m] a press goes beyond the touch: what the device's force allows
  std::uint64_t seed = 1;
};

/// Places a tool on a bone in as many ways as asked for, at places drawn from the seed.
class CaseMaker {
 public:
  /// Mills the holes into `milled`, a copy of `whole`. Both must outlive the maker and stay where they are.
  CaseMaker(const Grid& whole, Grid& milled, double isovalue, const trephine::Burr& burr, const CaseOptions& options);

  /// Cases for one algorithm; fewer where the bone offers no more: every kind ends after a bounded number of tries.
  /// `progress` hears how many are made.
  [[nodiscard]] std::vector<Case> make(Algorithm algorithm, const std::function<void(int)>& progress = {}) const;

  [[nodiscard]] int holes() const noexcept { return static_cast<int>(holes_.size()); }

 private:
  struct Hole {
    trephine::Vec3d mouth;  ///< on the surface, in G
    trephine::Vec3d out;    ///< unit vector along its axis
  };
  struct Draw;  // what one try draws from

  void mill_holes(Grid& milled, double isovalue);
  [[nodiscard]] double draw_depth(Random& random, double most) const;
  [[nodiscard]] bool tip_press(Draw& draw, Case& c) const;
  [[nodiscard]] bool shaft_lean(Draw& draw, bool crest, Case& c) const;
  [[nodiscard]] bool rim(Draw& draw, Case& c) const;
  [[nodiscard]] bool sliding(Draw& draw, Case& c) const;

  Field whole_;
  Field milled_;
  trephine::Burr burr_;
  CaseOptions options_;
  std::vector<Hole> holes_;
};

}  // namespace pick
