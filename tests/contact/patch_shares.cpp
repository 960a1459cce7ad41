// SPDX-License-Identifier: MIT
#include <trephine/contact/patch_shares.hpp>
#include <trephine/contact/smooth_depth.hpp>

#include <doctest/doctest.h>

#include <cmath>
#include <random>

namespace {

using namespace trephine;

constexpr double kRadius = 1.5e-3;
// As wide as the coupled tool has them.
double reach_of(int count) { return 1.25 * std::sqrt(4.0 / count); }

struct Found {
  ToolDiscretization<SurfaceCounts, double> tool;
  PointArrays<double> places;
  std::vector<double> values;
  PatchShares<double> shares;

  explicit Found(int count)
      : tool(Burr{.tip_radius = kRadius, .shaft_length = 0}, {.sphere = count, .slices = 0}),
        values(static_cast<std::size_t>(count), 1e-5),
        shares(kRadius, reach_of(count), count) {
    for (auto* v : {&places.x, &places.y, &places.z}) v->resize(static_cast<std::size_t>(padded_to_lane(count)));
  }
  void divide() {
    shares.divide(places, values, tool.groups()[0].count, -1e-4, [&](int j) { return tool.points()[j]; });
  }
  [[nodiscard]] double sum() const {
    double sum = 0;
    for (int j = 0; j < tool.groups()[0].count; ++j) sum += shares.of(j);
    return sum;
  }
};

Vec3d any_direction(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Vec3d(normal(random), normal(random), normal(random)).normalized();
}

}  // namespace

// On smooth bone all patches find the one place: it is one contact, wherever it lies and however many patches there
// are.
TEST_CASE("a place that all patches find counts once") {
  std::mt19937 random(7);
  for (const int count : {14, 26, 50, 98, 200, 1000}) {
    CAPTURE(count);
    Found found(count);
    for (int i = 0; i < 300; ++i) {
      const Vec3d place = kRadius * any_direction(random);
      for (int j = 0; j < count; ++j) found.places.put(j, place);
      found.divide();
      CHECK(found.sum() == doctest::Approx(1).epsilon(1e-9));
    }
  }
}

TEST_CASE("places far apart count one each, and what only neighbours hold counts nothing") {
  Found found(26);
  for (int j = 0; j < 26; ++j) found.values[static_cast<std::size_t>(j)] = -1;
  const auto at = [&](int j, const Vec3d& place, double value) {
    found.places.put(j, place);
    found.values[static_cast<std::size_t>(j)] = value;
  };
  // Two in the middles of their patches; a third at its patch' edge, of which the second is 25 degrees away.
  const Vec3d a = found.tool.points()[0], b = found.tool.points()[25];
  at(0, a, 2e-5);
  at(25, b, 1e-5);
  const Vec3d c = found.tool.points()[20], aside = (b - b.dot(c) / c.squaredNorm() * c).normalized();
  at(20, kRadius * (std::cos(reach_of(26)) * c / kRadius + std::sin(reach_of(26)) * aside), 1e-5);
  found.divide();
  CHECK(found.shares.of(0) == doctest::Approx(1));
  CHECK(found.shares.of(25) == doctest::Approx(1));
  CHECK(found.shares.of(20) == doctest::Approx(0));
  CHECK(found.sum() == doctest::Approx(2));
  // Were it the deepest of all, it would count.
  found.values[20] = 3e-5;
  found.values[25] = -1;
  found.divide();
  CHECK(found.shares.of(20) == doctest::Approx(1));
}

// Bone as a ball: φ = B − |p − c|, of which all derivatives are known, and so are the deepest place of a ball that
// touches it, and how that rolls.
TEST_CASE("a step settles where a ball is deepest in a ball, and tells how it rolls") {
  constexpr double kBone = 3e-3, kVoxel = 3e-4;
  std::mt19937 random(3);
  for (const bool hollow : {false, true}) {
    for (int i = 0; i < 300; ++i) {
      CAPTURE(hollow);
      const Vec3d to = any_direction(random);
      const double sign = hollow ? -1 : 1;
      // 20 µm deep.
      const Vec3d centre = hollow ? Vec3d(-(kBone - kRadius + 2e-5) * to) : Vec3d((kBone + kRadius - 2e-5) * to);
      const double off = 0.2 * kVoxel / kRadius;
      const Vec3d start = (to + off * to.cross(any_direction(random))).normalized();
      const VertexPatch<double> around{start, kRadius, std::cos(0.5), std::sin(0.5), true};
      SmoothDepth<double> there;
      there.place = kRadius * start;
      const Vec3d away = there.place - centre;
      const double r = away.norm();
      there.value = sign * (kBone - r);
      there.rise = there.smooth = -sign * away / r;
      there.bend = -sign * (Mat3d::Identity() - away * away.transpose() / (r * r)) / r;
      std::array<Rolling<double>, 2> rolls;
      // The step may be longer than the way where the hollow is nearly as round as the ball.
      const bool reached = settle(around, Mat3d(Mat3d::Identity()), kVoxel, there, rolls);
      CHECK(reached);
      CHECK(std::acos(std::min(1.0, there.place.dot(to) / kRadius)) < off * off);
      CHECK(there.value == doctest::Approx(2e-5).epsilon(0.02));
      // Its centre goes round the bone's, farther out than that is round by its own radius, or nearer by it.
      for (const Rolling<double>& roll : rolls) {
        CHECK(roll.bend == doctest::Approx(hollow ? 1 / (kBone - kRadius) : -1 / (kBone + kRadius)).epsilon(0.03));
        CHECK(roll.way.norm() == doctest::Approx(1));
      }
      CHECK(std::abs(rolls[0].way.dot(rolls[1].way)) < 1e-12);
    }
  }
}
