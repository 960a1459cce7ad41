// SPDX-License-Identifier: MIT
#include "support/figures.hpp"
#include "support/near.hpp"
#include "support/profile.hpp"
#include "support/random.hpp"

#include <trephine/tool/ball_and_shaft.hpp>
#include <trephine/tool/revolved_tool.hpp>
#include <trephine/tool/rims_in_voxels.hpp>
#include <trephine/tool/shapes/barrel.hpp>
#include <trephine/tool/shapes/cylinder.hpp>
#include <trephine/tool/shapes/disc.hpp>
#include <trephine/tool/shapes/drill_bit.hpp>
#include <trephine/tool/shapes/match_head.hpp>
#include <trephine/tool/shapes/pear.hpp>
#include <trephine/tool/shapes/reamer.hpp>
#include <trephine/tool/shapes/round.hpp>
#include <trephine/tool/shapes/taper.hpp>
#include <trephine/tool/shapes/twist_drill.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 611;
constexpr Shank kShank{.radius = 0.0012, .length = 0.012};
constexpr Shank kNecked{.radius = 0.0012, .length = 0.012, .neck_radius = 0.0006, .neck_length = 0.002};

/// A tool and, from its measures alone, its radius at a height: the oracle.
struct Named {
  std::string name;
  RevolvedTool tool;
  std::function<double(double)> radius;
};

double circle(double R, double h) { return std::sqrt(std::max(0.0, R * R - h * h)); }

/// A shank above a head that ends at height `top` with radius `rho`: a shoulder of 45°, then the shank.
double above(const Shank& s, double rho, double top, double z) {
  double first = s.radius, at = z - top;
  if (s.neck_length > 0) {
    const double shoulder = std::abs(rho - s.neck_radius);
    if (at > shoulder + s.neck_length) return std::min(s.radius, s.neck_radius + at - shoulder - s.neck_length);
    first = s.neck_radius;
  }
  return rho > first ? std::max(first, rho - at) : std::min(first, rho + at);
}

/// A body whose convex rims below a height are rounded: the union of the balls of radius r in a body of these radii,
/// which begins at height `low`.
class Rounded {
 public:
  Rounded(double r, double low, double high, std::function<double(double)> sharp) : r_(r), first_(low + r) {
    for (double z = first_; z <= high; z += kStep) {
      double most = 1;
      for (int i = -kSamples; i <= kSamples; ++i) {
        const double off = r * i / kSamples;
        most = std::min(most, sharp(z + off) - circle(r, off));
      }
      centres_.push_back(most);
    }
  }
  double operator()(double z) const {
    double most = 0;
    const auto n = static_cast<std::ptrdiff_t>(centres_.size());
    const std::ptrdiff_t i0 = std::clamp<std::ptrdiff_t>(std::lround((z - r_ - first_) / kStep), 0, n - 1);
    const std::ptrdiff_t i1 = std::clamp<std::ptrdiff_t>(std::lround((z + r_ - first_) / kStep), 0, n - 1);
    for (std::ptrdiff_t i = i0; i <= i1; ++i) {
      const double off = z - first_ - static_cast<double>(i) * kStep;
      if (std::abs(off) <= r_) most = std::max(most, centres_[static_cast<std::size_t>(i)] + circle(r_, off));
    }
    return most;
  }

 private:
  static constexpr double kStep = 1e-6;
  static constexpr int kSamples = 300;
  double r_, first_;
  std::vector<double> centres_;  // largest ρ of a ball's centre, by height
};

