// SPDX-License-Identifier: MIT
#include <trephine/contact/surface_proxy.hpp>

#include "contact/proxy_helpers.hpp"

#include <doctest/doctest.h>

/// Places where a proxy that follows tangent planes can go wrong: concave corners, sockets, slots, convex edges. The
/// oracle is the nearest free point, by brute force, of the same interpolated surface.
namespace {

using namespace trephine;
using namespace trephine::test;

constexpr double kStandsStill = 1e-5;  // voxels: a position's rounding in single precision
// Moves shorter than this share of a step, 1/8 of half a voxel, are no longer tried at a corner.
template <class Of>
constexpr double kCornerError = Of::Gradient::kSmooth ? 0.1 : 0.03;  // voxels: smoothed normals round corners
constexpr double kStiffness = 800;                                   // N/m

// A V-shaped valley along y that opens upward by `opening` about a mean direction that leans by `lean`.
auto valley(const Vec3d& bottom, double opening, double lean) {
  const auto wall = [&](double angle) { return HalfSpace{bottom, Vec3d(std::cos(angle), 0, std::sin(angle))}; };
  // Each wall's outward normal is square to it, turned into the valley.
  const double up = 1.5707963267948966 + lean;
  return Either{wall(up - 1.5707963267948966 + opening / 2), wall(up + 1.5707963267948966 - opening / 2)};
}

template <class Field>
auto interpolated(const Field& field) {
  return [&field](const Vec3d& p) { return -field.value(p); };
}

TEST_CASE_TEMPLATE("concave corners: the nearest free point, and no chatter", Of, CellNormals<float>,
                   CellNormals<double>, SplineNormals<float>, SplineNormals<double>) {
  using Scalar = typename Of::Scalar;
  const double h = kVoxel;
  double farther = 0, restless = 0;
  for (const Image image : {Image::kCtBlur, Image::kPartialVolume})
    for (const double opening : {60.0, 90.0, 120.0})
      for (const double lean : {0.0, 0.2, 0.7}) {
        CAPTURE(static_cast<int>(image));
        CAPTURE(opening);
        CAPTURE(lean);
        const RasterOptions o{.size = {64, 48, 64}, .image = image};
        const auto shape = valley(o.middle(), opening / degrees(1), lean);
        const auto grid = rasterise<std::uint8_t>(shape, o);
        const auto field = field_of<Scalar, typename Of::Gradient>(grid, o);
        const auto exact_field = field_of<double>(grid, o);
        Random random(31);
        for (int i = 0; i < 4; ++i) {
          const Vec3d up(-std::sin(lean), 0, std::cos(lean));
          const Vec3d start = o.middle() + 10 * h * up;
          const Vec3d side = random.uniform(-3, 3) * h * up.cross(Vec3d::UnitY());
          const double deep = random.uniform(3, 12) * h, along = random.uniform(-1, 1) * h;
          const Vec3d p = o.middle() - deep * up + side + along * Vec3d::UnitY();
          SurfaceProxy<Scalar> proxy;
          CHECK(lead(proxy, field, start, p, 0.15 * h) == Status::kOk);
          static_cast<void>(rest(proxy, field, p, 50));
          REQUIRE(proxy.in_contact());
          const Vec3d nearest = nearest_free(interpolated(exact_field), p, o.middle() - 12 * h * Vec3d::Ones(),
                                             o.middle() + 12 * h * Vec3d::Ones());
          const Vec3d q = proxy.position().template cast<double>();
          farther = std::max(farther, ((q - p).norm() - (nearest - p).norm()) / h);
          restless = std::max(restless, restlessness(proxy, field, p, 200));
        }
      }
  MESSAGE("valleys: farther than the nearest free point by ", farther, " voxels, moves at rest ", restless);
  CHECK(farther <= kCornerError<Of>);
  CHECK(restless <= kStandsStill);
}

TEST_CASE_TEMPLATE("a spherical socket and the inner edge of a slot", Of, CellNormals<float>, CellNormals<double>,
                   SplineNormals<float>, SplineNormals<double>) {
  using Scalar = typename Of::Scalar;
  const double h = kVoxel;
  const RasterOptions o{.size = {48, 48, 48}};
  double farther = 0, restless = 0;
  const auto check = [&](const auto& shape, const Vec3d& start, const auto& probe) {
    const auto grid = rasterise<std::uint8_t>(shape, o);
    const auto field = field_of<Scalar, typename Of::Gradient>(grid, o);
    const auto exact_field = field_of<double>(grid, o);
    Random random(32);
    for (int i = 0; i < 8; ++i) {
      const Vec3d p = probe(random);
      SurfaceProxy<Scalar> proxy;
      CHECK(lead(proxy, field, start, p, 0.15 * h) == Status::kOk);
      static_cast<void>(rest(proxy, field, p, 50));
      REQUIRE(proxy.in_contact());
      const Vec3d nearest = nearest_free(interpolated(exact_field), p, o.middle() - 11 * h * Vec3d::Ones(),
                                         o.middle() + 11 * h * Vec3d::Ones());
      farther = std::max(farther, ((proxy.position().template cast<double>() - p).norm() - (nearest - p).norm()) / h);
      restless = std::max(restless, restlessness(proxy, field, p, 200));
    }
  };
  check(Hollow{Ball{o.middle(), 9 * h}}, o.middle(),
        [&](Random& r) { return Vec3d(o.middle() + r.uniform(11, 18) * h * r.unit()); });
  // A slot along x, 8 voxels wide, with a flat floor: its inner edges are corners of 90 degrees.
  const auto slot = Either{HalfSpace{o.middle() - 4 * h * Vec3d::UnitZ(), Vec3d::UnitZ()},
                           Hollow{Plate{o.middle(), Vec3d::UnitY(), 8 * h}}};
  check(slot, o.middle() + 8 * h * Vec3d::UnitZ(), [&](Random& r) {
    return Vec3d(o.middle() +
                 Vec3d(r.uniform(-3, 3), (r.uniform() < 0.5 ? -1 : 1) * r.uniform(6, 12), -r.uniform(6, 12)) * h);
  });
  MESSAGE("socket and slot: farther than the nearest free point by ", farther, " voxels, moves at rest ", restless);
  CHECK(farther <= 0.02);
  CHECK(restless <= kStandsStill);
}

struct Slide {
  double excess = -1;    ///< largest force step over 1.5 K |Δx| [N]
  int jerks = 0;         ///< steps with an excess above .02 N
  double strongest = 0;  ///< largest force [N]
  double after = 0;      ///< force at the end [N]
};

template <class Scalar, class Shape>
Slide slide(const Shape& shape, const RasterOptions& o, const Vec3d& start, const Vec3d& from, const Vec3d& to,
            double step) {
  const auto grid = rasterise<std::uint8_t>(shape, o);
  const auto field = field_of<Scalar>(grid, o);
  SurfaceProxy<Scalar> proxy;
  static_cast<void>(lead(proxy, field, start, from, 0.15 * kVoxel));
  static_cast<void>(rest(proxy, field, from, 20));
  CHECK(proxy.in_contact());
  Vec3d before = kStiffness * (proxy.position().template cast<double>() - from);
  Slide result;
  const int n = static_cast<int>((to - from).norm() / step);
  for (int i = 1; i <= n; ++i) {
    const Vec3d p = from + (static_cast<double>(i) / n) * (to - from);
    CHECK(rest(proxy, field, p, 1) == Status::kOk);
    Vec3d force = Vec3d::Zero();
    if (proxy.in_contact()) force = kStiffness * (proxy.position().template cast<double>() - p);
    const double excess = (force - before).norm() - 1.5 * kStiffness * (to - from).norm() / n;
    result.excess = std::max(result.excess, excess);
    result.jerks += excess > 0.02 ? 1 : 0;
    result.strongest = std::max(result.strongest, force.norm());
    before = force;
  }
  result.after = before.norm();
  return result;
}

constexpr double kSlowStep = 0.1 * kVoxel;  // 30 mm/s at 1 kHz

TEST_CASE_TEMPLATE("slow slides into corners and through sockets do not jerk", Of, CellNormals<float>,
                   CellNormals<double>, SplineNormals<float>, SplineNormals<double>) {
  using Scalar = typename Of::Scalar;
  const double h = kVoxel;
  const RasterOptions o{.size = {64, 32, 64}};
  const Vec3d up = Vec3d::UnitZ(), along = Vec3d::UnitX();
  for (const double depth : {1.0, 2.5}) {
    CAPTURE(depth);
    // Along the floor, into the wall and 6 voxels on.
    const auto corner = Either{HalfSpace{o.middle(), up}, HalfSpace{o.middle(), -along}};
    const Slide into =
        slide<Scalar>(corner, o, o.middle() + Vec3d(-10, 0, 3) * h, o.middle() + Vec3d(-10, 0, -depth) * h,
                      o.middle() + Vec3d(6, 0, -depth) * h, kSlowStep);
    const auto socket = Hollow{Ball{o.middle(), 10 * h}};
    const Slide through = slide<Scalar>(socket, o, o.middle(), o.middle() + Vec3d(-9, 0, -10) * h,
                                        o.middle() + Vec3d(9, 0, -10) * h, kSlowStep);
    const auto plane = HalfSpace{o.middle(), Vec3d(0.3, 0.2, 1).normalized()};
    const Slide flat = slide<Scalar>(plane, o, o.middle() + Vec3d(-8, 0, 6) * h, o.middle() + Vec3d(-8, 0, -3) * h,
                                     o.middle() + Vec3d(8, 0, -depth - 3) * h, kSlowStep);
    MESSAGE("force step over 1.5 K |dx|: concave 90 ", into.excess, " N, socket ", through.excess, " N, plane ",
            flat.excess, " N");
    for (const Slide* s : {&into, &through, &flat}) CHECK(s->excess <= 0.02);
  }
}

TEST_CASE_TEMPLATE("off a convex edge a point proxy snaps once, to nothing", Of, CellNormals<float>,
                   CellNormals<double>, SplineNormals<float>, SplineNormals<double>) {
  using Scalar = typename Of::Scalar;
  // The force on a point that is dragged below a face has no reason to fall before the edge, and nothing holds it
  // after: the step is the constraint's own, as large as the force. There must be no more, and the force before it
  // right.
  const double h = kVoxel;
  const RasterOptions o{.size = {64, 32, 64}};
  const Vec3d up = Vec3d::UnitZ();
  for (const double opening : {90.0, 30.0})
    for (const double depth : {1.0, 2.5}) {
      CAPTURE(opening);
      CAPTURE(depth);
      const double a = opening / degrees(1);
      const auto edge = Both{HalfSpace{o.middle(), up}, HalfSpace{o.middle(), Vec3d(std::sin(a), 0, -std::cos(a))}};
      const Slide over =
          slide<Scalar>(edge, o, o.middle() + Vec3d(-14, 0, 3) * h, o.middle() + Vec3d(-14, 0, -depth) * h,
                        o.middle() + Vec3d(4, 0, -depth) * h, kSlowStep);
      MESSAGE(opening, " degrees, ", depth, " voxels deep: ", over.jerks, " jerks, force up to ",
              over.strongest / (kStiffness * depth * h), " of K depth");
      // On the blade one more: its last two voxels are thinner than the image resolves, the surface kinks there.
      CHECK(over.jerks <= (opening < 90 ? 2 : 1));
      CHECK(over.strongest <= 1.05 * kStiffness * depth * h);
      CHECK(over.after == 0);
    }
}

}  // namespace
