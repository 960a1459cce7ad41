// SPDX-License-Identifier: MIT
#include "support/figures.hpp"
#include "support/malloc_hook.hpp"
#include "support/raster.hpp"
#include "voxel/sampled_fields.hpp"

#include <trephine/voxel/bone_surface.hpp>
#include <trephine/voxel/carving.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <thread>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 302;
constexpr double kPi = 3.14159265358979323846;
constexpr double kH = 3e-4;

/// An element as the store keeps it, to compare bit by bit.
struct Kept {
  std::array<float, 11> values;  // position, along, across, area, spread
  bool operator==(const Kept&) const = default;
};
constexpr std::size_t kMaxOfEdge = 64;
/// All that a surface has, by voxel edge: 3 · (index of the edge's first voxel in the padded array) + axis, times
/// kMaxOfEdge, and the part of its element.
struct AllPatches {
  std::map<std::size_t, Kept> kept;
  std::map<std::size_t, SurfaceElement> elements;
  int twice = 0;   // edges that have two of a part
  int denied = 0;  // bricks that provide() refused
};

template <class Density>
void add_brick(const BoneSurface<Density>& surface, std::size_t brick, AllPatches& all) {
  const auto& grid = surface.grid();
  const auto at = grid.brick_coordinates(brick);
  surface.for_each_block(brick, [&](const ElementBlock& b, int count) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      const std::uint32_t edge = b.edge[i] % ElementBlock::kEdges, part = b.edge[i] / ElementBlock::kEdges;
      const int e = static_cast<int>(edge / 3);
      const std::size_t voxel = grid.index(8 * at[0] + e % 9 - 1, 8 * at[1] + e / 9 % 9 - 1, 8 * at[2] + e / 81 - 1);
      const std::size_t key = kMaxOfEdge * (3 * voxel + edge % 3) + part;
      all.twice += all.kept.count(key) > 0 ? 1 : 0;
      const auto &p = b.position, &u = b.along, &v = b.across;
      all.kept[key] = {
          {p[0][i], p[1][i], p[2][i], u[0][i], u[1][i], u[2][i], v[0][i], v[1][i], v[2][i], b.area[i], b.spread[i]}};
      all.elements[key] = b.element(i, surface.corner(brick));
    }
  });
}

/// Every brick of a surface, each in a tick of its own.
template <class Density>
AllPatches all_of(BoneSurface<Density>& surface) {
  AllPatches all;
  for (std::size_t brick = 0; brick < surface.grid().brick_count(); ++brick) {
    surface.begin_tick();
    surface.begin_use();
    if (!surface.crosses(brick)) continue;
    if (surface.provide(brick))
      add_brick(surface, brick, all);
    else
      ++all.denied;
  }
  return all;
}

template <class Density>
AllPatches all_anew(const VoxelGrid<Density>& grid, double isovalue) {
  BoneSurface<Density> surface(grid, isovalue);
  return all_of(surface);
}

/// The element that a voxel edge should have whose ends lie on different sides.
struct Crossed {
  Vec3d middle, along, across;
  double area;
  double of_face;     // the area in faces of a voxel
  double unsettled;   // how far a rounding moves the element, over the rounding
  bool flat = false;  // lies along its edge, so that roundings decide which way is out
};

