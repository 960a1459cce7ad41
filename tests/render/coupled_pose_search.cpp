// SPDX-License-Identifier: MIT
// The search on contacts whose equilibrium is known: a plane, a ball, a point at a lever, a plane with friction.
#include "support/figures.hpp"
#include "support/poses.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/render/coupled/pose_search.hpp>

#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <limits>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 334;
constexpr double kContact = 2e4;  // [N/m] of the contacts
constexpr double kRadius = 1.5e-3;
constexpr double kPosition = 1e-16;  // [m]: the last step of a search is Newton's
constexpr ToolBounds kBounds{-kRadius, kRadius, kRadius, kRadius, kRadius};
constexpr SearchTolerance kTight{.smallest_step = 1e-10, .motion_step = 0};

VirtualCoupling coupling(bool solves_rotation) {
  constexpr double kYield = 1e-4;
  const BallOnPlane contact{20 / BallOnPlane{1, kRadius, 5e-5}.force(kYield), kRadius, 5e-5};
  return {CompensatedSpring(800, contact, kYield), {0.3, 0.1}, solves_rotation};
}

/// The contact of one point with the penetration depth `depth`, the normal n toward the tool, at an arm.
FoundationSum one_contact(double depth, const Vec3d& n, const Vec3d& arm) {
  FoundationSum s;
  const double f = kContact * std::max(depth, 0.0);
  const Vec6d J = with_moment(n, arm);
  s.energy = 0.5 * f * std::max(depth, 0.0);
  s.wrench = f * J;
  if (depth > 0) s.stiffness = kContact * J * J.transpose();
  s.depth = std::max(depth, 0.0);
  // A point in contact does not bound the motion, and there are no others.
  s.clearance = {depth > 0 ? 1.0 : -depth, arm.norm(), {1, 10}, 1};
  return s;
}

/// A ball pressed on a plane through the origin.
struct OnPlane {
  Vec3d n;
  [[nodiscard]] double depth(const Posed& X) const { return kRadius - n.dot(X.translation()); }
  [[nodiscard]] FoundationSum operator()(const Posed& X) const { return one_contact(depth(X), n, Vec3d::Zero()); }
};

/// A ball pressed on a ball about the origin; `reach` is the sum of their radii.
struct OnBall {
  double reach;
  [[nodiscard]] FoundationSum operator()(const Posed& X) const {
    const double r = X.translation().norm();
    const Vec3d n = X.translation() / r;
    FoundationSum s = one_contact(reach - r, n, Vec3d::Zero());
    s.geometric_stiffness.topLeftCorner<3, 3>() =
        -kContact * std::max(reach - r, 0.0) / r * (Mat3d::Identity() - n * n.transpose());
    return s;
  }
};

/// A point of the tool at a lever, pressed on a plane through the origin.
struct LeverOnPlane {
  Vec3d n, lever;
  [[nodiscard]] FoundationSum operator()(const Posed& X) const {
    const Vec3d arm = X.linear() * lever;
    return one_contact(-n.dot(X.translation() + arm), n, arm);
  }
};

/// A hill about the origin that ends at a wall, along x. Its Gauss–Newton part is stiffer by far, so steps are short.
struct HillAndWall {
  static constexpr double kWall = 1e-3, kHill = kContact, kWallStiffness = 2000 * kHill, kGaussNewton = 200 * kHill;
  [[nodiscard]] FoundationSum operator()(const Posed& X) const {
    const double x = X.translation().x(), in = std::max(0.0, x - kWall);
    FoundationSum s = one_contact(kWall, Vec3d::UnitX(), Vec3d::Zero());
    s.energy = 0.5 * kHill * (4 * kWall * kWall - x * x) + 0.5 * kWallStiffness * in * in;
    s.wrench.setZero();
    s.wrench[0] = kHill * x - kWallStiffness * in;
    s.stiffness.setIdentity();
    s.stiffness(0, 0) = kGaussNewton + (in > 0 ? kWallStiffness : 0);
    s.geometric_stiffness(0, 0) = -kGaussNewton - kHill;
    return s;
  }
};

