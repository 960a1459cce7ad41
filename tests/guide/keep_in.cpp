// SPDX-License-Identifier: MIT
// The guide of a planned cavity: against formulas, its own derivative, closed paths and steps.
#include <trephine/core/rotation.hpp>
#include <trephine/guide/keep_in.hpp>

#include "stage/fakes.hpp"
#include "structure/phantom.hpp"
#include "support/malloc_hook.hpp"
#include "support/near.hpp"
#include "support/random.hpp"

#include <trephine/core/units.hpp>
#include <trephine/stage/mailbox.hpp>
#include <trephine/stage/remote.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

using namespace trephine;
using namespace trephine::test;
using namespace trephine::literals;

namespace {

constexpr double kSmoothing = 0.6e-3;

Posed askew() {
  return make_pose<double>(rotation_from_vector<double>(Vec3d(0.4, -0.2, 0.3)), Vec3d(3_mm, -2_mm, 1_mm));
}

LabelledTubes ball() { return {.tubes = {{Vec3d::Constant(9.5_mm), Vec3d::Constant(9.5_mm), 4_mm}}, .structure = {0}}; }
/// Bound of a border's error, for a ball of a radius: labels place it within a share of a voxel, and smoothing
/// displaces it by at most smoothing²/(4 · radius).
double border_error(const LabelledTubes& truth, double radius, double share) {
  return share * truth.voxel + kSmoothing * kSmoothing / (4 * radius);
}
/// Two tubes that cross, and a ball: concave edges and narrow places.
LabelledTubes bed() {
  const auto mm = [](double x, double y, double z) { return Vec3d(x * 1_mm, y * 1_mm, z * 1_mm); };
  return {.tubes = {{mm(5, 9, 9), mm(14, 10, 8), 2_mm},
                    {mm(9, 5, 9), mm(8, 14, 11), 1.2_mm},
                    {mm(12, 12, 12), mm(12, 12, 12), 3_mm}},
          .structure = {0, 0, 0}};
}

KeepIn::Options bed_options() {
  return {.radius = 1_mm, .margin = 0.2_mm, .stiffness = 500, .force = 1.5, .capture = 3_mm};
}

/// A place at most `beyond` outside of the cavity, in G.
Vec3d place_near(const LabelledTubes& truth, double beyond, Random& random) {
  for (;;) {
    const Vec3d p(Vec3d::Constant(9.5_mm) + random.arrow(0, 12_mm));
    if (truth.distance(0, p) < beyond) return askew() * p;
  }
}

}  // namespace

TEST_CASE("keep in: a ball's border pushes inward along its radius, as far as the spring and its end say") {
  const LabelledTubes truth = ball();
  const KeepIn keep(*truth.field(5_mm), 0, askew(),
                    {.radius = 1_mm, .margin = 0.5_mm, .stiffness = 400, .force = 0.8, .capture = 3_mm});
  Random random(3);
  const Vec3d centre = askew() * Vec3d::Constant(9.5_mm);
  // A spring of 400 N/m for 2 mm beyond 2.5 mm, then 0.8 N. From a quarter of its energy at 7 mm on it lets go.
  const auto energy = [](double u) { return u < 2e-3 ? 200 * u * u : 0.8 * (u - 1e-3); };
  const double depth = energy(4.5e-3);
  const auto push = [&](double r) {
    const double u = std::clamp(r - 2.5e-3, 0.0, 4.5e-3);
    return std::min(400 * u, 0.8) * std::min((depth - energy(u)) / (0.75 * depth), 1.0);
  };
  double worst = 0;
  for (int n = 0; n < 300; ++n) {
    const Vec3d u = random.unit();
    const double r = random.uniform(0.5_mm, 8_mm);
    const Vec3d f = keep.spring(centre + r * u);
    CAPTURE(r);
    worst = std::max(worst, std::abs(f.norm() - push(r)));
    if (f.norm() > 0.02) CHECK(-f.normalized().dot(u) > 0.98);
  }
  CHECK(worst < 400 * border_error(truth, 2.5_mm, 0.28));
}

