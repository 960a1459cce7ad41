// SPDX-License-Identifier: MIT
#include <trephine/contact/surface_search.hpp>

#include "support/fields.hpp"

#include <doctest/doctest.h>

namespace {

using namespace trephine;
using namespace trephine::test;

template <class Scalar>
Vec3<Scalar> cast(const Vec3d& p) {
  return p.template cast<Scalar>();
}

// Oracle: the first change of side at 400 points a voxel in double, then bisection.
template <class Field>
double first_crossing_slowly(const Field& field, const Vec3d& a, const Vec3d& b) {
  const auto inside = [&](double f) { return field.value(Vec3d(a + f * (b - a))) >= 0; };
  const int n = std::max(1, static_cast<int>((b - a).norm() / field.voxel() * 400));
  const bool from_bone = inside(0);
  for (int i = 1; i <= n; ++i) {
    if (inside(static_cast<double>(i) / n) == from_bone) continue;
    double lo = (i - 1.0) / n, hi = static_cast<double>(i) / n;
    for (int k = 0; k < 60; ++k) {
      const double mid = 0.5 * (lo + hi);
      (inside(mid) == from_bone ? lo : hi) = mid;
    }
    return 0.5 * (lo + hi);
  }
  return 2;
}

TEST_CASE_TEMPLATE("crossings of a voxel surface lie within a thousandth of a voxel", Scalar, float, double) {
  const double h = 3e-4;
  // float: a position of 10 mm is known to 1e-9 m = 3e-6 voxels, and 255 densities to 1.5e-5.
  const double rounding = std::is_same_v<Scalar, float> ? 1e-4 : 1e-9;
  for (const Image image : {Image::kBinary, Image::kPartialVolume, Image::kCtBlur, Image::kClampedDistance}) {
    const RasterOptions o{.size = {36, 36, 36}, .image = image};
    const auto grid = rasterise<std::uint8_t>(Ball{o.middle(), 10.3 * h}, o);
    const auto field = field_of<Scalar>(grid, o);
    const auto exact = field_of<double>(grid, o);
    Random random(7);
    double worst = 0;
    int missed = 0, found = 0;
    for (int i = 0; i < 400; ++i) {
      const Vec3d a = o.middle() + 15 * h * random.unit();
      const Vec3d b = o.middle() + 9 * h * random.arrow();
      // Both ways: into bone and out of it.
      for (const bool out : {false, true}) {
        const Vec3<Scalar> from = cast<Scalar>(out ? b : a), to = cast<Scalar>(out ? a : b);
        const auto hit = first_crossing(field, from, to, static_cast<Scalar>(0.5 * h), 512);
        const Vec3d from_d = from.template cast<double>(), to_d = to.template cast<double>();
        const double f = first_crossing_slowly(exact, from_d, to_d);
        const double length = (to_d - from_d).norm() / h;
        if (hit.found != (f <= 1)) ++missed;
        if (!hit.found || f > 1) continue;
        ++found;
        CHECK(hit.before <= hit.after);
        CHECK_FALSE(hit.bounded);
        // `before` is on the side it came from, `after` on the other: what the callers stand on.
        const Vec3<Scalar> d = to - from;
        CHECK((field.value(from + hit.before * d) >= Scalar(0)) == out);
        CHECK((field.value(from + hit.after * d) >= Scalar(0)) == !out);
        worst = std::max({worst, std::abs(static_cast<double>(hit.before) - f) * length,
                          std::abs(static_cast<double>(hit.after) - f) * length});
      }
    }
    CAPTURE(static_cast<int>(image));
    CHECK(found > 700);
    CHECK(missed == 0);
    MESSAGE("image ", static_cast<int>(image), ": worst crossing error ", worst, " voxels of ", found);
    CHECK(worst <= kSurfaceTolerance + rounding);
  }
}

TEST_CASE_TEMPLATE("half-voxel steps see every plate from one voxel up, and its first side", Scalar, float, double) {
  const double h = 3e-4;
  for (const double thick : {1.0, 1.5, 2.0, 4.0}) {
    Random random(11);
    const Vec3d n = random.unit();
    const RasterOptions o{.size = {40, 40, 40}, .image = Image::kPartialVolume};
    const auto grid = rasterise<std::uint8_t>(Plate{o.middle(), n, thick * h}, o);
    const auto field = field_of<Scalar>(grid, o);
    const auto exact = field_of<double>(grid, o);
    int through = 0;
    double worst = 0;
    for (int i = 0; i < 300; ++i) {
      const Vec3d side = random.unit();
      const Vec3d at = o.middle() + 4 * h * (side - side.dot(n) * n);
      const Vec3d a = at + (6 + random.uniform()) * h * n, b = at - (6 + random.uniform()) * h * n;
      const auto hit = first_crossing(field, cast<Scalar>(a), cast<Scalar>(b), static_cast<Scalar>(0.5 * h), 512);
      const double f = first_crossing_slowly(exact, cast<Scalar>(a).template cast<double>(),
                                             cast<Scalar>(b).template cast<double>());
      if (f > 1) continue;  // there is a hole in this image of the plate
      if (!hit.found) {
        ++through;
        continue;
      }
      worst = std::max(worst, std::abs(static_cast<double>(hit.before) - f) * (b - a).norm() / h);
    }
    CAPTURE(thick);
    CHECK(through == 0);
    CHECK(worst < 2e-3);
  }
}

TEST_CASE_TEMPLATE("the step bound is kept and said", Scalar, float, double) {
  const double h = 3e-4;
  const ShapeField<Scalar, HalfSpace> base({Vec3d(0, 0, -1), Vec3d::UnitZ()}, h);
  const CountingField field(base);
  const Vec3<Scalar> a(0, 0, Scalar(0.1));
  const Vec3<Scalar> b(0, 0, Scalar(-0.1));
  for (const int most : {1, 3, 100, 1333}) {
    field.samples = 0;
    const auto hit = first_crossing(field, a, b, static_cast<Scalar>(h / 2), most);
    CHECK_FALSE(hit.found);
    CHECK(hit.bounded);
    CHECK(field.samples <= most + 1);
  }
  CHECK_FALSE(first_crossing(field, a, b, static_cast<Scalar>(h / 2), 1400).bounded);
  // Steps so coarse that a plate is stepped over: bounded tells why.
  const ShapeField<Scalar, Plate> plate({Vec3d(0, 0, 0.021), Vec3d::UnitZ(), h}, h);
  const auto coarse = first_crossing(plate, a, b, static_cast<Scalar>(h / 2), 10);
  CHECK_FALSE(coarse.found);
  CHECK(coarse.bounded);
  CHECK(first_crossing(plate, a, b, static_cast<Scalar>(h / 2), 1400).found);
}

TEST_CASE_TEMPLATE("degenerate segments", Scalar, float, double) {
  const double h = 3e-4;
  const ShapeField<Scalar, HalfSpace> base({Vec3d::Zero(), Vec3d::UnitZ()}, h);
  const CountingField field(base);
  const Vec3<Scalar> free(0, 0, Scalar(1e-3)), bone(0, 0, Scalar(-1e-3));
  CHECK_FALSE(first_crossing(field, free, free, static_cast<Scalar>(h), 512).found);
  CHECK_FALSE(first_crossing(field, bone, bone, static_cast<Scalar>(h), 512).found);
  const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN(), inf = std::numeric_limits<Scalar>::infinity();
  for (const Vec3<Scalar>& bad : {Vec3<Scalar>(nan, 0, 0), Vec3<Scalar>(0, 0, inf), Vec3<Scalar>(0, -inf, nan),
                                  Vec3<Scalar>(std::numeric_limits<Scalar>::max(), 0, 0)}) {
    field.samples = 0;
    static_cast<void>(first_crossing(field, free, bad, static_cast<Scalar>(h), 512));
    static_cast<void>(first_crossing(field, bad, bone, static_cast<Scalar>(h), 512));
    CHECK(field.samples <= 2 * (512 + 13));
  }
  // A segment that ends on the surface: 0 counts as bone, exactly at its last point.
  const auto touch = first_crossing(field, free, Vec3<Scalar>(Vec3<Scalar>::Zero()), static_cast<Scalar>(h), 512);
  CHECK(touch.found);
}

TEST_CASE_TEMPLATE("the end of the segment is judged by the very point given", Scalar, float, double) {
  // Where a + 1 · (b − a) is not b in floating point, a free end must not be taken for bone or the other way round.
  const double h = 3e-4;
  const ShapeField<Scalar, HalfSpace> field({Vec3d(0, 0, 0.0013), Vec3d::UnitZ()}, h);
  Random random(3);
  int differs = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3<Scalar> a(Scalar(0), Scalar(0), static_cast<Scalar>(0.0013 + random.uniform(10, 40) * h));
    Scalar z = static_cast<Scalar>(0.0013);
    for (int n = random.below(7) - 3; n != 0; n += n < 0 ? 1 : -1)
      z = std::nextafter(z, n < 0 ? Scalar(-1) : Scalar(1));
    const Vec3<Scalar> b(Scalar(0), Scalar(0), z);
    if (!(field.value(a) < Scalar(0))) continue;
    differs += first_crossing(field, a, b, static_cast<Scalar>(h / 2), 512).found != (field.value(b) >= Scalar(0));
  }
  CHECK(differs == 0);
}

TEST_CASE("plan_steps") {
  CHECK(plan_steps(0, 1, 5).count == 1);
  CHECK(plan_steps(1, 1, 5).count == 1);
  CHECK(plan_steps(1.01, 1, 5).count == 2);
  CHECK(plan_steps(5, 1, 5).count == 5);
  CHECK_FALSE(plan_steps(5, 1, 5).bounded);
  CHECK(plan_steps(5.01, 1, 5).count == 5);
  CHECK(plan_steps(5.01, 1, 5).bounded);
  for (const double bad : {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN(), 1e300}) {
    CHECK(plan_steps(bad, 1, 5).count == 5);
    CHECK(plan_steps(bad, 1, 5).bounded);
  }
}

}  // namespace