/// A bed of springs along x whose force grows as a power of the depth, as that of a hole's wall does.
struct PowerBed {
  double power, force, scale;  // force [N] at the depth `scale` [m]
  [[nodiscard]] FoundationSum operator()(const Posed& X) const {
    const double depth = std::max(0.0, X.translation().x());
    FoundationSum s = one_contact(X.translation().x(), -Vec3d::UnitX(), Vec3d::Zero());
    const double f = force * std::pow(depth / scale, power);
    s.energy = f * depth / (power + 1);
    s.wrench[0] = -f;
    s.stiffness.setZero();
    if (depth > 0) s.stiffness(0, 0) = power * f / depth;
    return s;
  }
};

struct NoFriction {
  [[nodiscard]] static bool has_friction() { return false; }
  [[nodiscard]] static FrictionSum linearise(const Vec6d&) { return {}; }
  void attach(const Posed&) {}
};

/// A spring along a plane, from an anchor: friction that never slips.
struct Stick {
  static constexpr double kStiffness = 5e3;
  Vec3d n, anchor;
  Vec3d from = Vec3d::Zero();  // displacement from the anchor
  [[nodiscard]] static bool has_friction() { return true; }
  [[nodiscard]] FrictionSum linearise(const Vec6d& motion) const {
    const Mat3d tangent = Mat3d::Identity() - n * n.transpose();
    FrictionSum s;
    s.wrench.head<3>() = -kStiffness * tangent * (from + motion.head<3>());
    s.stiffness.topLeftCorner<3, 3>() = kStiffness * tangent;
    return s;
  }
  void attach(const Posed& X) { from = X.translation() - anchor; }
};

/// A search that counts its evaluations.
template <class Contact, class FrictionModel = NoFriction>
struct Search {
  VirtualCoupling springs;
  Contact contact;
  FrictionModel friction{};
  std::function<bool(const Posed&)> is_available = [](const Posed&) { return true; };
  int calls = 0;
  int ticks = 0;
  double first_contact_depth = 0;  // at the first evaluation in contact

  [[nodiscard]] PoseEvaluation evaluate(const Posed& X, const Posed& X_device) {
    friction.attach(X);
    return {contact(X), friction.linearise(Vec6d::Zero()), springs.evaluate(X, X_device), springs.solves_rotation};
  }
  SearchResult tick(const Posed& X, const Posed& X_device, const SearchTolerance& tolerance = kTight) {
    PoseSearch search(
        springs, X_device, kBounds,
        [&](const Posed& at) -> std::optional<PoseEvaluation> {
          if (!is_available(at)) return std::nullopt;
          ++calls;
          const PoseEvaluation e = evaluate(at, X_device);
          if (first_contact_depth == 0) first_contact_depth = e.contact.depth;
          return e;
        },
        friction);
    return search.minimise(X, tolerance, Vec6d::Zero());
  }
  /// Ticks until the search has converged.
  SearchResult run(const Posed& X, const Posed& X_device) {
    SearchResult r = tick(X, X_device);
    for (ticks = 1; ticks < 20 && !r.converged; ++ticks) r = tick(r.X, X_device);
    return r;
  }
};

/// Extension x of the coupling in series with the contact, of x + s = deep: its force is that of the contact at s.
double extension(const VirtualCoupling& springs, double deep) {
  double low = 0, high = deep;
  for (int i = 0; i < 80; ++i) {
    const double x = (low + high) / 2;
    (springs.translation_spring.evaluate(x).magnitude < kContact * (deep - x) ? low : high) = x;
  }
  return low;
}