/// All of them by their definition, by 3 · (index of the edge's first voxel) + axis.
template <class Density>
std::map<std::size_t, Crossed> crossed_of(const VoxelGrid<Density>& grid, double isovalue) {
  using Voxel = std::array<int, 3>;
  const Vec3d h = grid.spacing();
  const PlainCrossings<Density> crossings{grid, isovalue};
  const auto moved = PlainCrossings<Density>::moved;
  const auto crossing = [&](const Voxel& v, std::size_t a) { return crossings.on_edge(v, a); };
  const auto next = [&](const Voxel& v, std::size_t a, std::size_t b, int side) {
    return crossings.next(v, a, b, side);
  };
  const auto cell = [&](const Voxel& v) {
    Vec3d sum = Vec3d::Zero();
    int count = 0;
    for (std::size_t a = 0; a < 3; ++a)
      for (int i = 0; i < 4; ++i)
        if (const auto at = crossing(moved(moved(v, (a + 1) % 3, i % 2), (a + 2) % 3, i / 2), a)) {
          sum += *at;
          ++count;
        }
    return Vec3d(sum / count);
  };
  std::map<std::size_t, Crossed> all;
  for (int k = -1; k < grid.size()[2]; ++k)
    for (int j = -1; j < grid.size()[1]; ++j)
      for (int i = -1; i < grid.size()[0]; ++i)
        for (std::size_t a = 0; a < 3; ++a) {
          const Voxel v{i, j, k};
          const auto at = crossing(v, a);
          if (!at) continue;
          const std::size_t b = (a + 1) % 3, c = (a + 2) % 3;
          const Vec3d p00 = cell(moved(moved(v, b, -1), c, -1)), p10 = cell(moved(v, c, -1));
          const Vec3d p01 = cell(moved(v, b, -1)), p11 = cell(v);
          Crossed& q = all[3 * grid.index(i, j, k) + a];
          q = {(p00 + p10 + p01 + p11) / 4, (p10 + p11 - p00 - p01) / 4, (p01 + p11 - p00 - p10) / 4, 0, 0, 1};
          const Vec3d n = q.along.cross(q.across);
          q.area = 4 * n.norm();
          q.of_face = q.area / (h.prod() / h[static_cast<Eigen::Index>(a)]);
          if (!(q.area > 0)) continue;
          // Moved out, and at edges of bone onto the faces' means, less far where one would stand out.
          const double tilt = n[static_cast<Eigen::Index>(a)] / n.norm();
          const Vec3d out = n.normalized() * ((tilt > 0) == crossings.is_bone(v) ? 1 : -1);
          const Vec3d b0 = next(v, a, b, -1), b1 = next(v, a, b, 1), c0 = next(v, a, c, -1), c1 = next(v, a, c, 1);
          const Vec3d on_faces = ((*at + b0) / 2 + (*at + b1) / 2 + (*at + c0) / 2 + (*at + c1) / 2) / 4;
          // Half the way between the means of both pairs, taken inward as far as one would stand out.
          const Vec3d half = ((b0 + b1) - (c0 + c1)) / 8;
          const double height = half.dot(out), hb = h[static_cast<Eigen::Index>(b)],
                       hc = h[static_cast<Eigen::Index>(c)];
          const double over = std::max(0.0, std::abs(height) - std::pow(h.minCoeff(), 3) / (8 * hb * hc));
          const Vec3d edge = over > 0 ? Vec3d(on_faces - over / height * half) : on_faces;
          const double rise = (on_faces - q.middle).dot(out);
          const double round = 2 * h.minCoeff() / (8 * 12);
          const double thin = q.along.norm() * q.across.norm() / n.norm();
          q.unsettled = 1 + thin * (1 + (rise > 0 ? h.maxCoeff() / round : 0));
          q.flat = std::abs(tilt) < 1e-4 * (1 + thin);
          q.middle += (rise <= round ? 2 * rise : rise < 2 * round ? 2 * round : rise) * out;
          const double sharp = rise <= round ? 0 : rise < 2 * round ? rise / round - 1 : 1;
          q.middle = (1 - sharp) * q.middle + sharp * edge;
          q.along = (1 - sharp) * q.along + sharp * (b1 - b0) / 4;
          q.across = (1 - sharp) * q.across + sharp * (c1 - c0) / 4;
        }
  return all;
}

/// Edges that should have an element, in all its parts, and have none, and the other way round.
template <class Density>
int holes(const AllPatches& all, const VoxelGrid<Density>& grid, const std::map<std::size_t, Crossed>& crossed) {
  // Single precision of places up to nine voxels from a brick's corner is good to some 1e-6 of a face.
  constexpr double kMin = 1e-4, kRounding = 1e-5;
  const Vec3d h = grid.spacing();
  std::array<int, 3> parts{};
  for (std::size_t a = 0; a < 3; ++a)
    parts[a] = std::clamp(static_cast<int>(std::lround(h[static_cast<Eigen::Index>(a)] / h.minCoeff())), 1, 8);
  std::map<std::size_t, int> found;
  for (const auto& [key, kept] : all.kept) ++found[key / kMaxOfEdge];
  int wrong = 0;
  for (const auto& [key, q] : crossed) {
    const auto it = found.find(key);
    const int has = it == found.end() ? 0 : it->second, whole = parts[(key + 1) % 3] * parts[(key + 2) % 3];
    wrong += has != 0 && has != whole ? 1 : 0;
    wrong += (q.of_face > kMin + kRounding && has == 0) || (q.of_face < kMin - kRounding && has != 0) ? 1 : 0;
  }
  for (const auto& [key, count] : found) wrong += crossed.count(key) > 0 ? 0 : 1;
  return wrong;
}

