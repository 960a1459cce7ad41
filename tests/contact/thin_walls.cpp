// SPDX-License-Identifier: MIT
#include <trephine/contact/surface_proxy.hpp>

#include "contact/proxy_helpers.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

struct Crossings {
  int tries = 0;
  int through = 0;  ///< the proxy was on the other side, or gone, while the plate lay between it and the probe
  double deepest = 0;
};

// A probe that goes to and fro through a plate, ever faster, slanting and sliding behind it.
template <class Field>
Crossings cross(const Field& field, const RasterOptions& o, double thick, const Vec3d& n, double speed,
                Random& random) {
  using Scalar = typename Field::Scalar;
  const double h = kVoxel, dt = 1e-3;
  Crossings result;
  Status worst = Status::kOk;
  for (int run = 0; run < 10; ++run) {
    const double side = run % 2 == 0 ? 1 : -1;
    SurfaceProxy<Scalar> proxy;
    const auto within = [&](double along_n) {
      const Vec3d r = random.unit();
      return Vec3d(o.middle() + random.uniform(0, 7) * h * (r - r.dot(n) * n) + side * along_n * h * n);
    };
    Vec3d from = within(6);
    static_cast<void>(rest(proxy, field, from, 1));
    // In, behind the plate from place to place (16 voxels is the force limit of a small device), and out again.
    for (const Vec3d& to : {within(-6), within(-16), within(-3), within(-10), within(5)}) {
      const int ticks = std::max(1, static_cast<int>(std::ceil((to - from).norm() / (speed * dt))));
      for (int t = 1; t <= ticks; ++t) {
        const Vec3d p = from + (static_cast<double>(t) / ticks) * (to - from);
        worst = worse(worst, rest(proxy, field, p, 1));
        const double probe_at = side * (p - o.middle()).dot(n) / h;
        const double proxy_at = side * (proxy.position().template cast<double>() - o.middle()).dot(n) / h;
        result.deepest = std::max(result.deepest, -probe_at);
        if (probe_at > -thick / 2 - 0.5) continue;
        ++result.tries;
        if (!proxy.in_contact() || proxy_at < 0) {
          ++result.through;
          return result;
        }
      }
      from = to;
    }
    // Back in front of it: free, no force.
    CHECK_FALSE(proxy.in_contact());
  }
  CHECK(worst == Status::kOk);
  return result;
}

// A plate of one voxel that lies askew is no voxel thick everywhere in its trilinear image (in places it is a touch: 3
// of 255 levels above the isovalue), so plates here begin at one and a half.
TEST_CASE_TEMPLATE("no plate of 1.5 voxels or more is popped through at any speed", Scalar, float, double) {
  const unsigned seed = 51;
  CAPTURE(seed);
  Random random(seed);
  int tries = 0;
  for (const double thick : {1.5, 2.0, 4.0})
    for (const Image image : {Image::kCtBlur, Image::kPartialVolume}) {
      const RasterOptions o{.size = {72, 72, 72}, .image = image};
      const Vec3d n = random.unit();
      const auto grid = rasterise<std::uint8_t>(Plate{o.middle(), n, thick * kVoxel}, o);
      const auto field = field_of<Scalar>(grid, o);
      for (const double speed : {0.03, 0.3, 1.0, 2.0}) {
        CAPTURE(thick);
        CAPTURE(static_cast<int>(image));
        CAPTURE(speed);
        const Crossings c = cross(field, o, thick, n, speed, random);
        CHECK(c.through == 0);
        CHECK(c.deepest > 15);
        tries += c.tries;
      }
    }
  CHECK(tries > 10000);
}