TEST_CASE("pose search: on a plane it ends at the equilibrium of coupling and contact, beside the device") {
  CAPTURE(kSeed);
  Random random(kSeed);
  Figures off, steps, turned, ticks;
  for (int i = 0; i < 200; ++i) {
    const bool solves_rotation = i % 2 == 0;
    const Vec3d n = random.unit();
    Search<OnPlane> search{.springs = coupling(solves_rotation), .contact = {n}};
    const double deep = random.uniform(1e-5, 8e-3);
    const Vec3d along = n.cross(random.unit()).normalized();
    const Posed X_device = make_pose<double>(random.rotation(), (kRadius - deep) * n);
    Posed X = make_pose<double>(X_device.linear(), (kRadius + random.uniform(-3e-4, 2e-3)) * n + 1e-3 * along);
    if (solves_rotation) X = moved(X, (Vec6d() << Vec3d::Zero(), random.arrow(0, 0.4)).finished());
    const SearchResult r = search.run(X, X_device);
    REQUIRE(r.converged);
    CHECK(r.found_contact);
    const double x = extension(search.springs, deep);
    off.add((r.X.translation() - X_device.translation() - x * n).norm());
    turned.add((r.X.linear() - X_device.linear()).norm());
    steps.add(r.step_count);
    ticks.add(search.ticks);
    if (X.translation().dot(n) > kRadius)
      CHECK(search.first_contact_depth <= kRadius * CoupledConstants::kCoreFraction * (1 + 1e-9));
  }
  MESSAGE("off the equilibrium [m] ", off, "; rotation [rad] ", turned, "; steps ", steps, ", ticks ", ticks);
  CHECK(off.worst() <= kPosition);
  CHECK(turned.worst() <= 2e-15);
  CHECK(ticks.worst() == 1);
  CHECK(steps.worst() <= 12);
}

TEST_CASE("pose search: it slides around a ball to the place nearest the device") {
  CAPTURE(kSeed);
  constexpr double kReach = 6e-3;
  Random random(kSeed + 1);
  Figures off, steps;
  for (int i = 0; i < 100; ++i) {
    Search<OnBall> search{.springs = coupling(false), .contact = {kReach}};
    const double deep = random.uniform(5e-5, 2e-3);
    const Vec3d n = random.unit();
    const Posed X_device = make_pose<double>(Mat3d::Identity(), (kReach - deep) * n);
    // Starts up to a radian away, in contact or just outside.
    const Vec3d start = rotation_from_vector(Vec3d(random.uniform() * n.unitOrthogonal())) * n;
    const SearchResult r =
        search.run(make_pose<double>(Mat3d::Identity(), (kReach + random.uniform(-2e-4, 5e-4)) * start), X_device);
    REQUIRE(r.converged);
    off.add((r.X.translation() - (kReach - deep + extension(search.springs, deep)) * n).norm());
    steps.add(r.step_count);
    CHECK(r.X.linear() == Mat3d::Identity());
  }
  MESSAGE("off the equilibrium [m] ", off, "; steps ", steps);
  CHECK(off.worst() <= kPosition);
  CHECK(steps.worst() <= 25);
}

TEST_CASE("pose search: contact at a lever turns the tool until force and torque balance, at least energy") {
  CAPTURE(kSeed);
  constexpr double kBalance = 1.1e-8;  // [N]; torques count as forces at 1 cm
  Random random(kSeed + 2);
  Figures unbalanced;
  int lower = 0;
  for (int i = 0; i < 60; ++i) {
    const Vec3d n = random.unit();
    Search<LeverOnPlane> search{.springs = coupling(true), .contact = {n, 0.01 * random.unit()}};
    Posed X_device = make_pose<double>(random.rotation(), Vec3d::Zero());
    const double deep = random.uniform(1e-4, 1e-3);
    X_device.translation() = -(n.dot(X_device.linear() * search.contact.lever) + deep) * n;
    Posed X = X_device;
    X.translation() += 1.5 * deep * n;
    const SearchResult r = search.run(X, X_device);
    REQUIRE(r.converged);
    CHECK(r.found_contact);
    const PoseEvaluation end = search.evaluate(r.X, X_device);
    REQUIRE(end.contact.energy > 0);
    const Vec6d f = end.wrench();
    unbalanced.add(f.head<3>().norm() + f.tail<3>().norm() / 0.01);
    for (int k = 0; k < 50; ++k) {
      const Posed other = moved(r.X, (Vec6d() << 1e-5 * random.unit(), 1e-3 * random.unit()).finished());
      lower += search.evaluate(other, X_device).energy() < end.energy() ? 1 : 0;
    }
  }
  MESSAGE("unbalanced [N] ", unbalanced);
  CHECK(unbalanced.worst() <= kBalance);
  CHECK(lower == 0);
}

