// SPDX-License-Identifier: MIT
#include <trephine/contact/friction.hpp>

#include "contact/proxy_helpers.hpp"
#include "support/near.hpp"

#include <doctest/doctest.h>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr double kFrictionError = 0.05;  // evaluation.md scenario 11

TEST_CASE("Coulomb's law in distances") {
  const Coulomb law(0.5, 0.3);
  CHECK(law.slip(0.49, 1, true) == 0);
  CHECK(law.slip(0.51, 1, true) == near(0.21));
  CHECK(law.slip(0.29, 1, false) == 0);
  CHECK(law.slip(0.40, 1, false) == near(0.1));
  CHECK(law.slip(1, 0, true) == 1);
  CHECK(Frictionless{}.slip(0.7, 1, true) == 0.7);
  static_assert(Friction<Coulomb> && Friction<Frictionless>);
  static_assert(noexcept(law.slip(1, 1, true)));
}

TEST_CASE("coefficients that are none are refused") {
  CHECK_NOTHROW(Coulomb(0, 0));
  CHECK_THROWS_WITH(Coulomb(0.2, -0.1), "trephine::Coulomb: the kinetic coefficient must be >= 0, got -0.1");
  CHECK_THROWS_WITH(Coulomb(0.2, std::nan("")), "trephine::Coulomb: the kinetic coefficient must be >= 0, got nan");
  CHECK_THROWS_WITH(Coulomb(0.2, 0.3),
                    "trephine::Coulomb: the static coefficient must be finite and at least the kinetic one, got 0.2");
  CHECK_THROWS_WITH(Coulomb(INFINITY, 0.3),
                    "trephine::Coulomb: the static coefficient must be finite and at least the kinetic one, got inf");
  CHECK_THROWS_WITH(Coulomb(std::nan(""), 0.3),
                    "trephine::Coulomb: the static coefficient must be finite and at least the kinetic one, got nan");
}

// A probe pressed into a plane and then pulled aside until the proxy lets go: tangential over normal distance there.
template <class Scalar>
double threshold(const Coulomb& law, const Vec3d& n, double depth, Image image) {
  const double h = kVoxel;
  const RasterOptions o{.size = {64, 64, 64}, .image = image};
  const auto grid = rasterise<std::uint8_t>(HalfSpace{o.middle(), n}, o);
  const auto field = field_of<Scalar>(grid, o);
  SurfaceProxy<Scalar, Coulomb> proxy(ProxyOptions{}, law);
  static_cast<void>(lead(proxy, field, o.middle() + 2 * h * n, o.middle() - depth * h * n, 0.1 * h));
  static_cast<void>(rest(proxy, field, o.middle() - depth * h * n, 20));
  REQUIRE(proxy.sticks());
  const Vec3d held = proxy.position().template cast<double>();
  const Vec3d side = n.unitOrthogonal();
  for (int i = 0; i < 100000; ++i) {
    const double pulled = i * 0.002 * h;
    const Vec3d p = o.middle() - depth * h * n + pulled * side;
    static_cast<void>(rest(proxy, field, p, 1));
    const Vec3d q = proxy.position().template cast<double>();
    if ((q - held).norm() > 2e-3 * h) {
      const Vec3d d = p - held;
      return (d - d.dot(n) * n).norm() / -d.dot(n);
    }
  }
  return -1;
}

TEST_CASE_TEMPLATE("stick turns to slip at the static coefficient", Scalar, float, double) {
  Random random(41);
  for (const double mu : {0.1, 0.3, 0.8})
    for (int i = 0; i < 4; ++i) {
      const Vec3d n = i == 0 ? Vec3d::UnitZ() : random.unit();
      CAPTURE(mu);
      CAPTURE(i);
      // The distance field's normals are good to half a degree; tan of that is 3 % of the smallest coefficient … at .1
      // only the plane along the grid is asked.
      if (mu < 0.2 && i > 0) continue;
      const double found = threshold<Scalar>(Coulomb(mu, 0.8 * mu), n, 4, Image::kClampedDistance);
      CHECK(found == near(mu, kFrictionError));
    }
}