double middle_of(const auto& grid) {
  const double lo = static_cast<double>(grid.original_range().min), hi = static_cast<double>(grid.original_range().max);
  return lo + 0.45 * (hi - lo);
}

TEST_CASE_TEMPLATE("bone surface: every crossed edge has its element, from its cells' and its faces' crossings",
                   Density, std::uint8_t, std::int8_t, std::uint16_t, std::int16_t, float) {
  CAPTURE(kSeed);
  // Single precision of places up to nine voxels from a brick's corner.
  constexpr double kRounding = 12 * 1.2e-7;
  std::mt19937 rng(kSeed);
  Figures sides, areas, middles;
  int short_spreads = 0, flat = 0;
  for (const Vec3d& h : {Vec3d(3e-4, 3e-4, 3e-4), Vec3d(2e-4, 3e-4, 15e-4), Vec3d(5e-3, 2e-4, 4e-4)}) {
    const auto noise = random_grid<Density>({.size = {29, 17, 24}, .spacing = h, .outside = 1}, rng);
    const double contrast = std::is_same_v<Density, float> ? 5 : 120;
    const RasterOptions o{.size = {33, 26, 16}, .spacing = h, .contrast = contrast};
    const auto smooth = rasterise<Density>(Ball{o.middle(), 0.45 * h.cwiseProduct(Vec3d(33, 26, 16)).minCoeff()}, o);
    for (const auto* grid : {&noise, &smooth}) {
      const double isovalue = middle_of(*grid), longest = h.maxCoeff();
      const AllPatches all = all_anew(*grid, isovalue);
      const auto crossed = crossed_of(*grid, isovalue);
      CHECK(all.elements.size() > 300);
      CHECK(all.twice == 0);
      CHECK(all.denied == 0);
      CHECK(holes(all, *grid, crossed) == 0);
      struct Whole {
        Vec3d position = Vec3d::Zero();
        double area = 0;
        int parts = 0;
      };
      std::map<std::size_t, Whole> whole;
      for (const auto& [key, p] : all.elements) {
        Whole& w = whole[key / kMaxOfEdge];
        w.position += p.position;
        w.area += p.area;
        ++w.parts;
        short_spreads += static_cast<double>(all.kept.at(key).values[10]) >= p.along.norm() + p.across.norm() ? 0 : 1;
      }
      for (const auto& [edge, w] : whole) {
        const Crossed& q = crossed.at(edge);
        areas.add(std::abs(w.area - q.area) / (longest * longest));
        flat += q.flat ? 1 : 0;
        if (!q.flat) middles.add((w.position / w.parts - q.middle).norm() / (longest * q.unsettled));
      }
      std::array<double, 3> parts{};
      for (Eigen::Index a = 0; a < 3; ++a)
        parts[static_cast<std::size_t>(a)] = std::clamp(std::round(h[a] / h.minCoeff()), 1.0, 8.0);
      for (const auto& [key, p] : all.elements) {
        const Crossed& q = crossed.at(key / kMaxOfEdge);
        if (q.flat) continue;
        const std::size_t a = key / kMaxOfEdge % 3;
        const Vec3d along = p.along * parts[(a + 1) % 3] - q.along, across = p.across * parts[(a + 2) % 3] - q.across;
        sides.add(std::max(along.norm(), across.norm()) / (longest * q.unsettled));
      }
    }
  }
  MESSAGE("off what crossings tell [voxels]: sides ", sides, ", areas ", areas, ", middles ", middles,
          "; along their edges ", flat);
  CHECK(short_spreads == 0);
  CHECK(sides.worst() <= kRounding);
  CHECK(areas.worst() <= 4 * kRounding);
  // Twice the way between two means, along a normal that four sides' roundings turn.
  CHECK(middles.worst() <= 6 * kRounding);
  CHECK(flat < 20);
}

