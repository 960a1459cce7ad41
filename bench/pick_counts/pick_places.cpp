// SPDX-License-Identifier: MIT
#include "pick_places.hpp"

#include <algorithm>
#include <cmath>

namespace pick {
namespace {

constexpr int kTicks = 12;           // of a press
constexpr int kSlideTicks = 16;      // of a slide
constexpr int kTriesPerCase = 1000;  // most of them end at a look at one voxel
constexpr double kQuickest = 0.15;   // m/s, of a slide

/// What a try draws from.
struct Draw {
  const Field& field;
  double deepest;
  Random random;
  Feeler feeler;

  [[nodiscard]] double voxel() const { return field.voxel(); }
  [[nodiscard]] std::optional<double> touch(const Motion& motion, double reach) {
    return find_touch(feeler, field, motion, reach, 0.35 * voxel());
  }
  /// From a part of a voxel before the touch to a depth of at most `most` [m]. Depths are even in the logarithm from an
  /// eighth of that: light contacts are the hard ones and the frequent ones.
  void press_in(const Motion& motion, double touch, double most, Case& c) {
    const double depth = std::min(most, deepest) * std::exp(-random.uniform(0, std::log(8.0)));
    press(motion, touch, 0.3 * voxel(), depth, kTicks, c.X_GT);
  }
};

bool tip_press(Draw& draw, Case& c) {
  const auto spot = random_spot(draw.field, draw.random);
  if (!spot) return false;
  const Vec3d shaft = direction_near(spot->n, 0.5, draw.random);
  const Vec3d in = -direction_near(spot->n, 0.9, draw.random);
  const double clear = draw.feeler.tip_reach() + 1.5 * draw.voxel();
  const Motion motion{tool_pose(spot->p - clear * in, shaft), in, Vec3d::Zero()};
  const auto touch = draw.touch(motion, 2 * clear);
  if (!touch) return false;
  draw.press_in(motion, *touch, 0.8 * draw.feeler.burr().tip_radius, c);
  return true;
}

bool sliding(Draw& draw, Case& c) {
  if (!tip_press(draw, c)) return false;
  const Vec3d pressed = (c.X_GT.back().translation() - c.X_GT.front().translation()).normalized();
  const double step = 1e-3 * kQuickest * std::exp(-draw.random.uniform(0, std::log(8.0)));
  slide(step * square_to(pressed, draw.random), kSlideTicks, c.X_GT);
  return true;
}

bool shaft_lean(Draw& draw, bool crest, Case& c) {
  const Burr& burr = draw.feeler.burr();
  if (!burr.has_shaft()) return false;
  const auto spot = random_spot(draw.field, draw.random);
  if (!spot) return false;
  const Vec3d shaft = square_to(spot->n, draw.random);
  if (crest && !is_crest(draw.field, *spot, shaft, burr.tip_radius)) return false;
  const double from = 1.5 * burr.tip_radius;
  const double height = from + draw.random.uniform(0.05, 0.9) * std::max(0.0, burr.shaft_length - from);
  const double clear = draw.feeler.shaft_reach() + 1.5 * draw.voxel();
  Motion motion{tool_pose(spot->p + clear * spot->n - height * shaft, shaft), Vec3d::Zero(), Vec3d::Zero()};
  if (draw.random.uniform() < 0.5)
    motion.velocity = -spot->n;
  else
    motion.turn = turn_toward(shaft, -spot->n, height);
  const auto touch = draw.touch(motion, 2 * clear);
  if (!touch) return false;
  draw.press_in(motion, *touch, 0.8 * burr.shaft_radius, c);
  return true;
}

}  // namespace

std::vector<Case> make_cases(const Field& field, const Burr& burr, Algorithm algorithm, const CaseOptions& options,
                             const std::function<void(int)>& progress,
                             const std::optional<trephine::RevolvedTool>& tool) {
  Draw draw{field, options.deepest, Random(options.seed), Feeler(algorithm, burr, 0.35 * field.voxel(), tool)};
  std::vector<Case> cases;
  for (int k = 0; k < kKinds; ++k) {
    const auto kind = static_cast<Kind>(k);
    int made = 0;
    int in_vain = 0;  // since the last one
    for (int tries = 0; tries < kTriesPerCase * options.per_kind && made < options.per_kind; ++tries) {
      Case c{.kind = kind};
      ++in_vain;
      // Every other shaft lies on a crest, unless there are hardly any.
      const bool crest = made % 2 == 0 && in_vain < kTriesPerCase;
      const bool good = kind == Kind::kTipPress    ? tip_press(draw, c)
                        : kind == Kind::kShaftLean ? shaft_lean(draw, crest, c)
                                                   : sliding(draw, c);
      if (!good) continue;
      cases.push_back(std::move(c));
      ++made;
      in_vain = 0;
      if (progress) progress(static_cast<int>(cases.size()));
    }
  }
  return cases;
}

}  // namespace pick
