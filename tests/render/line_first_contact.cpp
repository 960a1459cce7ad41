// SPDX-License-Identifier: MIT
#include <trephine/render/line/first_contact.hpp>

#include "support/fields.hpp"
#include "support/near.hpp"

#include <doctest/doctest.h>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr double kVoxel = 3e-4;
const Burr kBurr{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.020};

template <class Scalar>
using LineTool = ToolDiscretization<LineCounts, Scalar>;

template <class Scalar>
Centreline<Scalar> line(const Vec3d& tip, const Vec3d& direction) {
  return {tip.template cast<Scalar>(), direction.template cast<Scalar>()};
}

// Where vertex at height h is after `time` of the path, written down from Eq. 3, 4 and 5, in double.
Vec3d on_path(const TranslateRotate&, const Centreline<double>& a, const Centreline<double>& b, double time, double h) {
  if (time <= 0.5) return a.tip + 2 * time * (b.tip - a.tip) + h * a.direction;
  const Vec3d axis = a.direction.cross(b.direction);
  const double angle = std::atan2(axis.norm(), a.direction.dot(b.direction));
  if (!(axis.norm() > 0)) return b.tip + h * a.direction;
  return b.tip + h * (Eigen::AngleAxisd((2 * time - 1) * angle, axis.normalized()) * a.direction);
}
Vec3d on_path(const RayCast&, const Centreline<double>& a, const Centreline<double>& b, double time, double h) {
  const Vec3d from = a.tip + h * a.direction;
  return from + time * (b.tip + h * b.direction - from);
}

struct Impact {
  bool found = false;
  double time = 2;
  double deepest = -1e9;  ///< of any vertex anywhere on the path [m]
};

// Heights of a line's vertices and of the points searched between them.
template <class Scalar>
std::vector<double> searched_heights(const LineTool<Scalar>& tool) {
  const double from = static_cast<double>(tool.heights().front());
  const double length = static_cast<double>(tool.heights()[static_cast<std::size_t>(tool.count() - 1)]) - from;
  const int points = (tool.count() - 1) * (kLane + 1);
  std::vector<double> heights;
  for (int i = 0; i <= points; ++i) heights.push_back(from + length * i / points);
  return heights;
}

// Oracle: points of the line at some heights, the path in small pieces, then bisection.
template <class Step, class Shape>
Impact impact_slowly(const Step& step, const Shape& shape, const std::vector<double>& heights,
                     const Centreline<double>& a, const Centreline<double>& b, int pieces) {
  const auto depth_at = [&](double time) {
    double deepest = -1e9;
    for (const double h : heights) deepest = std::max(deepest, -shape(on_path(step, a, b, time, h)));
    return deepest;
  };
  Impact impact;
  for (int n = 0; n <= pieces; ++n) {
    const double time = static_cast<double>(n) / pieces;
    const double depth = depth_at(time);
    impact.deepest = std::max(impact.deepest, depth);
    if (impact.found || depth < 0) continue;
    impact.found = true;
    double lo = std::max(0.0, time - 1.0 / pieces), hi = time;
    for (int k = 0; k < 40; ++k) {
      const double mid = 0.5 * (lo + hi);
      (depth_at(mid) < 0 ? lo : hi) = mid;
    }
    impact.time = hi;
  }
  return impact;
}

enum class Motion { kTranslation, kRotation, kBoth };

struct Tally {
  int found = 0, missed = 0, grazing = 0, invented = 0;
  double point = 0;  ///< distance of IntP from the surface [voxels]
  double late = 0;   ///< distance of IntP from where the line's point there first touches [voxels]
};