// Points of elements, four each as the foundation has them, against a ball's hole that was cut into a block.
TEST_CASE("bone surface: a hole's points lie on its wall, and its rim does not lean in") {
  CAPTURE(kSeed);
  constexpr double kR = 5 * kH;
  // Interpolated along edges, crossings lie up to h²/8R inside a hollow; means of chords would lie a further 4 µm.
  constexpr double kMean = 1e-6, kScatter = 7e-6, kLean = 36e-6;
  Random random(kSeed + 6);
  Figures mean, scatter, lean;
  for (int i = 0; i < 12; ++i) {
    const RasterOptions o{.size = {40, 40, 44}, .contrast = 2000, .air = -1000};
    const Vec3d n = i == 0 ? Vec3d(Vec3d::UnitZ()) : random.unit();
    const Vec3d shift{random.uniform(), random.uniform(), random.uniform()};
    const Vec3d bottom = o.middle() + kH * shift, top = bottom + random.uniform(5, 8) * kH * n;
    auto grid = rasterise<std::int16_t>(HalfSpace{top, n}, o);
    REQUIRE(carve(grid, o.isovalue(), SphereCutter(top + 2 * kR * n, bottom, kR)) > 0);
    double area = 0, sum = 0, squares = 0, nearest = 0;
    for (const auto& [key, p] : all_anew(grid, o.isovalue()).elements)
      for (int j = 0; j < 4; ++j) {
        const Vec3d q = p.position + (j % 2 - 0.5) * p.along + (j / 2 - 0.5) * p.across;
        const double z = (q - bottom).dot(n);
        const double off = (z > 0 ? (q - bottom - z * n).norm() : (q - bottom).norm()) - kR;
        if ((q - bottom).norm() < 9 * kH) nearest = std::min(nearest, off);
        // Nearer to the top the blurred face is lower than the cut's ramp.
        if ((q - top).dot(n) > -2.5 * kH || !(std::abs(off) < 0.3 * kH)) continue;
        area += p.area;
        sum += p.area * off;
        squares += p.area * off * off;
      }
    mean.add(std::abs(sum / area));
    scatter.add(std::sqrt(squares / area - sum / area * sum / area));
    lean.add(-nearest);
  }
  MESSAGE("points of a hole [m]: mean off its wall ", mean, ", scatter ", scatter, ", lean in by ", lean);
  CHECK(mean.worst() <= kMean);
  CHECK(scatter.worst() <= kScatter);
  CHECK(lean.worst() <= kLean);
}

// A window that falls off smoothly: a sum over elements is its integral but for what elements stand for.
TEST_CASE("bone surface: areas add up to a plane's and a sphere's, whatever the orientation and the spacing") {
  CAPTURE(kSeed);
  // Elements tile a plane, but for its densities' rounding.
  constexpr double kAreaError = 0.01, kPlaneError = 4e-4;
  for (const Vec3d& h : {Vec3d(kH, kH, kH), Vec3d(0.7 * kH, kH, 1.4 * kH)}) {
    Random random(kSeed + 1);
    Figures plane, sphere;
    for (int i = 0; i < 12; ++i) {
      const RasterOptions o{.size = {72, 56, 48}, .spacing = h, .contrast = 20000, .air = -10000};
      const Vec3d n = i == 0 ? Vec3d(Vec3d::UnitZ()) : random.unit();
      const Vec3d at = o.middle() + 0.5 * random.uniform() * h;
      const double width = 4 * kH;
      const auto grid = rasterise<std::int16_t>(HalfSpace{at, n}, o);
      double area = 0;
      for (const auto& [key, p] : all_anew(grid, o.isovalue()).elements)
        area += p.area * std::exp(-(p.position - at).squaredNorm() / (2 * width * width));
      plane.add(std::abs(area / (2 * kPi * width * width) - 1));
      if (i >= 4) continue;
      const double R = 15 * kH * 0.7;
      const auto ball = rasterise<std::int16_t>(Ball{at, R}, o);
      area = 0;
      for (const auto& [key, p] : all_anew(ball, o.isovalue()).elements) area += p.area;
      sphere.add(std::abs(area / (4 * kPi * R * R) - 1));
    }
    MESSAGE("spacing ", 1e3 * h.x(), " x ", 1e3 * h.y(), " x ", 1e3 * h.z(), " mm: area of planes off by ", plane,
            ", of spheres by ", sphere);
    CHECK(plane.worst() <= kPlaneError);
    CHECK(sphere.worst() <= kAreaError);
  }
}

