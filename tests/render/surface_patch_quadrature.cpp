// SPDX-License-Identifier: MIT
// Springs of a Surface tool's patches: on a plane in closed form, and on balls and in hollows by brute force.
#include "render/render_helpers.hpp"
#include "support/figures.hpp"
#include "support/malloc_hook.hpp"
#include "support/near.hpp"

#include <trephine/render/surface/patch_quadrature.hpp>
#include <trephine/render/surface/ray_exits.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 6607;
constexpr Burr kDrill{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.010};
using Tool = ToolDiscretization<SurfaceCounts, double>;

/// The springs of all patches of a tool at a pose, from the field's values and exit distances as the renderer has them.
struct Springs {
  explicit Springs(const Tool& t)
      : tool(&t),
        quadrature(t),
        values(static_cast<std::size_t>(t.padded())),
        lengths(static_cast<std::size_t>(t.periphery())),
        group_hit(t.groups().size()) {}

  template <class Field>
  void find(const Field& field, const Posed& X) {
    const auto& p = tool->points();
    field.values(X, p.x.data(), p.y.data(), p.z.data(), values.data(), tool->padded());
    std::fill(lengths.begin(), lengths.end(), 0.0);
    std::fill(group_hit.begin(), group_hit.end(), std::uint8_t{0});
    hits.clear();
    RayExits<double> exits(tool->periphery());
    for (int i = 0; i < tool->periphery(); ++i) {
      const auto& group = tool->groups()[tool->group_of(i)];
      if (!in_bone(i) || in_bone(group.centre)) continue;
      hits.push_back(i);
      exits.add(p[i], tool->inward()[i], group.radius, values[static_cast<std::size_t>(i)]);
      group_hit[tool->group_of(i)] = 1;
    }
    exits.search(field, X, 0.5 * field.voxel());
    for (int j = 0; j < exits.count(); ++j)
      lengths[static_cast<std::size_t>(hits[static_cast<std::size_t>(j)])] = exits[j];
    calls = heap_calls([&] {
      quadrature.integrate(field, *tool, tool->points(), X, values, hits, exits.covers(), lengths, group_hit);
    });
  }
  [[nodiscard]] bool in_bone(int i) const { return values[static_cast<std::size_t>(i)] >= 0; }
  [[nodiscard]] double length(int i) const { return lengths[static_cast<std::size_t>(i)]; }
  [[nodiscard]] Vec3d vector(int i) const {
    return length(i) > 0 ? Vec3d(length(i) * quadrature.spring(i).direction) : Vec3d(Vec3d::Zero());
  }

  const Tool* tool;
  PatchQuadrature<double> quadrature;
  std::vector<double> values, lengths;
  std::vector<int> hits;
  std::vector<std::uint8_t> group_hit;
  std::int64_t calls = 0;
};

/// A tool `above` a plane's point, lying or standing on it.
Posed on_plane(Random& random, const Vec3d& at, const Vec3d& n, double above) {
  const Vec3d across = n.unitOrthogonal(), lean = n + random.arrow(0, 0.5);
  const bool lies = random.uniform() < 0.5;
  return tool_at(at + above * n, lies ? Vec3d(across + 0.05 * n) : lean, random.uniform(0, 6));
}

