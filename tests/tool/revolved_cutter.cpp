// SPDX-License-Identifier: MIT
#include "support/figures.hpp"
#include "support/near.hpp"
#include "support/random.hpp"
#include "support/revolved_tools.hpp"

#include <trephine/core/units.hpp>
#include <trephine/tool/revolved_cutter.hpp>
#include <trephine/tool/rims_in_voxels.hpp>
#include <trephine/tool/shapes/cylinder.hpp>
#include <trephine/voxel/carving.hpp>
#include <trephine/voxel/density_field.hpp>

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 823;
constexpr double kIso = 300;
constexpr std::int16_t kBone = 1500;

/// Distances [voxels] from the cutter of the places where the isosurface crosses edges of cells.
Figures surface_errors(const VoxelGrid<std::int16_t>& grid, const RevolvedCutter& cutter) {
  Figures off;
  const auto& size = grid.size();
  const double h = grid.spacing().x();
  for (int k = 1; k + 1 < size[2]; ++k)
    for (int j = 1; j + 1 < size[1]; ++j)
      for (int i = 1; i + 1 < size[0]; ++i)
        for (int a = 0; a < 3; ++a) {
          const double v = grid.at(i, j, k) - kIso, w = grid.at(i + (a == 0), j + (a == 1), k + (a == 2)) - kIso;
          if ((v < 0) == (w < 0)) continue;
          const Vec3d p = h * (Vec3d(i, j, k) + v / (v - w) * Vec3d::Unit(a));
          off.add(std::abs(cutter.signed_distance(p)) / h);
        }
  return off;
}

double rms(const Figures& f) {
  double sum = 0;
  for (const double v : f.all()) sum += v * v;
  return std::sqrt(sum / static_cast<double>(f.count()));
}

/// Path of a tick: translation and rotation of up to a voxel at the head's ends.
Posed moved(const Posed& X, const CuttingHead& head, double h, Random& random) {
  const double far = std::max(head.outline.z_high(), -head.outline.z_low());
  const Vec3d turn = random.arrow(0, 0.5 * h / far);
  Posed Y = X;
  Y.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix() * X.linear();
  Y.translation() += random.arrow(0, 0.5 * h);
  return Y;
}

// A ball of 8 voxels is cut with an rms error of .022 voxel; rims sharper than a voxel are rounded by the grid.
TEST_CASE("revolved cutter: the surface left by a path lies on the swept head, in any pose") {
  Random random(kSeed);
  double worst = 0;
  for (const ToolOfShape& t : revolved_tools()) {
    const std::string& name = t.name;
    const RevolvedTool& tool = t.tool;
    CAPTURE(name);
    Figures still, swept;
    for (int n = 0; n < 6; ++n) {
      const double allowance = n % 2 == 0 ? 0.0 : 0.0001;
      const CuttingHead head = tool.cutting_head(allowance);
      const double h = 0.2_mm, length = head.outline.z_high() - head.outline.z_low();
      const int size = static_cast<int>(std::hypot(length, 2 * head.outline.largest_radius()) / h) + 12;
      const std::vector<std::int16_t> solid(static_cast<std::size_t>(size * size * size), kBone);
      VoxelGrid<std::int16_t> grid({.size = {size, size, size}, .spacing = Vec3d::Constant(h)}, solid);
      const Mat3d R = random.rotation();
      const Vec3d c =
          h * (size - 1) / 2.0 * Vec3d::Ones() - R.col(2) * (head.outline.z_high() + head.outline.z_low()) / 2;
      const Posed X = make_pose<double>(R, c + h * random.arrow());
      const Posed Y = moved(X, head, h, random);
      carve(grid, kIso, RevolvedCutter(head, X, X, h / 2));
      still.add(rms(surface_errors(grid, RevolvedCutter(head, X, X, h / 2))));
      const double removed = carve(grid, kIso, RevolvedCutter(head, X, Y, h / 2));
      CHECK(removed >= 0);
      // The union of many poses between both is the swept head.
      swept.add(rms(surface_errors(grid, RevolvedCutter(head, X, Y, h / 20))));
    }
    MESSAGE(name, ": rms [voxels] still ", still, "; swept ", swept);
    CHECK(still.worst() < 0.1);
    CHECK(swept.worst() < 0.1);
    worst = std::max({worst, still.worst(), swept.worst()});
  }
  documented("tool_quality", "Surface that a cut leaves, voxels of 0.2 mm, rms", worst);
}

