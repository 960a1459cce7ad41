// SPDX-License-Identifier: MIT
#include "support/fields.hpp"

#include <trephine/contact/depth_field.hpp>
#include <trephine/voxel/drill_cutter.hpp>

#include <doctest/doctest.h>

namespace {

using namespace trephine;
using namespace trephine::test;

struct Errors {
  double rms = 0, most = 0;  ///< of the depth [voxels]
  double angle = 0;          ///< mean, of the smooth normal [deg]
};

// Depths at points that lie `depth` voxels under the surface, against the shape's own distance.
template <class Shape>
Errors at_depth(const DepthMap& map, const Shape& shape, const RasterOptions& o, double depth) {
  const DepthField<double> field(map);
  const double h = o.spacing.minCoeff();
  Random random(7);
  Errors e;
  int n = 0;
  while (n < 1500) {
    Vec3d p = o.middle() +
              0.3 * o.spacing.cwiseProduct(Vec3d(o.size[0] * random.uniform(-1, 1), o.size[1] * random.uniform(-1, 1),
                                                 o.size[2] * random.uniform(-1, 1)));
    for (int i = 0; i < 4; ++i) p -= (shape(p) + depth * h) * outward_normal(shape, p);
    const Vec3d voxel = p.cwiseQuotient(o.spacing);
    const Vec3d last(o.size[0] - 1, o.size[1] - 1, o.size[2] - 1);
    if (std::abs(shape(p) + depth * h) > 1e-3 * h || (voxel.array() < 8).any() || ((last - voxel).array() < 8).any())
      continue;
    const double error = field.value(p) / h - depth;
    e.rms += error * error;
    e.most = std::max(e.most, std::abs(error));
    e.angle += angle_deg(-field.smooth_gradient(p), outward_normal(shape, p));
    ++n;
  }
  e.rms = std::sqrt(e.rms / n);
  e.angle /= n;
  return e;
}

template <class Shape>
void check_depths(const Shape& shape, const RasterOptions& o) {
  const auto bone = rasterise<std::uint8_t>(shape, o);
  const DepthMap map(bone, o.isovalue(), {.reach = 9});
  const bool soft = o.image == Image::kCtBlur;
  for (const double depth : {-7.5, -3.0, -1.0, 0.0, 0.5, 1.0, 3.0, 7.5}) {
    CAPTURE(depth);
    const Errors e = at_depth(map, shape, o, depth);
    // The trilinear bias of a convex surface, h²/(6R), is in these.
    CHECK(e.rms <= (std::abs(depth) <= 1 ? 0.05 : 0.2));
    if (soft && std::abs(depth) <= 1) CHECK(e.angle <= 0.6);
  }
  MESSAGE("depth error at the surface ", at_depth(map, shape, o, 0).rms, " voxels rms, normals ",
          at_depth(map, shape, o, 0.3).angle, " deg");
}

TEST_CASE("depths are the distances to the surface, to a small part of a voxel") {
  RasterOptions o{.size = {72, 72, 72}};
  const Vec3d off(1e-5, 3e-5, -7e-5);
  for (const Image image : {Image::kCtBlur, Image::kPartialVolume, Image::kClampedDistance}) {
    o.image = image;
    CAPTURE(static_cast<int>(image));
    check_depths(Ball{o.middle() + off, 20 * 3e-4}, o);
    check_depths(HalfSpace{o.middle() + off, Vec3d(0.3, 0.5, 0.8).normalized()}, o);
    check_depths(Hollow<Ball>{Ball{o.middle() + off, 18 * 3e-4}}, o);
  }
}

TEST_CASE("voxels that are longer along one axis: depths are metric all the same") {
  RasterOptions o{.size = {96, 96, 40}, .spacing = {3e-4, 3e-4, 9e-4}};
  const HalfSpace plane{o.middle(), Vec3d(0.6, 0, 0.8)};
  const auto bone = rasterise<std::int16_t>(plane, o);
  const DepthMap map(bone, o.isovalue(), {.reach = 9});
  for (const double depth : {-3.0, 0.0, 1.0, 4.0})
    CHECK(at_depth(map, plane, o, depth).rms <= (depth == 0 ? 0.05 : 0.2));
}

TEST_CASE("a depth is above 0 where the density is in bone, and no distance is overstated") {
  RasterOptions o{.size = {40, 44, 36}, .noise = 6};
  const auto bone = rasterise<std::uint8_t>(Ball{o.middle(), 12 * 3e-4}, o);
  const DepthMap map(bone, o.isovalue(), {.reach = 6});
  int wrong = 0, steep = 0;
  double most = 0;
  for (int k = 0; k < o.size[2]; ++k)
    for (int j = 0; j < o.size[1]; ++j)
      for (int i = 0; i < o.size[0]; ++i) {
        wrong += (map.grid().at(i, j, k) >= 0) != (bone.at(i, j, k) >= o.isovalue()) ? 1 : 0;
        most = std::max(most, std::abs(static_cast<double>(map.grid().at(i, j, k))) / DepthMap::kPerVoxel);
        if (i + 1 < o.size[0]) {
          const double step = std::abs(map.grid().at(i + 1, j, k) - map.grid().at(i, j, k));
          steep += step > 1.15 * DepthMap::kPerVoxel ? 1 : 0;
        }
      }
  CHECK(wrong == 0);
  CHECK(most <= 6);
  CHECK(steep == 0);
}

// Inside, the depth of what is left after cuts is the least of the depth before and the distance to each cutter.
// A tool's shaft mostly stands outside the volume. The ball is cut off by the volume's edge, half a voxel beyond the
// last voxels; nowhere may its depth there be above the distance to what is left of it.
TEST_CASE("beyond the volume depths go on without a jump, and are bounds of the distance to bone in it") {
  const RasterOptions o{.size = {48, 40, 32}, .spacing = Vec3d(3e-4, 3e-4, 4e-4)};
  const double h = 3e-4;
  const Vec3d last(47 * 3e-4, 39 * 3e-4, 31 * 4e-4);
  const Ball ball{Vec3d(last.x() - 4 * h, 20 * h, 16 * 4e-4), 10 * h};
  const auto bone = rasterise<std::uint8_t>(ball, o);
  const DepthMap map(bone, o.isovalue(), {.reach = 9});
  const DepthField<double> field(map);
  // To the ball up to the plane that cuts it off.
  const double end = last.x() + h / 2;
  const auto distance = [&](const Vec3d& p) {
    const Vec3d from = p - ball.centre;
    if (from.x() * ball.radius / from.norm() <= end - ball.centre.x()) return std::max(0.0, ball(p));
    const double disc = std::sqrt(ball.radius * ball.radius - (end - ball.centre.x()) * (end - ball.centre.x()));
    return std::hypot(p.x() - end, std::max(0.0, std::hypot(from.y(), from.z()) - disc));
  };
  Random random(11);
  double farthest_in_gap = 0;
  for (int n = 0; n < 20000; ++n) {
    const Vec3d p = o.middle() +
                    1.6 * last.cwiseProduct(Vec3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)));
    const Vec3d edge = p.cwiseMax(Vec3d::Zero()).cwiseMin(last);
    const double d = (p - edge).norm();
    if (d == 0) continue;
    const double value = field.value(p);
    CAPTURE(p.transpose() / h);
    // From the nearest point of the volume, whose own depth is tested elsewhere; and never deeper than half a voxel.
    const double at_edge = field.value(edge);
    CHECK(value == doctest::Approx(at_edge > 0 ? at_edge - d : -std::hypot(at_edge, d)).epsilon(1e-9));
    CHECK(value <= h);
    CHECK(field.clearance(value) <= distance(p) + 0.2 * h);
    // Steps across the edge are as small as the way.
    const Vec3d out = (p - edge) / d;
    CHECK(std::abs(field.value(edge + 1e-9 * out) - field.value(edge - 1e-9 * out)) <= 1e-8);
    farthest_in_gap = std::max(farthest_in_gap, d);

