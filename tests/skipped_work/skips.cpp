// SPDX-License-Identifier: MIT
#include "support/fields.hpp"

#include <trephine/contact/friction.hpp>
#include <trephine/core/rotation.hpp>
#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/voxel/carving.hpp>
#include <trephine/voxel/clearance_map.hpp>

#include <doctest/doctest.h>

#include <cstdint>

/// Renderers that pass over what they know to be clear, beside the same ones on a field that knows nothing: all that
/// they answer is the same to the bit, along a million random poses, while bone is cut away and put back.
namespace {

using namespace trephine;
using namespace trephine::test;
using Grid = VoxelGrid<std::uint8_t>;

constexpr Burr kBurr{.tip_radius = 1.5e-3, .shaft_radius = 0.8e-3, .shaft_length = 0.03};

/// A head, a rib of two voxels that stands apart from it, and bone that the volume's side cuts off.
Grid bone(const RasterOptions& o) {
  return rasterise<std::uint8_t>(
      Either{Either{Ball{o.middle(), 3e-3},
                    Both{Ball{Vec3d(2e-3, 3e-3, 14e-3), 2e-3}, Plate{Vec3d(2e-3, 0, 0), Vec3d::UnitX(), 6e-4}}},
             Ball{Vec3d(26e-3, 10e-3, 3e-3), 2e-3}},
      o);
}

/// Anywhere in and round the volume, and then seven ticks of a hand from there: slow or quick, some hardly at all.
class Walk {
 public:
  Walk(unsigned seed, Vec3d extent) : random_(seed), extent_(std::move(extent)) {}
  Posed next() {
    if (tick_++ % 8 == 0) {
      const double round = random_.below(2) == 0 ? 0.4 : -0.2;
      const auto somewhere = [&] { return random_.uniform(-round, 1 + round); };
      X_ = make_pose<double>(random_.rotation(), Vec3d(somewhere(), somewhere(), somewhere()).cwiseProduct(extent_));
      pace_ = std::pow(10.0, random_.uniform(-2, 0));
      return X_;
    }
    X_ = make_pose<double>(rotation_from_vector(Vec3d(0.05 * pace_ * random_.unit())) * X_.linear(),
                           X_.translation() + 2e-3 * pace_ * random_.unit());
    return X_;
  }

