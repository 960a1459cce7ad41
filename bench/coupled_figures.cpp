// SPDX-License-Identifier: MIT
#include "common/command_line.hpp"
#include "common/cuts.hpp"
#include "common/on_all_cores.hpp"
#include "common/table.hpp"
#include "render/coupled_helpers.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/voxel/bone_surface.hpp>

#include <cmath>
#include <cstdio>
#include <map>
#include <tuple>

/// The coupled tool's figures on shapes whose truth is known, wherever they lie between the voxels and whichever way
/// they are turned: bench_coupled_figures --out DIR [--quick] [--only WORD]
namespace {

using namespace trephine;
using namespace trephine::test;
using namespace trephine::test::coupled;

constexpr unsigned kSeed = 5077;  // the tests have others
constexpr double R = kBall.tip_radius, r = kDrill.shaft_radius;
constexpr double kCurved = 12 * kH;  // radius of balls and bars
constexpr double kWide = 2 * R;      // radius of sockets and grooves

/// A value of one figure. `bound`: of the greatest, or, where `share` is less than 1, of that quantile.
struct Value {
  std::string name;
  double bound;
  std::string unit;
  double value;
  double share;
};

/// What one spot gives.
struct Gathered {
  std::vector<Value> values;
  void add(const std::string& name, double bound, const std::string& unit, double value, double share = 1) {
    values.push_back({name, bound, unit, std::isnan(value) ? 1e9 : value, share});
  }
};

/// Where a shape lies: its frame in G, its image, and the numbers that a case draws.
struct Spot {
  Posed X = Posed::Identity();
  double sigma = 1;
  mutable Random random{1};
  [[nodiscard]] Vec3d n() const { return X.linear().col(2); }
  [[nodiscard]] Vec3d at(double x, double y, double z) const { return X * Vec3d(x, y, z); }
  [[nodiscard]] ImageOptions image(int side = 44) const { return {.size = {side, side, side}, .sigma = sigma}; }
};

Posed raised(Posed X, const Vec3d& by) {
  X.translation() += by;
  return X;
}

/// Greatest change of force in a step along `pose(0)`, `pose(1)`, … `pose(steps)`, in K dx.
template <class Scene, class PoseAt>
double greatest_step(Scene& scene, int steps, double dx, const PoseAt& pose) {
  Vec3d before = scene.tick({.X_WT = pose(0)}, kDt).wrench.force;
  double worst = 0;
  for (int i = 1; i <= steps; ++i) {
    const Vec3d now = scene.tick({.X_WT = pose(i)}, kDt).wrench.force;
    worst = std::max(worst, (now - before).norm());
    before = now;
  }
  return worst / (kK * dx);
}

// --- Edges: the greatest change of force in a tick of 30 µm beyond K dx
template <class Law>
double slide_over(Bone& bone, const Spot& spot, double deep, double yaw, double aside, const Law& law) {
  constexpr double kStep = 3e-5;
  auto scene = coupled_scene(bone, kBall, law);
  const Vec3d way(std::cos(yaw), std::sin(yaw), 0);
  return greatest_step(scene, 166, kStep, [&](int i) {
    const Vec3d p = Vec3d(0, aside, R - deep) + (i * kStep - 2.5e-3) * way;
    return tool_at(spot.X * p, spot.n());
  });
}
void edges(const Spot& spot, Gathered& out) {
  const auto one = [&](const std::string& name, const auto& shape) {
    Bone bone = blurred(Moved{shape, spot.X}, spot.image());
    const double yaw = spot.random.uniform(0, 0.6), aside = spot.random.uniform(-0.5, 0.5) * kH;
    for (const double deep : {3e-4, 5.5e-4, 8e-4}) {
      const double none = slide_over(bone, spot, deep, yaw, aside, Frictionless{});
      if (!(none > 0)) continue;  // blurred away
      out.add("slid over " + name + ": force step beyond K dx", 0.1, "K dx", none - 1);
      out.add("slid over " + name + ", friction .3: force step beyond K dx", 2, "K dx",
              slide_over(bone, spot, deep, yaw, aside, Coulomb(0.3, 0.3)) - 1);
    }
  };
  one("an edge of 90°", wedge(90));
  one("an edge of 60°", wedge(60));
  one("an edge of 30°", wedge(30));
  one("a corner", corner());
}

// --- Hollows that the ball milled: turned in them
void hollows(const Spot& spot, Gathered& out) {
  const Vec3d n = spot.n(), at = spot.at(0, 0, 0), side = n.unitOrthogonal();
  const auto one = [&](const std::string& name, double above, double from, double to, double aside, const Burr& burr) {
    Bone bone = image(HalfSpace{at + above * n, n}, spot.image(40));
    const Vec3d bottom = at + to * n;
    carve(bone, kIso, SphereCutter(at + from * n + aside * side, bottom + aside * side, R));
    if (aside > 0) carve(bone, kIso, SphereCutter(bottom - aside * side, bottom + aside * side, R));
    auto scene = coupled_scene(bone, burr);
    const Posed X = tool_at(bottom - 7e-4 * n, n);
    lead(scene, raised(X, 2e-3 * n), X, 60);
    const Vec3d rest = lead(scene, X, X, 30).wrench.force;
    const Vec3d axis = burr.has_shaft() ? Vec3d(Vec3d::UnitZ()) : spot.random.unit();
    double force = 0, torque = 0;
    for (int i = 1; i <= 60; ++i) {
      const Mat3d turned = X.linear() * rotation_from_vector(Vec3d(0.04 * i * axis));
      const TickResult t = scene.tick({.X_WT = make_pose<double>(turned, X.translation())}, kDt);
      force = std::max(force, (t.wrench.force - rest).norm() / rest.norm());
      torque = std::max(torque, t.wrench.torque.norm() / (rest.norm() * R));
    }
    const std::string title = name + (burr.has_shaft() ? ", shaft turned about its axis" : ", ball turned");
    out.add(title + ": change of force", 1e-6, "of it", force);
    out.add(title + ": torque", 1e-6, "of force × radius", torque);
  };
  for (const Burr& burr : {kBall, kDrill}) {
    one("pit", 0, 5e-4, 2e-4, 0, burr);
    one("socket", 2e-4, 0, 0, 0, burr);
    one("hole", 0, 3e-3, -2e-3, 0, burr);
    one("slot", 0, 2e-3, -1e-3, 1.5e-3, burr);
  }
}

// --- Plunged straight in, with every cut
template <class Law>
void plunge(const Spot& spot, const Law& law, const std::string& with, double bound, Gathered& out) {
  constexpr int kLead = 40, kRest = 500;
  const double depths[] = {R, 2e-3, 3e-3, 5e-3, 8e-3}, speeds[] = {5e-3, 1e-2, 2e-2};
  const double depth = depths[spot.random.below(5)], speed = speeds[spot.random.below(3)];
  const auto cut = static_cast<bench::Cut>(spot.random.below(3));
  ImageOptions o = spot.image(50);
  const Vec3d n = spot.n(), at = o.middle() + (spot.at(0, 0, 0) - spot.image().middle());
  const Vec3d top = at + 3e-3 * n;
  Bone bone = image(HalfSpace{top, n}, o);
  auto scene = coupled_scene(bone, kDrill, law, kGains, Cutting{bench::cut_of(cut, 2e5, 0.05)});
  const int ticks = static_cast<int>(std::lround(depth / (speed * kDt)));
  double removed = 0, at_rest = 0, behind = 0;
  for (int i = -kLead; i < ticks + kRest; ++i) {
    const Vec3d tip = top + (R - std::min(i, ticks) * speed * kDt) * n;
    const TickResult t = scene.tick({.X_WT = tool_at(tip, n), .spindle_on = true}, kDt);
    const double force = t.wrench.force.norm();
    removed += t.removed_mm3;
    if (i > 0) behind = std::max(behind, (scene.proxy_pose_W().translation() - tip).norm() - force / kK);
    if (i >= ticks + kRest - 100) at_rest = std::max(at_rest, force);
  }
  const double swept =
      depth < R ? kPi * depth * depth * (3 * R - depth) / 3 : 2.0 / 3 * kPi * R * R * R + kPi * R * R * (depth - R);
  const char* names[] = {"at once", "by rate", "advancing"};
  const std::string name = std::string("plunged, cut ") + names[static_cast<int>(cut)] + with +
                           (depth < 1.5 * R ? ", widest near the rim" : "");
  out.add(name + ": force at rest", bound, "N", at_rest);
  out.add(name + ": removed against swept", 0.01, "of it", std::abs(removed / (swept * 1e9) - 1));
  out.add(name + ": behind, beyond force / stiffness", 0.5, "voxel", behind / kH);
}
void plunges(const Spot& spot, Gathered& out) {
  plunge(spot, Frictionless{}, "", 0.01, out);
  plunge(spot, Coulomb(0.3, 0.3), ", friction .3", 0.05, out);
}

// --- Plates: the shaft pushed against the rim, and along its axis over an edge
template <class Surface>
double first_bone(const Surface& surface, const Vec3d& from, const Vec3d& way, double most, double step) {
  double x = 0;
  while (x < most && !surface.is_bone(from + x * way)) x += step;
  double low = x - step, high = x;
  for (int i = 0; i < 14 && x < most; ++i) {
    const double middle = (low + high) / 2;
    (surface.is_bone(from + middle * way) ? high : low) = middle;
  }
  return x < most ? high : most;
}
void plates(const Spot& spot, Gathered& out) {
  CoupledOptions stiff = kGains;
  stiff.rotational_stiffness = 1e3;
  stiff.torque = 100;
  for (const double voxels : {1.0, 2.0}) {
    const Vec3d u = spot.n(), in = spot.X.linear().col(0), at = spot.at(0, 0, 0);
    Bone bone = blurred(Both{Plate{at, u, voxels * kH}, HalfSpace{at, Vec3d(-in)}}, spot.image(), 4);
    const BoneSurface<std::int16_t> surface(bone, kIso);
    double rim = 1;
    for (double z = -kH; z <= kH; z += 0.1 * kH)
      rim = std::min(rim, first_bone(surface, at - 2 * kH * in + z * u, in, 8 * kH, 0.05 * kH) - 2 * kH);
    if (!(rim < 4 * kH)) continue;  // blurred away
    auto scene = coupled_scene(bone, kDrill, Frictionless{}, stiff);
    const double below = spot.random.uniform(4e-3, 14e-3);
    const auto pose = [&](double x) { return tool_at(at + (rim + x - r) * in - below * u, u); };
    const std::string name = voxels > 1 ? "plate of 2 voxels" : "plate of 1 voxel";
    for (const double x : {1e-3, 3e-3}) {
      scene.reset();
      const double held = lead(scene, pose(-5e-4), pose(x), 300).wrench.force.norm();
      out.add(name + " against the shaft: force less than K x by", 0.02, "of it", 1 - held / std::min(kForce, kK * x));
    }
  }
  // Along its axis over an edge of 90°, tilted.
  Bone bone = blurred(Moved{wedge(90), spot.X}, spot.image());
  auto scene = coupled_scene(bone, kDrill);
  const double tilt = spot.random.uniform(0.1, 0.5);
  const Vec3d axis = spot.X.linear() * Vec3d(std::cos(tilt), 0, std::sin(tilt)),
              up = spot.X.linear() * Vec3d(-std::sin(tilt), 0, std::cos(tilt));
  constexpr double kStep = 1e-6;
  const auto pose = [&](double along) {
    return tool_at(spot.at(0, 0, 0) + (r - 3e-4) * up - (5e-3 + along) * axis, axis);
  };
  lead(scene, raised(pose(0), 6e-4 * up), pose(0), 60);
  lead(scene, pose(0), pose(0), 20);
  out.add("shaft slid along its axis over an edge: force step a µm", 2, "K dx",
          greatest_step(scene, 300, kStep, [&](int i) { return pose(kStep * i); }));
}

// --- Pressed on noise with 1 N: the force above 30 Hz, that is less its mean over 33 ms
void noise(const Spot& spot, Gathered& out) {
  const Vec3d n = spot.n(), at = spot.at(0, 0, 0), along = n.unitOrthogonal();
  ImageOptions o = spot.image();
  o.seed = static_cast<unsigned>(spot.random.below(1 << 30));
  o.noise = 120;  // of a contrast of 2000
  Bone bone = image(HalfSpace{at, n}, o);
  auto scene = coupled_scene(bone, kBall);
  const auto pose = [&](double aside) { return tool_at(at + (R - 1 / kK) * n + aside * along, n); };
  lead(scene, raised(pose(-1e-3), 2e-3 * n), pose(-1e-3), 60);
  for (const double speed : {0.0, 0.02}) {
    std::vector<double> f;
    for (int t = 0; t < 100; ++t)
      f.push_back(scene.tick({.X_WT = pose(-1e-3 + speed * kDt * t)}, kDt).wrench.force.norm());
    double squares = 0;
    int count = 0;
    for (std::size_t i = 16; i + 16 < f.size(); ++i, ++count) {
      double mean = 0;
      for (std::size_t j = i - 16; j <= i + 16; ++j) mean += f[j] / 33;
      squares += (f[i] - mean) * (f[i] - mean);
    }
    out.add(speed > 0 ? "slid at 20 mm/s on noise, 1 N: rms above 30 Hz" : "still on noise, 1 N: rms above 30 Hz",
            speed > 0 ? 0.05 : 0.005, "N", std::sqrt(squares / count));
  }
}

// --- Directions
constexpr double kForces[] = {0.1, 0.3, 1, 3};

void directions(const Spot& spot, Gathered& out) {
  const Vec3d n = spot.n(), at = spot.at(0, 0, 0), along = n.unitOrthogonal(), across = n.cross(along);
  /// The device's centre at `deep` beyond touching, `aside` along; the way out there.
  struct Place {
    Vec3d p, out;
  };
  const auto one = [&](const std::string& name, const auto& shape, double bound, auto&& place, double deepest = 1) {
    Bone bone = image(shape, spot.image());
    auto scene = coupled_scene(bone, kBall);
    for (const double F : kForces) {
      if (F / kK > deepest) continue;
      const auto pose = [&](double deep, double aside) { return tool_at(place(deep, aside).p, n); };
      scene.reset();
      lead(scene, pose(-2e-4, -5e-4), pose(F / kK, -5e-4), 40);
      for (int t = 0; t < 50; ++t) {
        const double aside = -5e-4 + 2e-5 * t;
        const Vec3d f = scene.tick({.X_WT = pose(F / kK, aside)}, kDt).wrench.force;
        out.add("direction, slid with " + std::string(F > 2 ? "3 N" : ".1 to 1 N") + ": " + name, bound, "°",
                angle_deg(f, place(F / kK, aside).out), 0.99);
      }
    }
  };
  const auto flat = [&](double deep, double aside) { return Place{at + (R - deep) * n + aside * along, n}; };
  // About a centre or an axis `middle`, at `radius` from it when touching.
  const auto round = [&](const Vec3d& middle, double radius, double sign) {
    return [=](double deep, double aside) {
      const double angle = sign * aside / radius;
      const Vec3d away = std::cos(angle) * n + std::sin(angle) * along;
      return Place{middle + (sign * radius - deep) * away, away};
    };
  };
  one("plane", HalfSpace{at, n}, 0.5, flat);
  one("plate of 2 voxels", Plate{at - kH * n, n, 2 * kH}, 0.5, flat);
  one("bar", Rod{at - kCurved * n, across, kCurved}, 0.5, round(at - kCurved * n, kCurved + R, 1));
  one("ball", Ball{at - kCurved * n, kCurved}, 1.2, round(at - kCurved * n, kCurved + R, 1));
  // From 2 N on the device is beyond the ridge's axis.
  one("ridge", Rod{at - 1e-3 * n, across, 1e-3}, 1.2, round(at - 1e-3 * n, 1e-3 + R, 1), 1.3e-3);
  one("socket", Hollow{Ball{at + kWide * n, kWide}}, 1.2, round(at + kWide * n, kWide - R, -1));
}

// --- Stiffness felt
void felt(const Spot& spot, Gathered& out) {
  constexpr double kMove = 1e-5;
  const Vec3d n = spot.n(), at = spot.at(0, 0, 0);
  const auto one = [&](const std::string& name, const auto& shape) {
    Bone bone = image(shape, spot.image());
    auto scene = coupled_scene(bone, kBall);
    const auto pose = [&](double deep) { return tool_at(at + (R - deep) * n, n); };
    const auto force = [&](double deep) { return lead(scene, pose(deep), pose(deep), 2).wrench.force.dot(n); };
    for (const double F : {0.5, 1.0, 2.0, 3.0}) {
      scene.reset();
      lead(scene, pose(-3e-4), pose(F / kK), 60);
      out.add("stiffness felt on a " + name + ", force over way", 0.02, "of K", std::abs(force(F / kK) / F - 1));
      const double slope = (force(F / kK + kMove) - force(F / kK - kMove)) / (2 * kMove);
      out.add("stiffness felt on a " + name + ", small moves", 0.02, "of K", std::abs(slope / kK - 1));
    }
  };
  one("plane", HalfSpace{at, n});
  one("ball", Ball{at - kCurved * n, kCurved});
  one("socket", Hollow{Ball{at + kWide * n, kWide}});
  one("groove", Hollow{Rod{at + kWide * n, n.unitOrthogonal(), kWide}});
}

// --- Closed paths
void paths(const Spot& spot, Gathered& out) {
  constexpr int kSteps = 800;
  const Vec3d n = spot.n(), at = spot.at(0, 0, 0), along = n.unitOrthogonal();
  const auto one = [&](const std::string& name, Bone bone, const Burr& burr) {
    const bool lying = burr.has_shaft();
    auto scene = coupled_scene(bone, burr);
    const Vec3d a = spot.random.unit(), c = spot.random.unit(), turn = 0.1 * spot.random.unit();
    const double deep = spot.random.uniform(4e-4, 1.2e-3);
    const Posed start =
        lying ? tool_at(at + (r - 0.5 * deep) * n - 0.008 * along, along) : tool_at(at + (R - deep) * n, n);
    const auto pose = [&](int i) {
      const double phase = 2 * kPi * i / kSteps;
      return make_pose<double>(rotation_from_vector(Vec3d(std::sin(phase) * turn)) * start.linear(),
                               start.translation() + 4e-4 * (std::sin(phase) * a + (1 - std::cos(phase)) * c));
    };
    lead(scene, raised(pose(0), 2.5e-3 * n), pose(0), 80);
    PathWork sum(pose(0), scene.tick({.X_WT = pose(0)}, kDt).wrench);
    for (int i = 1; i <= kSteps; ++i) sum.go(pose(i), scene.tick({.X_WT = pose(i)}, kDt).wrench);
    if (!(sum.length > 1e-5)) return;
    out.add("net work of closed paths: " + name, 1e-4, "of it", std::abs(sum.net) / sum.length);
    out.add("energy gained on closed paths: " + name, 1e-4, "of it", sum.net / sum.length);
  };
  one("plane", image(HalfSpace{at, n}, spot.image()), kBall);
  one("edge", blurred(Both{HalfSpace{at, n}, HalfSpace{at, along}}, spot.image()), kBall);
  one("ball", image(Ball{at - kCurved * n, kCurved}, spot.image()), kBall);
  one("shaft on a ball", image(Ball{at - kCurved * n, kCurved}, spot.image()), kDrill);
}

// --- Walls that the image shows, and how deep the virtual tool sinks in
void walls(const Spot& spot, Gathered& out) {
  constexpr double kThick = 1.5 * kH;
  const Vec3d at = spot.at(0, 0, 0), n = spot.n();
  Bone bone = blurred(Plate{at, n, kThick}, spot.image(), 4);
  if (!BoneSurface<std::int16_t>(bone, kIso).is_bone(at)) return;  // blurred away
  auto scene = coupled_scene(bone, kDrill);
  for (const double speed : {0.01, 0.1, 1.0})
    for (const double side : {-1.0, 1.0})
      for (const bool lying : {false, true}) {
        const Vec3d up = side * n, axis = lying ? Vec3d(up.unitOrthogonal()) : up;
        const double radius = lying ? r : R;
        const Vec3d from = at + (radius + 1e-3) * up - (lying ? 0.008 : 0.0) * axis;
        scene.reset();
        double least = 1;
        for (int t = 0; t * speed * kDt < 6e-3; ++t) {
          static_cast<void>(scene.tick({.X_WT = tool_at(from - t * speed * kDt * up, axis)}, kDt));
          const Posed X = scene.proxy_pose_W();
          const Vec3d p = X.translation() + (lying ? 0.008 : 0.0) * X.linear().col(2);
          least = std::min(least, (p - at).dot(up) - radius - kThick / 2);
        }
        // Half a voxel below the image's own surface, as on faces and edges. The image of a wall that just shows has
        // its surface in the wall's middle.
        out.add(std::string("sunk into a wall of 1.5 voxels, ") + (lying ? "shaft" : "ball"), kThick / 2 / kH + 0.5,
                "voxel", -least / kH);
      }
}
void depths(const Spot& spot, Gathered& out) {
  const auto one = [&](const std::string& name, Bone bone) {
    const BoneSurface<std::int16_t> surface(bone, kIso);
    auto scene = coupled_scene(bone, kBall);
    const auto pose = [&](double deep) { return tool_at(spot.at(0, 0, R - deep), spot.n()); };
    lead(scene, pose(-3e-4), pose(16 * kH), 300);
    const Vec3d c = scene.proxy_pose_W().translation();
    double nearest = 1;
    for (int i = 0; i < 1500; ++i) {  // over the half that looks down, evenly
      const double z = -(i + 0.5) / 1500, angle = 2.399963229728653 * i, rho = std::sqrt(1 - z * z);
      const Vec3d way = spot.X.linear() * Vec3d(rho * std::cos(angle), rho * std::sin(angle), z);
      nearest = std::min(nearest, R - 2 * kH + first_bone(surface, c + (R - 2 * kH) * way, way, 4 * kH, 0.1 * kH));
    }
    if (nearest < R + 1.5 * kH)
      out.add("virtual tool below the image's own surface, 16 voxels of push: " + name, 0.5, "voxel",
              (R - nearest) / kH);
  };
  one("face", image(HalfSpace{spot.at(0, 0, 0), spot.n()}, spot.image()));
  one("edge of 90°", blurred(Moved{wedge(90), spot.X}, spot.image()));
}

struct Measure {
  std::string name;
  void (*run)(const Spot&, Gathered&);
  int times = 1;  // as many places of the full set: a plunge draws one of three cuts
};
const std::vector<Measure> kMeasures = {
    {"edges", edges},           {"hollows", hollows}, {"plunges", plunges, 3}, {"plates", plates}, {"noise", noise},
    {"directions", directions}, {"felt", felt},       {"paths", paths},        {"walls", walls},   {"depths", depths}};

struct Job {
  std::size_t measure;
  double sigma;
  int orientation, place;
};

Gathered run(const Job& job) {
  Random turned(kSeed + static_cast<unsigned>(job.orientation));
  const auto number = static_cast<unsigned>(100 * job.orientation + job.place);
  Spot spot{.sigma = job.sigma, .random = Random(kSeed + 1000 + number)};
  const Mat3d turn = job.orientation == 0 ? Mat3d(Mat3d::Identity()) : turned.rotation();
  spot.X = make_pose<double>(turn, spot.image().near_middle(spot.random));
  Gathered out;
  kMeasures[job.measure].run(spot, out);
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  std::string only;
  const bench::CommandLine options(argc, argv, {{"--only", &only}});
  const bool quick = options.quick;
  const int orientations = quick ? 3 : 7, places = quick ? 3 : 24;
  std::vector<Job> jobs;
  for (std::size_t m = 0; m < kMeasures.size(); ++m)
    for (const double sigma : quick ? std::vector{0.5, 1.0} : std::vector{0.5, 0.7, 1.0}) {
      if (!only.empty() && kMeasures[m].name != only) continue;
      for (int o = 0; o < orientations; ++o)
        for (int p = 0; p < (quick ? places : places * kMeasures[m].times); ++p) jobs.push_back({m, sigma, o, p});
    }
  std::vector<Gathered> results(jobs.size());
  bench::on_all_cores(jobs.size(), "coupled figures", [&](std::size_t i) { results[i] = run(jobs[i]); });

  struct Row {
    Value first;
    Figures values;
  };
  std::map<std::tuple<std::size_t, double, std::string>, Row> rows;
  for (std::size_t i = 0; i < jobs.size(); ++i)
    for (const Value& v : results[i].values)
      rows.try_emplace({jobs[i].measure, jobs[i].sigma, v.name}, Row{v, {}}).first->second.values.add(v.value);

  bench::Table table(options.folder + "/coupled_figures.csv",
                     "figure,blur_voxels,cases,median,worst,judged,bound,unit,pass");
  int met = 0;
  for (const auto& [key, row] : rows) {
    const auto& [measure, sigma, name] = key;
    const auto& [first, values] = row;
    const double value = values.share(first.share);
    const bool pass = value <= first.bound;
    met += pass;
    table.row(bench::without_commas(name), sigma, values.count(), values.median(), values.worst(), value, first.bound,
              first.unit, pass ? "pass" : "fail");
  }
  std::printf("coupled figures: %zu limits, %d met\n", rows.size(), met);
}