    const Vec3d g = field.gradient(p);
    if (d < 1e-6 || std::abs(at_edge) < 1e-6) continue;
    const double e = 1e-9;
    Vec3d numeric;
    for (int axis = 0; axis < 3; ++axis)
      numeric[axis] = (field.value(p + e * Vec3d::Unit(axis)) - field.value(p - e * Vec3d::Unit(axis))) / (2 * e);
    // Where the stencil crosses a face of a cell there are two slopes.
    if ((field.gradient(p + e * Vec3d::Ones()) - field.gradient(p - e * Vec3d::Ones())).norm() < 1e-3)
      CHECK((g - numeric).norm() <= 1e-3);

    // Batches say the same, each point for itself.
    std::array<double, kLane> x, y, z, values, gx, gy, gz;
    x.fill(o.middle().x());
    y.fill(o.middle().y());
    z.fill(o.middle().z());
    x[3] = p.x();
    y[3] = p.y();
    z[3] = p.z();
    field.values(Posed::Identity(), x.data(), y.data(), z.data(), values.data(), kLane);
    field.gradients(Posed::Identity(), x.data(), y.data(), z.data(), gx.data(), gy.data(), gz.data(), kLane);
    CHECK(values[3] == doctest::Approx(value).epsilon(1e-12));
    CHECK(values[0] == doctest::Approx(field.value(o.middle())).epsilon(1e-12));
    CHECK((Vec3d(gx[3], gy[3], gz[3]) - g).norm() <= 1e-12);
  }
  CHECK(farthest_in_gap > 10 * h);
}