 private:
  Random random_;
  Vec3d extent_;
  Posed X_ = Posed::Identity();
  double pace_ = 1;
  int tick_ = 0;
};

template <class Scalar>
bool same(const Rendered<Scalar>& a, const Rendered<Scalar>& b) {
  return a.wrench.force == b.wrench.force && a.wrench.torque == b.wrench.torque && a.status == b.status &&
         a.contact.count == b.contact.count && a.contact.tip == b.contact.tip && a.contact.shaft == b.contact.shaft &&
         a.contact.depth == b.contact.depth;
}
template <class Renderer>
bool same_state(const Renderer& a, const Renderer& b) {
  return a.proxy_pose().matrix() == b.proxy_pose().matrix() && a.cutting_pose().matrix() == b.cutting_pose().matrix() &&
         a.visual_pose().matrix() == b.visual_pose().matrix() &&
         std::ranges::equal(a.contacts(), b.contacts(), [](const auto& x, const auto& y) {
           return x.position == y.position && x.normal == y.normal && x.force == y.force;
         });
}

struct Outcome {
  int touching = 0;
  int shaft = 0;
  int first_difference = -1;
  std::int64_t samples_of_plain = 0;
};

template <class Renderer>
Outcome compare(const Renderer& make, int poses, unsigned seed) {
  using Scalar = typename Renderer::Scalar;
  using Field = DensityField<std::uint8_t, Scalar, typename Renderer::Gradient>;
  const RasterOptions o{.size = {90, 70, 60}, .grid = {.keep_original = true}};
  Grid grid = bone(o);
  const Field field(grid, o.isovalue());
  ClearanceMap<std::uint8_t> air(grid, o.isovalue());
  const CountingField<Field> plain(field);
  const FieldWithClearance<Field, std::uint8_t> known(field, air);
  Renderer all = make;
  Renderer skips = make;
  Walk walk(seed, 2 * o.middle());
  Outcome out;
  for (int i = 0; i < poses && out.first_difference < 0; ++i) {
    const Posed X_GT = walk.next();
    // The map is old for some thousand poses, and after `restore` it is worth nothing.
    if (i % 4096 == 1000)
      carve(grid, o.isovalue(), SphereCutter(o.middle(), o.middle() + 0.1 * Vec3d::UnitX() * o.middle().x(), 2e-3));
    if (i % 4096 == 2000) air.refresh();
    if (i % 4096 == 3000) grid.restore();
    if (i % 4096 == 3500) air.refresh();
    air.begin_tick();
    const Pose<Scalar> X = X_GT.cast<Scalar>();
    const auto a = all.render(plain, X);
    const auto b = skips.render(known, X);
    if (!same(a, b) || !same_state(all, skips)) out.first_difference = i;
    out.touching += a.contact.count > 0 ? 1 : 0;
    out.shaft += a.contact.shaft ? 1 : 0;
  }
  out.samples_of_plain = plain.samples;
  return out;
}

template <class Renderer>
void check(const std::string& name, const Renderer& make, int poses, unsigned seed) {
  CAPTURE(name);
  CAPTURE(seed);
  const Outcome out = compare(make, poses, seed);
  MESSAGE(name, ": ", poses, " poses, ", out.touching, " in contact, ", out.shaft, " of the shaft");
  CHECK(out.first_difference == -1);
  CHECK(out.touching > poses / 200);
  CHECK(out.touching < poses / 4);
  CHECK(out.shaft > poses / 1000);
}

const ToolDiscretization<SurfaceCounts> kSurfaceTool(kBurr, SurfaceCounts::thesis());
const ToolDiscretization<LineCounts> kLineTool(kBurr, LineCounts{});

TEST_CASE("Surface answers the same, whatever it passes over: 500 000 poses") {
  using Areas = SurfaceApproxRenderer<float, AreaWeights>;
  using Hold = SurfaceApproxRenderer<float, AreaWeights, HoldForce>;
  using Patches = SurfaceApproxRenderer<float>;
  using Doubles = SurfaceApproxRenderer<double>;
  check("patches", Patches(kSurfaceTool), 150000, 1);
  check("patches, few", Patches(ToolDiscretization(kBurr, SurfaceCounts{.sphere = 14, .slices = 8, .per_slice = 4})),
        50000, 9);
  check("areas", Areas(kSurfaceTool), 100000, 10);
  check("Hold", Hold(kSurfaceTool), 100000, 2);
  check("doubles", Doubles(ToolDiscretization<SurfaceCounts, double>(kBurr, SurfaceCounts::thesis())), 100000, 3);
}

TEST_CASE("Line answers the same, whatever it passes over: 500 000 poses") {
  using Rays = LineApproxRenderer<float, RayCast>;
  using Projected = LineApproxRenderer<float, TranslateRotate, ProjectedTracking, Coulomb>;
  check("translate, rotate", LineApproxRenderer<float>(kLineTool), 250000, 4);
  check("rays", Rays(kLineTool), 100000, 5);
  check("thesis", Projected(kLineTool, {.proxy = {.trigger = Trigger::kThesis}}), 100000, 6);
  check("doubles", LineApproxRenderer<double>(ToolDiscretization<LineCounts, double>(kBurr, LineCounts{})), 50000, 7);
}

// Where distances are known best: beside a block that fills its volume.
TEST_CASE_TEMPLATE("A shaft's way that is said to be clear meets no bone", Step, TranslateRotate, RayCast) {
  const std::vector<std::uint8_t> solid(24 * 24 * 24, 255);
  const Grid grid({.size = {24, 24, 24}, .spacing = Vec3d(3e-4, 2e-4, 4e-4), .outside = 0}, solid);
  using Field = DensityField<std::uint8_t, float>;
  const Field field(grid, 127.5);
  ClearanceMap<std::uint8_t> air(grid, 127.5);
  const FieldWithClearance<Field, std::uint8_t> known(field, air);
  const CountingField<Field> plain(field);
  const ToolDiscretization<LineCounts> tool(Burr{.tip_radius = 5e-4, .shaft_radius = 3e-4, .shaft_length = 6e-3},
                                            LineCounts{.shaft = 20});
  const float length = tool.heights()[static_cast<std::size_t>(tool.count() - 1)];
  std::vector<float> scratch(2 * static_cast<std::size_t>(tool.padded()));
  Random random(8);
  int beyond = 0, clear = 0, met = 0, met_though_clear = 0;
  for (int i = 0; i < 100000; ++i) {
    const Vec3d middle = 0.5 * 23 * grid.spacing();
    const auto line = [&](const Vec3d& tip, const Vec3d& direction) {
      return Centreline<float>{tip.cast<float>(), direction.normalized().cast<float>()};
    };
    const Vec3d tip = middle + random.arrow(2e-3, 12e-3);
    const Vec3d direction = random.unit();
    const double move = random.uniform(0, i % 4 < 2 ? 3e-3 : 1e-4), turn = random.uniform(0, i % 2 == 0 ? 0.5 : 4.0);
    const auto from = line(tip, direction);
    const Vec3d end = tip + move * random.unit();
    const auto to = line(end, direction + turn * random.unit());
    const bool is_clear = is_path_clear(known, from, to, length);
    const bool is_beyond = is_path_clear(field, from, to, length);
    const auto hit = find_first_contact(plain, tool, Step{}, from, to, scratch.data(), true);
    clear += is_clear && !is_beyond ? 1 : 0;
    beyond += is_beyond ? 1 : 0;
    met += hit.found ? 1 : 0;
    met_though_clear += is_clear && (hit.found || hit.started_inside) ? 1 : 0;
  }
  MESSAGE(beyond, " ways beyond the grid, ", clear, " clear beside it, ", met, " that meet bone");
  CHECK(met_though_clear == 0);
  CHECK(beyond > 10000);
  CHECK(clear > 2000);
  CHECK(met > 10000);
}

}  // namespace
