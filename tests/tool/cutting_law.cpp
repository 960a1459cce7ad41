// SPDX-License-Identifier: MIT
// The cutting law, and which part of a head cuts, against closed forms and brute force.
#include "support/figures.hpp"
#include "support/near.hpp"
#include "support/random.hpp"
#include "support/revolved_tools.hpp"

#include <trephine/tool/ball_and_shaft.hpp>
#include <trephine/tool/cutting_law.hpp>
#include <trephine/tool/engagement.hpp>
#include <trephine/tool/named_tools.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr double kPi = 3.14159265358979323846;
constexpr double kR = 0.0015;

HeadElements::Numbers all(float v) {
  HeadElements::Numbers n;
  n.fill(v);
  return n;
}

/// Sums by brute force over the outline's radius at each height, which is another way than along it. It holds where the
/// outline has no level piece.
struct Surface {
  double area = 0, length = 0;  // ∫ dA, ∫ dA / ρ
};
Surface side_of(const ToolOutline& o) {
  Surface sum;
  constexpr int kSteps = 400000;
  const double low = o.z_low(), step = (o.z_high() - low) / kSteps;
  double before = o.radius_at(low + 1e-12);
  for (int i = 1; i <= kSteps; ++i) {
    const double rho = o.radius_at(std::min(low + i * step, o.z_high() - 1e-12));
    const double s = std::hypot(rho - before, step);
    sum.area += kPi * (rho + before) * s;
    sum.length += 2 * kPi * s;
    before = rho;
  }
  return sum;
}

TEST_CASE("head elements: areas and lengths of every head add up to the outline's") {
  for (const ToolOfShape& t : revolved_tools()) {
    const CuttingHead head = t.tool.cutting_head(0);
    const HeadElements e(head.outline);
    double area = 0, length = 0;
    for (std::size_t i = 0; i < HeadElements::kCount; ++i) {
      area += static_cast<double>(e.area[i]);
      length += static_cast<double>(e.length[i]);
      const double normal = std::hypot(static_cast<double>(e.normal_x[i]), static_cast<double>(e.normal_y[i]),
                                       static_cast<double>(e.normal_z[i]));
      CHECK(normal == near(1, 1.2e-7));
      // The place lies on the head.
      const double rho = std::hypot(static_cast<double>(e.x[i]), static_cast<double>(e.y[i]));
      CHECK(std::abs(head.outline.signed_distance(rho, static_cast<double>(e.z[i]))) < 3e-10);
    }
    const std::string& name = t.name;
    CAPTURE(name);
    CHECK(length == near(2 * kPi * head.outline.side_length(), 6e-8));
    // Level pieces have no height: their rings are added.
    double level = 0, level_length = 0;
    for (double z = head.outline.z_low(); z < head.outline.z_high(); z += (head.outline.z_high() - z) * 2) {
      const double rho = head.outline.radius_at(z + 1e-9);
      if (rho > 1e-5) {
        level += kPi * rho * rho;
        level_length += 2 * kPi * rho;
      }
    }
    const Surface side = side_of(head.outline);
    if (name == "disc") continue;  // its upper side is level too
    CHECK(area == near(side.area + level, 3.5e-4));
    CHECK(length == near(side.length + level_length, 4e-4));
  }
}

/// ∫ over a head's outline, of what a feed along the axis or across it cuts. The azimuth is integrated by hand.
struct Cuts {
  double area = 0, pressed = 0;  // as Engagement
};
std::pair<Cuts, Cuts> along_and_across(const ToolOutline& head) {
  constexpr int kSteps = 100000;
  const double step = head.side_length() / kSteps;
  Cuts along, across;
  for (int i = 0; i < kSteps; ++i) {
    const ToolOutline::Place p = head.place_at((i + 0.5) * step);
    const double front = std::max(0.0, -p.normal_z);
    along.area += 2 * kPi * p.rho * front * step;
    along.pressed += 2 * kPi * front * front * step;
    across.area += 2 * p.rho * p.normal_rho * step;
    across.pressed += kPi / 2 * p.normal_rho * p.normal_rho * step;
  }
  return {along, across};
}

