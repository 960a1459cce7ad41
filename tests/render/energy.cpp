// SPDX-License-Identifier: MIT
#include "render/render_helpers.hpp"
#include "support/path_work.hpp"

#include <trephine/render/thesis/line.hpp>
#include <trephine/render/thesis/surface.hpp>

#include <doctest/doctest.h>

/// Net work on closed loops of poses, rotation included. A law that is the gradient of an energy does none; what it
/// does beyond friction is energy that the loop feeds into the hand or takes from it.
namespace {

using namespace trephine;
using namespace trephine::test;

const Burr kBurr{.tip_radius = 0.0018, .shaft_radius = 0.0009, .shaft_length = 0.010};

enum class Place { kTip, kShaft, kDeep };

struct Loop {
  Posed middle;
  Vec3d move[2], turn[2];
  [[nodiscard]] Posed at(double phase) const {
    const double c = std::cos(phase) - 1, s = std::sin(phase), c2 = std::cos(2 * phase) - 1;
    const Vec3d w = s * turn[0] + c2 * turn[1];
    return make_pose<double>(rotation_from_vector(w) * middle.linear(),
                             middle.translation() + c * move[0] + s * move[1]);
  }
};

struct Energy {
  double mean = 0, worst = 0;  ///< |∮ F·dx + T·dθ| / ∮ |F||dx| + |T||dθ|
  double gained = 0;           ///< mean of the signed ratio: > 0 is energy given to the hand
  int loops = 0;
};

// Loops that touch, go in deeper, turn and slide, and leave again or not.
template <class Renderer, class Field>
Energy closed_loops(Renderer& renderer, const Field& field, const Vec3d& bone, double bone_radius, Place place,
                    int count) {
  Random random(101);
  Energy e;
  for (int i = 0; i < count; ++i) {
    const Vec3d n = random.unit();
    const double depth = place == Place::kDeep ? random.uniform(1.2, 2.0) : random.uniform(0.1, 0.6);
    Loop loop;
    Vec3d shaft = (n + 0.6 * random.unit()).normalized();
    Vec3d tip = bone + (bone_radius + (1 - depth) * kBurr.tip_radius) * n;
    if (place == Place::kShaft) {  // lies across the bone with the shaft, the ball beside it
      shaft = n.unitOrthogonal();
      tip = bone + (bone_radius + 0.5 * kBurr.shaft_radius) * n - 0.006 * shaft;
    }
    if constexpr (requires { renderer.report(); })
      tip -= 0.9 * kBurr.tip_radius * n * (place == Place::kShaft ? 0.3 : 1);
    loop.middle = tool_at(tip, shaft);
    for (auto& m : loop.move) m = 0.0009 * random.arrow(0.3, 1);
    for (auto& t : loop.turn) t = 0.06 * random.arrow(0.3, 1);
    renderer.reset();
    // Come from outside, so that every law starts as it would.
    const Posed start = loop.at(0);
    lead(renderer, field, make_pose<double>(start.linear(), start.translation() + 0.004 * n), start, 120);
    constexpr int kSteps = 1500;
    // Once round to forget the start, then once round for the measure.
    for (int s = 0; s < kSteps; s += 3)
      static_cast<void>(render_at(renderer, field, loop.at(6.283185307179586 * s / kSteps)));
    PathWork work(loop.at(0), in_double(render_at(renderer, field, loop.at(0)).wrench));
    for (int s = 1; s <= kSteps; ++s) {
      const Posed X = loop.at(6.283185307179586 * s / kSteps);
      work.go(X, in_double(render_at(renderer, field, X).wrench));
    }
    if (!(work.length > 1e-7)) continue;
    ++e.loops;
    e.mean += std::abs(work.net) / work.length;
    e.gained += work.net / work.length;
    e.worst = std::max(e.worst, std::abs(work.net) / work.length);
  }
  e.mean /= std::max(1, e.loops);
  e.gained /= std::max(1, e.loops);
  return e;
}

constexpr int kLoops = 8;

struct Bench {
  RasterOptions o{.size = {88, 88, 88}};
  double radius = 20 * kVoxel;
  VoxelGrid<std::uint8_t> grid = rasterise<std::uint8_t>(Ball{o.middle(), radius}, o);
  DensityField<std::uint8_t, double> field{grid, o.isovalue()};