// A plate of one voxel, blurred by half a voxel: its image is thin in places, and in some directions there are gaps.
// An image that is a tenth of a voxel thick everywhere holds, pressed and slid along from behind.
TEST_CASE("a plate of one blurred voxel holds where its image is a tenth of a voxel thick") {
  const unsigned seed = 54;
  CAPTURE(seed);
  const double h = kVoxel, width = 0.5 * h * std::sqrt(2.0);
  Random random(seed);
  const RasterOptions o{.size = {40, 40, 40}};
  int whole = 0;
  std::array<int, 3> held{};
  for (int i = 0; i < 60; ++i) {
    const Vec3d n = random.unit(), at = o.middle() + h * random.arrow(), u = n.unitOrthogonal(), v = n.cross(u);
    std::vector<std::int16_t> voxels;
    for (int z = 0; z < 40; ++z)
      for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 40; ++x) {
          const double d = (h * Vec3d(x, y, z) - at).dot(n);
          const double share = 0.5 * (std::erf((d + h / 2) / width) - std::erf((d - h / 2) / width));
          voxels.push_back(static_cast<std::int16_t>(std::lround(-1000 + 2000 * share)));
        }
    const VoxelGrid<std::int16_t> grid({.size = o.size, .spacing = o.spacing, .outside = -1000.0}, voxels);
    const DensityField<std::int16_t, float, SplineGradient> field(grid, 0);
    bool gap = false;
    for (int a = -24; a <= 24; ++a)
      for (int b = -24; b <= 24; ++b) {
        int in_bone = 0;  // places .05 voxel apart
        for (int t = -20; t <= 20; ++t)
          in_bone += field.value((at + 0.2 * h * (a * u + b * v) + 0.05 * h * t * n).cast<float>()) >= 0 ? 1 : 0;
        gap = gap || in_bone < 3;  // less than a tenth of a voxel thick: finest steps are a sixteenth
      }
    whole += gap ? 0 : 1;
    std::size_t which = 0;
    for (const double speed : {0.01, 0.1, 1.0}) {
      SurfaceProxy<float> proxy;
      const Vec3d way = 12 * h * (0.3 * u - n).normalized();
      const int ticks = static_cast<int>(std::ceil(way.norm() / (speed * 1e-3)));
      bool on = true;
      for (int t = 0; t <= ticks; ++t) {
        const Vec3d p = at + 3 * h * n + (static_cast<double>(t) / ticks) * way;
        static_cast<void>(proxy.follow(field, Vec3<float>(p.cast<float>())));
        if ((p - at).dot(n) > -1.5 * h) continue;
        on = on && proxy.in_contact() && (proxy.position().cast<double>() - at).dot(n) > -0.6 * h;
      }
      if (!gap) held[which] += on ? 1 : 0;
      ++which;
    }
  }
  CHECK(whole > 20);
  for (const int count : held) CHECK(count == whole);
}

TEST_CASE_TEMPLATE("grazing and edge-on: a plate is not entered from its rim", Scalar, float, double) {
  // Dragged along a plate of one voxel, behind it, toward its rim and round it: comes free there, not before.
  const double h = kVoxel;
  const RasterOptions o{.size = {64, 32, 40}};
  const auto half_plate = Both{Plate{o.middle(), Vec3d::UnitZ(), 2 * h}, HalfSpace{o.middle(), Vec3d::UnitX()}};
  const auto grid = rasterise<std::uint8_t>(half_plate, o);
  const auto field = field_of<Scalar>(grid, o);
  SurfaceProxy<Scalar> proxy;
  const Vec3d above = o.middle() + Vec3d(-12, 0, 5) * h, below = o.middle() + Vec3d(-12, 0, -6) * h;
  CHECK(lead(proxy, field, above, below, 0.7 * h) == Status::kOk);
  REQUIRE(proxy.in_contact());
  bool held = true;
  for (double x = -12; x < 6; x += 0.2) {
    const Vec3d p = o.middle() + Vec3d(x, 0, -6) * h;
    CHECK(rest(proxy, field, p, 1) == Status::kOk);
    if (x < -1.5) held = held && proxy.in_contact() && static_cast<double>(proxy.position().z()) > o.middle().z();
    if (x > 1.5) held = held && !proxy.in_contact();
  }
  CHECK(held);
}

// --- Bounded work
// ------------------------------------------------------------------------------------------------------

// What SurfaceProxy promises: moves of one call, and samples.
constexpr std::int64_t most_moves(const ProxyOptions& o) { return 9 * o.iterations; }
constexpr std::int64_t work_bound(const ProxyOptions& o) {
  constexpr std::int64_t kClose = 13, kPushOut = 15 * (64 + kClose);
  return 2 + 2 * (o.path_steps + kClose) + most_moves(o) * 4 * (48 + 2 * o.path_steps + kClose) + kPushOut;
}