TEST_CASE("keep in: the force is the derivative of the energy, and closed paths do no work") {
  const LabelledTubes truth = bed();
  const KeepIn keep(*truth.field(5_mm), 0, askew(), bed_options());
  Random random(4);
  double worst = 0, strongest = 0;
  for (int n = 0; n < 2000; ++n) {
    const Vec3d p = place_near(truth, 3.5_mm, random);
    const Vec3d f = keep.spring(p);
    constexpr double kStep = 1e-7;
    for (int a = 0; a < 3; ++a) {
      const Vec3d d = kStep * Vec3d::Unit(a);
      worst = std::max(worst, std::abs(f[a] + (keep.energy(p + d) - keep.energy(p - d)) / (2 * kStep)));
    }
    strongest = std::max(strongest, f.norm());
  }
  // The gradient is continuous; its derivative steps at knots by up to 4/H.
  CHECK(worst <= 3e-10 * (500 * 8.0 / 3 + 4 * 1.5 / kSmoothing));
  CHECK(strongest > 1);
  CHECK(strongest <= 1.5 + 1e-9);

  double net = 0, turned_over = 0;
  for (int path = 0; path < 40; ++path) {
    const Vec3d o = place_near(truth, 2_mm, random), a = random.arrow(1_mm, 4_mm), b = random.arrow(1_mm, 4_mm);
    constexpr int kSteps = 4000;
    double work = 0, total = 0;
    for (int n = 0; n < kSteps; ++n) {
      const auto at = [&](double t) { return Vec3d(o + a * std::cos(t) + b * std::sin(t)); };
      constexpr double kTurn = 2 * 3.14159265358979323846 / kSteps;
      const double w = keep.spring(at((n + 0.5) * kTurn)).dot(at((n + 1) * kTurn) - at(n * kTurn));
      work += w;
      total += std::abs(w);
    }
    net += std::abs(work);
    turned_over += total;
  }
  MESSAGE("net work of closed paths " << 100 * net / turned_over << " %");
  CHECK(net < 4e-7 * turned_over);
}

TEST_CASE("keep in: no step anywhere, none at all inside, none when switched, and no memory") {
  const LabelledTubes truth = bed();
  KeepIn keep(*truth.field(5_mm), 0, askew(), bed_options());
  Random random(5);
  double step = 0;
  for (int path = 0; path < 100; ++path) {
    Vec3d p = place_near(truth, 4_mm, random);
    const Vec3d d = 10e-6 * random.unit();
    Vec3d last = keep.spring(p);
    for (int n = 0; n < 1000; ++n) {
      p += d;
      const Vec3d f = keep.spring(p);
      step = std::max(step, (f - last).norm());
      last = f;
    }
  }
  MESSAGE("greatest step in 10 um: " << step << " N");
  CHECK(step <= 10e-6 * (500 * 8.0 / 3 + 2 * 1.5 / kSmoothing));

  const Vec3d inside = askew() * Vec3d(12_mm, 12_mm, 12_mm);
  CHECK(keep.spring(inside) == Vec3d::Zero());
  CHECK(keep.energy(inside) == 0);
  CHECK(keep.spring(askew() * Vec3d::Constant(50_mm)) == Vec3d::Zero());

  Mailbox<KeepIn::Options> knob;
  Remote remote{keep, knob};
  const Posed X = make_pose<double>(Mat3d::Identity(), askew() * Vec3d(5_mm, 6_mm, 9_mm));
  const TickInput input{.X_WT = X};
  double last = 0, largest = 0;
  const std::int64_t calls = heap_calls([&] {
    for (int n = 0; n < 3000; ++n) {
      if (n == 1000) {
        KeepIn::Options off = bed_options();
        off.enabled = false;
        knob.post(off);
      }
      if (n == 2000) knob.post({.radius = 1_mm, .stiffness = 2000, .force = 3, .damping = 5, .capture = 1});
      remote.begin_tick();
      Wrenchd wrench;
      remote.apply({.input = input, .X_WG = Posed::Identity(), .dt = 1e-3}, wrench);
      largest = std::max(largest, std::abs(wrench.force.norm() - last));
      last = wrench.force.norm();
    }
  });
  CHECK(calls == 0);
  CHECK(last > 0.3);
  CHECK(largest < 0.02);
}

TEST_CASE("keep in: bone that lies askew turns the push with it, and a jump fades it in anew") {
  const auto field = ball().field(5_mm);
  KeepIn keep(*field, 0, askew(), {.radius = 1_mm, .ramp = 0.05});
  const Vec3d p_G = askew() * Vec3d(9.5_mm, 9.5_mm, 13.5_mm), push = keep.spring(p_G);
  REQUIRE(push.norm() > 0.1);
  const Posed X_WG = make_pose<double>(rotation_from_vector(Vec3d(1.2, 0.4, -2)), Vec3d(0.1, 0.2, -0.1));
  const TickInput input{.X_WT = make_pose<double>(Mat3d::Identity(), Vec3d(X_WG * p_G))};
  const auto force = [&](Status status) {
    TickContext context{.input = input, .X_WG = X_WG, .dt = 1e-3};
    context.status = status;
    Wrenchd wrench;
    keep.apply(context, wrench);
    return wrench.force;
  };
  for (int n = 0; n < 60; ++n) (void)force(Status::kOk);
  CHECK((force(Status::kOk) - X_WG.linear() * push).norm() < 1e-9);
  CHECK(force(Status::kJump).norm() < 0.01 * push.norm());
}