TEST_CASE(
    "patch quadrature: on a half space a patch wholly in bone has the true plane's spring, out of reach none has") {
  // The image's isosurface is off by hundredths of a voxel, and so is the exit distance of a patch that faces the
  // plane.
  constexpr double kImage = 0.05 * kVoxel;
  constexpr double kFacing = 0.3;  // cosine from which exits are compared: the error grows as its reciprocal
  CAPTURE(kSeed);
  Random random(kSeed);
  const RasterOptions o{.size = {72, 72, 72}};
  const Tool tool(kDrill, {.sphere = 150, .slices = 20, .per_slice = 16});
  Springs springs(tool);
  Figures off;
  int far = 0, of_far = 0, hit_without = 0, calls = 0;
  for (int turn = 0; turn < 6; ++turn) {
    const HalfSpace bone{o.middle(), random.unit()};
    const auto grid = rasterise<float>(bone, o);
    const auto field = field_of<double>(grid, o);
    for (int i = 0; i < 60; ++i) {
      const Posed X = on_plane(random, o.middle(), bone.outward, random.uniform(2e-4, 2.4e-3));
      springs.find(field, X);
      calls += springs.calls != 0 ? 1 : 0;
      const Vec3d n = X.linear().transpose() * bone.outward;
      bool reached = false;
      std::vector<std::uint8_t> has_spring(tool.groups().size());
      for (int v = 0; v < tool.periphery(); ++v) {
        const auto patch = tool.patch(v);
        const double depth = -bone(X * tool.points()[v]), cosine = n.dot(tool.inward()[v]);
        reached = reached || depth > -patch.reach() - kImage;
        if (springs.length(v) > 0) has_spring[tool.group_of(v)] = 1;
        const auto& group = tool.groups()[tool.group_of(v)];
        if (bone(X * tool.points()[group.centre]) < kImage || depth < patch.reach() || cosine < kFacing) continue;
        const auto exact = patch.spring(depth, n, tool.inward()[v], Vec3d::UnitZ());
        off.add((springs.vector(v) - exact.length * exact.direction).norm() * cosine);
      }
      hit_without += has_spring != springs.group_hit ? 1 : 0;
      if (reached) continue;
      ++far;
      of_far += std::count(has_spring.begin(), has_spring.end(), 1) > 0 ? 1 : 0;
    }
  }
  MESSAGE("springs off by [m] ", off, "; poses out of reach ", far);
  CHECK(off.worst() <= kImage);
  CHECK(off.count() > 1000);
  CHECK(far > 20);
  CHECK(of_far == 0);
  CHECK(hit_without == 0);
  CHECK(calls == 0);
}

TEST_CASE("patch quadrature: a small ball of bone in voxels has the force of the ball itself") {
  CAPTURE(kSeed);
  Random random(kSeed + 5);
  const RasterOptions o{.size = {32, 32, 32}, .image = Image::kClampedDistance};
  SurfaceApproxRenderer<double> renderer{Tool(Burr{.tip_radius = 0.0015, .shaft_length = 0}, {.sphere = 260})};
  Figures share;
  for (int turn = 0; turn < 8; ++turn) {
    const Ball bone{o.middle() + kVoxel * random.arrow(), 2.5 * kVoxel};
    const auto grid = rasterise<float>(bone, o);
    const auto voxels = field_of<double>(grid, o);
    const ShapeField<double, Ball> exact(bone, kVoxel);
    const Vec3d n = random.unit();
    const Posed X = tool_at(bone.centre + (bone.radius + 0.0015 - 2e-4) * n, random.unit());
    share.add(render_at(renderer, voxels, X).wrench.force.dot(n) / render_at(renderer, exact, X).wrench.force.dot(n));
  }
  MESSAGE("force in voxels over the ball's own ", share);
  CHECK(share.median() == near(1, 0.1));
}

TEST_CASE("patch quadrature: springs enter continuously as the tool is lowered") {
  // No spring grows by more than its reciprocal cosine, 10 at kMinCosine, per depth; the sum by its area in the plane.
  constexpr double kStep = 1e-6, kMore = 2;
  CAPTURE(kSeed);
  Random random(kSeed + 1);
  const ShapeField<double, HalfSpace> field({Vec3d::Zero(), Vec3d::UnitZ()}, kVoxel);
  const Tool tool(Burr{.tip_radius = 0.0015, .shaft_length = 0}, {.sphere = 260});
  Springs springs(tool);
  Figures steps;
  for (int turn = 0; turn < 5; ++turn) {
    const Mat3d R = random.rotation();
    double before = 0;
    for (double depth = -2e-4; depth < 5e-4; depth += kStep) {
      springs.find(field, make_pose<double>(R, Vec3d(0, 0, kDrill.tip_radius - depth)));
      double sum = 0;
      for (int v = 0; v < tool.periphery(); ++v)
        sum += tool.areas()[static_cast<std::size_t>(v)] * (R * springs.vector(v)).z();
      // π R δ² in the continuum: 2 π R δ dδ a step, for a depth with the reach of a patch.
      const double reach = tool.patch(0).reach();
      if (depth > -2e-4)
        steps.add((sum - before) / (2 * 3.14159 * kDrill.tip_radius * (std::max(depth, 0.0) + reach) * kStep));
      before = sum;
    }
  }
  MESSAGE("steps over the continuum's ", steps, ", least ", steps.least());
  CHECK(steps.worst() <= kMore);
  CHECK(steps.least() >= -kMore);
}