// A tool that is driven ahead must not be held by what its own cut leaves at its rim.
TEST_CASE("revolved cutter: the image of a cut leaves no bone inside a rim that voxels cannot hold") {
  Random random(kSeed + 9);
  for (const double rim : {0.1_mm, 0.3_mm, 0.6_mm}) {
    CAPTURE(rim);
    const double R = 1.5_mm, h = 0.3_mm;
    const CuttingHead head =
        RevolvedTool(CylinderBurr{.radius = R, .length = 4_mm, .rim_radius = rim}).cutting_head(h * h / 8 / R);
    Figures plain, sharper;
    for (int n = 0; n < 12; ++n) {
      const int size = 28;
      const std::vector<std::int16_t> solid(static_cast<std::size_t>(size * size * size), kBone);
      const Posed X = make_pose<double>(random.rotation(), h * (size - 1) / 2.0 * Vec3d::Ones() + h * random.arrow());
      for (const bool sharp : {false, true}) {
        VoxelGrid<std::int16_t> grid({.size = {size, size, size}, .spacing = Vec3d::Constant(h)}, solid);
        const ToolOutline outline = sharp ? with_sharper_rims(head.outline, h) : head.outline;
        carve(grid, kIso, RevolvedCutter({outline, head.allowance}, X, X, h / 2));
        const DensityField<std::int16_t, double> field(grid, kIso);
        const double slope = auto_slope(grid, kIso);
        for (int i = 0; i < 400; ++i) {
          // Places all round the rim's arc.
          const double a = random.uniform(0, 2 * std::numbers::pi), b = random.uniform(0, std::numbers::pi / 2);
          const double rho = R - rim + rim * std::cos(b), z = -R + rim - rim * std::sin(b);
          const double bone = field.value(X * Vec3d(rho * std::cos(a), rho * std::sin(a), z)) / slope;
          (sharp ? sharper : plain).add(std::max(0.0, bone));
        }
      }
    }
    MESSAGE("rim ", rim, " m: bone inside it by [voxels] ", plain, "; with sharper rims ", sharper);
    CHECK(sharper.worst() <= plain.worst());
    CHECK(sharper.median() <= plain.median());
    // A rim below a voxel cannot be sharper than a corner. Of larger ones a cut by pressure, 0.15 voxel ahead of the
    // tool along its axis, clears the rest.
    if (rim < h) continue;
    CHECK(sharper.median() == 0);
    CHECK(sharper.worst() < 0.15 * std::sqrt(0.5));
  }
}

TEST_CASE("revolved cutter: lanes, rows and bounds agree with the plain distance") {
  Random random(kSeed + 1);
  for (const ToolOfShape& t : revolved_tools()) {
    const std::string& name = t.name;
    const RevolvedTool& tool = t.tool;
    CAPTURE(name);
    const CuttingHead head = tool.cutting_head(0.05_mm);
    const double h = 0.3_mm, reach = 0.4_mm;
    const Posed X = make_pose<double>(random.rotation(), random.arrow(0, 0.01)), Y = moved(X, head, h, random);
    const RevolvedCutter cutter(head, X, Y, h / 2);
    const auto box = cutter.bounds();
    for (int n = 0; n < 300; ++n) {
      const Vec3d p = box.min() - Vec3d::Constant(h) +
                      (box.sizes() + Vec3d::Constant(2 * h))
                          .cwiseProduct(Vec3d{random.uniform(), random.uniform(), random.uniform()});
      const Vec3d q = p - cutter.origin();
      std::array<float, kCutLanes> out;
      cutter.distances(static_cast<float>(q.x()), static_cast<float>(h), static_cast<float>(q.y()),
                       static_cast<float>(q.z()), out);
      HalfCutLanes half;
      cutter.distances(static_cast<float>(q.x()), static_cast<float>(h), static_cast<float>(q.y()),
                       static_cast<float>(q.z()), half);
      for (std::size_t l = 0; l < half.size(); ++l) CHECK(out[l] == half[l]);
      for (int l = 0; l < kCutLanes; ++l) {
        const Vec3d at = p + l * h * Vec3d::UnitX();
        const double d = cutter.signed_distance(at);
        CHECK(std::abs(static_cast<double>(out[static_cast<std::size_t>(l)]) - d) < 6e-9);
        if (d < 0) CHECK(box.contains(at));
      }
      RowLanes y;
      for (std::size_t l = 0; l < kCutRows; ++l) y[l] = q.y() + static_cast<double>(l) * h;
      RowSpans spans;
      cutter.rows(y, q.z(), reach, spans);
      for (std::size_t l = 0; l < kCutRows; ++l) {
        const Vec3d at(p.x(), y[l] + cutter.origin().y(), p.z());
        if (cutter.signed_distance(at) < reach) CHECK((spans.lo[l] <= q.x() && q.x() <= spans.hi[l]));
      }
    }
  }
}

