// SPDX-License-Identifier: MIT
#include "render/render_helpers.hpp"
#include "support/cases.hpp"
#include "support/figures.hpp"
#include "support/path_work.hpp"

#include <doctest/doctest.h>

/// Line with tip and shaft both in contact: the contacts balance the wrench, and closed paths make no energy.
namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 131;
constexpr double kTau = 6.283185307179586;
const Burr kBurr{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.020};

/// What a scanner adds.
struct Scan {
  double blur = 1;   ///< [voxels]
  double noise = 0;  ///< standard deviation, as a share of the contrast
};

/// A blind hole turned in some direction; a tool whose tip presses on the floor while its shaft leans on the rim.
struct BlindHole {
  RasterOptions o{.size = {84, 84, 64}, .contrast = 2000};
  Vec3d top;
  double depth, radius;
  Posed X;

  BlindHole(Random& random, const Scan& scan) {
    o.blur = scan.blur;
    o.noise = scan.noise * o.contrast;
    const Vec3d aside = random.arrow();
    top = Vec3d(0.0126, 0.0126, 0.0140) + kVoxel * aside;
    depth = random.uniform(0.003, 0.005);
    radius = random.uniform(0.0016, 0.0024);
    const double x = random.uniform(-0.4, 0.4), y = random.uniform(-0.4, 0.4);
    const Mat3d Q = rotation_from_vector(Vec3d(x, y, 0));
    X = make_pose<double>(Q, top - Q * top);
  }
  [[nodiscard]] auto shape() const {
    return Moved{Either{Both{HalfSpace{top, Vec3d::UnitZ()}, Hollow{Rod{top, Vec3d::UnitZ(), radius}}},
                        HalfSpace{top - Vec3d(0, 0, depth), Vec3d::UnitZ()}},
                 X};
  }
  [[nodiscard]] Posed pose(double deep, double lean, double azimuth, const Vec3d& aside = Vec3d::Zero()) const {
    const Vec3d way(std::sin(lean) * std::cos(azimuth), std::sin(lean) * std::sin(azimuth), std::cos(lean));
    return X * tool_at(top - Vec3d(0, 0, depth + deep) + aside, way);
  }
};

struct Loops {
  Figures force, moment;    ///< contacts against the wrench, as shares of it
  Figures gained, changed;  ///< net work and its size over ∫ |F||dx| + |T||dθ|, a loop each
  double step = 0;          ///< largest change of the force in a step beyond the springs' own [N]
  int ticks = 0;
};

template <class Renderer>
Loops loops(const LineOptions& options, int count, bool leaves, const Scan& scan = {}) {
  using Scalar = typename Renderer::Scalar;
  Loops all;
  Random random(kSeed);
  for (int c = 0; c < count; ++c) {
    const BlindHole hole(random, scan);
    const auto grid = rasterise<std::int16_t>(hole.shape(), hole.o);
    const DensityField<std::int16_t, Scalar, SplineGradient> field(grid, hole.o.isovalue());
    Renderer renderer(ToolDiscretization<LineCounts, Scalar>(kBurr, {.shaft = 200}), options);
    const double lean = std::atan2(hole.radius, hole.depth), azimuth = random.uniform(0, kTau);
    const double a = random.uniform(0, kTau), b = random.uniform(0, kTau), d = random.uniform(0, kTau);
    const auto at = [&](double s) {
      const double deep = (leaves ? 0.0003 : 0.0007) + 0.0006 * std::sin(s);
      return hole.pose(deep, lean + 0.12 + 0.1 * std::sin(s + a), azimuth + 0.3 * std::sin(s + b),
                       0.0003 * Vec3d(std::sin(s + d), std::cos(s + d), 0));
    };
    lead(renderer, field, hole.pose(-0.0008, 0.02, azimuth), at(0), 120);
    constexpr int kSteps = 2000;
    for (int i = 0; i < kSteps; i += 2) static_cast<void>(render_at(renderer, field, at(kTau * i / kSteps)));
    PathWork work(at(0), in_double(render_at(renderer, field, at(0)).wrench));
    for (int i = 1; i <= kSteps; ++i) {
      const Posed X = at(kTau * i / kSteps);
      const auto out = render_at(renderer, field, X);
      const Wrenchd w = in_double(out.wrench);
      work.go(X, w);
      if (!out.contact.tip || !out.contact.shaft) continue;
      ++all.ticks;
      Vec3d F = Vec3d::Zero(), M = Vec3d::Zero();
      for (const auto& p : renderer.contacts()) {
        const Vec3d f = p.force.template cast<double>();
        F += f;
        M += (p.position.template cast<double>() - X.translation()).cross(f);
      }
      all.force.add((F - w.force).norm() / w.force.norm());
      all.moment.add((M - w.torque).norm() / (w.torque.norm() + 1e-4));
    }
    all.step = std::max(all.step, work.jump);
    all.gained.add(work.net / work.length);
    all.changed.add(std::abs(work.net) / work.length);
  }
  return all;
}