// Thousands of random moves of a line past a shape, at the speeds of a hand, 1 ms each.
template <class Scalar, class Step, class Shape>
Tally random_moves(const Step& step, const Shape& shape, const LineTool<Scalar>& tool, Motion motion, int moves,
                   Random& random) {
  const ShapeField<Scalar, Shape> field(shape, kVoxel);
  std::vector<Scalar> scratch(2 * static_cast<std::size_t>(tool.padded()));
  const std::vector<double> heights = searched_heights(tool);
  Tally tally;
  for (int i = 0; i < moves; ++i) {
    const double moved = 1e-3 * std::pow(10.0, random.uniform(-2, 0));  // .01 to 1 m/s
    const Vec3d direction = random.unit();
    // A free start beside the shape (which is round the origin), nearer than the move is long more often than not.
    const double gap = random.uniform(0, 1) * moved, along = random.uniform(0, kBurr.shaft_length);
    Vec3d tip = -along * direction + 1e-4 * random.unit();
    const Vec3d out = outward_normal(shape, Vec3d(tip + along * direction));
    for (int k = 0; k < 2000; ++k) {
      double deepest = -1e9;
      for (int v = 0; v < tool.count(); ++v)
        deepest = std::max(deepest,
                           -shape(tip + static_cast<double>(tool.heights()[static_cast<std::size_t>(v)]) * direction));
      if (deepest < -0.5 * gap) break;
      tip += std::max(deepest + gap, 0.02 * gap) * out;
    }
    Vec3d to_tip = tip, to_direction = direction;
    if (motion != Motion::kRotation) to_tip += moved * (random.unit() - 0.5 * out).normalized();
    if (motion != Motion::kTranslation)
      to_direction = (Eigen::AngleAxisd(moved / (motion == Motion::kRotation ? 0.01 : 0.02), random.unit()) * direction)
                         .normalized();
    const auto from = line<Scalar>(tip, direction), to = line<Scalar>(to_tip, to_direction);
    const Centreline<double> from_d{from.tip.template cast<double>(), from.direction.template cast<double>()};
    const Centreline<double> to_d{to.tip.template cast<double>(), to.direction.template cast<double>()};
    const Impact exact = impact_slowly(step, shape, heights, from_d, to_d, 100);
    if (exact.found && exact.time <= 0) continue;  // started inside: another test
    const auto hit = find_first_contact(field, tool, step, from, to, scratch.data());
    CHECK_FALSE(hit.bounded);
    CHECK_FALSE(hit.started_inside);
    if (!hit.found) {
      // Steps of half a voxel may overlook an arc that dips in by less than its own height.
      if (exact.found) ++(exact.deepest < 0.02 * kVoxel ? tally.grazing : tally.missed);
      continue;
    }
    if (!exact.found) {
      ++tally.invented;
      continue;
    }
    ++tally.found;
    tally.point = std::max(tally.point, std::abs(shape(hit.point.template cast<double>())) / kVoxel);
    const Vec3d tip_there = on_path(step, from_d, to_d, exact.time, 0);
    const double height = (hit.point.template cast<double>() - tip_there).norm();
    const Impact own = impact_slowly(step, shape, {height}, from_d, to_d, 100);
    if (!own.found) continue;
    const Vec3d there = on_path(step, from_d, to_d, own.time, height);
    tally.late = std::max(tally.late, (hit.point.template cast<double>() - there).norm() / kVoxel);
    CHECK(hit.fraction >= Scalar(0));
    CHECK(hit.fraction <= Scalar(1));
    CHECK(hit.active >= 1);
  }
  return tally;
}

