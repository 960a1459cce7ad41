// SPDX-License-Identifier: MIT
#include "render/render_helpers.hpp"
#include "support/near.hpp"

#include <doctest/doctest.h>

namespace {

using namespace trephine;
using namespace trephine::test;

const Burr kBurr{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.020};

template <class Scalar>
using Tool = ToolDiscretization<LineCounts, Scalar>;

// Single precision of a few mN·m.
template <class Scalar>
constexpr double kRounding = std::is_same_v<Scalar, float> ? 4.5e-10 : 4e-18;

// A hole of `radius` in a flat face, and a tool whose tip is free in it `depth` below the face.
struct Hole {
  double radius = 0.002, depth = 0.004;
  Vec3d top = Vec3d(0.0144, 0.0144, 0.0120);
  [[nodiscard]] auto shape() const {
    return Both{HalfSpace{top, Vec3d::UnitZ()}, Hollow{Rod{top, Vec3d::UnitZ(), radius}}};
  }
  [[nodiscard]] Vec3d tip() const { return top - Vec3d(0, 0, depth); }
  [[nodiscard]] double rim_lean() const { return std::atan2(radius, depth); }
  [[nodiscard]] Posed leaning(double lean, double azimuth = 0) const {
    return tool_at(tip(), {std::sin(lean) * std::cos(azimuth), std::sin(lean) * std::sin(azimuth), std::cos(lean)});
  }
};

TEST_CASE_TEMPLATE("a shaft that leans on a hole's rim: torque k r² 2 sin(Δ/2) cos(Δ/2)", Scalar, float, double) {
  const Hole hole;
  const ShapeField<Scalar, decltype(hole.shape())> field(hole.shape(), kVoxel);
  const double k = 700;
  for (const double beyond : {0.02, 0.1, 0.25})
    for (const double azimuth : {0.0, 0.7, 2.9}) {
      CAPTURE(beyond);
      CAPTURE(azimuth);
      LineApproxRenderer<Scalar> renderer(Tool<Scalar>(kBurr, {.shaft = 800}), {.stiffness = k});
      lead(renderer, field, hole.leaning(0.1, azimuth), hole.leaning(hole.rim_lean() + beyond, azimuth), 60);
      Rendered<Scalar> out;
      for (int i = 0; i < 30; ++i) out = render_at(renderer, field, hole.leaning(hole.rim_lean() + beyond, azimuth));
      REQUIRE(renderer.report().shaft_contact);
      CHECK(out.status == Status::kOk);
      CHECK(out.contact.shaft);
      CHECK_FALSE(out.contact.tip);
      const double r2 = hole.radius * hole.radius + hole.depth * hole.depth;
      const double torque = k * r2 * 2 * std::sin(beyond / 2) * std::cos(beyond / 2);
      // Vertices stand .023 mm apart: the rim is met at most that much lower, by .6 % of r.
      CHECK(static_cast<double>(renderer.report().torque_Nm) == near(torque, 0.0026 + 0.0005 / beyond));
      CHECK(static_cast<double>(renderer.report().lever_m) == near(std::sqrt(r2), 0.001));
      const Vec3d rim = hole.top + hole.radius * Vec3d(std::cos(azimuth), std::sin(azimuth), 0);
      CHECK((renderer.report().intersection.template cast<double>() - rim).norm() < 0.018 * kVoxel);
      // It turns the shaft back: against the lean, about the horizontal across it.
      const Vec3d back(std::sin(azimuth), -std::cos(azimuth), 0);
      CHECK(angle_deg(out.wrench.torque.template cast<double>(), back) < 0.0018);
    }
}

TEST_CASE_TEMPLATE("the wrench is the springs'", Scalar, float, double) {
  const Hole hole;
  const RasterOptions o{.size = {96, 96, 64}};
  const auto grid = rasterise<std::uint8_t>(hole.shape(), o);
  const auto field = field_of<Scalar>(grid, o);
  const Posed end = hole.leaning(hole.rim_lean() + 0.15, 0.4);
  const LineOptions options{.stiffness = 500, .shaft_stiffness = 900};
  LineApproxRenderer<Scalar> full(Tool<Scalar>(kBurr, {}), options);
  const auto f = lead(full, field, hole.leaning(0.1, 0.4), end, 40);
  REQUIRE(full.report().shaft_contact);
  REQUIRE(full.contacts().size() == 1);
  const Vec3d force = full.contacts()[0].force.template cast<double>();
  CHECK((f.wrench.force.template cast<double>() - force).norm() == 0);
  const auto& report = full.report();
  CHECK((force - 900 * report.spring.template cast<double>()).norm() <= 100 * kRounding<Scalar>);
  // Eq. 8, 12: lever times reaction, and the moment about T of the force where the probe's shaft is pulled.
  const Vec3d r = report.intersection.template cast<double>() - hole.tip();
  const Vec3d torque = f.wrench.torque.template cast<double>();
  CHECK((torque - r.cross(force)).norm() <= kRounding<Scalar>);
  CHECK((torque - (r.norm() * end.linear().col(2)).cross(force)).norm() <= kRounding<Scalar>);
  constexpr double kShare = std::is_same_v<Scalar, float> ? 1e-7 : 1e-15;
  CHECK(static_cast<double>(report.reaction_N) == near(force.norm(), kShare));
  CHECK(static_cast<double>(report.lever_m) == near(r.norm(), kShare));
  CHECK(static_cast<double>(report.torque_Nm) == near(torque.norm(), kShare));
  CHECK(static_cast<double>(report.spring_m) ==
        near(2 * r.norm() * std::sin(0.5 * angle_deg(r, end.linear().col(2)) / degrees(1)), 6.5e-7));
}

TEST_CASE_TEMPLATE("tip and shaft both in contact: the wrench is the contacts'", Scalar, float, double) {
  // The tip presses into the floor of a hole while the shaft leans on its rim.
  const Vec3d top(0.0144, 0.0144, 0.0140);
  const auto shape = Either{Both{HalfSpace{top, Vec3d::UnitZ()}, Hollow{Rod{top, Vec3d::UnitZ(), 0.002}}},
                            HalfSpace{top - Vec3d(0, 0, 0.004), Vec3d::UnitZ()}};
  const RasterOptions o{.size = {96, 96, 64}};
  const auto grid = rasterise<std::uint8_t>(shape, o);
  const auto field = field_of<Scalar>(grid, o);
  const double lean = std::atan2(2.0, 4.0);
  const auto pose = [&](double l, double deep) {
    return tool_at(top - Vec3d(0, 0, 0.004 + deep), {std::sin(l), 0, std::cos(l)});
  };
  LineApproxRenderer<Scalar> renderer(Tool<Scalar>(kBurr, {.shaft = 200}), {.stiffness = 800});
  lead(renderer, field, pose(0.05, -0.0005), pose(0.05, 0.0005), 30);
  lead(renderer, field, pose(0.05, 0.0005), pose(lean + 0.15, 0.0005), 60);
  const Posed end = pose(lean + 0.15, 0.0005);
  const auto out = render_at(renderer, field, end);
  const LineReport<Scalar>& report = renderer.report();
  REQUIRE(report.shaft_contact);
  REQUIRE(out.contact.tip);
  CHECK(out.contact.count == 2);
  const Vec3<Scalar> e = renderer.tip_proxy().position() - Vec3<Scalar>(end.translation().template cast<Scalar>());
  CHECK(static_cast<double>(e.norm()) == near(0.0005, 0.021));
  CHECK(angle_deg(report.tip_force.template cast<double>(), Vec3d::UnitZ()) < 1e-6);
  // The moment about T of the shaft's force at IntP. The floor bears that force's vertical part, up to as much as the
  // tip's own force.
  const Wrenchd w = in_double(out.wrench);
  const Vec3d f = 800 * report.spring.template cast<double>(), tip = report.tip_force.template cast<double>();
  CHECK((w.torque - (report.intersection.template cast<double>() - end.translation()).cross(f)).norm() < 1.1e-9);
  const Vec3d up = tip.normalized();
  const double borne = std::clamp(f.dot(up), -tip.norm(), tip.norm());
  CHECK((w.force - (tip + f - borne * up)).norm() < 8.9e-8);
}

TEST_CASE_TEMPLATE("the first tick searches nothing; a shaft that starts in bone waits until it was free", Scalar,
                   float, double) {
  const Hole hole;
  const RasterOptions o{.size = {96, 96, 64}};
  const auto grid = rasterise<std::uint8_t>(hole.shape(), o);
  const auto field = field_of<Scalar>(grid, o);
  LineApproxRenderer<Scalar> renderer(Tool<Scalar>(kBurr, {}));
  const Posed in = hole.leaning(hole.rim_lean() + 0.2), out = hole.leaning(0.1);
  for (int i = 0; i < 3; ++i) {
    const auto r = render_at(renderer, field, in);
    CHECK(r.status == Status::kStartedInside);
    CHECK(r.wrench == Wrench<Scalar>{});
  }
  CHECK(lead(renderer, field, in, out, 30).status == Status::kStartedInside);
  CHECK(render_at(renderer, field, out).status == Status::kOk);
  const auto again = lead(renderer, field, out, in, 30);
  CHECK(again.status == Status::kOk);
  CHECK(again.contact.shaft);
  renderer.reset();
  CHECK(render_at(renderer, field, in).status == Status::kStartedInside);
  CHECK_FALSE(renderer.report().shaft_contact);
}

TEST_CASE_TEMPLATE("moves shorter than `rest_threshold` add up: a slow approach is not overlooked", Scalar, float,
                   double) {
  // 40 kHz and 2 mm/s: 50 nm a tick.
  const ShapeField<Scalar, HalfSpace> field({Vec3d(-0.00001, 0, 0), Vec3d::UnitX()}, kVoxel);
  const Vec3d lean = Vec3d(-0.001, 0, 1).normalized();
  LineApproxRenderer<Scalar> renderer(Tool<Scalar>(kBurr, {}));
  bool found = false;
  Status worst = Status::kOk;
  for (int i = 0; i < 1200; ++i) {
    const auto out = render_at(renderer, field, tool_at(Vec3d(0.00004 - i * 50e-9, 0, 0), lean));
    worst = worse(worst, out.status);
    found = found || renderer.report().shaft_contact;
  }
  CHECK(found);
  CHECK(worst == Status::kOk);
  // And it is then followed as slowly: the shaft's far end is now .03 mm and more in the wall.
  REQUIRE(renderer.report().shaft_contact);
  const Vec3d far = renderer.proxy_pose().template cast<double>() * Vec3d(0, 0, 0.02);
  CHECK(far.x() > -0.00001 - 2e-3 * kVoxel);
}

TEST_CASE_TEMPLATE("at rest IntP is followed, so that carved bone lets go", Scalar, float, double) {
  const Hole hole;
  const RasterOptions o{.size = {96, 96, 64}};
  auto grid = rasterise<std::uint8_t>(hole.shape(), o);
  const auto field = field_of<Scalar>(grid, o);
  LineApproxRenderer<Scalar> renderer(Tool<Scalar>(kBurr, {}));
  const Posed end = hole.leaning(hole.rim_lean() + 0.15);
  const auto before = lead(renderer, field, hole.leaning(0.1), end, 40);
  REQUIRE(renderer.report().shaft_contact);
  const auto rested = render_at(renderer, field, end);
  CHECK((rested.wrench.torque - before.wrench.torque).norm() < Scalar(2e-17));
  for (int k = 0; k < o.size[2]; ++k)
    for (int j = 0; j < o.size[1]; ++j)
      grid.lower_row(j, k, 0, o.size[0] - 1, [](int, std::uint8_t) { return std::uint8_t{0}; });
  grid.commit();
  const auto carved = render_at(renderer, field, end);
  CHECK_FALSE(renderer.report().shaft_contact);
  CHECK(carved.wrench == Wrench<Scalar>{});
}

// --- Thin ribs
// -----------------------------------------------------------------------------------------------------------

// A rib of `thick` voxels that only the shaft can meet; the tool is pushed against it sideways as a whole, and turned.
template <class Scalar>
int ticks_through(double thick, double speed, bool turning, int& ticks_held) {
  const Vec3d at(0.0096, 0.0144, 0.0072);
  const RasterOptions o{.size = {64, 96, 100}};
  // Its surface's height is bounded: above the ball, below the shaft's end.
  const auto rib = Both{
      Plate{at, Vec3d::UnitX(), thick * kVoxel},
      Both{HalfSpace{at + Vec3d(0, 0, 0.010), Vec3d::UnitZ()}, HalfSpace{at + Vec3d(0, 0, 0.006), -Vec3d::UnitZ()}}};
  const auto grid = rasterise<std::uint8_t>(rib, o);
  const auto field = field_of<Scalar>(grid, o);
  LineApproxRenderer<Scalar> renderer(Tool<Scalar>(kBurr, {.shaft = 200}));
  const double travel = 0.004;
  const int ticks = std::max(2, static_cast<int>(std::ceil(travel / (speed * 1e-3))));
  int through = 0;
  for (int i = 0; i <= ticks; ++i) {
    const double x = -0.001 + travel * i / ticks;
    const double lean = turning ? std::atan2(x, 0.008) : 0;
    const Vec3d tip = at + (turning ? Vec3d(0, 0, 0) : Vec3d(x, 0, 0));
    if (turning && std::abs(x) > 0.003) continue;
    const Posed X = tool_at(turning ? Vec3d(tip - Vec3d(0.0005, 0, 0)) : tip, {std::sin(lean), 0, std::cos(lean)});
    static_cast<void>(render_at(renderer, field, X));
    const double shaft_x = (X * Vec3d(0, 0, 0.008)).x() - at.x();
    if (shaft_x < thick * kVoxel / 2 + 0.3 * kVoxel) continue;
    ++ticks_held;
    // Where the shaft stands that touches: it must still be on the side it came from.
    const Posed proxy = renderer.proxy_pose().template cast<double>();
    const Vec3d d = proxy.linear().col(2);
    const double x_there =
        proxy.translation().x() - at.x() + d.x() / d.z() * (at.z() + 0.008 - proxy.translation().z());
    if (!renderer.report().shaft_contact || x_there > 0) ++through;
  }
  return through;
}

TEST_CASE_TEMPLATE("a shaft pushed or turned against a thin rib does not pop through", Scalar, float, double) {
  for (const bool turning : {false, true})
    for (const double thick : {2.0, 3.0})
      for (const double speed : {0.02, 0.1, 0.5, 1.0}) {
        CAPTURE(turning);
        CAPTURE(thick);
        CAPTURE(speed);
        int ticks = 0;
        CHECK(ticks_through<Scalar>(thick, speed, turning, ticks) == 0);
        CHECK(ticks > 0);
      }
}

// --- The drawn tool
// --------------------------------------------------------------------------------------------------------

TEST_CASE_TEMPLATE("the drawn ball and shaft stand on the surface", Scalar, float, double) {
  const Vec3d n = Vec3d(0.2, -0.1, 1).normalized();
  const RasterOptions o{.size = {64, 64, 64}, .image = Image::kClampedDistance};
  const auto grid = rasterise<std::uint8_t>(HalfSpace{o.middle(), n}, o);
  const auto field = field_of<Scalar>(grid, o);
  LineApproxRenderer<Scalar> renderer(Tool<Scalar>(kBurr, {}));
  const Vec3d lean = (n + 0.4 * n.unitOrthogonal()).normalized();
  const Posed end = tool_at(o.middle() - 4 * kVoxel * n, lean);
  lead(renderer, field, tool_at(o.middle() + 3 * kVoxel * n, lean), end, 60);
  const Posed drawn = renderer.visual_pose().template cast<double>();
  // Eq. 13: the ball's centre is its radius above the plane.
  CHECK((drawn.translation() - o.middle()).dot(n) == near(kBurr.tip_radius, 3.5e-4));
  CHECK(angle_deg(drawn.linear().col(2), lean) < 9e-6);
  CHECK((renderer.cutting_pose().template cast<double>().translation() - o.middle()).dot(n) < 0.1 * kVoxel);
  CHECK(renderer.cutting_pose().linear() == end.linear().template cast<Scalar>());

  // Eq. 14: the shaft across a bar, its surface tangent to the bar's.
  const Vec3d bar(0.0096, 0.0096, 0.0060);
  const double bar_radius = 0.003;
  const auto round = rasterise<std::uint8_t>(Rod{bar, Vec3d::UnitY(), bar_radius}, o);
  const auto round_field = field_of<Scalar>(round, o);
  LineApproxRenderer<Scalar> across(Tool<Scalar>(kBurr, {.shaft = 400}));
  const Vec3d tip = bar + Vec3d(-0.006, 0, 0.0015);
  const Posed laid = tool_at(tip, Vec3d(1, 0, 0.02).normalized());
  lead(across, round_field, tool_at(tip, Vec3d(1, 0, 0.7).normalized()), laid, 100);
  REQUIRE(across.report().shaft_contact);
  const Posed on_bar = across.visual_pose().template cast<double>();
  const Vec3d axis = on_bar.linear().col(2), from = on_bar.translation();
  // Distance of the two axes: the radii's sum (a shaft this short of tilt loses the cosine of a few degrees).
  const double apart = std::abs((bar - from).dot(axis.cross(Vec3d::UnitY()).normalized()));
  CHECK(apart == near(bar_radius + kBurr.shaft_radius, 0.02));
  // The proxy's own axis touches the bar.
  const Posed proxy = across.proxy_pose().template cast<double>();
  const double touching =
      std::abs((bar - proxy.translation()).dot(proxy.linear().col(2).cross(Vec3d::UnitY()).normalized()));
  CHECK(touching == near(bar_radius, 0.0046));
  CHECK((proxy.linear().transpose() * proxy.linear() - Mat3d::Identity()).norm() < 1.4e-6);
}

TEST_CASE_TEMPLATE("the drawn tool does not jump when it touches or lets go", Scalar, float, double) {
  // Pressed on a floor by the tip, leaned on a rim by the shaft, and back, in turns of each order.
  constexpr double kMax = 4;  // times the motion of the tool at its touching place: its own, twice to lead, and a slide
  const unsigned seed = 132;
  CAPTURE(seed);
  Random random(seed);
  double most = 0, at_once = 0;
  for (int c = 0; c < 12; ++c) {
    const double depth = random.uniform(0.003, 0.005), lean = std::atan2(0.002, depth) + 0.1;
    const RasterOptions o{.size = {64, 64, 56}, .contrast = 2000};
    const Vec3d aside = kVoxel * random.arrow(), top = Vec3d(0.0096, 0.0096, 0.0120) + aside;
    const auto shape = Either{Both{HalfSpace{top, Vec3d::UnitZ()}, Hollow{Rod{top, Vec3d::UnitZ(), 0.002}}},
                              HalfSpace{top - Vec3d(0, 0, depth), Vec3d::UnitZ()}};
    const auto grid = rasterise<std::int16_t>(shape, o);
    const DensityField<std::int16_t, Scalar, SplineGradient> field(grid, o.isovalue());
    const auto pose = [&](double deep, double l) {
      return tool_at(top - Vec3d(0, 0, depth + deep), {std::sin(l), 0, std::cos(l)});
    };
    const std::array way{pose(-0.001, 0.1), pose(0.001, 0.1), pose(0.001, lean), pose(-0.001, lean),
                         pose(0.001, lean), pose(0.001, 0.1), pose(-0.001, 0.1)};
    for (const double lead : {2.0, std::numeric_limits<double>::infinity()}) {
      LineApproxRenderer<Scalar> renderer(Tool<Scalar>(kBurr, {.shaft = 200}), {.drawn_rate = lead});
      static_cast<void>(render_at(renderer, field, way[0]));
      Posed drawn = renderer.visual_pose().template cast<double>(), device = way[0];
      bool tip = false, shaft = false;
      for (std::size_t leg = 1; leg < way.size(); ++leg)
        for (int i = 1; i <= 200; ++i) {
          const Posed X = between(way[leg - 1], way[leg], i / 200.0);
          const auto out = render_at(renderer, field, X);
          tip = tip || out.contact.tip;
          shaft = shaft || out.contact.shaft;
          const Posed now = renderer.visual_pose().template cast<double>();
          const auto motion = [&](const Posed& a, const Posed& b) {
            return std::max((a.translation() - b.translation()).norm(),
                            (a * Vec3d(0, 0, depth) - b * Vec3d(0, 0, depth)).norm());
          };
          double& worst = lead < 10 ? most : at_once;
          worst = std::max(worst, motion(drawn, now) / motion(device, X));
          drawn = now;
          device = X;
        }
      CHECK(tip);
      CHECK(shaft);
      CHECK((drawn.translation() - device.translation()).norm() < 1.9e-9);
    }
  }
  MESSAGE("drawn step over the tool's own: ", most, "; at once ", at_once);
  CHECK(most <= kMax);
  CHECK(at_once > 50);
}

TEST_CASE("line options outside their range are refused") {
  const auto make = [](const LineOptions& o) { LineApproxRenderer<float> renderer(Tool<float>(kBurr, {}), o); };
  CHECK_NOTHROW(make({}));
  CHECK_THROWS_WITH(make({.stiffness = 0}), "trephine::LineOptions: stiffness must be > 0 N/m, got 0");
  CHECK_THROWS_WITH(make({.stiffness = std::nan("")}), "trephine::LineOptions: stiffness must be > 0 N/m, got nan");
  CHECK_THROWS_WITH(make({.shaft_stiffness = -1.0}), "trephine::LineOptions: shaft_stiffness must be > 0 N/m, got -1");
  CHECK_THROWS_WITH(make({.drawn_rate = 0}), "trephine::LineOptions: drawn_rate must be > 0, got 0");
  CHECK_THROWS_WITH(make({.rest_threshold = -1}), "trephine::LineOptions: rest_threshold must be >= 0 m, got -1");
  CHECK_THROWS_WITH(make({.proxy = {.iterations = 0}}), "trephine::ProxyOptions: iterations must be 1 to 1000, got 0");
  const auto stepping = [] {
    LineApproxRenderer<float, RayCast> renderer(Tool<float>(kBurr, {}), {}, RayCast{.stepping = {.step = 0}});
  };
  CHECK_THROWS_WITH(stepping(), "trephine::RayCast: step must be > 0 and at most 16 voxels, got 0");
}

}  // namespace