TEST_CASE_TEMPLATE("work is bounded whatever the probe does", Scalar, float, double) {
  const double h = kVoxel;
  const unsigned seed = 53;
  CAPTURE(seed);
  Random random(seed);
  const RasterOptions o{.size = {40, 40, 40}, .image = Image::kBinary};
  // Noise with holes of all sizes: the worst place for a search.
  std::vector<std::uint8_t> noise(40 * 40 * 40);
  for (auto& v : noise) v = static_cast<std::uint8_t>(random.below(256));
  const VoxelGrid<std::uint8_t> rough({.size = o.size, .spacing = o.spacing, .outside = 0.0}, noise);
  const VoxelGrid<std::uint8_t> full({.size = o.size, .spacing = o.spacing, .outside = 255.0},
                                     std::vector<std::uint8_t>(noise.size(), 255));
  const VoxelGrid<std::uint8_t> one({.size = {1, 1, 1}, .spacing = o.spacing, .outside = 0.0},
                                    std::vector<std::uint8_t>{255});
  const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN(), inf = std::numeric_limits<Scalar>::infinity();
  std::int64_t most = 0, typical = 0, calls = 0;
  for (const auto* grid : {&rough, &full, &one}) {
    const auto base = field_of<Scalar>(*grid, o);
    const CountingField field(base);
    {
      const ProxyOptions options{.iterations = 16, .path_steps = 64, .jump = 1.0};
      SurfaceProxy<Scalar, Coulomb> proxy(options, Coulomb(0.2, 0.1));
      for (int i = 0; i < 3000; ++i) {
        Vec3<Scalar> p = (o.middle() + h * random.arrow(0, 40)).template cast<Scalar>();
        if (i % 10 == 0) p *= Scalar(1e6);
        if (i % 17 == 0) p[random.below(3)] = i % 2 == 0 ? nan : inf;
        if (i % 23 == 0) p.setConstant(std::numeric_limits<Scalar>::max());
        if (i % 29 == 0) p.setConstant(std::numeric_limits<Scalar>::denorm_min());
        field.samples = field.normals = 0;
        static_cast<void>(proxy.follow(field, p));
        most = std::max(most, field.samples);
        typical += field.samples;
        ++calls;
        CHECK(field.samples <= work_bound(options));
        CHECK(field.normals <= most_moves(options) + 3);
      }
      // Afterwards it works again.
      static_cast<void>(proxy.follow(field, Vec3<Scalar>((Vec3d(-3, -3, -3) * h).template cast<Scalar>())));
      CHECK(proxy.follow(field, Vec3<Scalar>((Vec3d(-3, -3, -3.1) * h).template cast<Scalar>())) != Status::kJump);
      CHECK(is_finite(proxy.position()));
    }
  }
  CHECK(most < 3000);
  CHECK(typical / calls < 1000);
}

TEST_CASE_TEMPLATE("an ordinary tick takes a few dozen samples", Scalar, float, double) {
  const double h = kVoxel;
  const RasterOptions o{.size = {64, 64, 64}};
  const auto grid = rasterise<std::uint8_t>(Ball{o.middle(), 20 * h}, o);
  const auto base = field_of<Scalar>(grid, o);
  const CountingField field(base);
  SurfaceProxy<Scalar> proxy;
  static_cast<void>(
      lead(proxy, field, o.middle() + 24 * h * Vec3d::UnitZ(), o.middle() + 16 * h * Vec3d::UnitZ(), 0.1 * h));
  field.samples = 0;
  std::int64_t most = 0;
  constexpr int kTicks = 1000;
  for (int i = 0; i < kTicks; ++i) {
    const double a = 0.1 * i / 16;
    const std::int64_t before = field.samples;
    static_cast<void>(rest(proxy, field, o.middle() + 16 * h * Vec3d(std::sin(a), 0, std::cos(a)), 1));
    most = std::max(most, field.samples - before);
  }
  const double mean = static_cast<double>(field.samples) / kTicks;
  MESSAGE("sliding at 30 mm/s: ", mean, " samples a tick, most ", most);
  CHECK(mean < 40);
  CHECK(most < 400);  // a few moves that had to be halved
}

}  // namespace