template <class Scalar, class Step>
void check_random_moves(const Step& step, const char* name) {
  const unsigned seed = 61;
  CAPTURE(seed);
  Random random(seed);
  const LineTool<Scalar> tool(kBurr, {.shaft = 25});
  for (const Motion motion : {Motion::kTranslation, Motion::kRotation, Motion::kBoth}) {
    Tally sum;
    for (const double thick : {1.0, 2.0})
      for (int i = 0; i < 4; ++i) {
        const Plate plate{Vec3d::Zero(), random.unit(), thick * kVoxel};
        const Tally t = random_moves<Scalar>(step, plate, tool, motion, 150, random);
        sum.found += t.found, sum.missed += t.missed, sum.grazing += t.grazing, sum.invented += t.invented;
        sum.point = std::max(sum.point, t.point), sum.late = std::max(sum.late, t.late);
      }
    const Tally ball = random_moves<Scalar>(step, Ball{Vec3d::Zero(), 3 * kVoxel}, tool, motion, 400, random);
    MESSAGE(std::string(name), " motion ", static_cast<int>(motion), ": ", sum.found, " contacts, missed ", sum.missed,
            ", grazing ", sum.grazing, "; IntP off the plate by ", sum.point, " voxels, from the exact ", sum.late,
            "; ball: ", ball.found, " missed ", ball.missed, " grazing ", ball.grazing, " off ", ball.point);
    CHECK(sum.found > 150);
    CHECK(ball.found > 50);
    CHECK(sum.missed + ball.missed == 0);
    CHECK(sum.invented + ball.invented == 0);
    CHECK(sum.grazing + ball.grazing <= 3);
    // Along one step a vertex moves half a voxel and Eq. 1 is linear: exact on a plate.
    CHECK(sum.point < (std::is_same_v<Scalar, float> ? 7e-6 : 2e-14));
    CHECK(ball.point < 0.024);
    // Half a voxel, the final step, is what is promised; points between vertices also graze the ball.
    CHECK(std::max(sum.late, ball.late) <= 0.2);
  }
}

TEST_CASE_TEMPLATE("first contact against small steps in double: translate, then rotate", Scalar, float, double) {
  check_random_moves<Scalar>(TranslateRotate{}, "translate-rotate");
}
TEST_CASE_TEMPLATE("first contact against small steps in double: ray casting", Scalar, float, double) {
  check_random_moves<Scalar>(RayCast{}, "ray cast");
}

TEST_CASE_TEMPLATE("the error falls with the square of the step in the point of a sphere", Scalar, float, double) {
  const LineTool<Scalar> tool(kBurr, {.shaft = 50});
  for (const double step : {1.0, 0.25, 0.0625}) {
    Random same(63);
    const TranslateRotate by{.stepping = {.step = step, .max_steps = 4096}};
    const Tally t = random_moves<Scalar>(by, Ball{Vec3d::Zero(), 3 * kVoxel}, tool, Motion::kBoth, 400, same);
    MESSAGE("step ", step, ": IntP off the ball by ", t.point, " voxels");
    // Linear interpolation in a step of s on a curve of radius R errs by s²/8R.
    CHECK(t.point < step * step / (8 * 3));
    CHECK(t.point > step * step / (8 * 3) / 2);
  }
}

TEST_CASE_TEMPLATE("a search forward finds the side it came from, and says how far it got", Scalar, float, double) {
  const LineTool<Scalar> tool(kBurr, {.shaft = 50});
  std::vector<Scalar> scratch(2 * static_cast<std::size_t>(tool.padded()));
  const ShapeField<Scalar, Plate> field({Vec3d(0.0007, 0, 0), Vec3d::UnitX(), kVoxel}, kVoxel);
  const auto here = line<Scalar>(Vec3d::Zero(), Vec3d::UnitZ());
  const auto there = line<Scalar>(Vec3d(0.002, 0, 0), Vec3d::UnitZ());
  const auto go = [&](const auto& step, const auto& from, const auto& to) {
    return find_first_contact(field, tool, step, from, to, scratch.data());
  };
  const auto check = [&](const auto& step) {
    const auto forth = go(step, here, there), back = go(step, there, here);
    REQUIRE(forth.found);
    REQUIRE(back.found);
    CHECK(static_cast<double>(forth.point.x()) == near(0.00055, 4e-8));
    CHECK(static_cast<double>(back.point.x()) == near(0.00085, 4e-8));
    // The line handed back is free and within a step of the contact.
    CHECK(field.value(forth.line.at(Scalar(0.01))) < Scalar(0));
    CHECK(std::abs(static_cast<double>(forth.line.tip.x()) - 0.00055) < 0.5 * kVoxel);
    // All vertices touch at once: active counts them, the first of equals acts.
    CHECK(forth.active == 50);
    CHECK(forth.vertex == 0);
  };
  check(TranslateRotate{});
  check(RayCast{});
}

