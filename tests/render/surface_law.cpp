// SPDX-License-Identifier: MIT
#include "render/render_helpers.hpp"
#include "support/near.hpp"

#include <doctest/doctest.h>

#include <numbers>

/// The sum over vertices (thesis Eq. 15–17): in closed form, against the library's own and against voxels.
namespace {

using namespace trephine;
using namespace trephine::test;

template <class Scalar>
using Tool = ToolDiscretization<SurfaceCounts, Scalar>;

constexpr double kForceFloor = 0.05;                        // [N]: lighter forces count as this, without direction
constexpr double kTorqueError = 0.06, kTorqueFloor = 1e-3;  // 6 % or 1 mN·m

// --- The law on a plane
// ------------------------------------------------------------------------------------------------

TEST_CASE("Eq. 16 falls when one more vertex touches: the numbers") {
  // 26 cube directions, R = 3 mm, turned .3 about y and then .2 about x, both fixed axes; force along the plane's
  // normal, k = 1.
  const Tool<double> tool(Burr{.tip_radius = 3e-3, .shaft_length = 0}, SurfaceCounts::thesis());
  const Mat3d R = rotation_from_vector(Vec3d(0.2, 0, 0)) * rotation_from_vector(Vec3d(0, 0.3, 0));
  const auto force = [&](const Mat3d& turned, double depth) {
    const Vec3d n = turned.transpose() * Vec3d::UnitZ();
    return 1e3 * plane_law<CollisionRatio>(tool, 0, 1e-3 * depth, n).dot(n);
  };
  CHECK(force(R, 0.3) == within(2.83, 0.005));
  CHECK(force(R, 0.4) == within(2.72, 0.005));
  CHECK(force(R, 0.5) == within(5.32, 0.005));
  CHECK(force(R, 0.6) == within(4.45, 0.005));
  // Pole down: one vertex carries 26 k δ until the ring at 45 degrees touches at R (1 − cos 45°) = .8787; from there
  // five.
  const Mat3d down = Mat3d::Identity();
  const double ring = 3 * (1 - std::sqrt(0.5));
  CHECK(force(down, 0.6) == near(15.6, 1e-9));
  CHECK(force(down, ring - 1e-9) == near(26 * ring, 3.4e-9));
  CHECK(force(down, ring + 1e-9) == near(26 * ring / 5, 1.7e-8));
  CHECK(force(down, 1.0) == near(26.0 / 5 * (1 + 4 * (1 - ring)), 4.8e-15));
  CHECK(force(down, 1.0) == near(7.7, 0.005));
}

TEST_CASE("many vertices give the continuum's laws") {
  const double radius = 0.0015;
  double worst_area = 0, worst_ratio = 0, worst_mean = 0;
  for (const int count : {400, 12000}) {
    const Tool<double> tool(Burr{.tip_radius = radius, .shaft_length = 0}, {.sphere = count});
    worst_area = worst_ratio = worst_mean = 0;
    for (const double share : {1.0 / 6, 1.0 / 3, 0.5, 0.9}) {
      const double depth = share * radius;
      Random random(71);
      for (int i = 0; i < 10; ++i) {
        const Vec3d n = random.unit();
        const auto along = [&](auto weights) {
          using W = decltype(weights);
          return plane_law<W>(tool, 0, depth, n).dot(n);
        };
        const double foundation = std::numbers::pi * radius * depth * depth;
        worst_area = std::max(worst_area, std::abs(along(AreaWeights{}) / foundation - 1));
        worst_ratio = std::max(worst_ratio, std::abs(along(CollisionRatio{}) / (count * depth / 2) - 1));
        // A vertex enters gradually: less of the rim counts, so the mean is a little more than δ/2.
        worst_mean = std::max(worst_mean, std::abs(along(MeanWeights{}) / (depth / 2) - 1));
      }
    }
    MESSAGE(count, " vertices from the continuum: area ", worst_area, ", collision ratio ", worst_ratio, ", mean ",
            worst_mean);
  }
  CHECK(worst_area < 4e-4);
  CHECK(worst_ratio < 0.01);
  CHECK(worst_mean < 0.35);
}

TEST_CASE("on a plane, 26 vertices against the continuum") {
  const double radius = 0.0015;
  const Tool<double> tool(Burr{.tip_radius = radius, .shaft_length = 0}, SurfaceCounts::thesis());
  for (const double share : {1.0 / 6, 1.0 / 3}) {
    std::vector<double> errors;
    Random random(72);
    for (int i = 0; i < 1000; ++i) {
      const Vec3d n = random.unit();
      const double depth = share * radius;
      const Vec3d f = plane_law<AreaWeights>(tool, 0, depth, n);
      const Vec3d exact = std::numbers::pi * radius * depth * depth * n;
      errors.push_back((f - exact).norm() / exact.norm());
    }
    std::sort(errors.begin(), errors.end());
    MESSAGE("depth R ", share, ": error p50 ", errors[500], ", p95 ", errors[950]);
    CHECK(errors[950] < (share < 0.2 ? 0.9 : 0.5));
  }
}

// --- The renderer against the sum over its own vertices --------------------------------------------------------------

struct Sum {
  Wrenchd wrench;
  std::vector<Vec3d> forces;
  bool deep = false;
};

// Oracle: every vertex in bone, its way out by bisection of the shape, in double, the weights written out again.
template <class Weights, class Scalar, class Shape>
Sum exact_sum(const Shape& shape, const Tool<Scalar>& tool, const Posed& X, double k, bool shaft_force) {
  Sum sum;
  for (std::size_t g = 0; g < tool.groups().size(); ++g) {
    const auto& group = tool.groups()[g];
    const Vec3d c = X * tool.points()[group.centre].template cast<double>();
    const double radius = static_cast<double>(group.radius);
    sum.deep = sum.deep || shape(c) <= 0;
    Vec3d weighted = Vec3d::Zero();
    double divisor = 0;
    int colliding = 0;
    for (int i = group.first; i < group.first + group.count; ++i) {
      const Vec3d p = X * tool.points()[i].template cast<double>();
      const Vec3d d = X.linear() * tool.inward()[i].template cast<double>();
      if (shape(p) > 0) continue;
      double lo = 0, hi = radius;
      for (int s = 1; s <= 1000; ++s) {
        if (shape(p + radius * s / 1000 * d) <= 0) continue;
        lo = radius * (s - 1) / 1000;
        hi = radius * s / 1000;
        break;
      }
      for (int b = 0; b < 40; ++b) (shape(p + 0.5 * (lo + hi) * d) <= 0 ? lo : hi) = 0.5 * (lo + hi);
      const double a = 0.5 * (lo + hi), w = static_cast<double>(tool.areas()[static_cast<std::size_t>(i)]);
      ++colliding;
      if constexpr (std::is_same_v<Weights, CollisionRatio>) weighted += a * d;
      if constexpr (std::is_same_v<Weights, AreaWeights>) weighted += w * a * d;
      if constexpr (std::is_same_v<Weights, MeanWeights>) {
        const double m = std::min(1.0, 4 * a / radius);
        weighted += w * m * a * d;
        divisor += w * m;
      }
    }
    Vec3d force = k * weighted;
    if constexpr (std::is_same_v<Weights, CollisionRatio>)
      force *= colliding > 0 ? static_cast<double>(group.count) / colliding : 0.0;
    if constexpr (std::is_same_v<Weights, MeanWeights>) force *= divisor > 0 ? 1 / divisor : 0.0;
    sum.forces.push_back(force);
    if (g == 0 || shaft_force) sum.wrench.force += force;
    if (g > 0) sum.wrench.torque += (c - X.translation()).cross(force);
  }
  return sum;
}

struct Tally {
  int cases = 0, with_force = 0;
  double force = 0, direction = 0, torque = 0, contacts = 0;
};

// Poses that touch with ball, shaft or both, no centre in bone.
template <class Weights, class Shaft, class Scalar, class Shape>
Tally compare(const Shape& shape, const Vec3d& near, const RasterOptions& o, bool of_image, int cases, Random& random) {
  const auto grid = rasterise<std::uint8_t>(shape, o);
  const auto field = field_of<Scalar>(grid, o);
  const auto exact_field = field_of<double>(grid, o);
  const auto image = [&](const Vec3d& p) { return -exact_field.value(p); };
  const Tool<Scalar> tool(Burr{.tip_radius = 0.0015, .shaft_radius = 0.0009, .shaft_length = 0.012},
                          {.sphere = 100, .slices = 10, .per_slice = 32});
  SurfaceApproxRenderer<Scalar, Weights, ExtendAlongSurface, Shaft> renderer(tool, {.stiffness = 800});
  Tally tally;
  for (int tries = 0; tally.cases < cases && tries < 200000; ++tries) {
    const Vec3d normal = outward_normal(shape, near);
    Vec3d direction = (random.unit() + normal).normalized();
    if (random.uniform() < 0.5) direction = (normal.unitOrthogonal() + 0.2 * random.unit()).normalized();  // lies on it
    const double above = random.uniform(0.0002, 0.0016);
    const Vec3d tip = near + above * normal + 0.003 * random.arrow();
    const Posed X = make_pose<double>(
        tool_at(tip, direction).linear() * rotation_from_vector(Vec3d(0, 0, random.uniform(0, 6.28))), tip);
    const Posed X_used = X.template cast<Scalar>().template cast<double>();
    const Sum exact = of_image ? exact_sum<Weights>(image, tool, X_used, renderer.thesis_stiffness(), Shaft::kForce)
                               : exact_sum<Weights>(shape, tool, X_used, renderer.thesis_stiffness(), Shaft::kForce);
    if (exact.deep || exact.wrench.force.norm() + exact.wrench.torque.norm() == 0) continue;
    // Centres a hair outside may be inside in the image.
    bool near_centre = false;
    for (const auto& g : tool.groups())
      near_centre = near_centre || shape(X * Vec3d(0, 0, static_cast<double>(g.height))) < 0.1 * kVoxel;
    if (near_centre) continue;
    // A ratio's sum jumps where a vertex touches or not: no fair comparison within the image's error of that.
    if (std::is_same_v<Weights, CollisionRatio>) {
      bool near_vertex = false;
      for (int i = 0; i < tool.periphery(); ++i)
        near_vertex = near_vertex || std::abs(image(X * tool.points()[i].template cast<double>())) < 0.1;
      if (near_vertex) continue;
    }
    renderer.reset();
    const auto out = render_at(renderer, field, X);
    CHECK(out.status == Status::kOk);
    ++tally.cases;
    const Wrenchd got = in_double(out.wrench);
    tally.force = std::max(tally.force,
                           (got.force - exact.wrench.force).norm() / std::max(exact.wrench.force.norm(), kForceFloor));
    tally.torque = std::max(tally.torque, (got.torque - exact.wrench.torque).norm() /
                                              std::max(exact.wrench.torque.norm(), kTorqueFloor / kTorqueError));
    if (exact.wrench.force.norm() >= kForceFloor) {
      ++tally.with_force;
      tally.direction = std::max(tally.direction, angle_deg(got.force, exact.wrench.force));
    }
    // Reports: Eq. 20 literally, and contacts that sum to the group's force.
    Vec3d torque = Vec3d::Zero(), sum = Vec3d::Zero();
    for (const auto& slice : renderer.slices()) {
      const Vec3d lever = static_cast<double>(slice.lever_m) * X.linear().col(2);
      CHECK((lever.cross(slice.force.template cast<double>()) - slice.torque.template cast<double>()).norm() < 1.9e-9);
      torque += slice.torque.template cast<double>();
    }
    CHECK((torque - got.torque).norm() < 4.7e-9);
    for (const auto& c : renderer.contacts()) sum += c.force.template cast<double>();
    Vec3d groups = Vec3d::Zero();
    for (const auto& g : renderer.groups()) groups += g.force.template cast<double>();
    tally.contacts = std::max(tally.contacts, (sum - groups).norm());
  }
  return tally;
}

/// Bounds of a tally: shares of the exact force and torque, degrees.
struct Most {
  double force, direction, torque;
};

template <class Weights, class Scalar>
void check_renderer(const char* name) {
  Random random(73);
  const RasterOptions o{.size = {96, 96, 96}};
  const Vec3d n = Vec3d(0.3, -0.4, 1).normalized();
  const HalfSpace plane{o.middle(), n};
  const Ball ball{o.middle() - 30 * kVoxel * n, 30 * kVoxel};
  const auto report = [&](const char* where, const Tally& t, const Most& most) {
    MESSAGE(std::string(name), ", ", std::string(where), ": force ", t.force, ", direction ", t.direction,
            " deg, torque ", t.torque, " of ", t.cases, " poses (", t.with_force, " with .05 N and more)");
    CHECK(t.cases >= 40);
    CHECK(t.with_force > 20);
    CHECK(t.force <= most.force);
    CHECK(t.direction <= most.direction);
    CHECK(t.torque <= most.torque);
    CHECK(t.contacts < 1.5e-6);
  };
  // Against the surface that the voxels show, the renderer has only its search's tolerance to answer for.
  constexpr Most kImaged{4e-4, 9e-3, 4.4e-4}, kShape{0.035, 0.9, 0.006};
  report("plane as imaged", compare<Weights, FullWrench, Scalar>(plane, o.middle(), o, true, 40, random), kImaged);
  report("plane as imaged, torque only", compare<Weights, TorqueOnly, Scalar>(plane, o.middle(), o, true, 40, random),
         kImaged);
  report("sphere as imaged", compare<Weights, FullWrench, Scalar>(ball, o.middle(), o, true, 40, random), kImaged);
  // Against the shape itself. The other two laws are linear in depth, where an image that errs by .03 voxels is felt as
  // 7 mN at any depth: more than 3.5 % of the lightest touches, and not the renderer's doing.
  if constexpr (std::is_same_v<Weights, AreaWeights>) {
    report("plane", compare<Weights, FullWrench, Scalar>(plane, o.middle(), o, false, 60, random), kShape);
    report("sphere", compare<Weights, FullWrench, Scalar>(ball, o.middle(), o, false, 60, random), kShape);
  }
}

TEST_CASE_TEMPLATE("the rendered wrench is the sum over the renderer's own vertices: area", Scalar, float, double) {
  check_renderer<AreaWeights, Scalar>("area");
}
TEST_CASE_TEMPLATE("the rendered wrench is the sum over the renderer's own vertices: collision ratio", Scalar, float,
                   double) {
  check_renderer<CollisionRatio, Scalar>("collision ratio");
}
TEST_CASE_TEMPLATE("the rendered wrench is the sum over the renderer's own vertices: mean", Scalar, float, double) {
  check_renderer<MeanWeights, Scalar>("mean");
}

TEST_CASE_TEMPLATE("a shaft laid flush on a plane", Scalar, float, double) {
  // Ball and shaft of one radius, axis parallel to the plane: every slice is pressed alike, in closed form.
  const double radius = 0.0015, depth = 0.0006, length = 0.020;
  const RasterOptions o{.size = {96, 48, 48}};
  const auto grid = rasterise<std::uint8_t>(HalfSpace{o.middle(), Vec3d::UnitZ()}, o);
  const auto field = field_of<Scalar>(grid, o);
  const Tool<Scalar> tool(Burr{.tip_radius = radius, .shaft_radius = radius, .shaft_length = length},
                          {.sphere = 200, .slices = 20, .per_slice = 64});
  SurfaceApproxRenderer<Scalar> renderer(tool, {.thesis_stiffness = 1e8});
  CHECK(renderer.thesis_stiffness() == 1e8);
  const Posed X = tool_at(o.middle() + Vec3d(-0.010, 0, radius - depth), Vec3d::UnitX());
  const auto out = render_at(renderer, field, X);
  // A strip of length L of a cylinder at depth δ: k L R ∫ (δ − R(1 − cos φ)) / cos φ cos φ dφ over the pressed arc.
  const double half = std::acos(1 - depth / radius);
  const double per_length = 1e8 * radius * 2 * (radius * std::sin(half) - (radius - depth) * half);
  const Wrenchd w = in_double(out.wrench);
  const double ball = static_cast<double>(renderer.groups()[0].force.z());
  CHECK(ball == near(1e8 * std::numbers::pi * radius * depth * depth, 0.0015));
  CHECK(w.force.z() - ball == near(per_length * length, 3.7e-5));
  CHECK(w.torque.norm() == near(per_length * length * length / 2, 3.7e-5));
  CHECK(angle_deg(w.torque, -Vec3d::UnitY()) < 2.7e-7);
  for (const auto& slice : renderer.slices())
    CHECK(static_cast<double>(slice.force.z()) == near(per_length * length / 20, 3.7e-5));
}

// --- Stiffness
// ----------------------------------------------------------------------------------------------------------

template <class Weights, class Scalar>
void check_stiffness(int sphere) {
  const double radius = 0.0015;
  const ShapeField<Scalar, HalfSpace> field({Vec3d::Zero(), Vec3d::UnitZ()}, kVoxel);
  const Tool<Scalar> tool(Burr{.tip_radius = radius, .shaft_length = 0}, {.sphere = sphere});
  SurfaceApproxRenderer<Scalar, Weights> renderer(tool, {.stiffness = 650});
  Random random(74);
  double sum = 0;
  constexpr int kTurns = 400;
  for (int i = 0; i < kTurns; ++i) {
    renderer.reset();
    const Posed X = make_pose<double>(random.rotation(), Vec3d(0, 0, radius / 2));
    sum += static_cast<double>(render_at(renderer, field, X).wrench.force.z()) / (radius / 2) / kTurns;
  }
  CHECK(sum == near(650, 0.01));
  // The literal k gives the same again.
  SurfaceApproxRenderer<Scalar, Weights> literal(tool,
                                                 {.stiffness = 1, .thesis_stiffness = renderer.thesis_stiffness()});
  const Posed X = make_pose<double>(random.rotation(), Vec3d(0, 0, radius / 2));
  renderer.reset();
  CHECK(render_at(literal, field, X).wrench == render_at(renderer, field, X).wrench);
}

TEST_CASE_TEMPLATE("the stated stiffness is the secant at R/2, whatever the law and counts", Scalar, float, double) {
  for (const int sphere : {26, 50, 200}) {
    check_stiffness<AreaWeights, Scalar>(sphere);
    check_stiffness<CollisionRatio, Scalar>(sphere);
    check_stiffness<MeanWeights, Scalar>(sphere);
  }
}

TEST_CASE("surface options outside their range are refused") {
  const auto make = [](const SurfaceOptions& o) { SurfaceApproxRenderer<float> renderer(Tool<float>(Burr{}, {}), o); };
  CHECK_NOTHROW(make({}));
  CHECK_THROWS_WITH(make({.stiffness = 0}), "trephine::SurfaceOptions: stiffness must be > 0 N/m, got 0");
  CHECK_THROWS_WITH(make({.stiffness = std::nan("")}), "trephine::SurfaceOptions: stiffness must be > 0 N/m, got nan");
  CHECK_THROWS_WITH(make({.thesis_stiffness = -1.0}), "trephine::SurfaceOptions: thesis_stiffness must be > 0, got -1");
  CHECK_THROWS_WITH(make({.search_step = 0}),
                    "trephine::SurfaceOptions: search_step must be > 0 and at most 4 voxels, got 0");
  CHECK_THROWS_WITH(make({.search_step = 4.5}),
                    "trephine::SurfaceOptions: search_step must be > 0 and at most 4 voxels, got 4.5");
  CHECK_THROWS_WITH(make({.jump = 0}), "trephine::SurfaceOptions: jump must be > 0 m, got 0");
}

TEST_CASE_TEMPLATE("work is bounded: a lane of samples for every sixteen steps of a vertex's way out", Scalar, float,
                   double) {
  const double h = kVoxel;
  std::vector<std::uint8_t> noise(40 * 40 * 40);
  Random random(75);
  for (auto& v : noise) v = static_cast<std::uint8_t>(random.below(256));
  const VoxelGrid<std::uint8_t> grid({.size = {40, 40, 40}, .spacing = Vec3d::Constant(h), .outside = 0.0}, noise);
  const DensityField<std::uint8_t, Scalar> base(grid, 127.5);
  const CountingField field(base);
  const Burr burr{.tip_radius = 0.003, .shaft_radius = 0.001, .shaft_length = 0.01};
  SurfaceApproxRenderer<Scalar, AreaWeights, HoldForce> renderer(Tool<Scalar>(burr, SurfaceCounts::thesis()));
  const auto lanes = [&](double radius) { return 16 * static_cast<std::int64_t>(std::ceil(radius / (8 * h) - 1e-6)); };
  const std::int64_t bound = 208 + 26 * (lanes(0.003) + 14) + 160 * (lanes(0.001) + 14);
  std::int64_t most = 0;
  for (int i = 0; i < 1000; ++i) {
    field.samples = 0;
    static_cast<void>(render_at(renderer, field, random_pose(random, 20 * h * Vec3d::Ones(), 20 * h)));
    most = std::max(most, field.samples);
  }
  MESSAGE("samples a tick in noise: most ", most, " of ", bound);
  CHECK(most <= bound);
  // One bad radius cannot make it endless: 64 lanes a vertex at most.
  SurfaceApproxRenderer<Scalar, AreaWeights, HoldForce> huge(
      Tool<Scalar>(Burr{.tip_radius = 0.05, .shaft_length = 0}, SurfaceCounts::thesis()));
  const VoxelGrid<std::uint8_t> fine({.size = {40, 40, 40}, .spacing = Vec3d::Constant(1e-5), .outside = 0.0}, noise);
  const DensityField<std::uint8_t, Scalar> fine_base(fine, 127.5);
  const CountingField fine_field(fine_base);
  static_cast<void>(render_at(huge, fine_field, tool_at({2e-4, 2e-4, 0.0501}, Vec3d::UnitZ())));
  CHECK(fine_field.samples <= 32 + 26 * (64 * 16 + 14));
}

// A user's own weightings: with patches, and without.
struct HalfPatches : AreaWeights {
  static constexpr bool kUsesPatches = true;
  template <RealScalar Scalar>
  [[nodiscard]] static Scalar weight(Scalar area, Scalar, Scalar) noexcept {
    return area / Scalar(2);
  }
};
struct NoMember : AreaWeights {};
struct SaysNo : AreaWeights {
  static constexpr bool kUsesPatches = false;
};
static_assert(Weighting<HalfPatches> && kUsesPatches<HalfPatches> && kUsesPatches<PatchWeights>);
static_assert(Weighting<NoMember> && !kUsesPatches<NoMember> && !kUsesPatches<SaysNo> && !kUsesPatches<MeanWeights>);
static_assert(!Weighting<HoldForce>);

TEST_CASE("a user's own weighting with patches has the force of the patches") {
  const Tool<double> tool(Burr{.tip_radius = 0.0015, .shaft_length = 0}, SurfaceCounts::thesis());
  for (const double depth : {1e-5, 1e-4, 7e-4}) {
    const Vec3d n = Vec3d(0.2, 0.5, 1).normalized();
    CHECK((2 * plane_law<HalfPatches>(tool, 0, depth, n)).isApprox(plane_law<PatchWeights>(tool, 0, depth, n), 1e-12));
  }
}

TEST_CASE("the force on a plane is quadratic in depth: the tangent is 2 k at R/2 and up to 4 k at R, or the budget") {
  constexpr double k = 800, R = 0.0015;
  const Tool<float> tool(Burr{.tip_radius = R, .shaft_length = 0}, SurfaceCounts{});
  const SurfaceApproxRenderer<float> surface(tool, {.stiffness = k});
  CHECK(surface.tangent_stiffness(0) == near(2 * k, 1.8e-4));
  CHECK(surface.tangent_stiffness(k * R / 2) == near(2 * k, 0.0027));
  CHECK(surface.tangent_stiffness(0.25 * k * R / 2) == near(k, 0.0058));
  // At R the patches beside the equator round the square off.
  CHECK(surface.tangent_stiffness(100) < 4 * k);
  CHECK(surface.tangent_stiffness(100) > 3.4 * k);
  const SurfaceApproxRenderer<float> shared(tool, {.stiffness = k, .budget = StiffnessBudget{1000, 0.3}});
  CHECK(shared.tangent_stiffness(100) == 1000);
}

}  // namespace
