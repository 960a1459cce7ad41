// SPDX-License-Identifier: MIT
#include "support/near.hpp"
#include "voxel/sampled_fields.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/core/units.hpp>
#include <trephine/tool/revolved_cutter.hpp>
#include <trephine/tool/shapes/drill_bit.hpp>

#include <doctest/doctest.h>

#include <numbers>

using namespace trephine;
using namespace trephine::test;
using namespace trephine::literals;

namespace {

constexpr unsigned kSeed = 808;
/// Shares without a farthest distance.
template <class Lanes>
Lanes anywhere() {
  Lanes lanes;
  lanes.fill(1);  // [m]
  return lanes;
}
/// Single precision over a few centimetres, by way of squares.
constexpr double kLaneTolerance = 1e-8;  // [m]

/// What every cutter promises, at random rows round it.
template <Cutter C>
void check_contract(const C& cutter, std::mt19937& rng) {
  const Eigen::AlignedBox3d box = cutter.bounds();
  const double reach = 0.5_mm;
  const Vec3d pad = Vec3d::Constant(1.5_mm);
  for (std::size_t n = 0; n < 4000; ++n) {
    const Vec3d p = random_point(rng, box.min() - pad, box.max() + pad);
    const double d = cutter.signed_distance(p);
    if (d < 0) CHECK(box.contains(p));
    CHECK(std::max(d, 0.0) >= box.exteriorDistance(p) - 1e-12);
    const Vec3d r = p - cutter.origin();
    RowLanes y;
    y.fill(r.y());
    RowSpans spans;
    cutter.rows(y, r.z(), reach, spans);
    if (d < reach) CHECK((spans.lo[n % kCutRows] <= r.x() && r.x() <= spans.hi[n % kCutRows]));
    CutLanes lanes;
    const double step = 0.21_mm;
    cutter.distances(static_cast<float>(r.x()), static_cast<float>(step), static_cast<float>(r.y()),
                     static_cast<float>(r.z()), lanes);
    for (int l = 0; l < kCutLanes; l += 5)
      CHECK(std::abs(static_cast<double>(lanes[static_cast<std::size_t>(l)]) -
                     cutter.signed_distance(p + Vec3d(step * l, 0, 0))) < kLaneTolerance);
  }
}

/// Whether p, in T, is in the bit: by its definition.
bool in_bit(const DrillBit& bit, const Vec3d& p) {
  const double r = std::hypot(p.x(), p.y());
  const double z = p.z();
  switch (bit.end) {
    case DrillEnd::kFlat:
      return r < bit.radius && z > -bit.radius && z < bit.length;
    case DrillEnd::kCone:
      return r < bit.radius && z < bit.length && r < (z + bit.radius) * std::tan(bit.half_angle);
    case DrillEnd::kRound: {
      const double nearest = std::clamp(z, 0.0, bit.length - bit.radius);
      return std::hypot(r, z - nearest) < bit.radius;
    }
  }
  return false;
}

std::vector<DrillBit> bits() {
  return {{.radius = 1_mm, .length = 4_mm, .end = DrillEnd::kFlat},
          {.radius = 1_mm, .length = 4_mm, .end = DrillEnd::kCone, .half_angle = 1.0297},
          {.radius = 0.7_mm, .length = 5_mm, .end = DrillEnd::kCone, .half_angle = 0.4},
          {.radius = 1.2_mm, .length = 6_mm, .end = DrillEnd::kRound}};
}

}  // namespace

TEST_CASE("A swept ball is the union of balls along its way") {
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed);
  for (const double way : {0.0, 1e-12, 0.01_mm, 1_mm, 8_mm}) {
    const Vec3d a(0.02, -0.01, 0.03);
    const Vec3d b = a + way * random_direction(rng);
    const SphereCutter cutter(a, b, 1.5_mm);
    check_contract(cutter, rng);
    for (int n = 0; n < 300; ++n) {
      const Vec3d p = random_point(rng, cutter.bounds().min(), cutter.bounds().max());
      double nearest = 1;
      for (int i = 0; i <= 2000; ++i) nearest = std::min(nearest, (p - a - (i / 2000.0) * (b - a)).norm() - 1.5_mm);
      CHECK(cutter.signed_distance(p) <= nearest + 1e-12);
      CHECK(cutter.signed_distance(p) >= nearest - 3e-6);  // samples 4 µm apart
    }
  }
  for (int a = 0; a < 3; ++a) check_contract(SphereCutter(Vec3d::Zero(), Vec3d::Unit(a) * 3_mm, 1_mm), rng);
}

TEST_CASE("A swept ball's share is the mean over its way") {
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed);
  constexpr double kReach = 0.45e-3, kRadius = 1.5e-3;
  constexpr double kBound = 0.01;  // three Gauss points' and the middle's, where the share bends
  for (const double way : {0.0, 0.01, 0.1, 0.12, 0.13, 0.5}) {
    double worst = 0;
    for (int n = 0; n < 400; ++n) {
      const Vec3d a(0.02, -0.01, 0.03), b = a + way * kReach * random_direction(rng);
      const Vec3d p = a + (kRadius + kReach * (static_cast<double>(n) / 133 - 1.5)) * random_direction(rng);
      const Vec3d r = p - SphereCutter(a, b, kRadius).origin();
      CutLanes lanes;
      SphereCutter(a, b, kRadius)
          .shares(static_cast<float>(r.x()), 1e-4F, static_cast<float>(r.y()), static_cast<float>(r.z()),
                  static_cast<float>(kReach), anywhere<CutLanes>(), lanes);
      double mean = 0;
      constexpr int kParts = 400;
      for (int i = 0; i < kParts; ++i) {
        const Vec3d c = a + (i + 0.5) / kParts * (b - a);
        mean += std::clamp(0.5 - ((p - c).norm() - kRadius) / (2 * kReach), 0.0, 1.0) / kParts;
      }
      worst = std::max(worst, std::abs(static_cast<double>(lanes[0]) - mean));
    }
    CAPTURE(way);
    CHECK(worst <= kBound);
  }
}