TEST_CASE_TEMPLATE("the most active vertex is the one that touched first", Scalar, float, double) {
  const LineTool<Scalar> tool(kBurr, {.shaft = 50});
  std::vector<Scalar> scratch(2 * static_cast<std::size_t>(tool.padded()));
  // A line that leans by a known slope above a floor, coming straight down: its lower end touches, several go in.
  const ShapeField<Scalar, HalfSpace> field({Vec3d::Zero(), Vec3d::UnitX()}, kVoxel);
  for (const double slope : {0.02, -0.02}) {
    const Vec3d d = Vec3d(slope, 0, 1).normalized();
    const double up = 0.001 + (slope < 0 ? 0.02 * 0.0201 : 0);
    const auto from = line<Scalar>(Vec3d(up, 0, 0), d), to = line<Scalar>(Vec3d(up - 0.002, 0, 0), d);
    for (const double step : {0.5, 4.0}) {
      const auto hit =
          find_first_contact(field, tool, TranslateRotate{.stepping = {.step = step}}, from, to, scratch.data());
      REQUIRE(hit.found);
      CHECK(hit.vertex == (slope > 0 ? 0 : 49));
      CHECK(hit.active >= 1);
      // The line stops where that vertex is on the floor.
      CHECK(std::abs(static_cast<double>(hit.point.x())) < 1e-7 * kVoxel);
      const double height = static_cast<double>(tool.heights()[static_cast<std::size_t>(hit.vertex)]);
      CHECK(std::abs(static_cast<double>(hit.point.z()) - height * d.z()) < 2.9e-6 * kVoxel);
    }
  }
}

TEST_CASE_TEMPLATE("a line that starts in bone has fraction 0 and says so", Scalar, float, double) {
  const LineTool<Scalar> tool(kBurr, {.shaft = 50});
  std::vector<Scalar> scratch(2 * static_cast<std::size_t>(tool.padded()));
  const ShapeField<Scalar, Ball> field({Vec3d(0, 0, 0.01), 0.001}, kVoxel);
  const auto inside = line<Scalar>(Vec3d::Zero(), Vec3d::UnitZ());
  const auto check = [&](const auto& step) {
    const auto deeper =
        find_first_contact(field, tool, step, inside, line<Scalar>(Vec3d(1e-4, 0, 0), Vec3d::UnitZ()), scratch.data());
    REQUIRE(deeper.found);
    CHECK(deeper.started_inside);
    CHECK(deeper.fraction == Scalar(0));
    CHECK(is_finite(deeper.point));
    // Out in one step: no contact, but it still tells that it started inside.
    const auto out =
        find_first_contact(field, tool, step, inside, line<Scalar>(Vec3d(1.0, 0, 0), Vec3d::UnitZ()), scratch.data());
    CHECK(out.started_inside);
  };
  check(TranslateRotate{});
  check(RayCast{});
}