  /// `most`: of the worst loop [%].
  template <class R>
  Energy row(const char* name, R renderer, Place place, double most) {
    CAPTURE(name);
    CAPTURE(static_cast<int>(place));
    const Energy e = closed_loops(renderer, field, o.middle(), radius, place, kLoops);
    MESSAGE(std::string(name), " at place ", static_cast<int>(place), ": worst loop ", 100 * e.worst, " %");
    CHECK(e.loops > kLoops / 2);
    CHECK(100 * e.worst <= most);
    return e;
  }
};

TEST_CASE("closed loops: net work of every law") {
  Bench bench;
  const auto tool = [](int sphere) {
    return ToolDiscretization<SurfaceCounts, double>(kBurr, {.sphere = sphere, .slices = 10, .per_slice = 16});
  };
  const auto surface = [&](int sphere, Place place, double most) {
    return bench.row("Surface", SurfaceApproxRenderer<double>(tool(sphere)), place, most);
  };
  const auto thesis_surface = [&](Place place, double most) {
    return bench.row("the thesis' Surface", ThesisSurface<double>(tool(26)), place, most);
  };
  const Energy few = surface(26, Place::kTip, 16), more = surface(100, Place::kTip, 1.4),
               many = surface(400, Place::kTip, 0.39), shaft = surface(26, Place::kShaft, 0.45),
               deep_few = surface(26, Place::kDeep, 1.6), deep = surface(400, Place::kDeep, 1.6);
  const Energy thesis_tip = thesis_surface(Place::kTip, 31), thesis_shaft = thesis_surface(Place::kShaft, 100),
               thesis_deep = thesis_surface(Place::kDeep, 2.7);

  const ToolDiscretization<LineCounts, double> line_tool(kBurr, {.shaft = 100});
  const auto line = [&](Place place, double most) {
    return bench.row("Line", LineApproxRenderer<double>(line_tool), place, most);
  };
  const Energy tip = line(Place::kTip, 1.9), line_shaft = line(Place::kShaft, 8), deep_line = line(Place::kDeep, 10);
  const Energy thesis_line = bench.row("the thesis' Line", ThesisLine<double>(line_tool), Place::kShaft, 100);
  MESSAGE("mean net work, Surface's tip ", few.mean, ", ", more.mean, ", ", many.mean, ", shaft ", shaft.mean,
          ", deep ", deep_few.mean, ", ", deep.mean, "; the thesis' ", thesis_tip.mean, ", ", thesis_shaft.mean, ", ",
          thesis_deep.mean, "; Line's ", tip.mean, ", ", line_shaft.mean, ", ", deep_line.mean, ", the thesis' shaft ",
          thesis_line.mean);

  // Pulls toward a centre are no gradient, but ever more nearly one the more vertices share it.
  CHECK(many.mean < more.mean);
  CHECK(more.mean < few.mean);
  CHECK(many.worst < 0.0039);
  CHECK(thesis_tip.mean > many.mean);
  // Torque without its force is the gradient of no energy; with it, it nearly is one.
  CHECK(thesis_shaft.mean > 3 * shaft.mean);
  CHECK(thesis_line.mean > 3 * line_shaft.mean);
  // A frictionless proxy on the nearest point of a surface is the gradient of ½ k times distance squared; what is left
  // is the dents of the trilinear surface it snaps between.
  CHECK(tip.mean < 0.0089);
  CHECK(deep_line.mean < 0.05);
  CHECK(deep_line.gained < 0.005);  // snaps lose energy, they do not make it
  CHECK(deep.mean < 0.0039);
}

}  // namespace