// In single precision the first isovalue is the density of some voxels, which are air.
TEST_CASE_TEMPLATE("bone surface: voxels just below the isovalue are air", Density, std::uint8_t, std::int16_t, float) {
  const RasterOptions o{.size = {24, 24, 24}, .contrast = 40};
  const auto grid = rasterise<Density>(Ball{o.middle(), 2.3 * kH}, o);
  int tried = 0;
  for (const auto [i, j, k] : {std::array{11, 11, 14}, std::array{9, 11, 12}, std::array{10, 10, 10}}) {
    const double density = static_cast<double>(grid.at(i, j, k));
    if (!(density > 5 && density < 35)) continue;
    ++tried;
    const AllPatches just_above = all_anew(grid, std::nextafter(density, 100)), above = all_anew(grid, density + 1e-3);
    CHECK(just_above.elements.size() == above.elements.size());
    double apart = 0;
    for (const auto& [key, p] : above.elements)
      if (const auto it = just_above.elements.find(key); it != just_above.elements.end())
        apart = std::max(apart, (it->second.position - p.position).norm());
    // The isovalues' difference over the slope.
    CHECK(apart < 2.5e-4 * kH);
  }
  CHECK(tried > 0);
}

TEST_CASE_TEMPLATE("bone surface: voxels at the isovalue are bone, of a mask too", Density, std::uint8_t, std::int16_t,
                   float) {
  const RasterOptions o{.size = {24, 24, 24}, .image = Image::kBinary, .contrast = 40};
  const auto grid = rasterise<Density>(Ball{o.middle(), 5.3 * kH}, o);
  const AllPatches at = all_anew(grid, 40), below = all_anew(grid, 39.99);
  CHECK(at.elements.size() > 300);
  CHECK(at.elements.size() == below.elements.size());
  int apart = 0;
  for (const auto& [key, p] : below.elements) {
    const auto it = at.elements.find(key);
    apart += it != at.elements.end() && (it->second.position - p.position).norm() < 0.01 * kH ? 0 : 1;
  }
  CHECK(apart == 0);
  const BoneSurface<Density> surface(grid, 40);
  CHECK(surface.is_bone(o.middle()));
  CHECK(surface.has_bone(grid.brick_index(1, 1, 1)));
  CHECK(surface.crosses(grid.brick_index(1, 1, 1)));
}

TEST_CASE("bone surface: bone that the volume cuts off ends in a face") {
  for (const int n : {15, 16, 17}) {
    CAPTURE(n);
    const auto grid = make_grid<std::uint8_t>({.size = {n, n, n}, .spacing = Vec3d::Constant(kH), .outside = 0},
                                              [](int, int, int) { return 200; });
    const AllPatches all = all_anew(grid, 100);
    CHECK(all.elements.size() == static_cast<std::size_t>(6 * n * n));
    // Beside the cube's edges elements lean over them.
    int outside = 0, flat = 0;
    for (const auto& [key, p] : all.elements) {
      Vec3d from_middle = (p.position - Vec3d::Constant((n - 1) * kH / 2)).cwiseAbs();
      std::sort(from_middle.data(), from_middle.data() + 3);
      if (from_middle[1] > (0.5 * n - 0.8) * kH) continue;
      ++flat;
      outside += std::abs(from_middle[2] / (n * kH / 2) - 1) < 1e-6 ? 0 : 1;
    }
    CHECK(flat == 6 * (n - 2) * (n - 2));
    CHECK(outside == 0);
  }
  // Where bone goes on beyond the volume there is no face.
  const auto endless = make_grid<std::uint8_t>({.size = {16, 16, 16}, .spacing = Vec3d::Constant(kH), .outside = 200},
                                               [](int, int, int) { return 200; });
  CHECK(all_anew(endless, 100).elements.empty());
}