TEST_CASE("a thousand cuts: inside, depths are exactly what distances say; against a map made anew") {
  const unsigned seed = 17;
  CAPTURE(seed);
  Random random(seed);
  RasterOptions o{.size = {56, 56, 56}};
  auto bone = rasterise<std::uint8_t>(HalfSpace{o.middle() + Vec3d(0, 0, 12 * 3e-4), Vec3d::UnitZ()}, o);
  DepthMap map(bone, o.isovalue());
  const double reach = map.reach(), unit = map.unit();
  std::vector<double> expected;
  const auto for_all = [&](auto&& f) {
    for (int k = 0; k < o.size[2]; ++k)
      for (int j = 0; j < o.size[1]; ++j)
        for (int i = 0; i < o.size[0]; ++i) f(i, j, k);
  };
  for_all([&](int i, int j, int k) { expected.push_back(map.grid().at(i, j, k) * unit); });
  BoneWithDepth both(bone, map);
  for (int cut = 0; cut < 1000; ++cut) {
    const Vec3d p = o.spacing.cwiseProduct(Vec3d(random.uniform(8, 48), random.uniform(8, 48), random.uniform(30, 46)));
    const SphereCutter cutter(p, p + random.uniform(0, 1) * 3e-4 * random.unit(), random.uniform(2, 4) * 3e-4);
    const std::uint64_t edits = bone.edit_count();
    static_cast<void>(carve(both, o.isovalue(), cutter));
    if (bone.edit_count() == edits) continue;  // in air: depths are not looked at
    std::size_t v = 0;
    for_all([&](int i, int j, int k) {
      const double d = cutter.signed_distance(o.spacing.cwiseProduct(Vec3d(i, j, k)));
      if (d < reach) expected[v] = std::min(expected[v], d);
      ++v;
    });
  }
  const DepthMap anew(bone, o.isovalue());
  std::size_t v = 0;
  double off = 0, off_anew = 0, overstated = 0;
  int inside = 0;
  for_all([&](int i, int j, int k) {
    const double depth = map.grid().at(i, j, k) * unit;
    if (expected[v] > 0) {
      off = std::max(off, std::abs(depth - expected[v]));
      const double difference = depth - anew.grid().at(i, j, k) * unit;
      off_anew += difference * difference;
      ++inside;
    } else if (random.below(20) == 0) {
      // Outside, bone is not nearer than the depth says: look at the voxels themselves.
      double nearest = 6 * 3e-4;
      for (int dk = -5; dk <= 5; ++dk)
        for (int dj = -5; dj <= 5; ++dj)
          for (int di = -5; di <= 5; ++di)
            if (bone.contains(i + di, j + dj, k + dk) && bone.at(i + di, j + dj, k + dk) >= o.isovalue())
              nearest = std::min(nearest, 3e-4 * Vec3d(di, dj, dk).norm());
      overstated = std::max(overstated, -depth - nearest);
    }
    ++v;
  });
  CHECK(off <= 1.01 * unit);
  CHECK(std::sqrt(off_anew / inside) <= 0.06 * 3e-4);
  CHECK(overstated <= 0.05 * 3e-4);
  MESSAGE("against a map made anew: ", std::sqrt(off_anew / inside) / 3e-4, " voxels rms over ", inside,
          " voxels in bone");
  CHECK(both.restore() == 0);
  CHECK(map.grid().at(28, 28, 5) > 0);
}

TEST_CASE("depths follow bone that wears down: their surface is that of the densities") {
  RasterOptions o{.size = {40, 40, 40}};
  auto bone = rasterise<std::uint8_t>(HalfSpace{o.middle() + Vec3d(0, 0, 3e-4), Vec3d::UnitZ()}, o);
  DepthMap map(bone, o.isovalue());
  BoneWithDepth both(bone, map);
  const SphereCutter cutter(o.middle(), o.middle(), 5 * 3e-4);
  const RateLimitedCut<> slow{.rate = 2000};
  for (std::uint32_t tick = 0; tick < 400; ++tick)
    static_cast<void>(carve(both, o.isovalue(), cutter, slow, CutAllowance{.dt = 1e-3, .tick = tick}));
  // Along rays from the cutter's centre down: where densities fall below the isovalue and where depths fall below 0.
  const DensityField<std::uint8_t, double> density(bone, o.isovalue());
  const DepthField<double> depth(map);
  Random random(4);
  double off = 0;
  for (int i = 0; i < 300; ++i) {
    Vec3d d = random.unit();
    d.z() = -std::abs(d.z()) - 0.3;
    d.normalize();
    const auto surface = [&](const auto& field) {
      double s = 0;
      while (s < 9 * 3e-4 && !(field.value(o.middle() + s * d) >= 0)) s += 3e-6;
      return s;
    };
    off = std::max(off, std::abs(surface(density) - surface(depth)));
  }
  CHECK(off <= 0.15 * 3e-4);
}