std::vector<Named> tools() {
  std::vector<Named> all;
  const auto add = [&](std::string name, const RevolvedTool& tool, std::function<double(double)> radius) {
    all.push_back({std::move(name), tool, std::move(radius)});
  };
  const MatchHead match{.radius = 0.0015, .length = 0.0038, .shank = kShank};
  add("match head", match, [](double z) {
    return z < 0 ? circle(0.0015, z) : z < 0.0023 ? 0.0015 : above(kShank, 0.0015, 0.0023, z);
  });
  const RoundBurr round{.radius = 0.001, .shank = kNecked};
  add("round", round, [](double z) { return z < 0.0008 ? circle(0.001, z) : above(kNecked, 0.0006, 0.0008, z); });
  // The convex hull of the ball and the upper rim.
  const PearBurr pear{.radius = 0.0012, .length = 0.004, .top_radius = 0.0007, .shank = kNecked};
  add("pear", pear, [](double z) {
    double rho = circle(0.0012, z);
    if (z > 0.0028) return above(kNecked, 0.0007, 0.0028, z);
    for (double a = 0; a < 1.5; a += 1e-4) {
      const double r = 0.0012 * std::cos(a), h = 0.0012 * std::sin(a);
      if (h < z && z <= 0.0028) rho = std::max(rho, r + (0.0007 - r) * (z - h) / (0.0028 - h));
    }
    return rho;
  });
  const CylinderBurr cylinder{.radius = 0.0008, .length = 0.0045, .rim_radius = 0.0002, .shank = kShank};
  add("cylinder", cylinder, [](double z) {
    if (z < -0.0006) return 0.0006 + circle(0.0002, z + 0.0006);
    return z < 0.0037 ? 0.0008 : above(kShank, 0.0008, 0.0037, z);
  });
  const TaperBurr taper{.radius = 0.0008, .end_radius = 0.0004, .length = 0.006, .shank = kShank};
  add("taper", taper, [](double z) {
    const double c = -0.0004, top = 0.0052;
    if (z > top) return above(kShank, 0.0008, top, z);
    double rho = circle(0.0004, z - c);
    for (double a = -1.5; a < 1.5; a += 1e-4) {
      const double r = 0.0004 * std::cos(a), h = c + 0.0004 * std::sin(a);
      if (h < z) rho = std::max(rho, r + (0.0008 - r) * (z - h) / (top - h));
    }
    return rho;
  });
  const BarrelBurr barrel{
      .radius = 0.002, .end_radius = 0.0014, .length = 0.005, .rim_radius = 0.0004, .shank = kShank};
  const Rounded round_barrel(0.0004, -0.002, 0.0035, [](double z) {
    const double arc = (0.0025 * 0.0025 + 0.0006 * 0.0006) / 0.0012;
    return z < -0.002 - 1e-12 || z > 0.003 + 1e-12 ? -1.0 : 0.002 - arc + circle(arc, z - 0.0005);
  });
  const double rim_top = round_barrel(0.003 - 1e-9);
  add("barrel", barrel, [=](double z) { return z < 0.003 ? round_barrel(z) : above(kShank, rim_top, 0.003, z); });
  const DiscBurr disc{.radius = 0.005, .thickness = 0.0008, .shank = kShank};
  add("disc", disc, [](double z) { return z < -0.0042 ? 0.0046 + circle(0.0004, z + 0.0046) : 0.0012; });
  const TwistDrill drill{.radius = 0.0016, .point_angle = std::numbers::pi / 2, .length = 0.012};
  const double apex = -0.0016 + 0.0003 * (1 - std::sqrt(2.0)), on_ball = -0.0013 - 0.0003 / std::sqrt(2.0);
  const auto sharp_drill = [=](double z) {
    return z < on_ball ? circle(0.0003, z + 0.0013) : std::min(0.0016, z - apex);
  };
  const Rounded round_drill(0.0003, -0.0016, 0.002, sharp_drill);
  add("twist drill", drill, [=](double z) { return z < -0.001 || z > 0.0015 ? sharp_drill(z) : round_drill(z); });
  const Reamer reamer{.radius = 0.003, .front_radius = 0.0025, .chamfer = 0.001, .length = 0.0075, .shank = kShank};
  const auto sharp_reamer = [](double z) {
    if (z < -0.003 - 1e-12) return -1.0;
    if (z < -0.002) return 0.0015 + (z + 0.003);
    return z < 0.0045 ? 0.0025 + 0.0005 * (z + 0.002) / 0.0065 : above(kShank, 0.003, 0.0045, z);
  };
  const Rounded round_reamer(0.0004, -0.003, 0.003, sharp_reamer);
  add("reamer", reamer, [=](double z) { return z < 0.002 ? round_reamer(z) : sharp_reamer(z); });
  // A waist, which bulges inward.
  ToolOutline waist(0, -0.002);
  waist.arc_to(0.002, 0, 0, 0)
      .arc_to(0.002, 0.004, 0.0035, 0.002)
      .line_to(0.002, 0.005)
      .line_to(0.001, 0.006)
      .line_to(0.001, 0.012);
  add("waist", RevolvedTool(waist.close(), 0.005), [](double z) {
    if (z < 0) return circle(0.002, z);
    if (z < 0.004) return 0.0035 - circle(0.0025, z - 0.002);
    return z < 0.005 ? 0.002 : std::max(0.001, 0.002 - (z - 0.005));
  });
  return all;
}