// Slides for `ticks` at `speed` voxels a tick along a circle in the tangent plane; tangential over normal force,
// averaged over the second half, its range, and the angle between friction and velocity.
struct Sliding {
  double mean = 0, least = 1e9, most = 0, against = 0;
};
template <class Scalar, class Law>
Sliding slide_on_circle(const Law& law, const Vec3d& n, double depth, double speed, int ticks) {
  const double h = kVoxel;
  const RasterOptions o{.size = {64, 64, 64}, .image = Image::kClampedDistance};
  const auto grid = rasterise<std::uint8_t>(HalfSpace{o.middle(), n}, o);
  const auto field = field_of<Scalar>(grid, o);
  SurfaceProxy<Scalar, Law> proxy(ProxyOptions{}, law);
  const Vec3d u = n.unitOrthogonal(), v = n.cross(u);
  const double radius = 12 * h;
  const auto at = [&](double s) {
    return Vec3d(o.middle() + radius * (std::cos(s) * u + std::sin(s) * v) - depth * h * n);
  };
  static_cast<void>(lead(proxy, field, at(0) + (depth + 2) * h * n, at(0), 0.1 * h));
  Sliding result;
  double s = 0;
  for (int i = 0; i < ticks; ++i) {
    const Vec3d before = at(s);
    s += speed * h / radius;
    const Vec3d p = at(s);
    static_cast<void>(rest(proxy, field, p, 1));
    if (i < ticks / 2) continue;
    const Vec3d e = proxy.position().template cast<double>() - p;
    const Vec3d t = e - e.dot(n) * n;
    const double ratio = t.norm() / e.dot(n);
    result.mean += ratio / (ticks - ticks / 2);
    result.least = std::min(result.least, ratio);
    result.most = std::max(result.most, ratio);
    result.against = std::max(result.against, angle_deg(t, before - p));
  }
  return result;
}

TEST_CASE_TEMPLATE("sliding friction is the kinetic coefficient, against the motion", Scalar, float, double) {
  // 30 mm/s at 1 kHz: .1 voxel a tick.
  const Vec3d n = Vec3d::UnitZ();
  for (const double mu : {0.15, 0.4}) {
    CAPTURE(mu);
    const Sliding same = slide_on_circle<Scalar>(Coulomb(mu, mu), n, 4, 0.1, 3000);
    const Sliding lower = slide_on_circle<Scalar>(Coulomb(1.5 * mu, mu), n, 4, 0.1, 3000);
    MESSAGE("mu ", mu, ": one coefficient ", same.mean, " [", same.least, ", ", same.most,
            "]; static 1.5 times higher ", lower.mean, " [", lower.least, ", ", lower.most, "]");
    for (const Sliding* s : {&same, &lower}) {
      // Along the grid the normals are exact: what is left is rounding.
      CHECK(s->mean == near(mu, 1e-7));
      CHECK(s->least > (1 - 1.5e-5) * mu);
      CHECK(s->most < (1 + 1.5e-5) * mu);
    }
    // On a circle of 12 voxels the proxy trails by μ · 4 voxels: that many degrees behind.
    const double trail = degrees(std::asin(mu * 4 / 12));
    CHECK(same.against < trail + 1.5e-3);
  }
  Random random(42);
  for (int i = 0; i < 3; ++i) {
    const Sliding tilted = slide_on_circle<Scalar>(Coulomb(0.4, 0.4), random.unit(), 4, 0.1, 3000);
    CHECK(tilted.mean == near(0.4, 4e-3));
  }
}

TEST_CASE_TEMPLATE("a slide by less than the search's tolerance a tick is a slide, not a stick", Scalar, float,
                   double) {
  // Else it would stop at each tick, and the next one had the static coefficient.
  const Sliding s = slide_on_circle<Scalar>(Coulomb(0.5, 0.2), Vec3d::UnitZ(), 4, 0.4 * kSurfaceTolerance, 16000);
  CHECK(s.mean == near(0.2, kFrictionError));
}