/// Mean exit vector in T of a disc's points toward the ball's centre, from bone that is a ball (hollow: around one).
Vec3d brute_force(const Patch<double>& patch, const Vec3d& inward, const Vec3d& centre_T, double radius, bool hollow) {
  constexpr int kPoints = 60;
  const Vec3d e = inward.unitOrthogonal(), f = inward.cross(e);
  Vec3d sum = Vec3d::Zero();
  int count = 0;
  for (int i = 0; i < kPoints; ++i)
    for (int j = 0; j < kPoints; ++j) {
      const double u = (2 * i + 1.0) / kPoints - 1, v = (2 * j + 1.0) / kPoints - 1;
      if (u * u + v * v > 1) continue;
      ++count;
      const double angle = patch.disc * std::hypot(u, v) / patch.radius;
      const Vec3d d = std::cos(angle) * inward - std::sin(angle) * (u * e + v * f).normalized();
      const Vec3d y = -patch.radius * d - centre_T;
      const double b = y.dot(d), c = y.squaredNorm() - radius * radius;
      if (hollow ? c <= 0 : c >= 0) continue;
      const double root = std::sqrt(std::max(0.0, b * b - c));
      sum += (hollow ? -b - root : -b + root) * d;
    }
  return sum / count;
}

TEST_CASE("patch quadrature: on a ball and in a hollow the fitted curvature gives the springs of brute force") {
  // Curvature enters by its mean over the patch. Its change across a patch of r is of the order r / R, and acts on the
  // spring by r² / 2R of the exit distance: 4 % here.
  constexpr double kMean = 0.04;
  CAPTURE(kSeed);
  Random random(kSeed + 2);
  const Tool tool(Burr{.tip_radius = 0.0015, .shaft_length = 0}, {.sphere = 100});
  Springs springs(tool);
  const auto check = [&](const auto& field, const Vec3d& centre, double radius, bool hollow) {
    Figures off;
    for (int i = 0; i < 40; ++i) {
      const double depth = random.uniform(3e-4, 1e-3),
                   away = hollow ? radius - 1.5e-3 + depth : radius + 1.5e-3 - depth;
      const Posed X = make_pose<double>(random.rotation(), centre + away * random.unit());
      springs.find(field, X);
      const Vec3d centre_T = X.inverse() * centre;
      for (int v = 0; v < tool.periphery(); ++v) {
        const auto patch = tool.patch(v);
        const Vec3d y = tool.points()[v] - centre_T, n = (hollow ? -1 : 1) * y.normalized();
        const double below = hollow ? y.norm() - radius : radius - y.norm();
        if (below < patch.reach() || n.dot(tool.inward()[v]) < 0.5) continue;
        const Vec3d exact = brute_force(patch, tool.inward()[v], centre_T, radius, hollow);
        off.add((springs.vector(v) - exact).norm() / exact.norm());
      }
    }
    MESSAGE("springs off by ", off);
    CHECK(off.count() > 100);
    CHECK(off.worst() <= kMean);
  };
  const Ball ball{Vec3d::Zero(), 0.003};
  check(ShapeField<double, Ball>(ball, kVoxel), ball.centre, ball.radius, false);
  const Ball socket{Vec3d::Zero(), 0.003};
  check(ShapeField<double, Hollow<Ball>>(Hollow<Ball>{socket}, kVoxel), socket.centre, socket.radius, true);
}

}  // namespace
