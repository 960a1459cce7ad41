// SPDX-License-Identifier: MIT
#include "support/raster.hpp"

#include <trephine/contact/fading_places.hpp>
#include <trephine/contact/vertex_contacts.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr int kBall = 26;
constexpr double kClose = 1.5e-4;

VertexContact contact(int vertex, const Vec3d& lever, double weight = 1) {
  VertexContact c;
  c.vertex = vertex;
  c.lever = lever;
  c.weight = weight;
  return c;
}

/// What is held on to beside `found`, as contacts.
std::vector<VertexContact> held(const FadingPlaces& fading, const std::vector<VertexContact>& found) {
  std::vector<VertexContact> all;
  fading.each(std::span<const VertexContact>(found), kClose,
              [&](const FadingPlaces::Place& p, double weight) { all.push_back(contact(p.vertex, p.lever, weight)); });
  return all;
}

double sum_of(const std::vector<VertexContact>& contacts) {
  double sum = 0;
  for (const VertexContact& c : contacts) sum += c.weight;
  return sum;
}

void begin(FadingPlaces& fading, const std::vector<VertexContact>& found) {
  fading.begin(std::span<const VertexContact>(found), kBall);
}

TEST_CASE("a place that nothing holds any more fades by equal parts, and is let go") {
  FadingPlaces fading(kBall);
  std::vector<VertexContact> found{contact(3, Vec3d(0, 0, -1e-3)), contact(40, Vec3d(0, 1e-3, 0.01))};
  double weight = 1;
  int ticks = 0;
  for (; ticks < 100 && !found.empty(); ++ticks) {
    begin(fading, found);
    found = held(fading, {});
    if (found.empty()) break;
    REQUIRE(found.size() == 1);  // the shaft's is not held on to
    CHECK(found[0].vertex == 3);
    CHECK(found[0].weight == doctest::Approx(0.7 * weight));
    weight = found[0].weight;
  }
  CHECK(ticks == 25);
  CHECK(weight < 2e-4);
}

TEST_CASE("what is found close by takes the place of what was held") {
  FadingPlaces fading(kBall);
  Random random(11);
  for (int i = 0; i < 1000; ++i) {
    const Vec3d place = 1e-3 * random.unit();
    const double weight = random.uniform(0.1, 1);
    begin(fading, {contact(1, place, weight)});
    // Moved a little, it is the same.
    CHECK(held(fading, {contact(2, place + 0.5 * kClose * random.unit(), weight)}).empty());
    // A voxel away it is another.
    CHECK(sum_of(held(fading, {contact(2, place + 2 * kClose * random.unit(), weight)})) ==
          doctest::Approx(0.7 * weight));
    // One that two held is held once.
    const double share = random.uniform(0.01, 0.6);
    begin(fading, {contact(1, place, share * weight), contact(2, place, (1 - share) * weight)});
    CHECK(sum_of(held(fading, {contact(1, place, 0.4 * weight)})) == doctest::Approx(0.3 * weight));
  }
}

TEST_CASE("as many places are held on to as the ball has vertices, and none once forgotten") {
  FadingPlaces fading(kBall);
  Random random(12);
  std::vector<VertexContact> found;
  for (int i = 0; i < 2 * kBall; ++i) found.push_back(contact(i % kBall, 1e-3 * random.unit()));
  begin(fading, found);
  CHECK(held(fading, {}).size() == kBall);
  fading.forget();
  CHECK(held(fading, {}).empty());
  const FadingPlaces unused(kBall);
  FadingPlaces copy = unused;  // as a scene makes of its renderer
  begin(copy, found);
  CHECK(held(copy, {}).size() == kBall);
}

}  // namespace