/// One of each shape, and the largest of each named family.
std::vector<ToolOfShape> every_tool() {
  std::vector<ToolOfShape> tools = revolved_tools();
  for (const ToolFamily& family : kToolFamilies) {
    const std::string name = std::string(family.name) + "-" + std::to_string(family.most);
    tools.push_back({name, tool_by_name(name).tool});
  }
  return tools;
}

TEST_CASE("engagement: every head cuts as its outline's integrals say, along its axis and across it") {
  Figures along_area, along_pressed, across_area, across_pressed, across_any;
  for (const ToolOfShape& t : every_tool()) {
    const CuttingHead head = t.tool.cutting_head(0);
    const HeadElements elements(head.outline);
    const auto [along, across] = along_and_across(head.outline);
    CAPTURE(t.name);
    const Engagement front = engagement_of(elements, -Vec3d::UnitZ(), all(1), all(1));
    along_area.add(std::abs(front.area / along.area - 1));
    along_pressed.add(std::abs(front.pressed / along.pressed - 1));
    CHECK(along_area.all().back() < 2.5e-3);
    CHECK(along_pressed.all().back() < 1.8e-3);
    // Whatever the direction, within what four elements a band see; on the mean over directions within arcs' φ²/24.
    double area = 0, pressed = 0;
    constexpr int kDirections = 36;
    for (int i = 0; i < kDirections; ++i) {
      const double angle = 2 * kPi * i / kDirections;
      const Engagement side = engagement_of(elements, {std::cos(angle), std::sin(angle), 0}, all(1), all(1));
      area += side.area / kDirections;
      pressed += side.pressed / kDirections;
      across_any.add(std::abs(side.area / across.area - 1));
      CHECK(across_any.all().back() < 0.015);
    }
    across_area.add(std::abs(area / across.area - 1));
    across_pressed.add(std::abs(pressed / across.pressed - 1));
    CHECK(across_area.all().back() < 2.5e-3);
    CHECK(across_pressed.all().back() < 6e-4);
  }
  MESSAGE("off: along, area ", along_area, ", pressed ", along_pressed, "; across, area ", across_area, ", pressed ",
          across_pressed, "; area in any direction ", across_any);
}

/// Sums over a fine mesh of a head's outline and of angles about the axis.
Engagement brute_force(const ToolOutline& head, const Vec3d& feed) {
  constexpr int kAlong = 400, kAbout = 180;
  const double step = head.side_length() / kAlong, angle = 2 * kPi / kAbout;
  Engagement sum;
  for (int i = 0; i < kAlong; ++i) {
    const ToolOutline::Place p = head.place_at((i + 0.5) * step);
    for (int j = 0; j < kAbout; ++j) {
      const Vec3d radial{std::cos((j + 0.5) * angle), std::sin((j + 0.5) * angle), 0};
      const double facing = p.normal_rho * radial.dot(feed) + p.normal_z * feed.z();
      if (!(facing > 0)) continue;
      sum.area += facing * p.rho * angle * step;
      sum.pressed += facing * facing * angle * step;
      const Vec3d around = facing * angle * step * Vec3d::UnitZ().cross(radial);
      sum.around += around;
      sum.moment += (p.rho * radial + p.z * Vec3d::UnitZ()).cross(around);
    }
  }
  return sum;
}