struct InHalfPlane {
  double rho, z;
};

/// The outline as a polygon of the oracle's radii, both ends on the axis.
std::vector<InHalfPlane> polygon(const Named& t, double step) {
  const double low = t.tool.outline().z_low(), high = t.tool.outline().z_high();
  const int n = static_cast<int>((high - low) / step);
  std::vector<InHalfPlane> all{{0, low}};
  for (int i = 0; i <= n; ++i) {
    const double z = low + (high - low) * (i + 1e-6) / (n + 2e-6);
    all.push_back({t.radius(z), z});
  }
  all.push_back({0, high});
  return all;
}

double distance_to(const std::vector<InHalfPlane>& polygon, double rho, double z) {
  double least = std::numeric_limits<double>::max();
  for (std::size_t i = 1; i < polygon.size(); ++i) {
    const double ar = polygon[i].rho - polygon[i - 1].rho, az = polygon[i].z - polygon[i - 1].z,
                 length2 = ar * ar + az * az;
    double s = length2 > 0 ? ((rho - polygon[i - 1].rho) * ar + (z - polygon[i - 1].z) * az) / length2 : 0;
    s = std::clamp(s, 0.0, 1.0);
    least = std::min(least, std::hypot(rho - polygon[i - 1].rho - s * ar, z - polygon[i - 1].z - s * az));
  }
  return least;
}

InHalfPlane random_place(Random& random, const ToolBounds& b) {
  return {random.uniform(0, 2 * b.radius), random.uniform(b.z_low - b.radius, b.z_high + b.radius)};
}

// The oracle's polygon of steps h is off by a step of the radius over one interval: by h at most.
TEST_CASE("outlines: the distance is that of the radii that the measures say, inside and outside") {
  constexpr double kStep = 2e-6;
  Random random(kSeed);
  double worst = 0;
  for (const Named& t : tools()) {
    CAPTURE(t.name);
    const auto truth = polygon(t, kStep);
    Figures off;
    int inside = 0;
    for (int n = 0; n < 400; ++n) {
      const auto [rho, z] = random_place(random, t.tool.bounds());
      const bool in = z > truth.front().z && z < truth.back().z && rho < t.radius(z);
      inside += in;
      const double want = distance_to(truth, rho, z) * (in ? -1 : 1);
      off.add(std::abs(t.tool.outline().signed_distance(rho, z) - want));
    }
    MESSAGE(t.name, ": off by [m] ", off, ", ", inside, " of 400 inside");
    CHECK(off.worst() <= kStep);
    CHECK(inside > 20);
    worst = std::max(worst, off.worst());
  }
  documented("tool_quality", "Distance against brute force", 1e6 * worst);
}