TEST_CASE_TEMPLATE("turns by half a circle, no motion, and bad numbers", Scalar, float, double) {
  const LineTool<Scalar> tool(kBurr, {.shaft = 50});
  std::vector<Scalar> scratch(2 * static_cast<std::size_t>(tool.padded()));
  const ShapeField<Scalar, HalfSpace> base({Vec3d(0, 0, -0.001), Vec3d::UnitZ()}, kVoxel);
  const CountingField field(base);
  const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN(), inf = std::numeric_limits<Scalar>::infinity();
  const auto up = line<Scalar>(Vec3d::Zero(), Vec3d::UnitZ());
  const auto check = [&](const auto& step) {
    const auto half =
        find_first_contact(field, tool, step, up, line<Scalar>(Vec3d::Zero(), -Vec3d::UnitZ()), scratch.data());
    CHECK(half.found);  // it ends in the floor
    CHECK(is_finite(half.point));
    CHECK(std::isfinite(half.fraction));
    CHECK_FALSE(find_first_contact(field, tool, step, up, up, scratch.data()).found);
    for (const Scalar bad : {nan, inf, -inf, std::numeric_limits<Scalar>::max()}) {
      field.samples = 0;
      const Centreline<Scalar> wild{Vec3<Scalar>::Constant(bad), Vec3<Scalar>::Constant(bad)};
      static_cast<void>(find_first_contact(field, tool, step, up, wild, scratch.data()));
      static_cast<void>(find_first_contact(field, tool, step, wild, up, scratch.data()));
      CHECK(field.samples <= 2 * (2 * (512 + 1)) * (tool.padded() + kLane));
    }
    // The bound is kept and said.
    auto coarse = step;
    coarse.stepping.max_steps = 8;
    field.samples = 0;
    const auto far =
        find_first_contact(field, tool, coarse, up, line<Scalar>(Vec3d(1, 0, 0), Vec3d::UnitZ()), scratch.data());
    CHECK(far.bounded);
    CHECK(field.samples <= (2 * (8 + 1)) * (tool.padded() + kLane));
  };
  check(TranslateRotate{});
  check(RayCast{});
}

TEST_CASE_TEMPLATE("what lies between the half turn's ends is found", Scalar, float, double) {
  // A wall on every side: whichever way an undetermined half turn goes, it meets it.
  const LineTool<Scalar> tool(kBurr, {.shaft = 50});
  std::vector<Scalar> scratch(2 * static_cast<std::size_t>(tool.padded()));
  const auto ring = Both{Hollow{Rod{Vec3d::Zero(), Vec3d::UnitZ(), 0.01}}, Plate{Vec3d::Zero(), Vec3d::UnitZ(), 0.004}};
  const ShapeField<Scalar, decltype(ring)> field(ring, kVoxel);
  for (const Vec3d& d : {Vec3d(0, 0, 1), Vec3d(0, 0, -1)})
    CHECK(find_first_contact(field, tool, TranslateRotate{}, line<Scalar>(Vec3d::Zero(), d),
                             line<Scalar>(Vec3d::Zero(), -d), scratch.data())
              .found);
}

TEST_CASE("index_of_largest gives the first of equals") {
  const float v[] = {1, 3, 2, 3, 0};
  CHECK(index_of_largest(v, 5) == 1);
  CHECK(index_of_largest(v, 1) == 0);
}

TEST_CASE("stepping options outside their range are refused") {
  const auto steps = [](const SteppingOptions& o) { TranslateRotate{.stepping = o}.validate(); };
  CHECK_NOTHROW(steps({}));
  CHECK_THROWS_WITH(steps({.step = 0}), "trephine::TranslateRotate: step must be > 0 and at most 16 voxels, got 0");
  CHECK_THROWS_WITH(steps({.step = 17}), "trephine::TranslateRotate: step must be > 0 and at most 16 voxels, got 17");
  CHECK_THROWS_WITH(steps({.step = std::nan("")}),
                    "trephine::TranslateRotate: step must be > 0 and at most 16 voxels, got nan");
  CHECK_THROWS_WITH(steps({.max_steps = 0}), "trephine::TranslateRotate: max_steps must be 1 to 100000, got 0");
  CHECK_THROWS_WITH((RayCast{.stepping = {.max_steps = 100001}}.validate()),
                    "trephine::RayCast: max_steps must be 1 to 100000, got 100001");
}

static_assert(Stepping<TranslateRotate> && Stepping<RayCast>);

}  // namespace