TEST_CASE("engagement: every head cuts as brute force says, in any direction") {
  Random random(13);
  Figures area, pressed, around, moment;
  for (const ToolOfShape& t : every_tool()) {
    const ToolOutline head = t.tool.cutting_head(0).outline;
    const HeadElements elements(head);
    for (int n = 0; n < 12; ++n) {
      Vec3d feed = random.unit();
      feed.z() = -std::abs(feed.z());
      const Engagement truth = brute_force(head, feed), on = engagement_of(elements, feed, all(1), all(1));
      area.add(std::abs(on.area / truth.area - 1));
      pressed.add(std::abs(on.pressed / truth.pressed - 1));
      around.add((on.around - truth.around).norm() / truth.pressed);
      moment.add((on.moment - truth.moment).norm() / (truth.pressed * head.side_length()));
      CAPTURE(t.name);
      CAPTURE(feed.transpose());
      CHECK(area.all().back() < 0.015);
      CHECK(pressed.all().back() < 0.008);
      CHECK(around.all().back() < 0.027);
      CHECK(moment.all().back() < 0.015);
    }
  }
  MESSAGE("off: area ", area, ", pressed ", pressed, ", around ", around, ", moment ", moment);
}

TEST_CASE("engagement: a ball whose front half cuts has closed forms, in any direction") {
  const HeadElements ball(outline_of(Burr{.tip_radius = kR, .shaft_length = 0}));
  Random random(11);
  for (int n = 0; n < 40; ++n) {
    const Vec3d d = random.unit();
    const Engagement e = engagement_of(ball, d, all(1), all(2));
    CAPTURE(d.transpose());
    CHECK(e.area == near(kPi * kR * kR, 0.006));
    CHECK(e.hard_area == near(2 * e.area, 1e-5));
    // An element is 2 % of it, and faces the feed as a whole or not at all.
    CHECK(e.facing_area == near(2 * kPi * kR * kR, 0.09));
    // ∫ (d·n)₊² dA/ρ = R ∫∫ (d·n)₊² dθ dφ over polar and azimuth angle: (π² R / 4) (1 + d_z²).
    CHECK(e.pressed == near(2 * kPi * kPi * kR / 4 * (1 + d.z() * d.z()), 0.004));
    // ∫ (d·n)₊ t dA/ρ: of d across the axis π R along z × d, none along the axis.
    const Vec3d across = Vec3d::UnitZ().cross(d);
    CHECK((e.around - 2 * kPi * kR * across).norm() < 0.02 * kPi * kR);
    CHECK(e.moment.z() == e.hard_area);
  }
}

TEST_CASE("engagement: half of a cylinder that mills a slot") {
  // Without its flat front. Depth b, feed along x: sums by hand.
  ToolOutline tube(0, -kR);
  const double b = 0.004;
  tube.line_to(kR, -kR + 1e-9).line_to(kR, -kR + b).close();
  const HeadElements e(tube);
  HeadElements::Numbers side;
  for (std::size_t i = 0; i < HeadElements::kCount; ++i) side[i] = e.normal_z[i] < -0.5F ? 0.0F : 1.0F;
  const Engagement s = engagement_of(e, Vec3d::UnitX(), side, all(1));
  CHECK(s.area == near(2 * kR * b, 0.0085));
  CHECK(s.pressed == near(kPi / 2 * b, 7.5e-7));
  CHECK(s.around.y() == near(kPi / 2 * b, 7.5e-7));
  CHECK(std::abs(s.around.x()) < 2.5e-8 * s.around.y());
  // Half of the slot is bone: y > 0 alone. Then the pull has a part against the feed.
  for (std::size_t i = 0; i < HeadElements::kCount; ++i) side[i] = e.y[i] > 0 ? side[i] : 0.0F;
  const Engagement half = engagement_of(e, Vec3d::UnitX(), side, all(1));
  CHECK(half.area == near(kR * b, 0.021));
  CHECK(half.around.x() == near(-b / 2, 0.043));
}

TEST_CASE("head elements: a head larger by an allowance has the tool's own elements") {
  const double allowance = 5e-5;
  const RevolvedTool round = RoundBurr{.radius = kR};
  const CuttingBall ball = BallAndShaft(round.burr()).cutting_head(allowance);
  CHECK(ball.tip_radius == kR + allowance);
  const auto area = [](const ToolOutline& outline) {
    return engagement_of(HeadElements(outline), -Vec3d::UnitZ(), all(1), all(1)).area;
  };
  CHECK(area(outline_of(ball)) == near(kPi * kR * kR, 3.2e-3));
  CHECK(area(outline_of(round.cutting_head(allowance))) == near(kPi * kR * kR, 3.2e-3));
}