// A distance's gradient is a unit vector and turns along the level line by the curvature.
TEST_CASE("outlines: gradients and curvatures are the distance's derivatives") {
  Random random(kSeed + 1);
  constexpr double kD = 1e-8;
  for (const Named& t : tools()) {
    CAPTURE(t.name);
    Figures unit, slope, bend;
    for (int n = 0; n < 2000; ++n) {
      const InHalfPlane at = random_place(random, t.tool.bounds());
      const double rho = at.rho, z = at.z;
      const ProfilePoint p = profile_at(t.tool, rho, z);
      const auto d = [&](double a, double b) { return t.tool.outline().signed_distance(rho + a, z + b); };
      CHECK(p.distance == near(d(0, 0), 1e-9));
      unit.add(std::abs(std::hypot(p.normal_rho, p.normal_z) - 1));
      if (rho < 2 * kD) continue;
      const double sr = (d(kD, 0) - d(-kD, 0)) / (2 * kD), sz = (d(0, kD) - d(0, -kD)) / (2 * kD);
      // Not across a medial axis or a joint, where derivatives step.
      if (std::abs(std::hypot(sr, sz) - 1) > 1e-5) continue;
      slope.add(std::hypot(sr - p.normal_rho, sz - p.normal_z));
      const double tr = -p.normal_z, tz = p.normal_rho, step = 1e-7;
      const ProfilePoint on = profile_at(t.tool, rho + step * tr, z + step * tz),
                         back = profile_at(t.tool, rho - step * tr, z - step * tz);
      const double turn = ((on.normal_rho - back.normal_rho) * tr + (on.normal_z - back.normal_z) * tz) / (2 * step);
      // Across a joint it steps.
      if (std::abs(on.curvature - back.curvature) <= 1e-3 * std::abs(p.curvature))
        bend.add(std::abs(turn - p.curvature) * 1e-3);
    }
    MESSAGE(t.name, ": gradient off by ", slope, ", curvature [1/mm] ", bend);
    CHECK(unit.worst() <= 1e-12);
    CHECK(slope.worst() <= 3.5e-8);
    CHECK(bend.count() > 1900);
    CHECK(bend.worst() <= 4.5e-4);
  }
}

TEST_CASE("outlines: single precision lanes differ from double by rounding") {
  Random random(kSeed + 2);
  for (const Named& t : tools()) {
    CAPTURE(t.name);
    Figures off;
    for (int n = 0; n < 100; ++n) {
      ProfileLanes<double> rho, z, d;
      ProfileLanes<float> rho_f, z_f, d_f;
      for (std::size_t l = 0; l < kProfileLanes; ++l) {
        const auto p = random_place(random, t.tool.bounds());
        rho[l] = rho_f[l] = static_cast<float>(p.rho);
        z[l] = z_f[l] = static_cast<float>(p.z);
      }
      t.tool.outline().distances(rho, z, d);
      t.tool.distances(rho_f, z_f, d_f);
      for (std::size_t l = 0; l < kProfileLanes; ++l) off.add(std::abs(d[l] - static_cast<double>(d_f[l])));
    }
    CHECK(off.worst() <= 4e-9);
  }
}

// Pieces beyond all points are left out: points from all over the tool leave none out.
TEST_CASE("outlines: lanes from all over a tool, from near one another and alone have the same bits") {
  Random random(kSeed + 9);
  for (const Named& t : tools()) {
    CAPTURE(t.name);
    const ToolOutline& outline = t.tool.outline();
    const ToolBounds bounds = t.tool.bounds();
    const auto height = [&](double of) { return bounds.z_low + of * (bounds.z_high - bounds.z_low); };
    for (int n = 0; n < 200; ++n) {
      ProfileLanes<double> rho, z, d, d_near, rho_near, z_near;
      for (std::size_t l = 0; l < kProfileLanes; ++l) {
        const auto p = random_place(random, bounds);
        rho[l] = p.rho;
        z[l] = l % 2 == 0 ? p.z : bounds.z_low + random.uniform(-1, 3) * bounds.radius;
      }
      // The ends take part, so that every piece is level with some lane.
      z[0] = height(-0.01);
      z[1] = height(1.01);
      outline.distances(rho, z, d);
      Profile spread, near;
      outline.profile(rho, z, spread);
      const std::size_t of = 2 + static_cast<std::size_t>(n) % (kProfileLanes - 2);
      for (std::size_t l = 0; l < kProfileLanes; ++l) {
        CHECK(outline.signed_distance(rho[l], z[l]) == d[l]);
        rho_near[l] = l == 0 ? rho[of] : rho[of] * random.uniform(0.9, 1.1);
        z_near[l] = l == 0 ? z[of] : z[of] + 1e-4 * random.uniform(-1, 1);
      }
      outline.distances(rho_near, z_near, d_near);
      outline.profile(rho_near, z_near, near);
      CHECK(d_near[0] == d[of]);
      CHECK(near.distance[0] == spread.distance[of]);
      CHECK(near.normal_rho[0] == spread.normal_rho[of]);
      CHECK(near.normal_z[0] == spread.normal_z[of]);
      CHECK(near.curvature[0] == spread.curvature[of]);
      CHECK(near.central[0] == spread.central[of]);
    }
  }
}