TEST_CASE_TEMPLATE("Line: contacts add up to the wrench, force and moment, with tip and shaft in contact", Scalar,
                   float, double) {
  CAPTURE(kSeed);
  // Rounding: single precision of a torque of .1 mN·m and more.
  constexpr double kBalance = std::is_same_v<Scalar, float> ? 1.6e-5 : 1.5e-15;
  using Smooth = LineApproxRenderer<Scalar>;
  using Rough = LineApproxRenderer<Scalar, TranslateRotate, Coulomb>;
  const auto check = [&](const Loops& l) {
    MESSAGE("contacts against the wrench: force ", l.force, ", moment ", l.moment);
    CHECK(l.ticks > 1000);
    CHECK(l.force.worst() <= (std::is_same_v<Scalar, float> ? 3e-7 : 1e-15));
    CHECK(l.moment.worst() <= kBalance);
  };
  check(loops<Smooth>({}, cases(8), false));
  check(loops<Smooth>({.shaft_stiffness = 300}, cases(8), true));
  check(loops<Rough>({}, cases(8), false));
}

TEST_CASE("Line: closed paths of a tool that touches with tip and shaft make no energy" * doctest::test_suite("long")) {
  CAPTURE(kSeed);
  // The tip's part is the gradient of an energy, the shaft's but for its lever, and for the tip's entry.
  const Loops in = loops<LineApproxRenderer<double>>({}, cases(24), false);
  const Loops out = loops<LineApproxRenderer<double>>({}, cases(24), true);
  MESSAGE("net work, tip always in contact: ", in.changed, ", gained at most ", in.gained.worst(),
          "; tip in and out: ", out.changed, ", gained at most ", out.gained.worst(), "; steps ", in.step, ", ",
          out.step, " N");
  CHECK(in.gained.worst() <= 0.03);
  CHECK(out.gained.worst() <= 0.04);
  CHECK(in.changed.worst() <= 0.06);
  CHECK(out.changed.worst() <= 0.08);
  CHECK(in.step <= 0.27);
  CHECK(out.step <= 0.27);
  if (kSanitized) return;  // a median of few paths is another figure
  CHECK(in.changed.median() <= 0.01);
  CHECK(out.changed.median() <= 0.02);
}

TEST_CASE("Line: on noise closed paths lose work, and few gain more than on clean bone" * doctest::test_suite("long")) {
  CAPTURE(kSeed);
  // Crests of the noise let the tip and the shaft go: that loses work. What is gained is the lever's and the entry's.
  const auto check = [](double noise, double most) {
    for (const double blur : {0.5, 1.0}) {
      const Scan scan{.blur = blur, .noise = noise};
      const Loops in = loops<LineApproxRenderer<double>>({}, cases(8), false, scan);
      const Loops out = loops<LineApproxRenderer<double>>({}, cases(8), true, scan);
      MESSAGE("noise ", noise, ", blur ", blur, ": gained at most ", in.gained.worst(), " and ", out.gained.worst(),
              ", median ", in.gained.median(), " and ", out.gained.median());
      CAPTURE(noise);
      CAPTURE(blur);
      CHECK(in.gained.worst() <= most);
      CHECK(out.gained.worst() <= most);
      if (kSanitized) continue;  // a median of few paths is another figure
      CHECK(in.gained.median() < 7.5e-4);
      CHECK(out.gained.median() < 0.01);
    }
  };
  check(0.06, 0.04);
  if (!kSanitized) check(0.2, 0.06);
}

}  // namespace