TEST_CASE("keep in: damping takes energy, and what the guide cannot use is refused") {
  const LabelledTubes truth = ball();
  const auto field = truth.field(5_mm);
  KeepIn keep(*field, 0, Posed::Identity(), {.radius = 1_mm, .stiffness = 400, .force = 2, .damping = 3, .ramp = 0.05});
  const TickInput input{.X_WT = make_pose<double>(Mat3d::Identity(), Vec3d(9.5_mm, 9.5_mm, 13.5_mm))};
  const auto force_at = [&](const Vec3d& v) {
    Wrenchd wrench;
    TickContext context{.input = input, .X_WG = Posed::Identity(), .dt = 1e-3};
    context.twist_to_bone.linear = v;
    keep.apply(context, wrench);
    return wrench.force;
  };
  for (int n = 0; n < 60; ++n) (void)force_at(Vec3d::Zero());
  const double still = force_at(Vec3d::Zero()).z();
  // Along an axis of the voxels a whole face of labels may be half a voxel off.
  CHECK(std::abs(still + 0.4) < 400 * border_error(truth, 3_mm, 0.5));
  CHECK(force_at({0, 0, 0.05}).z() < still);
  CHECK(force_at({0, 0, -0.05}).z() > still);
  CHECK(force_at({0, 0, -10}).z() == 0);
  CHECK(force_at({0, 0, 10}).norm() <= 2 + 1e-12);

  const auto made = [&](const KeepIn::Options& o) { (void)KeepIn(*field, 0, Posed::Identity(), o); };
  CHECK_NOTHROW(made({.radius = 1_mm}));
  CHECK_THROWS_AS(made({.radius = -1_mm}), std::invalid_argument);
  CHECK_THROWS_AS(made({.radius = 2}), std::invalid_argument);
  CHECK_THROWS_AS(made({.radius = 1_mm, .capture = 0}), std::invalid_argument);
  CHECK_THROWS_AS(made({.radius = 1_mm, .capture = 4_mm}), std::invalid_argument);  // with 1.6 mm beyond the bands
  CHECK_THROWS_AS(made({.radius = 1_mm, .ramp = 0}), std::invalid_argument);
  CHECK_THROWS_AS((KeepIn(*field, 1, Posed::Identity(), {})), std::invalid_argument);
  CHECK_THROWS_AS((KeepIn(*field, -1, Posed::Identity(), {})), std::invalid_argument);
  Posed scaled = Posed::Identity();
  scaled.linear() *= 2;
  CHECK_THROWS_AS((KeepIn(*field, 0, scaled, {})), std::invalid_argument);
}

TEST_CASE("keep in: no place is stiffer than said, and a budget holds in a bed narrower than the ball") {
  const LabelledTubes truth = bed();
  const auto field = truth.field(5_mm);
  Random random(9);
  KeepIn::Options narrow = bed_options();
  narrow.radius = 2.5_mm;  // tubes of 1.2 and 2 mm: the push turns over at their axes
  KeepIn::Options budgeted = narrow;
  budgeted.budget = StiffnessBudget{.linear = 300, .angular = 0.1};
  KeepIn wide(*field, 0, askew(), bed_options()), tight(*field, 0, askew(), narrow), kept(*field, 0, askew(), budgeted);
  CHECK(tight.stiffness() > 2 * narrow.stiffness);  // or this would not ask anything
  CHECK(kept.stiffness() == near(300));
  CHECK(kept.options().force / kept.options().stiffness == near(narrow.force / narrow.stiffness));
  KeepIn firmer = kept;
  KeepIn::Options more = budgeted;
  more.force = 3;
  more.margin = 1_mm;
  firmer.reset();
  firmer.adopt(more);
  firmer.reset();
  CHECK(firmer.stiffness() <= 300 * (1 + 1e-9));
  constexpr double kStep = 0.05_mm;  // secants are no stiffer than the tangents on the way
  for (const auto& [name, keep] :
       {std::pair("wide", &wide), std::pair("tight", &tight), std::pair("kept", &kept), std::pair("firmer", &firmer)}) {
    double stiffest = 0;
    for (int n = 0; n < 20000; ++n) {
      const Vec3d p = place_near(truth, 3_mm, random), u = random.unit();
      stiffest = std::max(stiffest, (keep->spring(p) - keep->spring(p + kStep * u)).dot(u) / kStep);
    }
    MESSAGE(std::string(name) << ": at most " << keep->stiffness() << " N/m said, " << stiffest << " found");
    CHECK(stiffest < 1.03 * keep->stiffness());
    CHECK(stiffest > (keep == &firmer ? 0.2 : 0.6) * keep->stiffness());
  }
  narrow.budget = StiffnessBudget{.linear = 0, .angular = 1};
  CHECK_THROWS_AS(KeepIn(*field, 0, askew(), narrow), std::invalid_argument);
}