TEST_CASE_TEMPLATE("bone surface: a cut shows once it is provided anew, restore() brings the first back", Density,
                   std::uint8_t, std::int16_t, float) {
  const RasterOptions o{.size = {40, 33, 32}, .contrast = 100};
  auto grid = rasterise<Density>(HalfSpace{o.middle(), Vec3d(0.2, 0.1, 1).normalized()}, o);
  BoneSurface<Density> surface(grid, o.isovalue());
  const AllPatches before = all_of(surface);
  const auto as_kept = [&] {
    AllPatches all;
    for (std::size_t b = 0; b < grid.brick_count(); ++b)
      if (surface.crosses(b)) add_brick(surface, b, all);
    return all;
  };
  const SphereCutter cutter(o.middle(), o.middle() + Vec3d(2 * kH, kH, -kH), 4 * kH);
  std::vector<std::size_t> first;
  for (std::size_t b = 0; b < grid.brick_count(); ++b)
    if (surface.crosses(b)) first.push_back(b);
  REQUIRE(carve(grid, o.isovalue(), cutter) > 0);
  AllPatches unasked;
  for (const std::size_t b : first) add_brick(surface, b, unasked);
  CHECK(unasked.kept == before.kept);
  const AllPatches after = all_of(surface);
  CHECK(after.kept != before.kept);
  CHECK(after.kept == all_anew(grid, o.isovalue()).kept);
  CHECK(as_kept().kept == after.kept);
  CHECK(holes(after, grid, crossed_of(grid, o.isovalue())) == 0);
  grid.restore();
  CHECK(all_of(surface).kept == before.kept);
}

// A cut changes the bricks of its turn and the halos of others, and a brick is computed once a round.
TEST_CASE("bone surface: bricks that were cut wait for their turn, a round at most, in a surface that takes them too") {
  const RasterOptions o{.size = {90, 60, 50}, .contrast = 100};
  auto grid = rasterise<std::int16_t>(HalfSpace{o.middle(), Vec3d(0.2, 0.1, 1).normalized()}, o);
  BoneSurface<std::int16_t> surface(grid, o.isovalue());
  constexpr int kTurns = 7;
  std::vector<int> computed(grid.brick_count(), 0);
  const auto tick = [&](BoneSurface<std::int16_t>& of, int turn) {
    of.begin_tick(std::numeric_limits<int>::max());
    of.begin_use();
    of.begin_turn({turn, kTurns});
    AllPatches all;
    for (std::size_t b = 0; b < grid.brick_count(); ++b) {
      if (!of.crosses(b)) continue;
      const std::uint64_t changes = of.changes();
      REQUIRE(of.provide(b));
      computed[b] += of.changes() != changes ? 1 : 0;
      add_brick(of, b, all);
    }
    return all;
  };
  const AllPatches before = tick(surface, 0);
  std::vector<int> had = computed;
  const SphereCutter cutter(o.middle(), o.middle(), 18 * kH);
  for (int t = 0; t < kTurns; ++t) {
    carve(grid, o.isovalue(), cutter, GeometricCut{}, {}, 0, {t, kTurns});
    const AllPatches now = tick(surface, t);
    if (t == 3) {
      auto copy = grid.copy();
      BoneSurface<std::int16_t> other(copy, o.isovalue());
      other.take_waiting(surface);
      const std::vector<int> counts = computed;
      CHECK(tick(other, t + 1).kept == tick(surface, t + 1).kept);
      computed = counts;
      CHECK(now.kept != all_anew(grid, o.isovalue()).kept);
    }
  }
  for (std::size_t b = 0; b < grid.brick_count(); ++b) CHECK(computed[b] - had[b] <= (had[b] > 0 ? 1 : 2));
  for (int t = 0; t < kTurns; ++t) static_cast<void>(tick(surface, t));
  const AllPatches after = tick(surface, 0);
  CHECK(after.kept != before.kept);
  CHECK(after.kept == all_anew(grid, o.isovalue()).kept);
  // What no one asked for during a round is computed at once.
  carve(grid, o.isovalue(), SphereCutter(cutter.origin(), cutter.origin(), 20 * kH));
  for (int t = 0; t < kTurns; ++t) surface.begin_tick();
  CHECK(tick(surface, 0).kept == all_anew(grid, o.isovalue()).kept);
  grid.restore();
  CHECK(tick(surface, 0).kept == before.kept);
}

/// Blocks that any one brick's elements fit into.
constexpr std::size_t kFewest =
    ElementBlock::kEdges * ElementSize::kMaxParts * ElementSize::kMaxParts / ElementBlock::kSize + 1;
constexpr std::size_t kMany = 65536;

