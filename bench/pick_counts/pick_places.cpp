// SPDX-License-Identifier: MIT
#include "pick_places.hpp"

#include <trephine/voxel/carving.hpp>

#include <algorithm>
#include <cmath>

namespace pick {
namespace {

constexpr int kTicks = 12;           // of a press
constexpr int kSlideTicks = 16;      // of a slide
constexpr int kTriesPerCase = 1000;  // most of them end at a look at one voxel
constexpr double kHoleDepth = 2.5;   // in burr radii
constexpr double kWiderHole = 1.1;   // than the burr: a drill never runs quite true
constexpr double kQuickest = 0.15;   // m/s, of a slide

}  // namespace

struct CaseMaker::Draw {
  Random random;
  Feeler feeler;
  double gap;  // of the first pose before the touch [m]
};

CaseMaker::CaseMaker(const Grid& whole, Grid& milled, double isovalue, const Burr& burr, const CaseOptions& options)
    : whole_(whole, isovalue), milled_(milled, isovalue), burr_(burr), options_(options) {
  if (burr.has_shaft()) mill_holes(milled, isovalue);
}

void CaseMaker::mill_holes(Grid& milled, double isovalue) {
  Random random(options_.seed ^ 0x9E3779B97F4A7C15ULL);
  Feeler feeler(Algorithm::kSurface, burr_, 0.5 * whole_.voxel());
  const double R = burr_.tip_radius;
  for (int tries = 0; tries < kTriesPerCase * options_.holes && holes() < options_.holes; ++tries) {
    const auto spot = random_spot(whole_, random);
    if (!spot) continue;
    const Vec3d out = random.direction_near(spot->n, 0.9);
    // Holes that run into each other have no rim.
    const auto near = [&](const Hole& h) { return (h.mouth - spot->p).norm() < 5 * R; };
    if (std::any_of(holes_.begin(), holes_.end(), near)) continue;
    // There is bone to drill into, and the tool gets there.
    if (whole_.value(spot->p - 0.5 * R * out) < 0) continue;
    if (feeler.touches(whole_, tool_pose(spot->p + 1.5 * R * out, out))) continue;
    const Vec3d bottom = spot->p - (kHoleDepth - 1) * R * out;
    trephine::carve(milled, isovalue, trephine::SphereCutter(spot->p + 2 * R * out, bottom, kWiderHole * R));
    holes_.push_back({spot->p, out});
  }
}

std::vector<Case> CaseMaker::make(Algorithm algorithm, const std::function<void(int)>& progress) const {
  Draw draw{Random(options_.seed), Feeler(algorithm, burr_, 0.35 * whole_.voxel()), 0.3 * whole_.voxel()};
  std::vector<Case> cases;
  for (int k = 0; k < kKinds; ++k) {
    const auto kind = static_cast<Kind>(k);
    int made = 0;
    int in_vain = 0;  // since the last one
    for (int tries = 0; tries < kTriesPerCase * options_.per_kind && made < options_.per_kind; ++tries) {
      Case c{.kind = kind};
      bool good = false;
      ++in_vain;
      switch (kind) {
        case Kind::kTipPress:
          good = tip_press(draw, c);
          break;
        case Kind::kShaftLean:
          // Every other one on a crest, unless there are hardly any.
          good = shaft_lean(draw, made % 2 == 0 && in_vain < kTriesPerCase, c);
          break;
        case Kind::kRim:
          good = rim(draw, c);
          break;
        case Kind::kSlide:
          good = sliding(draw, c);
          break;
      }
      if (!good) continue;
      cases.push_back(std::move(c));
      ++made;
      in_vain = 0;
      if (progress) progress(static_cast<int>(cases.size()));
    }
  }
  return cases;
}

/// Even in the logarithm from an eighth of `most`: light contacts are the hard ones and the frequent ones.
double CaseMaker::draw_depth(Random& random, double most) const {
  const double deepest = std::min(most, options_.deepest);
  return deepest * std::exp(-random.between(0, std::log(8.0)));
}

bool CaseMaker::tip_press(Draw& draw, Case& c) const {
  const auto spot = random_spot(whole_, draw.random);
  if (!spot) return false;
  const Vec3d shaft = draw.random.direction_near(spot->n, 0.5);
  const Vec3d in = -draw.random.direction_near(spot->n, 0.9);
  const double clear = draw.feeler.tip_reach() + 1.5 * whole_.voxel();
  const Motion motion{tool_pose(spot->p - clear * in, shaft), in, Vec3d::Zero()};
  const auto touch = find_touch(draw.feeler, whole_, motion, 2 * clear, 0.35 * whole_.voxel());
  if (!touch) return false;
  press(motion, *touch, draw.gap, draw_depth(draw.random, 0.8 * burr_.tip_radius), kTicks, c.X_GT);
  return true;
}

bool CaseMaker::sliding(Draw& draw, Case& c) const {
  if (!tip_press(draw, c)) return false;
  const Vec3d pressed = (c.X_GT.back().translation() - c.X_GT.front().translation()).normalized();
  const double step = 1e-3 * kQuickest * std::exp(-draw.random.between(0, std::log(8.0)));
  slide(step * draw.random.square_to(pressed), kSlideTicks, c.X_GT);
  return true;
}

bool CaseMaker::shaft_lean(Draw& draw, bool crest, Case& c) const {
  if (!burr_.has_shaft()) return false;
  const auto spot = random_spot(whole_, draw.random);
  if (!spot) return false;
  const Vec3d shaft = draw.random.square_to(spot->n);
  if (crest && !is_crest(whole_, *spot, shaft, burr_.tip_radius)) return false;
  const double from = 1.5 * burr_.tip_radius;
  const double height = from + draw.random.between(0.05, 0.9) * std::max(0.0, burr_.shaft_length - from);
  const double clear = draw.feeler.shaft_reach() + 1.5 * whole_.voxel();
  Motion motion{tool_pose(spot->p + clear * spot->n - height * shaft, shaft), Vec3d::Zero(), Vec3d::Zero()};
  if (draw.random.unit() < 0.5)
    motion.velocity = -spot->n;
  else
    motion.turn = turn_toward(shaft, -spot->n, height);
  const auto touch = find_touch(draw.feeler, whole_, motion, 2 * clear, 0.35 * whole_.voxel());
  if (!touch) return false;
  press(motion, *touch, draw.gap, draw_depth(draw.random, 0.8 * burr_.shaft_radius), kTicks, c.X_GT);
  return true;
}

bool CaseMaker::rim(Draw& draw, Case& c) const {
  if (holes_.empty()) return false;
  const Hole& hole = holes_[draw.random.index(holes_.size())];
  const double R = burr_.tip_radius;
  // A little above the ground, so that the tool starts free; a third of the cases go down onto it too.
  const double depth = (kHoleDepth - 1) * R * draw.random.between(0.75, 0.95);
  const Vec3d way = draw.random.square_to(hole.out);
  Motion motion{tool_pose(hole.mouth - depth * hole.out, hole.out), Vec3d::Zero(),
                turn_toward(hole.out, way, std::max(depth, 0.5 * R))};
  if (draw.random.unit() < 0.33) motion.velocity = -draw.random.between(0.1, 0.5) * hole.out;
  const auto touch = find_touch(draw.feeler, milled_, motion, 3 * R, 0.35 * whole_.voxel());
  if (!touch) return false;
  c.milled = true;
  press(motion, *touch, draw.gap, draw_depth(draw.random, 0.8 * burr_.shaft_radius), kTicks, c.X_GT);
  return true;
}

}  // namespace pick
