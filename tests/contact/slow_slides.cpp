// SPDX-License-Identifier: MIT
#include "contact/proxy_helpers.hpp"
#include "support/figures.hpp"

#include <doctest/doctest.h>

#include <array>
#include <string>

/// A slide is felt alike at any speed: a proxy that rests short of where the surface faces its probe sticks and slips.
namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 61;
constexpr double kStiffness = 800;  // N/m

struct Slides {
  Figures direction;  ///< off the surface's normal [degrees]
  Figures ripple;     ///< rms of the normal force about its mean, a slide each [N]
  double step = 0;    ///< largest change of force in a tick beyond K |dx| [N]
};

/// Along `at`, which gives the probe and the surface's normal there for a way [m], `move` metres a tick.
template <class Field, class At>
void slide(const Field& field, const At& at, double move, Slides& all) {
  using Scalar = typename Field::Scalar;
  const double h = kVoxel, way = std::min(8 * h, 1500 * move);
  const int ticks = std::max(8, static_cast<int>(way / move));
  SurfaceProxy<Scalar> proxy;
  const auto [start, up] = at(-way / 2);
  CHECK(lead(proxy, field, start + 6 * h * up, start, 0.1 * h) == Status::kOk);
  CHECK(rest(proxy, field, start, 20) == Status::kOk);
  std::vector<double> along;
  int bad = 0;
  Vec3d p0 = start, F0 = kStiffness * (proxy.position().template cast<double>() - p0);
  for (int i = 1; i <= ticks; ++i) {
    const auto [p, n] = at(-way / 2 + way * i / ticks);
    bad += rest(proxy, field, p, 1) == Status::kOk && proxy.in_contact() ? 0 : 1;
    const Vec3d F = kStiffness * (proxy.position().template cast<double>() - p);
    all.direction.add(angle_deg(F, n));
    all.step = std::max(all.step, (F - F0).norm() - kStiffness * (p - p0).norm());
    along.push_back(F.dot(n));
    p0 = p;
    F0 = F;
  }
  CHECK(bad == 0);
  double mean = 0, squares = 0;
  for (const double f : along) mean += f / ticks;
  for (const double f : along) squares += (f - mean) * (f - mean) / ticks;
  all.ripple.add(std::sqrt(squares));
}

TEST_CASE_TEMPLATE("slides from .1 um to 1 mm a tick have one direction, one ripple and no steps", Scalar, float,
                   double) {
  CAPTURE(kSeed);
  constexpr double kStep = 0.001;  // [N] a tick, beyond K |dx|
  const double h = kVoxel;
  struct Case {
    double blur, p99, worst, ripple;  // the direction's percentile and worst [degrees], the ripple's worst [N]
  };
  // What the image itself does to the normals, with a margin of a quarter.
  for (const Case& c : {Case{0.5, 3.1, 3.3, 0.009}, Case{0.7, 1.2, 1.3, 0.005}, Case{1.0, 0.35, 0.4, 0.003}})
    for (const int kind : {0, 1, 2}) {
      std::array<Slides, 6> speeds;
      Random random(kSeed);
      for (int i = 0; i < 12; ++i) {
        const RasterOptions o{.size = {52, 52, 52}, .blur = c.blur, .contrast = 2000};
        const Vec3d middle = o.middle() + h * random.arrow(), n = random.unit(), other = random.unit();
        const Vec3d along = (other - other.dot(n) * n).normalized();
        const double radius = 14 * h, depth = random.uniform(0.6, 3.5) * h;
        // A plane, a ball, a socket.
        const double probe = kind == 1 ? radius - depth : radius + depth, side = kind == 1 ? 1 : -1;
        const auto at = [&](double s) {
          if (kind == 0) return std::pair{Vec3d(middle + s * along - depth * n), n};
          const Vec3d m = std::cos(s / radius) * n + std::sin(s / radius) * along;
          return std::pair{Vec3d(middle + probe * m), Vec3d(side * m)};
        };
        const auto grid = rasterise<std::int16_t>(
            [&](const Vec3d& p) {
              const double d = (p - middle).norm() - radius;
              return kind == 0 ? (p - middle).dot(n) : side * d;
            },
            o);
        const DensityField<std::int16_t, Scalar, SplineGradient> field(grid, o.isovalue());
        std::size_t speed = 0;
        for (const double move : {1e-7, 1e-6, 3e-6, 1e-5, 1e-4, 1e-3}) slide(field, at, move, speeds[speed++]);
      }
      CAPTURE(c.blur);
      CAPTURE(kind);
      double p99 = 0, worst = 0, ripple = 0, step = 0;
      for (const Slides& s : speeds) {
        p99 = std::max(p99, s.direction.share(0.99));
        worst = std::max(worst, s.direction.worst());
        ripple = std::max(ripple, s.ripple.worst());
        step = std::max(step, s.step);
      }
      MESSAGE(std::array<std::string, 3>{"plane", "ball", "socket"}[static_cast<std::size_t>(kind)], ", blur ", c.blur,
              ": direction p99 ", p99, ", worst ", worst, " degrees, ripple ", ripple, " N rms, steps ", step, " N");
      CHECK(p99 <= c.p99);
      CHECK(worst <= c.worst);
      CHECK(ripple <= c.ripple);
      CHECK(step <= kStep);
    }
}

}  // namespace