TEST_CASE("cutting law: the feed is the one whose thrust is the force") {
  Random random(12);
  for (int n = 0; n < 300; ++n) {
    const CuttingLaw law{.energy = random.uniform(1e8, 5e9),
                         .thrust_ratio = random.uniform(0.1, 2),
                         .edge_force = random.uniform(0, 5e4),
                         .edge_thrust = random.uniform(0, 5e4),
                         .edge_radius = random.uniform(1e-6, 5e-5)};
    Engagement on;
    on.pressed = random.uniform(1e-5, 1e-2);
    on.tip = random.uniform();
    const CuttingEdges edges{.flutes = 1 + random.below(12), .chisel = n % 2 == 0};
    const double force = std::pow(10, random.uniform(-3, 3));
    const double x = law.feed_under(force, on, edges, 0.002);
    CAPTURE(force);
    CHECK(x > 0);
    CHECK(law.thrust(x, on, edges, 0.002) == near(force, 3e-6));
  }
  CHECK(CuttingLaw{}.feed_under(1, Engagement{}, {}, 0.002) == 0);
  Engagement on;
  on.pressed = 0.01;
  CHECK(CuttingLaw{}.feed_under(0, on, {}, 0.002) == 0);
  CHECK(CuttingLaw{}.feed_under(-1, on, {}, 0.002) == 0);
  CHECK(CuttingLaw{}.feed_under(std::nan(""), on, {}, 0.002) == 0);
}

TEST_CASE("cutting law: thin chips take energy in proportion, thick ones u and the whole edge") {
  const CuttingLaw law;
  Engagement on;
  on.pressed = 0.005;
  const CuttingEdges edges{.flutes = 6};
  const double thin = 1e-12, thick = 1e-3;
  CHECK(law.thrust(2 * thin, on, edges, 0) == near(2 * law.thrust(thin, on, edges, 0), 1.3e-7));
  CHECK(law.edges_around(thin, edges) == near(law.edge_force * thin / law.edge_radius, 1.6e-7));
  CHECK(law.edges_around(thick, edges) == near(law.edge_force * 6 / (2 * kPi), 1e-6));
}

/// Thrust and torque of a whole head that is fed along its axis at `speed` [m/s].
struct Forces {
  double thrust, torque;
};
Forces forces_of(const CuttingLaw& law, const Engagement& on, const CuttingEdges& edges, double radius, double speed,
                 double spindle) {
  const double x = speed / spindle;
  return {law.thrust(x, on, edges, radius), (law.energy * x + law.edges_around(x, edges)) * on.hard_area};
}
/// d ln f / d ln a, by central differences of a fifth.
template <class F>
double exponent(F&& f, double a) {
  return std::log(f(1.2 * a) / f(a / 1.2)) / std::log(1.44);
}