TEST_CASE("pose search: with friction the forces of coupling, contact and friction balance") {
  CAPTURE(kSeed);
  constexpr double kBalance = 4e-14;  // [N]
  Random random(kSeed + 3);
  Figures unbalanced, held;
  for (int i = 0; i < 100; ++i) {
    const Vec3d n = random.unit(), along = n.cross(random.unit()).normalized();
    const Posed X = make_pose<double>(Mat3d::Identity(), (kRadius - random.uniform(1e-6, 1e-4)) * n);
    Search<OnPlane, Stick> search{.springs = coupling(false), .contact = {n}, .friction = {n, X.translation()}};
    const Posed X_device = make_pose<double>(
        Mat3d::Identity(), (kRadius - random.uniform(1e-4, 2e-3)) * n + random.uniform(1e-4, 2e-3) * along);
    const SearchResult r = search.run(X, X_device);
    REQUIRE(r.converged);
    unbalanced.add(search.evaluate(r.X, X_device).wrench().norm());
    held.add((r.X.translation() - X.translation()).dot(along) / (X_device.translation() - X.translation()).dot(along));
  }
  MESSAGE("unbalanced [N] ", unbalanced, "; moved along, as a share of the device's motion ", held);
  CHECK(unbalanced.worst() <= kBalance);
  // 800 N/m against 5 kN/m moves the tool by a seventh.
  CHECK(held.worst() < 0.2);
  CHECK(held.least() > 0.05);
}

TEST_CASE("pose search: trials that run out downhill of a wall are not lost") {
  // A step is half a percent of the way from the origin, so the seventh trial of 64 steps is downhill of the wall, and
  // the eighth is in it.
  Search<HillAndWall> search{.springs = coupling(false), .contact = {}};
  const Posed X_device = Posed::Identity();
  for (const double start : {0.64, 0.68, 0.72, 0.75}) {
    CAPTURE(start);
    const SearchResult r =
        search.run(make_pose<double>(Mat3d::Identity(), Vec3d(start * HillAndWall::kWall, 0, 0)), X_device);
    REQUIRE(r.converged);
    CHECK(search.ticks == 1);
    CHECK(std::abs(r.X.translation().x() - HillAndWall::kWall) < 1.4e-6);
    CHECK(std::abs(search.evaluate(r.X, X_device).wrench().x()) < 6.6e-12);
  }
}

TEST_CASE("pose search: from a pose too far in contact, the way back to the balance is that of a power law") {
  Random random(kSeed + 6);
  Figures off;
  for (int i = 0; i < 200; ++i) {
    const PowerBed bed{random.uniform(1, 5), 0.5, 2e-6};
    const Posed X = make_pose<double>(Mat3d::Identity(), Vec3d(random.uniform(5e-6, 5e-5), 0, 0));
    Vec6d step = Vec6d::Zero();
    step[0] = random.uniform(3e-5, 2e-4);
    // The coupling pulls with this at the depth 0, and with nothing at X.
    const double pull_N = random.uniform(0.005, 0.5), x = X.translation().x();
    double low = 0, high = x;  // depth of the balance
    for (int k = 0; k < 60; ++k) {
      const double middle = 0.5 * (low + high);
      (bed.force * std::pow(middle / bed.scale, bed.power) < pull_N * (1 - middle / x) ? low : high) = middle;
    }
    const double back = backtrack(bed(X), step, 0, pull_N * step[0] * step[0] / x);
    off.add(std::abs(x - back * step[0] - low) / low);
  }
  MESSAGE("off the depth of the balance ", off);
  CHECK(off.worst() < 0.01);
  CHECK_FALSE(std::isfinite(backtrack(FoundationSum{}, Vec6d::UnitX(), 1, 0)));
}

