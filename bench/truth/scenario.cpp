// SPDX-License-Identifier: MIT
#include "truth/scenario.hpp"

#include "support/exact_line.hpp"
#include "support/poses.hpp"
#include "support/raster.hpp"

#include <numbers>
#include <stdexcept>

namespace trephine::bench {
namespace {

using test::Ball;
using test::between;
using test::Block;
using test::Both;
using test::Either;
using test::HalfSpace;
using test::Hollow;
using test::Plate;
using test::Random;
using test::Rod;
using test::tool_at;

constexpr double kVoxel = 3e-4;
constexpr int kTicks = 16;

const Vec3d kMiddle = Vec3d::Constant(kSide / 2);

// From a over b to c at even speed.
[[nodiscard]] std::vector<Posed> path(const Posed& a, const Posed& b, const Posed& c) {
  std::vector<Posed> poses;
  for (int i = 0; i < kTicks / 2; ++i) poses.push_back(between(a, b, static_cast<double>(i) / (kTicks / 2)));
  for (int i = 0; i <= kTicks / 2; ++i) poses.push_back(between(b, c, static_cast<double>(i) / (kTicks / 2)));
  return poses;
}

// A direction within `cone` of n.
[[nodiscard]] Vec3d near(const Vec3d& n, double cone, Random& random) {
  const Vec3d u = n.unitOrthogonal(), v = n.cross(u);
  const double angle = cone * std::sqrt(random.uniform()), phi = random.uniform(0, 2 * std::numbers::pi);
  return (std::cos(angle) * n + std::sin(angle) * (std::cos(phi) * u + std::sin(phi) * v)).normalized();
}

/// Anywhere in the middle's voxel, turned any way.
[[nodiscard]] Posed random_frame(Random& random) {
  const Vec3d offset{random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5)};
  return make_pose<double>(random.rotation(), kMiddle + kVoxel * offset);
}

/// A surface that a tip can be pressed on: where, and which way is out.
struct Spot {
  Vec3d point, normal;
};

// --- Tips -----------------------------------------------------------------------------------------------------------

/// How deep a tip is pressed [radii], how far from the normal the shaft may lean [rad], whether Line has an exact
/// answer.
struct TipOptions {
  double least = 1.0 / 6, most = 0.8, cone = 0.9;
  bool line = true;
};

/// Presses the ball (Surface) or the point (Line) on `to`, by way of `from`, both spots of one smooth face.
void add_tip(Scenario& s, std::size_t bone, const Spot& from, const Spot& to, const TipOptions& o, Random& random) {
  const double R = s.burr.tip_radius;
  const Shape& shape = s.bones[bone];
  for (int attempt = 0; attempt < 50; ++attempt) {
    Case c;
    c.bone = bone;
    c.deepest = -to.normal;
    c.depth = random.uniform(o.least, o.most) * R;
    const Vec3d axis = near(to.normal, o.cone, random);
    const double spin = random.uniform(0, 2 * std::numbers::pi);
    const auto pose = [&](const Spot& spot, double above) {
      return tool_at(spot.point + above * spot.normal, axis, spin);
    };
    c.surface_path = path(pose(from, R + 0.3 * R), pose(from, R - c.depth), pose(to, R - c.depth));
    c.surface = {to.point, to.normal};
    const Posed& last = c.surface_path.back();
    // The ball's centre and the shaft stay out of bone: contact of the vertices alone.
    if (!(shape(last.translation()) > 0)) continue;
    bool free = true;
    for (int i = 0; i <= 400 && free; ++i)
      free = test::ring_depth(shape, last,
                              s.burr.shaft_emerges() + 1e-5 + (s.burr.shaft_length - s.burr.shaft_emerges()) * i / 400,
                              s.burr.shaft_radius) < -2.5 * kVoxel;
    if (!free) continue;
    c.ball = ball_integral(shape, last, R, c.deepest, s.smooth ? 96 : 768);
    if (o.line) {
      c.line_path = path(pose(from, 0.3 * R), pose(from, -c.depth), pose(to, -c.depth));
      c.line = c.surface;
      c.line_contact = to.point;
      c.line_truth.force = c.depth * to.normal;
    }
    s.cases.push_back(std::move(c));
    return;
  }
  throw std::logic_error("no place for a tip in scenario " + s.name);
}

/// A shape in a frame whose z is out of the bone and whose origin is where the tool touches, and places on it.
struct TipShape {
  Shape shape;
  std::function<Spot(Random&)> spot;
  TipOptions options{};
};

[[nodiscard]] TipShape tip_shape(const std::string& name) {
  constexpr double kReach = 0.0005;  // from the origin to spots on flat or straight shapes [m]
  const Vec3d origin = Vec3d::Zero(), across = Vec3d::UnitX(), along = Vec3d::UnitY(), up = Vec3d::UnitZ();
  const auto flat = [=](Random& r) {
    const double y = r.uniform(-kReach, kReach), x = r.uniform(-kReach, kReach);
    return Spot{Vec3d(x, y, 0), up};
  };
  if (name == "plane") return {HalfSpace{origin, up}, flat};
  if (name == "plate") return {Plate{-0.0006 * up, up, 0.0012}, flat};
  if (name == "sphere") {
    const double radius = 0.0048;
    const Vec3d centre = -radius * up;
    return {Ball{centre, radius}, [=](Random& r) {
              const Vec3d n = near(up, 0.1, r);
              return Spot{centre + radius * n, n};
            }};
  }
  if (name == "socket") {
    const double radius = 0.003;
    const Vec3d centre = radius * up;
    const auto spot = [=](Random& r) {
      const Vec3d n = -near(-up, 0.3, r);
      return Spot{centre - radius * n, n};
    };
    return {Both{HalfSpace{centre, up}, Hollow{Ball{centre, radius}}}, spot, {.cone = 0.1}};
  }
  if (name == "cylinder" || name == "ridge") {
    const bool ridge = name == "ridge";
    const double radius = ridge ? 0.0015 : 0.0048;
    const Vec3d centre = -radius * up;
    // A ridge is the round rim of a wall.
    const Rod rod{centre, along, radius};
    const Both wall{Plate{centre, across, 2 * radius}, HalfSpace{centre, up}};
    const auto spot = [=](Random& r) {
      const double lean = r.uniform(-0.1, 0.1);
      const Vec3d n = std::cos(lean) * up + std::sin(lean) * across;
      return Spot{centre + radius * n + r.uniform(-kReach, kReach) * along, n};
    };
    // A point deeper than half the radius of what it presses on has no clear way out.
    return {ridge ? Shape(Either{rod, wall}) : Shape(rod), spot, {.most = ridge ? 0.5 : 0.8}};
  }
  if (name == "box_edge" || name == "box_corner") {
    // The block's edge along y or its corner points along z.
    const bool corner = name == "box_corner";
    const Vec3d diagonal = Vec3d(1, corner ? 1 : 0, 1).normalized();
    const Mat3d R = rotation_between<double>(diagonal, up);
    const Vec3d half(0.004, corner ? 0.004 : 0.02, 0.004), reach(half.x(), corner ? half.y() : 0, half.z());
    const auto spot = [=](Random& r) { return Spot{(corner ? 0.0 : r.uniform(-kReach, kReach)) * R * along, up}; };
    return {test::Moved{Block{-reach, half}, make_pose<double>(R, origin)}, spot, {.most = 0.6, .line = false}};
  }
  if (name == "slot") {
    // Narrower than the ball, which rests on both edges; a spot is where its lowest place would be.
    const auto spot = [=](Random& r) { return Spot{r.uniform(-kReach, kReach) * along, up}; };
    const TipOptions options{.least = 0.35, .most = 0.75, .line = false};
    return {Both{HalfSpace{origin, up}, Hollow{Plate{origin, across, 0.0016}}}, spot, options};
  }
  throw std::invalid_argument("no scenario is called " + name);
}

void make_tips(Scenario& s, int bones, int per_bone, Random& random) {
  const TipShape tip = tip_shape(s.name);
  for (int b = 0; b < bones; ++b) {
    const Posed X = random_frame(random);
    s.bones.emplace_back(test::Moved{tip.shape, X});
    const auto spot = [&] {
      const Spot local = tip.spot(random);
      return Spot{X * local.point, X.linear() * local.normal};
    };
    for (int i = 0; i < per_bone; ++i) {
      const Spot from = spot(), to = spot();
      add_tip(s, s.bones.size() - 1, from, to, tip.options, random);
    }
  }
}

// --- Shafts ---------------------------------------------------------------------------------------------------------

/// A shaft led from `free` to `pressed` and on to `aside`, its tip resting in the open at `tip`. `normal`: out of the
/// bone where it touches. Depth is that of the shaft's side (Surface) or centreline (Line).
struct ShaftLay {
  Vec3d tip;
  Vec3d free, touching, aside;  ///< directions: clear of the bone; the centreline just touching; the same further along
  Vec3d towards;                ///< where more pressure turns it (adds to the direction)
  double most_lean = 0.1;  ///< of Line's centreline beyond touching [rad]; past a thin bone's middle the nearest way
                           ///< out is on its other side
};

void add_shaft(Scenario& s, std::size_t bone, const ShaftLay& lay, Random& random) {
  const Shape& shape = s.bones[bone];
  const double r = s.burr.shaft_radius;
  Case c;
  c.bone = bone;
  const double spin = random.uniform(0, 2 * std::numbers::pi);
  const auto pose = [&](const Vec3d& d) { return tool_at(lay.tip, d.normalized(), spin); };
  const auto pressed = [&](const Vec3d& d, double by) { return pose(d.normalized() + by * lay.towards); };
  // Surface: by how much to turn so that the side is `depth` in.
  const auto turn_for = [&](const Vec3d& d, double depth) {
    double lo = -0.6, hi = 0.2;
    for (int i = 0; i < 50; ++i) {
      const double mid = 0.5 * (lo + hi);
      const Posed X = pressed(d, mid);
      (test::deepest_on_shaft(shape, X, s.burr).depth > depth ? hi : lo) = mid;
    }
    return 0.5 * (lo + hi);
  };
  c.depth = random.uniform(1.0 / 6, 0.8) * r;
  c.surface_path = path(pose(lay.free), pressed(lay.touching, turn_for(lay.touching, c.depth)),
                        pressed(lay.aside, turn_for(lay.aside, c.depth)));
  const Posed& last = c.surface_path.back();
  const auto deepest = test::deepest_on_shaft(shape, last, s.burr);
  c.surface.normal = test::outward_normal(shape, deepest.point);
  c.surface.point = deepest.point + deepest.depth * c.surface.normal;
  c.shaft = shaft_integral(shape, last, s.burr);

  const double lean = random.uniform(0.2, 1) * lay.most_lean;
  c.line_path = path(pose(lay.free), pressed(lay.touching, lean), pressed(lay.aside, lean));
  const Vec3d direction = c.line_path.back().linear().col(2);
  const auto exact = test::constrained_line(shape, s.burr, lay.tip, direction,
                                            Vec3d(direction + 0.1 * (lay.free.normalized() - direction)), 0.15);
  c.line_contact = exact.contact;
  c.line = {exact.contact, test::outward_normal(shape, exact.contact)};
  const double height = (exact.contact - lay.tip).norm();
  c.line_truth.force = exact.contact - (lay.tip + height * direction);
  c.line_truth.torque = (exact.contact - lay.tip).cross(c.line_truth.force);
  s.cases.push_back(std::move(c));
}

/// A frame whose z is out of the bone.
struct Placed {
  Posed X;
  [[nodiscard]] Vec3d p(double x, double y, double z) const { return X * Vec3d(x, y, z); }
  [[nodiscard]] Vec3d d(double x, double y, double z) const { return X.linear() * Vec3d(x, y, z); }
};

void make_shafts(Scenario& s, int bones, int per_bone, Random& random) {
  for (int b = 0; b < bones; ++b) {
    const Placed f{random_frame(random)};
    if (s.name == "hole") {
      const double hole = 0.002;
      s.bones.emplace_back(Both{HalfSpace{f.p(0, 0, 0), f.d(0, 0, 1)}, Hollow{Rod{f.p(0, 0, 0), f.d(0, 0, 1), hole}}});
      for (int i = 0; i < per_bone; ++i) {
        const double deep = random.uniform(0.003, 0.005);
        const double phi = random.uniform(0, 2 * std::numbers::pi), turn = random.uniform(-0.6, 0.6);
        const auto rim = [&](double at) { return Vec3d(f.d(hole * std::cos(at), hole * std::sin(at), deep)); };
        const Vec3d out = f.d(std::cos(phi), std::sin(phi), 0);
        add_shaft(s, s.bones.size() - 1, {f.p(0, 0, -deep), f.d(0, 0, 1), rim(phi), rim(phi + turn), out}, random);
      }
      continue;
    }
    const bool edge = s.name == "shaft_edge";
    const double radius = s.name == "shaft_ridge" ? 0.0012 : s.name == "shaft_cylinder" ? 0.003 : 0;
    if (!edge && radius == 0) throw std::invalid_argument("no scenario is called " + s.name);
    if (edge)
      s.bones.emplace_back(Both{HalfSpace{f.p(0, 0, 0), f.d(0, 0, 1)}, HalfSpace{f.p(0, 0, 0), f.d(-1, 0, 0)}});
    else
      s.bones.emplace_back(Rod{f.p(0, 0, -radius), f.d(0, 1, 0), radius});
    for (int i = 0; i < per_bone; ++i) {
      const double lever = random.uniform(0.005, 0.012),
                   low = random.uniform(0.0002, 0.0010) + (edge ? 0.0 : 0.5 * radius);
      const double start = random.uniform(-0.0015, 0.0015), slide = random.uniform(-0.0015, 0.0015);
      const Vec3d tip = f.p(-lever, start, -low);
      // The line from the tip that touches the rod (or passes over the edge), in the plane across it, then slid along.
      const double up = edge ? std::atan2(low, lever)
                             : std::asin(radius / std::hypot(lever, radius - low)) - std::atan2(radius - low, lever);
      const auto touching = [&](double along) { return Vec3d(f.d(std::cos(up), along / lever, std::sin(up))); };
      const double most_lean = edge ? 0.1 : std::min(0.1, 0.8 * radius / lever);
      add_shaft(s, s.bones.size() - 1, {tip, f.d(1, 0, 0.6), touching(0), touching(slide), -f.d(0, 0, 1), most_lean},
                random);
    }
  }
}

}  // namespace

std::vector<std::string> scenario_names() {
  return {"plane",      "sphere", "socket", "cylinder",    "ridge",          "plate",     "box_edge",
          "box_corner", "slot",   "hole",   "shaft_ridge", "shaft_cylinder", "shaft_edge"};
}

Scenario make_scenario(const std::string& name, int bones, int per_bone) {
  Scenario s;
  s.name = name;
  s.shaft = name == "hole" || name.rfind("shaft_", 0) == 0;
  s.smooth = name != "box_edge" && name != "box_corner" && name != "slot" && name != "hole" && name != "shaft_edge";
  unsigned seed = 1;
  for (const char c : name) seed = seed * 31 + static_cast<unsigned char>(c);
  Random random(seed);
  s.shaft ? make_shafts(s, bones, per_bone, random) : make_tips(s, bones, per_bone, random);
  return s;
}

}  // namespace trephine::bench