// Outside, ball and shaft and their outline are one body.
TEST_CASE("outlines: that of a round burr answers as BallAndShaft") {
  const Burr burr{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.012};
  ToolOutline outline(0, -burr.tip_radius);
  outline.arc_to(burr.shaft_radius, burr.shaft_emerges(), 0, 0).line_to(burr.shaft_radius, burr.shaft_length).close();
  const RevolvedTool tool(outline, burr.shaft_emerges());
  const BallAndShaft plain(burr);
  CHECK(tool.burr().tip_radius == near(burr.tip_radius));
  CHECK(tool.burr().shaft_radius == near(burr.shaft_radius));
  CHECK(tool.burr().shaft_length == burr.shaft_length);
  CHECK(tool.bounds().arm() == near(plain.bounds().arm()));
  CHECK(tool.bounds().core_radius == near(plain.bounds().core_radius));
  CHECK(tool.bounds().head_top == near(plain.bounds().head_top));
  Random random(kSeed + 3);
  for (int n = 0; n < 5000; ++n) {
    const auto [rho, z] = random_place(random, tool.bounds());
    const ProfilePoint a = profile_at(tool, rho, z), b = profile_at(plain, rho, z);
    if (b.distance < 0) continue;
    CHECK(a.distance == near(b.distance, 1e-9));
    CHECK(a.central == b.central);
    CHECK(std::abs(a.normal_rho - b.normal_rho) < 1.5e-12);
    CHECK(std::abs(a.normal_z - b.normal_z) < 1.5e-12);
    CHECK(a.curvature == near(b.curvature, 1.5e-12));
  }
}

TEST_CASE(
    "outlines: the core is as wide as it says, the head ends where it says, T's origin is a radius behind the tip") {
  for (const Named& t : tools()) {
    CAPTURE(t.name);
    const ToolBounds b = t.tool.bounds();
    CHECK(b.core_radius > 0);
    double most = 0, least = 1, head = 0;
    for (int i = 0; i <= 100000; ++i) {
      const double z = b.z_low + (b.z_high - b.z_low) * i / 100000.0, r = i % 100000 == 0 ? 0 : t.radius(z);
      most = std::max(most, r);
      if (z <= b.head_top) head = std::max(head, r);
      if (z >= b.z_low + b.core_radius && z <= b.z_high - b.core_radius) least = std::min(least, r);
    }
    CHECK(b.radius == near(most, 2.5e-9));
    CHECK(-b.z_low == near(head, 2.5e-9));
    CHECK(t.tool.burr().tip_radius == near(head, 2.5e-9));
    CHECK(least >= b.core_radius * (1 - 1e-6));
    CHECK(least <= b.core_radius * (1 + 1e-2));
    const ToolOutline cuts = t.tool.cutting_head(0).outline;
    CHECK(cuts.z_high() == near(b.head_top));
    Random random(kSeed + 4);
    for (int n = 0; n < 300; ++n) {
      const auto [rho, z] = random_place(random, b);
      const bool in = t.tool.outline().signed_distance(rho, z) < 0 && z < b.head_top;
      if (std::abs(z - b.head_top) > 1e-9) CHECK((cuts.signed_distance(rho, z) < 0) == in);
    }
  }
}