// A path of several ticks, each of which leaves out the pose that the last one cut.
TEST_CASE("revolved cutter: a path whose start is cut leaves what the whole path leaves") {
  Random random(kSeed + 2);
  for (const ToolOfShape& t : revolved_tools()) {
    const std::string& name = t.name;
    CAPTURE(name);
    const CuttingHead head = t.tool.cutting_head(0);
    const double h = 0.3_mm;
    const int size =
        static_cast<int>(
            2 * std::hypot(head.outline.z_high() - head.outline.z_low(), 2 * head.outline.largest_radius()) / h) +
        12;
    const std::vector<std::int16_t> solid(static_cast<std::size_t>(size * size * size), kBone);
    VoxelGrid<std::int16_t> whole({.size = {size, size, size}, .spacing = Vec3d::Constant(h)}, solid),
        parts({.size = {size, size, size}, .spacing = Vec3d::Constant(h)}, solid);
    Posed X = make_pose<double>(random.rotation(), h * (size - 1) / 2.0 * Vec3d::Ones());
    double all_mm3 = carve(whole, kIso, RevolvedCutter(head, X, X, h / 2)), parts_mm3 = all_mm3;
    carve(parts, kIso, RevolvedCutter(head, X, X, h / 2));
    for (int tick = 0; tick < 5; ++tick) {
      const Posed Y = moved(X, head, h, random);
      all_mm3 += carve(whole, kIso, RevolvedCutter(head, X, Y, h / 2));
      parts_mm3 += carve(parts, kIso, RevolvedCutter(head, X, Y, h / 2, 0, true));
      X = Y;
    }
    CHECK(parts_mm3 == near(all_mm3, 1e-9));
    int different = 0;
    for (int k = 0; k < size; ++k)
      for (int j = 0; j < size; ++j)
        for (int i = 0; i < size; ++i) different += whole.at(i, j, k) != parts.at(i, j, k) ? 1 : 0;
    CHECK(different == 0);
  }
}

// Over consecutive ticks, rectangles and trapezia add up to the same time in each place, but for half a step at the
// ends.
TEST_CASE("revolved cutter: shares of a path without its start add up to those with it") {
  Random random(kSeed + 3);
  constexpr int kTicks = 40;
  for (const ToolOfShape& t : revolved_tools()) {
    const std::string& name = t.name;
    CAPTURE(name);
    const CuttingHead head = t.tool.cutting_head(0);
    const double h = 0.3_mm;
    const float reach = 0.4e-3F;
    const Posed X = make_pose<double>(random.rotation(), random.arrow(0, 0.01));
    const Vec3d step = random.arrow(0.2 * h, 0.9 * h);
    const auto at = [&](int tick) { return Posed(Eigen::Translation3d(tick * step) * X); };
    for (int n = 0; n < 20; ++n) {
      const Vec3d p = X.translation() + random.uniform(0, kTicks) * step + random.arrow(0, 2e-3);
      double with_start = 0, without = 0;
      for (int tick = 0; tick < kTicks; ++tick)
        for (const bool start_is_cut : {false, true}) {
          const RevolvedCutter cutter(head, at(tick), at(tick + 1), h / 2, 0, start_is_cut);
          const Vec3<float> q = (p - cutter.origin()).cast<float>();
          HalfCutLanes share, anywhere;
          anywhere.fill(1);
          cutter.shares(q.x(), static_cast<float>(h), q.y(), q.z(), reach, anywhere, share);
          (start_is_cut ? without : with_start) += static_cast<double>(share[0]);
        }
      CHECK(std::abs(with_start - without) <= 0.5 + 1e-4);
    }
  }
}

}  // namespace
