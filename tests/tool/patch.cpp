// SPDX-License-Identifier: MIT
#include "support/near.hpp"

#include <trephine/tool/neighbours.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace {

using namespace trephine;
using namespace trephine::test;

// Sums over the points of a square grid on [−1, 1]² that `on` keeps.
template <class On, class F>
PatchMoments<double> summed(const On& on, const F& f) {
  constexpr int kPoints = 600;
  PatchMoments<double> m;
  double count = 0;
  for (int i = 0; i < kPoints; ++i)
    for (int j = 0; j < kPoints; ++j) {
      const double u = (2 * i + 1.0) / kPoints - 1, v = (2 * j + 1.0) / kPoints - 1;
      if (!on(u, v)) continue;
      const double h = std::max(0.0, f(u, v));
      m.mean += h;
      m.by_u += u * h;
      m.by_v += v * h;
      ++count;
    }
  return {m.mean / count, m.by_u / count, m.by_v / count};
}

template <class Scalar>
void check_moments(const PatchMoments<Scalar>& m, const PatchMoments<double>& expected, double tolerance) {
  CHECK(static_cast<double>(m.mean) == within(expected.mean, tolerance));
  CHECK(static_cast<double>(m.by_u) == within(expected.by_u, tolerance));
  CHECK(static_cast<double>(m.by_v) == within(expected.by_v, tolerance));
}

TEST_CASE_TEMPLATE("moments over disc and rectangle against sums over their points", Scalar, float, double) {
  for (const double q : {-1.5, -1.0, -0.9, -0.3, 0.0, 0.4, 0.95, 1.0, 3.0}) {
    CAPTURE(q);
    check_moments(
        moments_over_disc(static_cast<Scalar>(q)),
        summed([](double u, double v) { return u * u + v * v <= 1; }, [&](double u, double) { return q + u; }), 5e-5);
  }
  for (const double s : {-3.0, -1.1, -0.2, 0.0, 0.3, 1.4, 4.0})
    for (const auto& sides :
         {std::pair(1.0, 0.6), {0.5, 1.2}, {1.0, 0.0}, {1.0, 0.04}, {-0.7, 0.3}, {0.4, -0.9}, {0.0, 0.0}}) {
      const double a = sides.first, b = sides.second;
      CAPTURE(s);
      CAPTURE(a);
      CAPTURE(b);
      // Where one side is short its own share is left out: a twenty-fourth of its square over the other.
      check_moments(moments_over_rectangle(static_cast<Scalar>(s), static_cast<Scalar>(a), static_cast<Scalar>(b)),
                    summed([](double, double) { return true; }, [&](double u, double v) { return s + a * u + b * v; }),
                    1e-3);
    }
}

TEST_CASE("patches cover the tool, and neighbours know each other") {
  const Burr burr{.tip_radius = 0.002, .shaft_radius = 0.001, .shaft_length = 0.02};
  for (const int sphere : {26, 100, 1000}) {
    const ToolDiscretization<SurfaceCounts, double> tool(burr, {.sphere = sphere, .slices = 30, .per_slice = 12});
    double ball = 0, side = 0;
    for (std::size_t g = 0; g < tool.groups().size(); ++g)
      for (int i = tool.groups()[g].first; i < tool.groups()[g].first + tool.groups()[g].count; ++i) {
        CHECK(tool.group_of(i) == g);
        const auto patch = tool.patch(i);
        if (g == 0)
          ball += std::numbers::pi * patch.disc * patch.disc;
        else
          side += 4 * patch.half_arc * patch.half_length;
      }
    CHECK(ball == near(4 * std::numbers::pi * 4e-6, 1e-9));
    CHECK(side == near(2 * std::numbers::pi * 0.001 * (0.02 - burr.shaft_emerges()), 1e-9));
    const PatchNeighbours neighbours(tool);
    for (int i = 0; i < tool.periphery(); ++i) {
      const auto mine = neighbours.of(i);
      CHECK(mine.size() >= 3);
      CHECK(mine.size() <= 24);
      for (const int j : mine) {
        const auto theirs = neighbours.of(j);
        const bool mutual = std::find(theirs.begin(), theirs.end(), i) != theirs.end();
        // Equal areas: only the ball's 26 directions stand for unequal ones.
        if (sphere != 26 || tool.group_of(i) != 0) CHECK(mutual);
      }
    }
  }
  // Slices farther apart than the shaft is thick count with their ring alone.
  const ToolDiscretization<SurfaceCounts, double> coarse(burr, {.sphere = 26, .slices = 5, .per_slice = 8});
  CHECK(coarse.patch(coarse.groups()[1].first).half_length == 0);
}

TEST_CASE("a patch on a plane: nothing far above it, the vertex's own exit distance deep below, gradual between") {
  const Patch<double> patch{.radius = 0.002, .disc = 0.0004};
  const Vec3d inward = Vec3d::UnitZ(), axis = Vec3d::UnitX();
  const Vec3d n = Vec3d(0.3, 0.2, 1).normalized();
  const double cosine = n.z();
  CHECK(patch.spring(-0.0005, n, inward, axis).length == 0);
  double before = 0;
  for (double depth = -0.0003; depth < 0.0003; depth += 1e-6) {
    const PatchSpring<double> spring = patch.spring(depth, n, inward, axis);
    CHECK(spring.length >= before);
    CHECK(spring.length - before <= 1.01e-6 / cosine);
    if (spring.length > 0) CHECK(spring.direction.norm() == near(1));
    before = spring.length;
  }
  CHECK(before > 0);
  CHECK(patch.spring(0.0015, -n, inward, axis).length == 0);  // a surface that faces away
}