TEST_CASE_TEMPLATE("no friction where the coefficient is zero", Scalar, float, double) {
  const Sliding none = slide_on_circle<Scalar>(Frictionless{}, Vec3d::UnitZ(), 4, 0.1, 1000);
  const Sliding zero = slide_on_circle<Scalar>(Coulomb(0, 0), Vec3d::UnitZ(), 4, 0.1, 1000);
  CHECK(none.most < 1.5e-6);
  CHECK(zero.most < 1.5e-6);
}

TEST_CASE_TEMPLATE("a proxy that sticks does not creep, whatever the image", Scalar, float, double) {
  const double h = kVoxel, dt = 1e-3;
  Random random(43);
  double worst = 0;
  for (const Image image : {Image::kBinary, Image::kPartialVolume, Image::kCtBlur})
    for (int i = 0; i < 6; ++i) {
      const Vec3d n = random.unit();
      const RasterOptions o{.size = {40, 40, 40}, .image = image};
      const auto grid = rasterise<std::uint8_t>(HalfSpace{o.middle(), n}, o);
      const auto field = field_of<Scalar>(grid, o);
      SurfaceProxy<Scalar, Coulomb> proxy(ProxyOptions{}, Coulomb(0.6, 0.5));
      const Vec3d side = n.unitOrthogonal();
      const Vec3d p = o.middle() - 4 * h * n;
      static_cast<void>(lead(proxy, field, o.middle() + 2 * h * n, p, 0.1 * h));
      // Slid to a stop, left under load, then shaken by an encoder's quantum within the cone.
      static_cast<void>(lead(proxy, field, p, p + 5 * h * side, 0.05 * h));
      Vec3d held = p + 3.5 * h * side;
      static_cast<void>(lead(proxy, field, p + 5 * h * side, held, 0.02 * h));
      static_cast<void>(rest(proxy, field, held, 20));
      REQUIRE(proxy.in_contact());
      REQUIRE(proxy.sticks());
      const Vec3d start = proxy.position().template cast<double>();
      for (int t = 0; t < 1000; ++t) static_cast<void>(rest(proxy, field, held + (t % 2) * 0.1 * h * random.unit(), 1));
      worst = std::max(worst, (proxy.position().template cast<double>() - start).norm() / (1000 * dt));
    }
  MESSAGE("creep under load ", worst, " m/s");
  CHECK(worst == 0);
}

TEST_CASE_TEMPLATE("on an incline a hanging load holds below the friction angle and runs above", Scalar, float,
                   double) {
  // The probe is pulled straight down by a fixed distance under the proxy: a weight on a spring.
  const double h = kVoxel, mu = 0.4;
  const double limit = std::atan(mu);
  for (const double share : {0.95, 1.05}) {
    const double slope = limit * share;
    const Vec3d n(std::sin(slope), 0, std::cos(slope));
    const RasterOptions o{.size = {96, 24, 64}, .image = Image::kClampedDistance};
    const auto grid = rasterise<std::uint8_t>(HalfSpace{o.middle(), n}, o);
    const auto field = field_of<Scalar>(grid, o);
    SurfaceProxy<Scalar, Coulomb> proxy(ProxyOptions{}, Coulomb(mu, mu));
    const Vec3d top = o.middle() - 20 * h * Vec3d(std::cos(slope), 0, -std::sin(slope));
    static_cast<void>(lead(proxy, field, top + 2 * h * n, top - 0.5 * h * n, 0.05 * h));
    const Vec3d start = proxy.position().template cast<double>();
    for (int t = 0; t < 3000; ++t) {
      const Vec3d q = proxy.position().template cast<double>();
      static_cast<void>(rest(proxy, field, q - 4 * h * Vec3d::UnitZ(), 1));
    }
    const double ran = (proxy.position().template cast<double>() - start).norm() / h;
    CAPTURE(share);
    CAPTURE(ran);
    CHECK((share < 1 ? ran < 0.5 : ran > 5));
  }
}

}  // namespace
