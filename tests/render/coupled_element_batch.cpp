// SPDX-License-Identifier: MIT
// Distances of surface elements' points, many elements at a time, against the tool's distance of each point alone.
#include "support/figures.hpp"
#include "support/malloc_hook.hpp"
#include "support/near.hpp"
#include "support/poses.hpp"

#include <trephine/render/coupled/coupled_constants.hpp>
#include <trephine/render/coupled/element_batch.hpp>
#include <trephine/tool/ball_and_shaft.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 7723;
constexpr Burr kDrill{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.030};
constexpr Burr kBallAlone{.tip_radius = 0.002, .shaft_radius = 0.0008, .shaft_length = 0};
// Near the tool's surface the narrow phase counts on this error.
constexpr double kNearSurface = 5e-4;  // [m]
constexpr auto kSingle = static_cast<double>(CoupledConstants::kSinglePrecision);
// Elsewhere: coordinates up to 5 cm round by 2e-9 m, and a distance comes from a few of them.
constexpr double kSingleFar = 2e-8;  // [m]
// On the axis ρ, the root of a difference of squares of half a millimetre, may err by √(6e-8 · 2.5e-7 m²), 1.2e-7 m;
// places near it meet a tenth of that.
constexpr double kNearAxis = 2e-4, kSingleOnAxis = 1.3e-8;  // [m]
constexpr std::array<std::size_t, 6> kCounts{1, 2, 7, 11, 15, ElementBatch::kSize};

/// Signed distance of a point in T: a ball about the origin, or a cylinder with flat ends, whichever is nearer.
double exact_distance(const Burr& burr, const Vec3d& p_T) {
  const double ball = p_T.norm() - burr.tip_radius;
  if (!burr.has_shaft()) return ball;
  const double side = p_T.head<2>().norm() - burr.shaft_radius;
  const double end = std::max(-p_T.z(), p_T.z() - burr.shaft_length);
  const double outside = std::hypot(std::max(side, 0.0), std::max(end, 0.0));
  return std::min(ball, outside + std::min(std::max(side, end), 0.0));
}

/// A block of skewed elements near a tool at X, about a brick's corner. Half sides are those of voxels of .3 mm.
NearBlock random_block(Random& random, ElementBlock& elements, const Burr& burr, const Posed& X) {
  NearBlock block{.elements = &elements, .count = ElementBlock::kSize, .brick = 0, .corner = Vec3d::Zero()};
  const double height = random.uniform(-3e-3, burr.shaft_length + 3e-3);
  block.corner = X * Vec3d(Vec3d(0, 0, height) + random.arrow(0, 3e-3));
  for (std::size_t i = 0; i < ElementBlock::kSize; ++i) {
    const Vec3d position = random.arrow(0, 3e-3), along = random.arrow(0, 3e-4), across = random.arrow(0, 3e-4);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<Eigen::Index>(axis);
      elements.position[axis][i] = static_cast<float>(position[a]);
      elements.along[axis][i] = static_cast<float>(along[a]);
      elements.across[axis][i] = static_cast<float>(across[a]);
    }
  }
  return block;
}

/// Fills all lanes, and all results, with numbers that no element has.
void poison(ElementBatch& batch) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  for (auto* vector : {&batch.position, &batch.along, &batch.across})
    for (auto& lanes : *vector) lanes.fill(kNaN);
  for (auto& lanes : batch.distance) lanes.fill(kNaN);
  batch.min_distance.fill(kNaN);
}

struct Errors {
  Figures near_surface, near_axis, far;
  int in_tool = 0, not_least = 0, wrong_element = 0;
};

void check_batches(const Burr& burr, unsigned seed, Errors& errors) {
  Random random(seed);
  const BallAndShaft shape(burr);
  ElementBatch batch;
  std::array<ElementBlock, 2> elements{};
  for (int repeat = 0; repeat < 50; ++repeat)
    for (std::size_t side = 1; side <= PointLattice::kMaxSide; ++side)
      for (const std::size_t count : kCounts) {
        const Posed X = random_pose(random, Vec3d::Zero(), 0.05);
        const Vec3<float> axis = X.linear().col(2).cast<float>();
        const std::array<NearBlock, 2> blocks{random_block(random, elements[0], burr, X),
                                              random_block(random, elements[1], burr, X)};
        if (repeat % 2 == 0) poison(batch);
        batch.count = 0;
        const auto calls = heap_calls([&] {
          for (std::size_t n = 0; n < count; ++n) {
            const NearBlock& block = blocks[n % 2];
            batch.add(block, n / 2, (block.corner - X.translation()).cast<float>());
          }
          batch.compute_distances(shape, PointLattice(side), axis);
        });
        CHECK(calls == 0);
        REQUIRE(batch.count == count);
        for (std::size_t n = 0; n < count; ++n) {
          errors.wrong_element += batch.element[n] != std::pair(&blocks[n % 2], n / 2) ? 1 : 0;
          const SurfaceElement element = blocks[n % 2].element(n / 2);
          float least = std::numeric_limits<float>::max();
          for (std::size_t j = 0; j < side * side; ++j) {
            // Rows of `side` points over the parallelogram, each in the middle of its share.
            const double i = (2.0 * static_cast<double>(j / side) + 1) / static_cast<double>(side) - 1;
            const double k = (2.0 * static_cast<double>(j % side) + 1) / static_cast<double>(side) - 1;
            const Vec3d p_T = X.inverse() * Vec3d(element.position + i * element.along + k * element.across);
            const double exact = exact_distance(burr, p_T);
            const double error = std::abs(static_cast<double>(batch.distance[j][n]) - exact);
            Figures& figures = p_T.head<2>().norm() < kNearAxis ? errors.near_axis
                               : std::abs(exact) < kNearSurface ? errors.near_surface
                                                                : errors.far;
            figures.add(std::isnan(error) ? std::numeric_limits<double>::infinity() : error);
            errors.in_tool += exact < 0 ? 1 : 0;
            least = std::min(least, batch.distance[j][n]);
          }
          errors.not_least += batch.min_distance[n] == least ? 0 : 1;
        }
      }
}