// The ways out of a patch's own points, toward the centre of a ball or the axis of a shaft, from a bone that is a ball
// of radius `bone` (hollow where negative) with the outward normal n `depth` above the vertex: their mean spring.
struct ExactSpring {
  double length = 0;
  Vec3d spring = Vec3d::Zero();
  double shaft_offset = 0;
  double surface_distance = 0;
};
ExactSpring exact_spring(const Patch<double>& patch, double depth, const Vec3d& n, double bone) {
  constexpr int kPoints = 160;
  const double r = patch.radius;  // inward is +z, the shaft's axis x, the vertex the origin
  // The bone's surface under the vertex along n, and its centre.
  const Vec3d centre = depth * n - bone * n;
  ExactSpring sum;
  double count = 0;
  for (int i = 0; i < kPoints; ++i)
    for (int j = 0; j < kPoints; ++j) {
      double u = (2 * i + 1.0) / kPoints - 1, v = (2 * j + 1.0) / kPoints - 1;
      Vec3d d, x;
      if (patch.disc > 0) {
        if (u * u + v * v > 1) continue;
        u *= patch.disc;
        v *= patch.disc;
        const double t = std::hypot(u, v), angle = t / r;
        const Vec3d side = t > 0 ? Vec3d(u / t, v / t, 0) : Vec3d(1, 0, 0);
        d = std::cos(angle) * Vec3d::UnitZ() - std::sin(angle) * side;
      } else {
        const double angle = u * patch.half_arc / r;
        d = Vec3d(0, -std::sin(angle), std::cos(angle));
        v *= patch.half_length;
      }
      x = Vec3d(0, 0, r) - r * d + (patch.disc > 0 ? 0 : v) * Vec3d::UnitX();
      ++count;
      // |x + a d − centre| = |bone|, from inside.
      const Vec3d y = x - centre;
      const double b = y.dot(d), c = y.squaredNorm() - bone * bone, root = std::sqrt(std::max(0.0, b * b - c));
      const bool inside = bone > 0 ? c < 0 : c > 0;
      if (!inside) continue;
      const double a = bone > 0 ? -b + root : -b - root;
      sum.length += a;
      sum.surface_distance += a * a;
      sum.spring += a * d;
      if (!(patch.disc > 0)) sum.shaft_offset += a * v;
    }
  sum.shaft_offset /= sum.length;
  sum.surface_distance /= sum.length;
  sum.length /= count;
  sum.spring /= count;
  return sum;
}

TEST_CASE(
    "a patch's spring against the exit vectors of its points: flat, convex and hollow bone, half and whole in it") {
  const Vec3d inward = Vec3d::UnitZ(), axis = Vec3d::UnitX();
  const Patch<double> patches[] = {{.radius = 0.0015, .disc = 0.0003},
                                   {.radius = 0.0015, .disc = 0.0005},
                                   {.radius = 0.0008, .half_arc = 0.0003, .half_length = 0.0004}};
  for (const Patch<double>& patch : patches)
    for (const double bone : {1e3, 0.005, -0.003})
      for (const Vec3d& lean : {Vec3d(0, 0, 0), Vec3d(0.3, 0, 0), Vec3d(0.2, -0.4, 0)})
        for (const double share : {-0.15, 0.0, 0.3, 1.0}) {
          const Vec3d n = (Vec3d::UnitZ() + lean).normalized();
          const double depth = share * patch.reach();
          CAPTURE(patch.disc);
          CAPTURE(bone);
          CAPTURE(lean.transpose());
          CAPTURE(share);
          const ExactSpring exact = exact_spring(patch, depth, n, bone);
          const PatchSpring<double> spring = patch.spring(depth, n, inward, axis, {1 / bone, 1 / bone});
          const Vec3d mine = spring.length * spring.direction;
          // Relative to the spring of a patch that is wholly in bone.
          const double whole = std::max(exact_spring(patch, patch.reach(), n, bone).length, exact.length);
          CHECK((mine - exact.spring).norm() <= 0.04 * whole);
          if (exact.length > 0.1 * whole) {
            if (!(patch.disc > 0))
              CHECK(std::abs(spring.shaft_offset - exact.shaft_offset) <= 0.04 * patch.half_length);
            CHECK(std::abs(spring.surface_distance - exact.surface_distance) <=
                  0.06 * whole);  // the mean exit distance is off by up to 0.14
          }
          // Without curvature the spring on a hollow or a ball is off by its sagitta.
          if (std::abs(bone) < 1 && share == 1.0 && lean.norm() == 0) {
            const PatchSpring<double> flat = patch.spring(depth, n, inward, axis);
            const double along = exact.spring.z();
            CHECK(std::abs(spring.length - along) < 0.15 * std::abs(flat.length - along));
          }
        }
}

}  // namespace
