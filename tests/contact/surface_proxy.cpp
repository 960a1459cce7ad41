// SPDX-License-Identifier: MIT
#include <trephine/contact/surface_proxy.hpp>

#include "contact/proxy_helpers.hpp"
#include "support/near.hpp"

#include <doctest/doctest.h>

namespace {

using namespace trephine;
using namespace trephine::test;

// Half a just noticeable difference of force.
constexpr double kForceError = 0.035;
constexpr double kStandsStill = 1e-5;  // voxels: a position's rounding in single precision
// A proxy comes to rest where the surface it stands on faces the probe, so on a plane its direction is as good as the
// surface's own normal: 1.3 degrees mean, 4 at most on 8-bit blurred planes, a fifth of that if normals are smoothed.
template <class Of>
constexpr double kMedianDirection = Of::Gradient::kSmooth ? 0.4 : 2;
template <class Of>
constexpr double kWorstDirection = Of::Gradient::kSmooth ? 0.8 : 4;

struct Errors {
  std::vector<double> magnitudes, directions;
  void take(const Vec3d& got, const Vec3d& exact) {
    magnitudes.push_back(std::abs(got.norm() - exact.norm()) / exact.norm());
    directions.push_back(angle_deg(got, exact));
    std::sort(magnitudes.begin(), magnitudes.end());
    std::sort(directions.begin(), directions.end());
  }
  [[nodiscard]] double magnitude() const { return magnitudes.back(); }
  [[nodiscard]] double median() const { return directions[directions.size() / 2]; }
  [[nodiscard]] double worst() const { return directions.back(); }
};

TEST_CASE("a probe led far in a tick is kept up with; one led too far says so, and is caught up with") {
  const double h = kVoxel;
  const RasterOptions o{.size = {80, 80, 80}};
  const auto grid = rasterise<std::uint8_t>(HalfSpace{o.middle(), Vec3d::UnitZ()}, o);
  const auto field = field_of<float, SplineGradient>(grid, o);
  const Vec3d from = o.middle() - h * Vec3d(8, 0, 2), to = from + 15 * h * Vec3d::UnitX();
  const auto beside = [&](const SurfaceProxy<float>& proxy) {
    return (proxy.position().cast<double>() - to).head<2>().norm() / h;
  };
  SurfaceProxy<float> proxy;
  CHECK(lead(proxy, field, from + 3 * h * Vec3d::UnitZ(), from, 0.2 * h) == Status::kOk);
  CHECK(proxy.follow(field, to.cast<float>()) == Status::kOk);
  CHECK(beside(proxy) <= 8e-5);

  SurfaceProxy<float> hurried(ProxyOptions{.iterations = 2});  // at most 18 moves of half a voxel
  CHECK(lead(hurried, field, from + 3 * h * Vec3d::UnitZ(), from, 0.2 * h) == Status::kOk);
  CHECK(hurried.follow(field, to.cast<float>()) == Status::kWorkBound);
  CHECK(beside(hurried) == near(15 - 9, 8e-6));
  CHECK(hurried.follow(field, to.cast<float>()) == Status::kOk);
  CHECK(beside(hurried) <= 8e-5);
}

TEST_CASE_TEMPLATE("tip proxy on planes of any tilt: k times depth, down to saturated depths", Of, CellNormals<float>,
                   CellNormals<double>, SplineNormals<float>, SplineNormals<double>) {
  using Scalar = typename Of::Scalar;
  const double h = kVoxel;
  Random random(21);
  for (const Image image : {Image::kCtBlur, Image::kClampedDistance}) {
    Errors shallow, deep;
    double restless = 0;
    for (int tilt = 0; tilt < 12; ++tilt) {
      const Vec3d n = tilt == 0 ? Vec3d::UnitZ() : random.unit();
      const RasterOptions o{.size = {80, 80, 80}, .image = image};
      const auto grid = rasterise<std::uint8_t>(HalfSpace{o.middle(), n}, o);
      const auto field = field_of<Scalar, typename Of::Gradient>(grid, o);
      for (const double depth : {1.5, 3.0, 5.0, 16.0, 30.0}) {
        SurfaceProxy<Scalar> proxy;
        const Vec3d side = n.unitOrthogonal();
        const Vec3d target = o.middle() - depth * h * n + 3 * h * side;
        CHECK(lead(proxy, field, o.middle() + 3 * h * n, target, 0.2 * h) == Status::kOk);
        // A slide of 6 voxels: the proxy has to keep up at depth too.
        CHECK(lead(proxy, field, target, target - 6 * h * side, 0.1 * h) == Status::kOk);
        const Vec3d p = target - 6 * h * side;
        CHECK(rest(proxy, field, p, 50) == Status::kOk);
        REQUIRE(proxy.in_contact());
        (depth < 10 ? shallow : deep).take(proxy.position().template cast<double>() - p, depth * h * n);
        restless = std::max(restless, restlessness(proxy, field, p, 200));
        CHECK(field.value(proxy.position()) < Scalar(0));  // just outside
      }
    }
    MESSAGE("image ", static_cast<int>(image), " plane 1.5-5 voxels deep: force ", shallow.magnitude(),
            ", direction median ", shallow.median(), " worst ", shallow.worst(),
            " deg; 16, 30 deep: ", deep.magnitude(), ", ", deep.median(), " ", deep.worst(), " deg; moves at rest ",
            restless, " voxels");
    for (const Errors* e : {&shallow, &deep}) {
      CHECK(e->magnitude() <= 0.014);
      CHECK(e->median() <= kMedianDirection<Of>);
      CHECK(e->worst() <= kWorstDirection<Of>);
    }
    CHECK(restless <= kStandsStill);
  }
}

TEST_CASE_TEMPLATE("tip proxy on a sphere", Of, CellNormals<float>, CellNormals<double>, SplineNormals<float>,
                   SplineNormals<double>) {
  using Scalar = typename Of::Scalar;
  const double h = kVoxel;
  Random random(22);
  struct Case {
    double radius, surface_error, normal_error;
  };
  // Errors of the trilinear surface of an 8-bit blurred sphere, measured on 20,000 rays: rms distance [voxels] and
  // worst normal [degrees].
  for (const Case& c : {Case{8, 0.023, 7}, Case{16, 0.014, 5.5}, Case{32, 0.009, 4}}) {
    CAPTURE(c.radius);
    const int size = static_cast<int>(2 * c.radius) + 16;
    const RasterOptions o{.size = {size, size, size}};
    const auto grid = rasterise<std::uint8_t>(Ball{o.middle(), c.radius * h}, o);
    const auto field = field_of<Scalar, typename Of::Gradient>(grid, o);
    // Where a proxy that cannot slide touches: on the surface, in no direction preferred.
    double squares = 0;
    constexpr int kTouches = 400;
    for (int i = 0; i < kTouches; ++i) {
      const Vec3d n = random.unit();
      SurfaceProxy<Scalar, Coulomb> proxy(ProxyOptions{}, Coulomb(10, 10));
      static_cast<void>(rest(proxy, field, o.middle() + (c.radius + 1.3) * h * n, 1));
      static_cast<void>(rest(proxy, field, o.middle() + (c.radius - 0.8) * h * n, 1));
      REQUIRE(proxy.in_contact());
      const double r = (proxy.position().template cast<double>() - o.middle()).norm();
      squares += std::pow(r / h - c.radius, 2) / kTouches;
    }
    MESSAGE("sphere of ", c.radius, " voxels: contact error ", std::sqrt(squares), " voxels rms");
    CHECK(std::sqrt(squares) <= 1.2 * c.surface_error);

    Errors error;
    double restless = 0, least_share = 1e9, unbalanced = 0;
    constexpr int kProbes = 30;
    for (int i = 0; i < kProbes; ++i) {
      const Vec3d n = random.unit();
      const double depth = random.uniform(1.5, 0.7 * c.radius);
      const Vec3d p = o.middle() + (c.radius - depth) * h * n;
      SurfaceProxy<Scalar> proxy;
      // From beside the nearest point: it has to slide round to it.
      const Vec3d beside = o.middle() + (c.radius + 2) * h * (n + 0.3 * random.unit()).normalized();
      CHECK(lead(proxy, field, beside, p, 0.2 * h) == Status::kOk);
      CHECK(rest(proxy, field, p, 100) == Status::kOk);
      REQUIRE(proxy.in_contact());
      const Vec3d q = proxy.position().template cast<double>();
      error.take(q - p, depth * h * n);
      restless = std::max(restless, restlessness(proxy, field, p, 200));
      // At rest the surface faces the probe, up to the gradient's jump at a cell's face.
      unbalanced = std::max(unbalanced, angle_deg(proxy.normal().template cast<double>(), q - p));
      // Seen from a probe below the surface a slope error η displaces the resting place so that the force turns by
      // η / (1 − δ/R): the sphere is flatter from inside.
      least_share = std::min(least_share, c.normal_error / (1 - depth / c.radius) - angle_deg(q - p, n));
    }
    MESSAGE("sphere of ", c.radius, " voxels: force ", error.magnitude(), ", direction median ", error.median(),
            " worst ", error.worst(), " deg, normal to force ", unbalanced, " deg, moves at rest ", restless);
    CHECK(error.magnitude() <= kForceError);
    CHECK(least_share >= 0);
    CHECK(unbalanced < (Of::Gradient::kSmooth ? 0.07 : 1.5));
    CHECK(restless <= kStandsStill);
  }
}

TEST_CASE_TEMPLATE("tip proxy on voxels of 1:1:3, in a grid that is turned in the world", Of, CellNormals<float>,
                   CellNormals<double>, SplineNormals<float>, SplineNormals<double>) {
  using Scalar = typename Of::Scalar;
  const double h = kVoxel;
  Random random(23);
  Errors error;
  for (int tilt = 0; tilt < 12; ++tilt) {
    const Vec3d n = random.unit();
    RasterOptions o{.size = {60, 60, 30}, .spacing = Vec3d(h, h, 3 * h)};
    const Mat3d turned = random.rotation();
    o.X_WG = make_pose<double>(turned, random.unit());  // proxies live in G: must not matter
    const auto grid = rasterise<std::int16_t>(HalfSpace{o.middle(), n}, o);
    const auto field = field_of<Scalar, typename Of::Gradient>(grid, o);
    for (const double depth : {4.0, 16.0}) {
      SurfaceProxy<Scalar> proxy;
      const Vec3d p = o.middle() - depth * h * n;
      CHECK(lead(proxy, field, o.middle() + 4 * h * n + 3 * h * n.unitOrthogonal(), p, 0.3 * h) == Status::kOk);
      CHECK(rest(proxy, field, p, 100) == Status::kOk);
      REQUIRE(proxy.in_contact());
      error.take(proxy.position().template cast<double>() - p, depth * h * n);
    }
  }
  MESSAGE("1:1:3: force ", error.magnitude(), ", direction median ", error.median(), " worst ", error.worst(), " deg");
  CHECK(error.magnitude() <= 0.0018);
  CHECK(error.median() <= kMedianDirection<Of>);
  CHECK(error.worst() <= kWorstDirection<Of>);
}

TEST_CASE_TEMPLATE("no force outside, and let go when the straight path is free", Scalar, float, double) {
  const double h = kVoxel;
  const RasterOptions o{.size = {48, 48, 48}};
  const auto grid = rasterise<std::uint8_t>(Ball{o.middle(), 8 * h}, o);
  const auto field = field_of<Scalar>(grid, o);
  const Vec3d top = o.middle() + 12 * h * Vec3d::UnitZ();
  SurfaceProxy<Scalar> proxy;
  CHECK_FALSE(proxy.in_contact());
  CHECK(lead(proxy, field, top, top + 4 * h * Vec3d::UnitX(), 0.1 * h) == Status::kOk);
  CHECK_FALSE(proxy.in_contact());
  CHECK(lead(proxy, field, top, o.middle() + 4 * h * Vec3d::UnitZ(), 0.1 * h) == Status::kOk);
  CHECK(proxy.in_contact());
  // Back out: gone within a tick of the probe's leaving the bone.
  CHECK(lead(proxy, field, o.middle() + 4 * h * Vec3d::UnitZ(), o.middle() + 8.2 * h * Vec3d::UnitZ(), 0.1 * h) ==
        Status::kOk);
  CHECK_FALSE(proxy.in_contact());
  CHECK(proxy.position() == (o.middle() + 8.2 * h * Vec3d::UnitZ()).template cast<Scalar>());
  proxy.reset();
  CHECK_FALSE(proxy.in_contact());
}

TEST_CASE_TEMPLATE("a slow approach is never taken for a start in bone", Scalar, float, double) {
  // Probes that land within rounding of the surface.
  const double h = kVoxel;
  Random random(24);
  const ShapeField<Scalar, HalfSpace> field({Vec3d(0, 0, 0.0013), Vec3d::UnitZ()}, h);
  int wrong = 0;
  for (int i = 0; i < 5000; ++i) {
    SurfaceProxy<Scalar> proxy;
    Vec3<Scalar> p(Scalar(0.01), Scalar(-0.02), static_cast<Scalar>(0.0013 + random.uniform(5, 15) * h));
    wrong += proxy.follow(field, p) != Status::kOk;
    p.z() = static_cast<Scalar>(0.0013);
    for (int n = random.below(5) - 2; n != 0; n += n < 0 ? 1 : -1)
      p.z() = std::nextafter(p.z(), n < 0 ? Scalar(-1) : Scalar(1));
    wrong += proxy.follow(field, p) != Status::kOk;
    for (int k = 0; k < 4; ++k) {
      p.z() = std::nextafter(p.z(), Scalar(-1));
      wrong += proxy.follow(field, p) != Status::kOk;
    }
  }
  CHECK(wrong == 0);
}

TEST_CASE_TEMPLATE("start inside and jumps are said, and the next ticks are right", Scalar, float, double) {
  const double h = kVoxel;
  const RasterOptions o{.size = {64, 64, 64}};
  const Vec3d n = Vec3d(0.2, -0.3, 1).normalized();
  const auto grid = rasterise<std::uint8_t>(HalfSpace{o.middle(), n}, o);
  const auto field = field_of<Scalar>(grid, o);
  for (const double depth : {0.3, 2.0, 6.0, 15.0}) {
    CAPTURE(depth);
    SurfaceProxy<Scalar> proxy;
    const Vec3d p = o.middle() - depth * h * n;
    CHECK(rest(proxy, field, p, 1) == Status::kStartedInside);
    CHECK(rest(proxy, field, p, 1) == Status::kOk);
    CHECK(rest(proxy, field, p, 100) == Status::kOk);
    REQUIRE(proxy.in_contact());
    const Vec3d e = proxy.position().template cast<double>() - p;
    CHECK(e.norm() == near(depth * h, 4e-3));
    CHECK(angle_deg(e, n) < 3);
  }
  // Deeper than the way out is looked for: no contact, no force, and said so at every tick.
  {
    const RasterOptions block{.size = {200, 200, 100}};
    const VoxelGrid<std::uint8_t> wide({.size = block.size, .spacing = block.spacing, .outside = 0.0},
                                       std::vector<std::uint8_t>(200 * 200 * 100, 255));
    const auto deep = field_of<Scalar>(wide, block);
    SurfaceProxy<Scalar> proxy;
    CHECK(rest(proxy, deep, Vec3d(100, 100, 50) * h, 1) == Status::kStartedInside);
    CHECK(rest(proxy, deep, Vec3d(100, 100, 50) * h, 1) == Status::kStartedInside);
    CHECK_FALSE(proxy.in_contact());
    CHECK(rest(proxy, deep, Vec3d(100, 100, 51) * h, 1) == Status::kStartedInside);
    // Near enough to a surface it is pushed out.
    CHECK(lead(proxy, deep, Vec3d(100, 100, 51) * h, Vec3d(100, 100, 80) * h, 2 * h) == Status::kStartedInside);
    CHECK(proxy.in_contact());
    CHECK(rest(proxy, deep, Vec3d(100, 100, 80) * h, 1) == Status::kOk);
  }
  // Jumps, in, out and across.
  const double far = 300 * h;
  const Vec3d free = o.middle() + far * n;
  SurfaceProxy<Scalar> proxy;
  CHECK(rest(proxy, field, free, 1) == Status::kOk);
  CHECK(rest(proxy, field, o.middle() - 3 * h * n, 1) == Status::kJump);
  CHECK(rest(proxy, field, o.middle() - 3 * h * n, 60) == Status::kOk);
  CHECK((proxy.position().template cast<double>() - o.middle()).norm() < 0.15 * h);
  CHECK(rest(proxy, field, free, 1) == Status::kJump);
  CHECK_FALSE(proxy.in_contact());
  CHECK(rest(proxy, field, free, 1) == Status::kOk);
}

TEST_CASE_TEMPLATE("bone carved away under the proxy drops it onto what is left", Scalar, float, double) {
  const double h = kVoxel;
  const RasterOptions o{.size = {48, 48, 48}};
  auto grid = rasterise<std::uint8_t>(HalfSpace{o.middle(), Vec3d::UnitZ()}, o);
  const auto field = field_of<Scalar>(grid, o);
  const Vec3d p = o.middle() - 12 * h * Vec3d::UnitZ();
  for (const bool rough : {false, true}) {
    SurfaceProxy<Scalar, Coulomb> proxy(ProxyOptions{}, rough ? Coulomb(0.5, 0.4) : Coulomb(0, 0));
    CHECK(lead(proxy, field, o.middle() + 3 * h * Vec3d::UnitZ(), p, 0.2 * h) == Status::kOk);
    double surface = o.middle().z();
    for (int round = 0; round < 4; ++round) {
      surface -= 2.3 * h;
      for (int k = 0; k < 48; ++k) {
        const double d = k * h - surface;
        const auto level = static_cast<std::uint8_t>(std::lround(255 * 0.5 * std::erfc(d / (h * std::sqrt(2.0)))));
        for (int j = 0; j < 48; ++j) grid.lower_row(j, k, 0, 47, [&](int, std::uint8_t) { return level; });
      }
      grid.commit();
      CHECK(rest(proxy, field, p, 1) == Status::kOk);
      REQUIRE(proxy.in_contact());
      CHECK(std::abs(static_cast<double>(proxy.position().z()) - surface) < 0.05 * h);
      CHECK(restlessness(proxy, field, p, 50) <= kStandsStill);
    }
    // All of it gone: let go.
    for (int k = 0; k < 48; ++k)
      for (int j = 0; j < 48; ++j) grid.lower_row(j, k, 0, 47, [&](int, std::uint8_t) { return std::uint8_t{0}; });
    grid.commit();
    CHECK(rest(proxy, field, p, 1) == Status::kOk);
    CHECK_FALSE(proxy.in_contact());
    // Restored round the free proxy: it is in bone now, and that is said.
    grid.restore();
    CHECK(rest(proxy, field, p, 1) == Status::kStartedInside);
    CHECK(proxy.in_contact());
    CHECK(rest(proxy, field, p, 1) == Status::kOk);
  }
}

TEST_CASE_TEMPLATE("bone restored over a proxy in contact pushes it out again", Scalar, float, double) {
  const double h = kVoxel;
  const RasterOptions o{.size = {48, 48, 48}};
  auto grid = rasterise<std::uint8_t>(HalfSpace{o.middle(), Vec3d::UnitZ()}, o);
  const auto field = field_of<Scalar>(grid, o);
  const Vec3d p = o.middle() - 12 * h * Vec3d::UnitZ();
  for (int k = 0; k < 48; ++k)
    for (int j = 0; j < 48; ++j)
      if (k * h > o.middle().z() - 6 * h)
        grid.lower_row(j, k, 0, 47, [&](int, std::uint8_t) { return std::uint8_t{0}; });
  grid.commit();
  SurfaceProxy<Scalar> proxy;
  CHECK(lead(proxy, field, o.middle() + 3 * h * Vec3d::UnitZ(), p, 0.2 * h) == Status::kOk);
  CHECK(std::abs(static_cast<double>(proxy.position().z()) - (o.middle().z() - 6 * h)) < 4e-4 * h);
  grid.restore();
  CHECK_NOTHROW(static_cast<void>(rest(proxy, field, p, 1)));
  REQUIRE(proxy.in_contact());
  CHECK(std::abs(static_cast<double>(proxy.position().z()) - o.middle().z()) < 1.8e-4 * h);
}

TEST_CASE("proxy options outside their range are refused") {
  const auto make = [](const ProxyOptions& o) { SurfaceProxy<float> proxy(o); };
  CHECK_NOTHROW(make({}));
  CHECK_THROWS_WITH(make({.step = 0}), "trephine::ProxyOptions: step must be > 0 and at most 4 voxels, got 0");
  CHECK_THROWS_WITH(make({.step = 4.5}), "trephine::ProxyOptions: step must be > 0 and at most 4 voxels, got 4.5");
  CHECK_THROWS_WITH(make({.step = std::nan("")}),
                    "trephine::ProxyOptions: step must be > 0 and at most 4 voxels, got nan");
  CHECK_THROWS_WITH(make({.iterations = 0}), "trephine::ProxyOptions: iterations must be 1 to 1000, got 0");
  CHECK_THROWS_WITH(make({.iterations = 1001}), "trephine::ProxyOptions: iterations must be 1 to 1000, got 1001");
  CHECK_THROWS_WITH(make({.path_steps = 7}), "trephine::ProxyOptions: path_steps must be 8 to 100000, got 7");
  CHECK_THROWS_WITH(make({.jump = 0}), "trephine::ProxyOptions: jump must be > 0 m, got 0");
  CHECK_THROWS_WITH(make({.jump = std::nan("")}), "trephine::ProxyOptions: jump must be > 0 m, got nan");
  CHECK_THROWS_WITH(make({.path_steps = 100001}), "trephine::ProxyOptions: path_steps must be 8 to 100000, got 100001");
}

}  // namespace