// Densities fall from far above the isovalue to just below it where the burr was: neither is a ramp's.
TEST_CASE("depths follow bone of a scanner's contrast at every stage of its wear") {
  RasterOptions o{.size = {40, 40, 32}, .spacing = {3e-4, 3e-4, 4.5e-4}};
  o.contrast = 2500;
  o.air = -1000;
  const double h = 3e-4;
  auto bone = rasterise<std::int16_t>(HalfSpace{o.middle() + Vec3d(0, 0, h), Vec3d(0.2, 0.1, 1).normalized()}, o);
  DepthMap map(bone, o.isovalue());
  BoneWithDepth both(bone, map);
  const SphereCutter cutter(o.middle(), o.middle(), 6 * h);
  const RateLimitedCut<> slow{.rate = 5000};
  constexpr double kSteep = 200;  // [densities per voxel]
  double off = 0, squares = 0, off_anew = 0;
  int rays = 0, voxels = 0, other_side = 0;
  for (std::uint32_t tick = 0; tick < 600; ++tick) {
    static_cast<void>(carve(both, o.isovalue(), cutter, slow, CutAllowance{.dt = 1e-3, .tick = tick}));
    if (tick % 60 != 59) continue;
    const DensityField<std::int16_t, double> density(bone, o.isovalue());
    const DepthField<double> depth(map);
    Random random(4);
    for (int i = 0; i < 200; ++i) {
      Vec3d d = random.unit();
      d.z() = -std::abs(d.z()) - 0.3;
      d.normalize();
      double reached = 0;
      while (reached < 9 * h && !(density.value(o.middle() + reached * d) >= 0)) reached += 3e-6;
      if (reached == 0 || reached >= 9 * h) continue;
      const Vec3d p = o.middle() + reached * d;
      // Where bone is worn to a few densities about the isovalue, the image hardly says where it ends.
      if (density.gradient(p).norm() < kSteep / h) continue;
      const double depth_there = depth.metres() * depth.value(p);
      off = std::max(off, std::abs(depth_there));
      squares += depth_there * depth_there;
      ++rays;
    }
    const DepthMap anew(bone, o.isovalue());
    for (int k = 4; k < 28; ++k)
      for (int j = 4; j < 36; ++j)
        for (int i = 4; i < 36; ++i) {
          const double is = map.grid().at(i, j, k), should = anew.grid().at(i, j, k);
          const bool in = static_cast<double>(bone.at(i, j, k)) >= o.isovalue();
          if (in ? is < 0 : is > 0) ++other_side;
          if (!(should > 0 && should < 2 * DepthMap::kPerVoxel)) continue;
          const double difference = (is - should) / DepthMap::kPerVoxel;
          off_anew += difference * difference;
          ++voxels;
        }
  }
  off_anew = std::sqrt(off_anew / voxels);
  const double rms = std::sqrt(squares / rays);
  MESSAGE("depth at the densities' surface: ", rms / h, " voxels rms, at most ", off / h,
          "; against maps made anew: ", off_anew, " voxels rms");
  REQUIRE(rays > 300);
  CHECK(rms <= 0.12 * h);
  CHECK(off <= 0.5 * h);
  CHECK(off_anew <= 0.1);
  CHECK(other_side == 0);
}

TEST_CASE("depth maps that cannot be are refused") {
  RasterOptions o{.size = {8, 8, 8}};
  const auto bone = rasterise<std::uint8_t>(Ball{o.middle(), 3 * 3e-4}, o);
  CHECK_THROWS_AS(DepthMap(bone, std::numeric_limits<double>::quiet_NaN()), std::invalid_argument);
  CHECK_THROWS_AS(DepthMap(bone, 127.5, {.reach = 1}), std::invalid_argument);
  CHECK_THROWS_AS(DepthMap(bone, 127.5, {.reach = 200}), std::invalid_argument);
  // No bone, nothing but bone, a single voxel.
  CHECK(DepthMap(bone, 300).grid().at(4, 4, 4) < 0);
  CHECK(DepthMap(bone, -1).grid().at(4, 4, 4) > 0);
  const std::vector<std::uint8_t> one{255};
  const VoxelGrid<std::uint8_t> voxel({.size = {1, 1, 1}, .spacing = {1e-3, 1e-3, 1e-3}, .outside = 0}, one);
  CHECK(DepthMap(voxel, 127.5).grid().at(0, 0, 0) > 0);
}

}  // namespace