TEST_CASE("pose search: from free into a steep wall it takes few evaluations") {
  Random random(kSeed + 7);
  Figures calls, unbalanced;
  for (int i = 0; i < 200; ++i) {
    Search<PowerBed> search{.springs = coupling(false), .contact = {random.uniform(1.5, 4), 0.5, 3e-6}};
    const Posed X = make_pose<double>(Mat3d::Identity(), Vec3d(-random.uniform(1e-7, 3e-5), 0, 0)),
                X_device = make_pose<double>(Mat3d::Identity(), Vec3d(random.uniform(1e-5, 1e-4), 0, 0));
    const SearchResult r = search.tick(X, X_device, {.smallest_step = 3e-10, .motion_step = 0});
    REQUIRE(r.converged);
    calls.add(search.calls);
    unbalanced.add(std::abs(search.evaluate(r.X, X_device).wrench().x()));
  }
  MESSAGE("evaluations ", calls, "; unbalanced [N] ", unbalanced);
  CHECK(unbalanced.worst() < 2.6e-8);
  CHECK(calls.median() <= 5);
  CHECK(calls.worst() <= 10);
}

TEST_CASE("pose search: in the air it takes the device's pose with one evaluation") {
  Search<OnPlane> search{.springs = coupling(true), .contact = {Vec3d::UnitZ()}};
  Random random(kSeed + 4);
  const Posed X = make_pose<double>(random.rotation(), Vec3d(0, 0, 0.01)),
              X_device = make_pose<double>(random.rotation(), Vec3d(0.004, 0, 0.012));
  const SearchResult r = search.tick(X, X_device);
  CHECK(r.converged);
  CHECK_FALSE(r.found_contact);
  CHECK(r.X.matrix() == X_device.matrix());
  CHECK(search.calls == 1);
}

TEST_CASE("pose search: without bone's surface, or at its bounds, it stays to be carried on") {
  Random random(kSeed + 5);
  const Posed X = make_pose<double>(Mat3d::Identity(), Vec3d(0, 0, 2e-3)),
              X_device = make_pose<double>(Mat3d::Identity(), Vec3d(0, 0, -1e-3));
  Search<OnPlane> search{.springs = coupling(false), .contact = {Vec3d::UnitZ()}};
  search.is_available = [](const Posed&) { return false; };
  SearchResult r = search.tick(X, X_device);
  CHECK_FALSE(r.converged);
  CHECK(r.X.matrix() == X.matrix());
  CHECK(r.evaluation_count == 0);
  search.is_available = [&](const Posed& at) { return at.matrix() == X.matrix(); };
  r = search.tick(X, X_device);
  CHECK_FALSE(r.converged);
  CHECK(r.X.matrix() == X.matrix());
  CHECK(r.evaluation_count == 1);
  // No step is small enough.
  search.is_available = [](const Posed&) { return true; };
  search.calls = 0;
  r = search.tick(X, X_device, {.smallest_step = -1, .motion_step = -1});
  CHECK_FALSE(r.converged);
  const bool at_bound =
      r.step_count == CoupledConstants::kMaxSteps + 1 || r.evaluation_count > CoupledConstants::kMaxEvaluations;
  CHECK(at_bound);
  CHECK(r.evaluation_count == search.calls);
  CHECK(r.evaluation_count <= CoupledConstants::kMaxEvaluations + CoupledConstants::kMaxTrials + 1);
}

}  // namespace