// Bricks of nothing but surface, in voxels so long that elements have many parts: the store has room for some dozen.
TEST_CASE("bone surface: the smallest store answers as a large one, in any order of asking") {
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed + 2);
  const Vec3d h(kH, kH, 8 * kH);
  const GridGeometry geometry{.size = {40, 24, 24}, .spacing = h, .outside = 0};
  const auto noise = random_grid<std::uint8_t>(geometry, rng);
  const auto chess = make_grid<std::uint8_t>(geometry, [](int i, int j, int k) { return (i + j + k) % 2 * 200; });
  const RasterOptions o{.size = {40, 24, 24}, .spacing = h};
  const auto smooth = rasterise<std::uint8_t>(HalfSpace{o.middle(), Vec3d::UnitZ()}, o);
  CHECK(all_anew(chess, 100).elements.size() > 2 * kFewest * ElementBlock::kSize);
  for (const auto* grid : {&noise, &chess, &smooth}) {
    BoneSurface<std::uint8_t> large(*grid, 100, kMany), small(*grid, 100, kFewest);
    const AllPatches all = all_of(large);
    CHECK(all_of(small).kept == all.kept);
    int differ = 0;
    for (int i = 0; i < 300; ++i) {
      const std::size_t brick = rng() % grid->brick_count();
      if (i % 7 == 0) small.begin_use();
      small.begin_tick();
      large.begin_tick();
      if (!small.crosses(brick)) continue;
      AllPatches a, b;
      if (small.provide(brick)) add_brick(small, brick, a);
      if (large.provide(brick)) add_brick(large, brick, b);
      differ += a.kept == b.kept && !a.kept.empty() ? 0 : 1;
    }
    CHECK(differ == 0);
  }
  CHECK_THROWS_AS(BoneSurface<std::uint8_t>(noise, 100, kFewest - 1), std::invalid_argument);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    CHECK_THROWS_AS(BoneSurface<std::uint8_t>(noise, bad), std::invalid_argument);
}

TEST_CASE("bone surface: a tick makes so many bricks and no more, and none takes memory") {
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed + 3);
  const auto grid =
      random_grid<std::uint8_t>({.size = {56, 48, 48}, .spacing = Vec3d(kH, kH, 8 * kH), .outside = 0}, rng);
  using Surface = BoneSurface<std::uint8_t>;
  REQUIRE(grid.brick_count() > 2 * Surface::kBricksPerTick - 50);
  for (const std::size_t blocks : {kFewest, kMany}) {
    Surface surface(grid, 100, blocks);
    const auto heap = heap_calls([&] {
      surface.begin_tick();
      static_cast<void>(surface.provide(0));
    });
    CHECK(heap == 0);
    surface.begin_tick();
    int provided = 0, wrong = 0;
    std::int64_t calls = 0;
    for (std::size_t b = 1; b < grid.brick_count(); ++b) {
      bool ok = false;
      calls += heap_calls([&] { ok = surface.provide(b); });
      provided += ok ? 1 : 0;
      wrong += ok == (b <= static_cast<std::size_t>(Surface::kBricksPerTick)) ? 0 : 1;
    }
    CHECK(calls == 0);
    CHECK(wrong == 0);
    CHECK(provided == Surface::kBricksPerTick);
    // One that is up to date costs nothing.
    if (blocks == kMany) CHECK(surface.provide(1));
    surface.begin_tick();
    CHECK(surface.provide(grid.brick_count() - 1));
    surface.begin_tick(2);
    CHECK(surface.provide(2));
    provided = 0;
    if (blocks == kFewest)
      for (std::size_t b = 3; b < 9; ++b) provided += surface.provide(b) ? 1 : 0;
    CHECK(provided <= 2);
    surface.begin_tick(static_cast<int>(grid.brick_count()));
    for (std::size_t b = 0; b < grid.brick_count(); ++b) CHECK(surface.provide(b));
  }
}