TEST_CASE("cutting law: signs and exponents of feed, spindle, teeth, size, density and depth") {
  const CuttingLaw law;
  const RevolvedTool drill = tool_by_name("twist-3.2").tool;
  const CuttingEdges edges = tool_by_name("twist-3.2").edges;
  const double R = drill.burr().tip_radius, spindle = 2 * kPi * 1000 / 60;
  const Engagement on = engagement_of(HeadElements(drill.cutting_head(0).outline), -Vec3d::UnitZ(), all(1), all(1));
  const auto at = [&](double speed, double turns, int flutes) {
    return forces_of(law, on, {.flutes = flutes, .chisel = edges.chisel}, R, speed, turns);
  };
  // Feed: thin chips take force in proportion, thick ones less, since the edge's own force is whole.
  const auto by_feed = [&](double v) { return at(v, spindle, 2).thrust; };
  const auto torque_by_feed = [&](double v) { return at(v, spindle, 2).torque; };
  CHECK(exponent(by_feed, 1e-8) == near(1, 4.2e-5));
  CHECK(exponent(torque_by_feed, 1e-8) == near(1, 3e-5));
  for (const double v : {2e-4, 2e-3, 2e-2}) {
    CHECK(exponent(by_feed, v) > 0);
    CHECK(exponent(by_feed, v) < 1);
    CHECK(exponent(torque_by_feed, v) > 0);
    CHECK(exponent(torque_by_feed, v) < 1);
    // A law's own torque is that sum.
    CHECK(law.torque(v / spindle, on, {.flutes = 2}) == near(at(v, spindle, 2).torque, 1e-12));
    // Spindle: the chip is feed by turn, so the exponent is the feed's with the other sign.
    CHECK(exponent([&](double w) { return at(v, w, 2).thrust; }, spindle) == near(-exponent(by_feed, v)));
    // Teeth: thinner chips, and each has an edge.
    CHECK(at(v, spindle, 3).torque > at(v, spindle, 2).torque);
    CHECK(at(v, spindle, 3).torque < 1.5 * at(v, spindle, 2).torque);
  }
  // MacAvelia et al. 2012: from 1000 to 1500 rpm thrust falls to 0.89, torque to 0.75.
  CHECK(exponent([&](double w) { return at(2e-3, w, 2).thrust; }, 1.2 * spindle) ==
        near(std::log(176.0 / 198) / std::log(1.5), 0.3));
  CHECK(exponent([&](double w) { return at(2e-3, w, 2).torque; }, 1.2 * spindle) ==
        near(std::log(140.0 / 186) / std::log(1.5), 0.2));

  // Size: a burr of twice the radius has twice the edge, at twice the lever.
  const auto ball = [&](double radius) {
    const HeadElements head(outline_of(Burr{.tip_radius = radius, .shaft_length = 0}));
    return forces_of(law, engagement_of(head, -Vec3d::UnitZ(), all(1), all(1)), {}, radius, 1e-3, 3000);
  };
  CHECK(exponent([&](double r) { return ball(r).thrust; }, kR) == near(1, 2e-7));
  CHECK(exponent([&](double r) { return ball(r).torque; }, kR) == near(2, 2e-7));

  // Density: both with its square.
  const BoneStrength strength{.soft = 0, .cortical = 1700};
  const auto by_density = [&](double density) {
    const auto s = static_cast<float>(strength(density));
    const HeadElements head(outline_of(Burr{.tip_radius = kR, .shaft_length = 0}));
    return forces_of(law, engagement_of(head, -Vec3d::UnitZ(), all(1), all(s)), {}, kR, 1e-3, 3000);
  };
  CHECK(exponent([&](double d) { return by_density(d).thrust; }, 1200) == near(2, 1e-8));
  CHECK(exponent([&](double d) { return by_density(d).torque; }, 1200) == near(2, 2e-7));

  // Depth of a ball that mills along x: the torque is that of the segment's area, 4/3 √(2R) a^1.5 at small depths a.
  const auto by_depth = [&](double a) {
    const HeadElements head(outline_of(Burr{.tip_radius = kR, .shaft_length = 0}));
    HeadElements::Numbers engaged{};
    for (std::size_t i = 0; i < HeadElements::kCount; ++i) engaged[i] = head.z[i] < a - kR ? 1.0F : 0.0F;
    return forces_of(law, engagement_of(head, Vec3d::UnitX(), engaged, all(1)), {}, kR, 4e-3, 3000);
  };
  const auto segment = [&](double a) {
    return kR * kR * std::acos(1 - a / kR) - (kR - a) * std::sqrt(2 * kR * a - a * a);
  };
  for (const double a : {0.3 * kR, 0.6 * kR, kR})
    CHECK(by_depth(a).torque / by_depth(2 * kR).torque == near(segment(a) / (kPi * kR * kR), 0.1));
  CHECK(by_depth(0.6 * kR).thrust > by_depth(0.3 * kR).thrust);
}