TEST_CASE("Distances have the same bits in few lanes and in many") {
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed + 1);
  int differ = 0;
  for (int n = 0; n < 2000; ++n) {
    const Vec3d r = 3e-3 * random_direction(rng);
    const SphereCutter cutter(Vec3d::Zero(), 1e-4 * random_direction(rng), 1.5e-3);
    const auto x = static_cast<float>(r.x()), y = static_cast<float>(r.y()), z = static_cast<float>(r.z());
    CutLanes many, share_of_many;
    HalfCutLanes few, share_of_few;
    cutter.distances(x, 3e-4F, y, z, many);
    cutter.distances(x, 3e-4F, y, z, few);
    cutter.shares(x, 3e-4F, y, z, 4.5e-4F, anywhere<CutLanes>(), share_of_many);
    cutter.shares(x, 3e-4F, y, z, 4.5e-4F, anywhere<HalfCutLanes>(), share_of_few);
    for (std::size_t l = 0; l < few.size(); ++l)
      differ += few[l] != many[l] || share_of_few[l] != share_of_many[l] ? 1 : 0;
  }
  CHECK(differ == 0);
}

TEST_CASE("A drill bit has the shape and the distances it says") {
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed + 1);
  for (const DrillBit& bit : bits()) {
    bit.validate();
    const Posed X = make_pose<double>(random_rotation(rng), {0.01, 0.02, -0.03});
    const RevolvedCutter cutter(bit, X, X, 0.1_mm);
    check_contract(cutter, rng);
    const Vec3d half(1.5 * bit.radius, 1.5 * bit.radius, 0);
    for (int n = 0; n < 20000; ++n) {
      const Vec3d p_T = random_point(rng, -half - Vec3d(0, 0, 1.5 * bit.radius), half + Vec3d(0, 0, 1.1 * bit.length));
      const double d = cutter.signed_distance(X * p_T);
      CHECK((d < 0) == in_bit(bit, p_T));
      // A distance: no nearer point is on the other side ...
      const Vec3d q_T = p_T + 0.98 * std::abs(d) * random_direction(rng);
      CHECK(in_bit(bit, q_T) == (d < 0));
    }
    // ... and at that distance there is one: along the descent of the distance itself.
    for (int n = 0; n < 500; ++n) {
      const Vec3d p = X * random_point(rng, -half, half + Vec3d(0, 0, bit.length));
      const double d = cutter.signed_distance(p);
      Vec3d g;
      for (int a = 0; a < 3; ++a) {
        const Vec3d e = Vec3d::Unit(a) * 1e-8;
        g[a] = (cutter.signed_distance(p + e) - cutter.signed_distance(p - e)) / 2e-8;
      }
      if (std::abs(g.norm() - 1) > 1e-5) continue;  // on a ridge, equally far from two faces
      CHECK(std::abs(cutter.signed_distance(p - d * g)) < 5e-11);
    }
    CHECK(cutter.signed_distance(X * Vec3d(0, 0, -bit.radius)) == within(0, 1e-17));
  }
}

TEST_CASE("A swept drill bit covers its way") {
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed + 2);
  for (const DrillBit& bit : bits()) {
    const Posed X0 = make_pose<double>(random_rotation(rng), {0.01, 0, 0});
    const Vec3d turn = 0.3 * random_direction(rng);
    const Posed X1 =
        make_pose<double>(X0.linear() * rotation_from_vector(turn), X0.translation() + 1.3_mm * random_direction(rng));
    const double step = 0.1_mm;
    CHECK(RevolvedCutter::travel(bit, X0, X1) == near(1.3_mm + 0.3 * std::hypot(bit.length, bit.radius)));
    const RevolvedCutter cutter(bit, X0, X1, step);
    check_contract(cutter, rng);
    for (int n = 0; n < 300; ++n) {
      // A point of the bit at a time in between is in the sweep, or as near as the steps leave it.
      const double t = std::uniform_real_distribution<double>(0, 1)(rng);
      Vec3d p_T;
      do {
        p_T =
            random_point(rng, Vec3d(-bit.radius, -bit.radius, -bit.radius), Vec3d(bit.radius, bit.radius, bit.length));
      } while (!in_bit(bit, p_T));
      const Posed X = make_pose<double>(X0.linear() * rotation_from_vector<double>(t * turn),
                                        (1 - t) * X0.translation() + t * X1.translation());
      CHECK(cutter.signed_distance(X * p_T) < step / 2);
    }
  }
}

TEST_CASE("A bit that cannot be is refused") {
  const auto refused = [](const DrillBit& bit) { CHECK_THROWS_AS(bit.validate(), std::invalid_argument); };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {0.0, -1e-3, nan, std::numeric_limits<double>::infinity()}) {
    refused({.radius = bad});
    refused({.length = bad});
  }
  for (const double bad : {0.0, -1.0, 1.6, nan}) refused({.half_angle = bad});
  refused({.radius = 1_mm, .length = 1_mm, .half_angle = 0.2});
  refused({.radius = 1_mm, .length = 0.9_mm, .end = DrillEnd::kRound});
  CHECK_NOTHROW(DrillBit{}.validate());
}