// The rounded corner of a cylinder has its middle r(√2 − 1) behind the sharp one. A chord over a cell's diagonal √3 h
// sags by 3h²/8r, of which a tool's allowance has the part of its largest radius.
TEST_CASE("outlines: sharper rims move out by what voxels lack, and flanks and ends stay") {
  const double R = 2e-3, root_half = std::sqrt(0.5);
  for (const double r : {0.1e-3, 0.5e-3, 1.2e-3})
    for (const double h : {0.05e-3, 0.2e-3, 0.5e-3}) {
      CAPTURE(r);
      CAPTURE(h);
      const ToolOutline sharper =
          with_sharper_rims(RevolvedTool(CylinderBurr{.radius = R, .length = 6e-3, .rim_radius = r}).outline(), h);
      const double lacks = std::min(3 * h * h / 8 * (1 / r - 1 / R), 0.44 * h * root_half);
      const double out = r + std::min(lacks, r * (std::sqrt(2) - 1));
      CHECK(std::abs(sharper.signed_distance(R - r + out * root_half, -R + r - out * root_half)) < 1.3e-3 * r);
    }
  Random random(kSeed + 7);
  for (const Named& t : tools()) {
    CAPTURE(t.name);
    const ToolOutline& plain = t.tool.outline();
    for (const double h : {0.1e-3, 0.3e-3, 1e-3}) {
      const ToolOutline sharper = with_sharper_rims(plain, h);
      CHECK(sharper.z_low() == plain.z_low());
      CHECK(sharper.z_high() == plain.z_high());
      CHECK(sharper.largest_radius() == plain.largest_radius());
      // Each piece begins where the last one ends. An arc's ends lie on its circle.
      const auto pieces = sharper.pieces();
      for (std::size_t i = 0; i < pieces.size(); ++i) {
        const ToolOutline::Piece& p = pieces[i];
        const double gap = i > 0 ? std::hypot(p.rho - pieces[i - 1].end_rho, p.z - pieces[i - 1].end_z) : 0.0;
        CHECK(gap < 1e-15);
        if (p.side == 0) continue;
        CHECK(std::abs(std::hypot(p.rho - p.centre_rho, p.z - p.centre_z) - p.radius) < 1e-17);
        CHECK(std::abs(std::hypot(p.end_rho - p.centre_rho, p.end_z - p.centre_z) - p.radius) < 1e-17);
      }
      double most = 0;
      for (int n = 0; n < 300; ++n) {
        const auto [rho, z] = random_place(random, t.tool.bounds());
        const double d = plain.signed_distance(rho, z), e = sharper.signed_distance(rho, z);
        most = std::max(most, d - e);
        CHECK(e <= d + 1e-12);  // the body holds the plain one
        // Nothing lies beyond the radius or the ends.
        if (rho > plain.largest_radius() || z < plain.z_low() || z > plain.z_high()) CHECK(e > 0);
      }
      CHECK(most <= 0.44 * h);
    }
    // Fine voxels need no sharper rims.
    const ToolOutline same = with_sharper_rims(plain, 1e-9);
    for (int n = 0; n < 100; ++n) {
      const auto [rho, z] = random_place(random, t.tool.bounds());
      CHECK(std::abs(same.signed_distance(rho, z) - plain.signed_distance(rho, z)) < 1e-17);
    }
  }
}

TEST_CASE("outlines: a drill's flutes guide it as wide as its hole, and no shank guides a burr") {
  for (const RevolvedTool& burr :
       {RevolvedTool(CylinderBurr{}), RevolvedTool(RoundBurr{}), RevolvedTool(DiscBurr{}), RevolvedTool(Reamer{})}) {
    CHECK(burr.cutting_head(0).guide == 0);
    CHECK(burr.cutting_head(0).with_guide(1e-3).z_high() == burr.bounds().head_top);
  }
  const TwistDrill measures{};
  const RevolvedTool drill = measures;
  const CuttingHead head = drill.cutting_head(0);
  const double top = drill.bounds().head_top;
  CHECK(head.guide == near(measures.length - top, 1e-12));
  Random random(kSeed + 7);
  for (const double height : {1e-4, 2e-3, 1.0}) {
    const ToolOutline guided = head.with_guide(height),
                      oracle = drill.outline().below(std::min(top + height, measures.length));
    CHECK(guided.z_high() == near(oracle.z_high(), 1e-12));
    CHECK(guided.is_closed());
    for (int n = 0; n < 200; ++n) {
      const double rho = random.uniform(0, 3e-3), z = random.uniform(-3e-3, oracle.z_high() + 1e-3);
      CHECK(std::abs(guided.signed_distance(rho, z) - oracle.signed_distance(rho, z)) < 1e-17);
    }
  }
}