TEST_CASE("cutting law: grains press by their ratio, whatever they cut") {
  Random random(54);
  const CuttingLaw law;
  const CuttingEdges grains = tool_by_name("diamond-4").edges;
  for (int n = 0; n < 200; ++n) {
    // One element of a head: its force along the way is u h + K by edge and length, which `most_pull` sums.
    Engagement on;
    on.pressed = on.edge = random.uniform(1e-4, 1e-2);
    const double x = std::pow(10, random.uniform(-9, -3));
    CHECK(law.thrust(x, on, grains, 0.002) == near(law.grain_thrust * law.most_pull(x, on, grains), 1e-12));
    CHECK(law.feed_under(law.thrust(x, on, grains, 0.002), on, grains, 0.002) == near(x, 3e-5));
  }
}

TEST_CASE("cutting law: a worn edge's own forces grow by its wear, and chips take what they took") {
  const CuttingLaw law;
  Engagement on;
  on.pressed = on.edge = 0.004;
  on.hard_area = 1e-5;
  for (const CuttingEdges sharp : {CuttingEdges{.flutes = 6}, CuttingEdges{.kind = CuttingEdges::Kind::kDiamond}}) {
    CuttingEdges worn = sharp;
    worn.wear = 0.7;
    for (const double x : {1e-9, 1e-6, 1e-3}) {
      CHECK(law.edges_around(x, worn) == near(1.7 * law.edges_around(x, sharp), 1e-12));
      CuttingLaw rubbing = law;
      rubbing.edge_force *= 1.7, rubbing.edge_thrust *= 1.7;
      CHECK(law.thrust(x, on, worn, 0.002) == near(rubbing.thrust(x, on, sharp, 0.002), 1e-12));
      CHECK(law.torque(x, on, worn) > law.torque(x, on, sharp));
    }
    CHECK(law.feed_under(5, on, worn, 0.002) < law.feed_under(5, on, sharp, 0.002));
  }
}

TEST_CASE("cutting law: bone's strength grows with the square of its density") {
  const BoneStrength s{.soft = 0, .cortical = 1700};
  CHECK(s(1700) == near(1));
  CHECK(s(850) == near(0.25));
  CHECK(s(-1000) == 0);
  CHECK(s(30000) == 4);
}

TEST_CASE("cutting law: what is out of range is refused") {
  CHECK_NOTHROW(CuttingLaw{}.validate());
  CHECK_THROWS_AS((CuttingLaw{.energy = 0}.validate()), std::invalid_argument);
  CHECK_THROWS_AS((CuttingLaw{.edge_radius = 0}.validate()), std::invalid_argument);
  CHECK_THROWS_AS((CuttingLaw{.edge_force = -1}.validate()), std::invalid_argument);
  CHECK_THROWS_AS((CuttingLaw{.thrust_ratio = 0, .edge_thrust = 0}.validate()), std::invalid_argument);
  CHECK_THROWS_AS((CuttingLaw{.chisel = std::nan("")}.validate()), std::invalid_argument);
  CHECK_THROWS_AS((BoneStrength{.soft = 100, .cortical = 100}.validate()), std::invalid_argument);
  CHECK_THROWS_AS((CuttingEdges{.flutes = 0}.validate()), std::invalid_argument);
  CHECK_THROWS_AS((CuttingLaw{.grain_thrust = 0}.validate()), std::invalid_argument);
  CHECK_THROWS_AS((CuttingEdges{.wear = -0.1}.validate()), std::invalid_argument);
  CHECK_THROWS_AS((CuttingEdges{.wear = std::nan("")}.validate()), std::invalid_argument);
  CHECK_NOTHROW((CuttingEdges{.kind = CuttingEdges::Kind::kDiamond, .flutes = 0}.validate()));
}

}  // namespace