TEST_CASE("element batch: each point of each element has the tool's signed distance, and the least is their minimum") {
  CAPTURE(kSeed);
  for (const Burr& burr : {kDrill, kBallAlone}) {
    CAPTURE(burr.shaft_length);
    Errors errors;
    check_batches(burr, kSeed, errors);
    MESSAGE("distance off by [m]: near the surface ", errors.near_surface, "; near the axis ", errors.near_axis,
            "; elsewhere ", errors.far, "; points in the tool ", errors.in_tool);
    CHECK(errors.near_surface.worst() <= kSingle);
    CHECK(errors.near_axis.worst() <= kSingleOnAxis);
    CHECK(errors.far.worst() <= kSingleFar);
    CHECK(errors.not_least == 0);
    CHECK(errors.wrong_element == 0);
    CHECK(errors.near_surface.count() > 10000);
    CHECK(errors.near_axis.count() > 500);
    CHECK(errors.in_tool > 3000);
  }
}

// A point on the axis, one beside the shaft, one above its end and one on the rim: numbers without a sum of squares.
TEST_CASE("element batch: one element in closed form, and lattices") {
  ElementBlock elements{};
  const NearBlock block{.elements = &elements, .count = 1, .brick = 0, .corner = Vec3d::Zero()};
  elements.along[0][0] = 0.0010F;   // x
  elements.across[2][0] = 0.0020F;  // z
  ElementBatch batch;
  const auto distances = [&](const Vec3<float>& shift, std::size_t side) {
    batch.count = 0;
    batch.add(block, 0, shift);
    batch.compute_distances(BallAndShaft(kDrill), PointLattice(side), Vec3<float>::UnitZ());
  };
  distances({0, 0, 0.010F}, 1);
  CHECK(static_cast<double>(batch.distance[0][0]) == near(-0.0008, 1e-7));
  distances({0, 0.003F, 0.010F}, 1);
  CHECK(static_cast<double>(batch.distance[0][0]) == near(0.0022, 1e-7));
  distances({0.0005F, 0, 0.0315F}, 1);
  CHECK(static_cast<double>(batch.distance[0][0]) == near(0.0015, 2.3e-6));
  // Two points a side at half the half sides: x = .0045 ± .0005, z = .031 ± .001.
  distances({0.0045F, 0, 0.031F}, 2);
  CHECK(static_cast<double>(batch.distance[0][0]) == near(0.0032, 8e-7));
  CHECK(static_cast<double>(batch.distance[1][0]) == near(std::hypot(0.0032, 0.002), 8e-7));
  CHECK(static_cast<double>(batch.distance[2][0]) == near(0.0042, 8e-7));
  CHECK(static_cast<double>(batch.distance[3][0]) == near(std::hypot(0.0042, 0.002), 8e-7));
  CHECK(batch.min_distance[0] == batch.distance[0][0]);
  for (std::size_t side = 1; side <= PointLattice::kMaxSide; ++side) {
    const PointLattice lattice(side);
    REQUIRE(lattice.points == side * side);
    for (std::size_t j = 0; j < lattice.points; ++j) {
      CHECK(lattice.along[j] == -lattice.along[lattice.points - 1 - j]);
      CHECK(lattice.across[j] == -lattice.across[lattice.points - 1 - j]);
    }
    CHECK(lattice.outermost == lattice.along[lattice.points - 1]);
  }
  CHECK(PointLattice(1).along[0] == 0);
  CHECK(PointLattice(4).across[0] == -0.75);
  CHECK(PointLattice(4).along[9] == 0.25);
  CHECK(PointLattice(0).points == 1);
  CHECK(PointLattice(9).points == 16);
}

static_assert(ElementBatch::kSize % kProfileLanes == 0);
static_assert(noexcept(std::declval<ElementBatch&>().add(std::declval<const NearBlock&>(), 0,
                                                         std::declval<const Vec3<float>&>())));
static_assert(noexcept(std::declval<ElementBatch&>().compute_distances(std::declval<const BallAndShaft&>(),
                                                                       PointLattice(1),
                                                                       std::declval<const Vec3<float>&>())));

}  // namespace