TEST_CASE("outlines: what is no tool is refused with its reason") {
  const auto message = [](const auto& make) {
    try {
      make();
    } catch (const std::invalid_argument& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  const auto starts = [&](const auto& make, const std::string& rule) {
    const std::string got = message(make);
    CHECK_MESSAGE(got.find(rule) != std::string::npos, got, " should say ", rule);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  starts([] { ToolOutline(-1e-3, 0); }, "rho must be >= 0 m, got -0.001");
  starts([&] { ToolOutline(nan, 0); }, "rho must be >= 0 m");
  starts([] { ToolOutline(3, 0); }, "did you mean 3_mm");
  starts([&] { ToolOutline(0, nan); }, "heights must not descend");
  starts([] { ToolOutline(0, 0).line_to(1e-3, -1e-3); }, "heights must not descend");
  starts([] { ToolOutline(0, 0).line_to(1e-3, 0).close(); }, "must ascend");
  starts([] { ToolOutline(0, 0).arc_to(1e-3, 1e-3, 0, 5e-3); }, "equally far");
  starts([] { ToolOutline(1e-3, 0).arc_to(1e-3, 2e-3, 1e-3, 1e-3); }, "accepted");
  starts([] { ToolOutline(1e-3, -1e-3).arc_to(3e-3, 1e-3, 2e-3, 0); }, "one side");
  starts([] { ToolOutline(0, 0).line_to(1e-3, 1e-3).close().line_to(0, 2e-3); }, "closed");
  starts(
      [] {
        ToolOutline outline(0, 0);
        for (int i = 1; i < 40; ++i) outline.line_to(1e-3, i * 1e-3);
      },
      "at most 24 pieces");
  starts([] { RevolvedTool(ToolOutline(0, -1e-3).line_to(1e-3, 0), 0); }, "must be closed");
  starts([] { RevolvedTool(ToolOutline(0, -1e-3).line_to(1e-3, 5e-3).close(), 7e-3); }, "head_top");
  starts([] { RevolvedTool(ToolOutline(0, 0).line_to(1e-3, 5e-3).close(), 5e-3); }, "foremost point");
  for (const double bad : {0.0, -1e-3, nan, 3.0}) {
    CAPTURE(bad);
    CHECK(message([&] { (void)RevolvedTool(MatchHead{.radius = bad}); }) != "accepted");
    CHECK(message([&] { (void)RevolvedTool(PearBurr{.radius = bad}); }) != "accepted");
    CHECK(message([&] { (void)RevolvedTool(CylinderBurr{.radius = bad}); }) != "accepted");
    CHECK(message([&] { (void)RevolvedTool(TaperBurr{.radius = bad}); }) != "accepted");
    CHECK(message([&] { (void)RevolvedTool(BarrelBurr{.radius = bad}); }) != "accepted");
    CHECK(message([&] { (void)RevolvedTool(DiscBurr{.radius = bad}); }) != "accepted");
    CHECK(message([&] { (void)RevolvedTool(TwistDrill{.radius = bad}); }) != "accepted");
    CHECK(message([&] { (void)RevolvedTool(Reamer{.radius = bad}); }) != "accepted");
    CHECK(message([&] { (void)RevolvedTool(MatchHead{.shank = {.length = bad}}); }) != "accepted");
  }
  starts([] { (void)RevolvedTool(TwistDrill{.point_angle = 118}); }, "60 to 170 degrees");
}

}  // namespace
