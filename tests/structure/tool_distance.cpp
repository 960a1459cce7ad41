// SPDX-License-Identifier: MIT
#include "structure/label_shapes.hpp"
#include "support/figures.hpp"
#include "support/malloc_hook.hpp"
#include "support/near.hpp"
#include "support/random.hpp"

#include <trephine/structure/build_structure_field.hpp>
#include <trephine/structure/tool_distance.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <iostream>
#include <limits>
#include <vector>

using namespace trephine;
using namespace trephine::test;

namespace {

/// The least of field minus radius along the axis, in small steps.
double plain_distance(const StructureField& field, const Burr& burr, const Posed& X_ST, double step) {
  double least = field.nearest(X_ST.translation()).distance - burr.tip_radius;
  if (!burr.has_shaft()) return least;
  const int steps = static_cast<int>(std::ceil(burr.shaft_length / step));
  for (int n = 0; n <= steps; ++n) {
    const Vec3d p = X_ST * Vec3d(0, 0, burr.shaft_length * n / steps);
    least = std::min(least, field.nearest(p).distance - burr.shaft_radius);
  }
  return least;
}

Labels some_structures(const Vec3d& h, Random& rng) {
  Labels labels({60, 50, 40}, h);
  for (int s = 0; s < 6; ++s) {
    const Vec3d centre = labels.end().cwiseProduct(Vec3d{rng.uniform(), rng.uniform(), rng.uniform()});
    labels.fill(random_shape(s % kShapes, centre, 0.5 * h.maxCoeff(), rng).distance, s + 1);
  }
  return labels;
}

}  // namespace

TEST_CASE("The whole tool's distance is the least along its axis") {
  constexpr unsigned kSeed = 31;
  Random rng(kSeed);
  Figures errors, lookups, known_errors, known_lookups;
  double most_bound = 0;
  for (const Vec3d& h : {Vec3d(3e-4, 3e-4, 3e-4), Vec3d(2e-4, 2e-4, 5e-4)}) {
    const Labels labels = some_structures(h, rng);
    const auto field = build_structure_field(labels.view(), {.threads = 2});
    const double longest = h.maxCoeff();
    for (int n = 0; n < 400; ++n) {
      Burr burr{.tip_radius = rng.uniform(2e-4, 2e-3), .shaft_radius = rng.uniform(2e-4, 1.5e-3)};
      burr.shaft_length = n % 5 == 0 ? 0 : rng.uniform(3e-3, 0.04);
      const Mat3d R = n % 7 == 0 ? Mat3d(Mat3d::Identity()) : rng.rotation();
      const Vec3d at =
          labels.end().cwiseProduct(Vec3d{rng.uniform(-0.5, 1.5), rng.uniform(-0.5, 1.5), rng.uniform(-0.5, 1.5)});
      const Posed X_ST = make_pose<double>(R, at);
      const ToolDistance d = tool_distance(*field, burr, X_ST);
      const double truth = plain_distance(*field, burr, X_ST, 0.01 * longest);
      errors.add(std::abs(d.distance - truth) / longest);
      lookups.add(d.lookups);
      const double bound = 10 + burr.shaft_length * (1 / h.x() + 1 / h.y() + 1 / h.z() + 1 / longest);
      most_bound = std::max(most_bound, d.lookups / bound);
      // The point is on the tool, and as far from the structure as said.
      const Vec3d axis_point = X_ST * Vec3d(0, 0, d.z_T);
      const bool tip = d.z_T == 0 && std::abs((d.p_S - axis_point).norm() - burr.tip_radius) < 1e-9;
      const bool shaft = std::abs((d.p_S - axis_point).norm() - burr.shaft_radius) < 1e-9;
      CHECK((tip || shaft));
      CHECK(d.direction_S.norm() == near(1));
      CHECK(d.structure == field->nearest(axis_point).structure);

      // With distances that are known at places on the axis: none, few, or as dense as a guard's.
      std::vector<AxisProbe> known(static_cast<std::size_t>(n % 4 == 0 ? rng.below(4) : rng.below(60)));
      for (AxisProbe& probe : known) probe.z = rng.uniform(0, burr.shaft_length);
      std::sort(known.begin(), known.end(), [](const auto& a, const auto& b) { return a.z < b.z; });
      for (AxisProbe& probe : known) probe.distance = field->nearest(X_ST * Vec3d(0, 0, probe.z)).distance;
      const ToolDistance told = tool_distance(*field, burr, X_ST, known);
      known_errors.add(std::abs(told.distance - truth) / longest);
      known_lookups.add(told.lookups);
      CHECK(told.distance <= d.distance + 0.02 * longest);
    }
  }
  std::cout << "tool against small steps [longest spacings]: " << errors << "; lookups: " << lookups << '\n';
  std::cout << "with known distances: " << known_errors << "; lookups: " << known_lookups << '\n';
  CHECK(errors.worst() < 0.0046);
  CHECK(known_errors.worst() < 0.0046);
  CHECK(known_lookups.median() < 0.7 * lookups.median());
  CHECK(most_bound <= 1);
}

TEST_CASE("The whole tool's distance at its edges, without memory") {
  Random rng(32);
  const Labels labels = some_structures(Vec3d::Constant(3e-4), rng);
  const auto field = build_structure_field(labels.view(), {.threads = 1});
  const Burr burr;
  Posed X_ST = Posed::Identity();
  X_ST.translation().x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(tool_distance(*field, burr, X_ST).structure == -1);
  X_ST.translation().x() = std::numeric_limits<double>::infinity();
  CHECK(tool_distance(*field, burr, X_ST).structure == -1);
  X_ST.translation().x() = 100;
  const ToolDistance far = tool_distance(*field, burr, X_ST);
  CHECK(far.distance == near(100, 5.8e-4));
  CHECK(far.lookups <= 10 + burr.shaft_length * 4 / 3e-4);
  static_assert(noexcept(tool_distance(*field, burr, X_ST)));
  X_ST.translation() = 0.5 * labels.end();
  const auto calls = heap_calls([&] { (void)tool_distance(*field, burr, X_ST); });
  CHECK(calls == 0);
}