// By brute force over all bricks; no side of the grid is a multiple of a box.
TEST_CASE("bone surface: boxes have the bricks of bone, keep those that are cut, and learn of bone that comes back") {
  using Surface = BoneSurface<std::uint8_t>;
  const RasterOptions o{.size = {70, 41, 90}, .spacing = Vec3d::Constant(kH)};
  const auto raster = rasterise<std::uint8_t>(Ball{o.middle(), 14 * kH}, o);
  std::vector<std::uint8_t> voxels(70 * 41 * 90);
  raster.copy_voxels(voxels);
  VoxelGrid<std::uint8_t> bone({.size = o.size, .spacing = o.spacing, .outside = raster.outside()}, voxels,
                               {.keep_original = true});
  using Bricks = std::vector<std::size_t>;
  const auto told = [&](Surface& surface) {
    Bricks all;
    const auto& n = bone.bricks();
    for (int k = 0; k * Surface::kBox < n[2]; ++k)
      for (int j = 0; j * Surface::kBox < n[1]; ++j)
        for (int i = 0; i * Surface::kBox < n[0]; ++i) {
          std::vector<std::array<int, 3>> found;
          surface.for_each_brick_of_bone({i, j, k}, [&](const std::array<int, 3>& at) { found.push_back(at); });
          for (const auto& at : found) {
            REQUIRE((at[0] < n[0] && at[1] < n[1] && at[2] < n[2]));
            CHECK((at[0] / Surface::kBox == i && at[1] / Surface::kBox == j && at[2] / Surface::kBox == k));
            all.push_back(bone.brick_index(at[0], at[1], at[2]));
          }
        }
    std::sort(all.begin(), all.end());
    return all;
  };
  Surface surface(bone, o.isovalue());
  const auto bricks_of_bone = [&] {
    Bricks all;
    for (std::size_t b = 0; b < bone.brick_count(); ++b)
      if (surface.has_bone(b)) all.push_back(b);
    return all;
  };
  const Bricks whole = bricks_of_bone();
  REQUIRE(whole.size() > 30);
  REQUIRE(whole.size() + 30 < bone.brick_count());
  CHECK(told(surface) == whole);

  const Vec3d side = o.middle() + Vec3d(10 * kH, 0, 0);
  REQUIRE(carve(bone, o.isovalue(), SphereCutter(side, side, 12 * kH)) > 0);
  REQUIRE(bricks_of_bone() != whole);
  CHECK(told(surface) == whole);
  Surface cut(bone, o.isovalue());
  CHECK(told(cut) == bricks_of_bone());
  bone.restore();
  CHECK(told(cut) == whole);
  CHECK(heap_calls([&] { cut.for_each_brick_of_bone({0, 0, 0}, [](const std::array<int, 3>&) {}); }) == 0);
}

TEST_CASE("bone surface: scenes of a grid and an isovalue share one") {
  std::mt19937 rng(kSeed + 4);
  const GridGeometry geometry{.size = {16, 16, 16}, .spacing = Vec3d::Constant(kH), .outside = 0};
  const auto one = random_grid<std::uint8_t>(geometry, rng), other = random_grid<std::uint8_t>(geometry, rng);
  auto a = shared_bone_surface(one, 100.0);
  const auto b = shared_bone_surface(one, 100.0);
  CHECK(a == b);
  CHECK(a != shared_bone_surface(one, 101.0));
  CHECK(a != shared_bone_surface(other, 100.0));
  // Each haptic thread has its own.
  std::shared_ptr<BoneSurface<std::uint8_t>> elsewhere;
  std::thread([&] { elsewhere = shared_bone_surface(one, 100.0); }).join();
  CHECK(elsewhere != a);
  CHECK(&a->grid() == &one);
  CHECK(a->isovalue() == 100);
  const std::weak_ptr<BoneSurface<std::uint8_t>> seen = a;
  a.reset();
  CHECK_FALSE(seen.expired());
  CHECK_THROWS_AS(static_cast<void>(shared_bone_surface(one, std::nan(""))), std::invalid_argument);
}

TEST_CASE("bone surface: a point is bone where the interpolant reaches the isovalue; beyond the volume is air") {
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed + 5);
  const Vec3d h(2e-4, 3e-4, 5e-4);
  const auto grid = random_grid<std::int16_t>({.size = {20, 16, 13}, .spacing = h, .outside = -30000}, rng);
  BoneSurface<std::int16_t> surface(grid, 0);
  int wrong = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vec3d p = random_point(rng, -3 * h, h.cwiseProduct(Vec3d(23, 19, 16)));
    const double value = interpolate(grid, p);
    wrong += std::abs(value) > 1e-6 && surface.is_bone(p) != (value >= 0) ? 1 : 0;
    // A ball about p is beyond where none of it is over a cell that has bone.
    if (surface.view().is_beyond(p, 1e-3))
      wrong += (p + 9.9e-4 * random_direction(rng)).minCoeff() > -3e-3 && surface.is_bone(p) ? 1 : 0;
  }
  CHECK(wrong == 0);
  CHECK(surface.view().is_beyond(Vec3d(-2e-3, 0, 0), 1e-3));
  CHECK_FALSE(surface.view().is_beyond(Vec3d(-1e-3, 0, 0), 1e-3));
  CHECK(surface.view().voxel() == 5e-4);
}

}  // namespace
