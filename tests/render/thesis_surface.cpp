// SPDX-License-Identifier: MIT
#include "render/render_helpers.hpp"
#include "render/thesis_path.hpp"
#include "support/near.hpp"

#include <trephine/render/thesis/surface.hpp>

#include <doctest/doctest.h>

#include <numbers>

/// The thesis' Surface: equations 15 to 21 in closed form, by brute force on voxels, and values that are stored.
namespace {

using namespace trephine;
using namespace trephine::test;

template <class Scalar>
using Tool = ToolDiscretization<SurfaceCounts, Scalar>;

Posed ball_at(const Vec3d& p) { return tool_at(p, Vec3d::UnitZ()); }

TEST_CASE("Eq. 16 falls when one more vertex touches: the numbers") {
  // 26 cube directions, R = 3 mm, turned .3 about y and then .2 about x, both fixed axes; force along the plane's
  // normal, k = 1 N/mm.
  constexpr double R = 3e-3;
  const ShapeField<double, HalfSpace> field({Vec3d::Zero(), Vec3d::UnitZ()}, kVoxel);
  ThesisSurface<double> renderer(Tool<double>(Burr{.tip_radius = R, .shaft_length = 0}, SurfaceCounts::thesis()),
                                 {.k = 1e3});
  CHECK(renderer.k() == 1e3);
  const auto force = [&](const Mat3d& turned, double depth_mm) {
    return render_at(renderer, field, make_pose<double>(turned, Vec3d(0, 0, R - 1e-3 * depth_mm))).wrench.force.z();
  };
  const Mat3d turned = rotation_from_vector(Vec3d(0.2, 0, 0)) * rotation_from_vector(Vec3d(0, 0.3, 0));
  CHECK(force(turned, 0.3) == within(2.83, 0.005));
  CHECK(force(turned, 0.4) == within(2.72, 0.005));
  CHECK(force(turned, 0.5) == within(5.32, 0.005));
  CHECK(force(turned, 0.6) == within(4.45, 0.005));
  // Pole down: one vertex carries 26 k δ until the ring at 45 degrees touches at R (1 − cos 45°) = .8787; from there
  // five.
  const Mat3d down = Mat3d::Identity();
  const double ring = 3 * (1 - std::sqrt(0.5));
  CHECK(force(down, 0.6) == near(15.6, 1e-9));
  CHECK(force(down, ring - 1e-6) == near(26 * (ring - 1e-6), 1e-9));
  CHECK(force(down, ring + 1e-6) == near(26 * ring / 5, 1e-5));
  CHECK(force(down, 1.0) == near(26.0 / 5 * (1 + 4 * (1 - ring)), 1e-9));
  CHECK(force(down, 1.0) == near(7.7, 0.005));
}

TEST_CASE("single equations") {
  CHECK(eq_16_k_res<double>(26, 5) == 5.2);
  CHECK(eq_15_spring_force<double>(800, 5.2, Vec3d(1e-4, 0, -2e-4)) == Vec3d(800 * 5.2 * 1e-4, 0, 800 * 5.2 * -2e-4));
  CHECK(eq_20_slice_torque<double>(Vec3d(0, 0, 0.02), Vec3d(3, 0, 0)) == Vec3d(0, 0.06, 0));
}

TEST_CASE("many vertices on a plane and on a ball: F = N k depth / 2 in the continuum") {
  // On a plane Σ a_i d_i · n / N_colliding is the mean depth δ/2 over the cap of the ball in bone.
  const double R = 0.0015, k = 2.0;
  constexpr int kCount = 12000;
  ThesisSurface<double> renderer(Tool<double>(Burr{.tip_radius = R, .shaft_length = 0}, {.sphere = kCount}), {.k = k});
  const ShapeField<double, HalfSpace> plane({Vec3d::Zero(), Vec3d::UnitZ()}, kVoxel);
  for (const double share : {1.0 / 6, 0.5, 0.9}) {
    const double depth = share * R;
    CHECK(render_at(renderer, plane, ball_at(Vec3d(0, 0, R - depth))).wrench.force.z() ==
          near(kCount * k * depth / 2, 0.01));
  }
  // A ball of bone below: for each vertex at an angle from the axis, the chord to the bone's sphere, by quadrature.
  const double B = 0.006, depth = 0.0005;
  const ShapeField<double, Ball> ball({Vec3d(0, 0, -B), B}, kVoxel);
  const double height = R - depth + B;  // of the tool's centre over the bone's
  double sum = 0, cap = 0;
  constexpr int kSteps = 20000;
  for (int i = 0; i < kSteps; ++i) {
    const double cosine = (i + 0.5) / kSteps;  // of the angle from −z: equal steps are equal areas
    // The vertex lies R along (sin, −cos); toward the centre the bone ends at s, the smaller root of |c − s d| = B.
    const double along = height * cosine, inside = B * B - height * height + along * along;
    if (inside < 0) continue;
    const double exit = along - std::sqrt(inside);  // from the centre to the bone
    if (!(exit < R)) continue;
    cap += 1;
    sum += (R - exit) * cosine;
  }
  CHECK(render_at(renderer, ball, ball_at(Vec3d(0, 0, R - depth))).wrench.force.z() ==
        near(kCount * k * sum / cap, 0.01));
}

// --- On voxels, against the sum over the renderer's own vertices -----------------------------------------------------

struct Sum {
  Wrenchd wrench;
  bool deep = false;
};

// Oracle: every vertex in bone, its way out by bisection of the image, in double.
template <class Scalar, class Image>
Sum exact_sum(const Image& outside, const Tool<Scalar>& tool, const Posed& X, double k) {
  Sum sum;
  for (std::size_t g = 0; g < tool.groups().size(); ++g) {
    const auto& group = tool.groups()[g];
    const Vec3d c = X * tool.points()[group.centre].template cast<double>();
    const double radius = static_cast<double>(group.radius);
    sum.deep = sum.deep || outside(c) <= 0;
    Vec3d springs = Vec3d::Zero();
    int colliding = 0;
    for (int i = group.first; i < group.first + group.count; ++i) {
      const Vec3d p = X * tool.points()[i].template cast<double>();
      const Vec3d d = X.linear() * tool.inward()[i].template cast<double>();
      if (outside(p) > 0) continue;
      double lo = 0, hi = radius;
      for (int s = 1; s <= 1000; ++s) {
        if (outside(p + radius * s / 1000 * d) <= 0) continue;
        lo = radius * (s - 1) / 1000;
        hi = radius * s / 1000;
        break;
      }
      for (int b = 0; b < 40; ++b) (outside(p + 0.5 * (lo + hi) * d) <= 0 ? lo : hi) = 0.5 * (lo + hi);
      ++colliding;
      springs += 0.5 * (lo + hi) * d;
    }
    if (colliding == 0) continue;
    const Vec3d force = k * group.count / colliding * springs;
    if (g == 0)
      sum.wrench.force = force;  // of the sphere alone
    else
      sum.wrench.torque += (c - X.translation()).cross(force);
  }
  return sum;
}

TEST_CASE_TEMPLATE("on voxels the wrench is the sum over the vertices, by brute force", Scalar, float, double) {
  const RasterOptions o{.size = {96, 96, 96}};
  const Vec3d n = Vec3d(0.3, -0.4, 1).normalized();
  const Ball ball{o.middle() - 30 * kVoxel * n, 30 * kVoxel};
  const auto grid = rasterise<std::uint8_t>(ball, o);
  const auto field = field_of<Scalar>(grid, o);
  const auto exact_field = field_of<double>(grid, o);
  const auto image = [&](const Vec3d& p) { return -exact_field.value(p); };
  const Tool<Scalar> tool(Burr{.tip_radius = 0.0015, .shaft_radius = 0.0009, .shaft_length = 0.012},
                          {.sphere = 100, .slices = 10, .per_slice = 32});
  ThesisSurface<Scalar> renderer(tool, {.stiffness = 800});
  Random random(73);
  int poses = 0;
  double force = 0, torque = 0;
  for (int tries = 0; poses < 60 && tries < 100000; ++tries) {
    Vec3d direction = (random.unit() + n).normalized();
    if (random.uniform() < 0.5) direction = (n.unitOrthogonal() + 0.2 * random.unit()).normalized();  // lies on it
    const Vec3d tip = o.middle() + random.uniform(0.0002, 0.0016) * n + 0.003 * random.arrow();
    const Posed X = tool_at(tip, direction, random.uniform(0, 6.28)).template cast<Scalar>().template cast<double>();
    const Sum exact = exact_sum(image, tool, X, renderer.k());
    if (exact.deep || exact.wrench.force.norm() + exact.wrench.torque.norm() == 0) continue;
    // The sum jumps where a vertex or a centre is on the surface: no fair comparison within rounding of that.
    bool near_surface = false;
    for (int i = 0; i < tool.count(); ++i)
      near_surface = near_surface || std::abs(image(X * tool.points()[i].template cast<double>())) < 0.1;
    if (near_surface) continue;
    renderer.reset();
    const auto out = render_at(renderer, field, X);
    CHECK(out.status == Status::kOk);
    ++poses;
    const Wrenchd got = in_double(out.wrench);
    force = std::max(force, (got.force - exact.wrench.force).norm() / std::max(exact.wrench.force.norm(), 0.05));
    torque = std::max(torque, (got.torque - exact.wrench.torque).norm() / std::max(exact.wrench.torque.norm(), 0.017));
    // Reports: Eq. 20 and 21, and contacts that sum to the groups' forces.
    Vec3d sum = Vec3d::Zero(), groups = Vec3d::Zero(), contacts = Vec3d::Zero();
    for (const auto& slice : renderer.slices()) {
      const Vec3d lever = static_cast<double>(slice.lever_m) * X.linear().col(2);
      CHECK((lever.cross(slice.force.template cast<double>()) - slice.torque.template cast<double>()).norm() < 1.9e-9);
      sum += slice.torque.template cast<double>();
    }
    CHECK((sum - got.torque).norm() < 4.7e-9);
    for (const auto& c : renderer.contacts()) contacts += c.force.template cast<double>();
    for (const auto& g : renderer.groups()) groups += g.force.template cast<double>();
    CHECK((contacts - groups).norm() < 1.5e-6);
  }
  MESSAGE("off by force ", force, ", torque ", torque, " of ", poses, " poses");
  CHECK(poses == 60);
  CHECK(force <= 4e-4);
  CHECK(torque <= 4.4e-4);
}

// --- Eq. 18 and 19, stiffness, work, options
// --------------------------------------------------------------------------

TEST_CASE_TEMPLATE("Eq. 18, 19: the held force is that of the last tick outside, slices too", Scalar, float, double) {
  const RasterOptions o{.size = {96, 48, 48}};
  const auto grid = rasterise<std::uint8_t>(HalfSpace{o.middle(), Vec3d::UnitZ()}, o);
  const auto field = field_of<Scalar>(grid, o);
  ThesisSurface<Scalar> renderer(
      Tool<Scalar>(Burr{.tip_radius = 0.0015, .shaft_radius = 0.0012, .shaft_length = 0.02}, SurfaceCounts::thesis()));
  std::vector<Vec3d> last(21);
  for (double z = 6.1; z > -3; z -= 0.2) {
    const auto out = render_at(renderer, field, tool_at(o.middle() + Vec3d(-0.01, 0, z * kVoxel), Vec3d::UnitX()));
    CHECK(out.status == Status::kOk);
    int deep = 0;
    for (std::size_t g = 0; g < renderer.groups().size(); ++g) {
      const Vec3d f = renderer.groups()[g].force.template cast<double>();
      if (renderer.groups()[g].deep) CHECK(f == last[g]);
      last[g] = f;
      deep += renderer.groups()[g].deep ? 1 : 0;
    }
    CHECK(deep == (z < 0 ? 21 : 0));
  }
}

TEST_CASE_TEMPLATE("the stated stiffness is the secant at R/2, whatever the counts", Scalar, float, double) {
  const double radius = 0.0015;
  const ShapeField<Scalar, HalfSpace> field({Vec3d::Zero(), Vec3d::UnitZ()}, kVoxel);
  for (const int sphere : {26, 50, 200}) {
    const Tool<Scalar> tool(Burr{.tip_radius = radius, .shaft_length = 0}, {.sphere = sphere});
    ThesisSurface<Scalar> renderer(tool, {.stiffness = 650});
    Random random(74);
    double sum = 0;
    constexpr int kTurns = 400;
    for (int i = 0; i < kTurns; ++i) {
      const Posed X = make_pose<double>(random.rotation(), Vec3d(0, 0, radius / 2));
      sum += static_cast<double>(render_at(renderer, field, X).wrench.force.z()) / (radius / 2) / kTurns;
    }
    CHECK(sum == near(650, 0.01));
    // The literal k gives the same again.
    ThesisSurface<Scalar> literal(tool, {.stiffness = 1, .k = renderer.k()});
    const Posed X = make_pose<double>(random.rotation(), Vec3d(0, 0, radius / 2));
    CHECK(render_at(literal, field, X).wrench == render_at(renderer, field, X).wrench);
  }
}

TEST_CASE("the thesis' Surface: options outside their range are refused") {
  const auto make = [](const ThesisSurfaceOptions& o) { ThesisSurface<float> renderer(Tool<float>(Burr{}, {}), o); };
  CHECK_NOTHROW(make({}));
  CHECK_THROWS_WITH(make({.stiffness = 0}), "trephine::ThesisSurfaceOptions: stiffness must be > 0 N/m, got 0");
  CHECK_THROWS_WITH(make({.k = -1.0}), "trephine::ThesisSurfaceOptions: stiffness must be > 0 N/m, got -1");
  CHECK_THROWS_WITH(make({.search_step = 0}),
                    "trephine::ThesisSurfaceOptions: search_step must be > 0 and at most 4 voxels, got 0");
  CHECK_THROWS_WITH(make({.jump = 0}), "trephine::ThesisSurfaceOptions: jump must be > 0 m, got 0");
}

TEST_CASE_TEMPLATE(
    "the thesis' Surface: work is bounded, a lane of samples for every sixteen steps of a vertex's way out", Scalar,
    float, double) {
  const double h = kVoxel;
  std::vector<std::uint8_t> noise(40 * 40 * 40);
  Random random(75);
  for (auto& v : noise) v = static_cast<std::uint8_t>(random.below(256));
  const VoxelGrid<std::uint8_t> grid({.size = {40, 40, 40}, .spacing = Vec3d::Constant(h), .outside = 0.0}, noise);
  const DensityField<std::uint8_t, Scalar> base(grid, 127.5);
  const CountingField field(base);
  const Burr burr{.tip_radius = 0.003, .shaft_radius = 0.001, .shaft_length = 0.01};
  ThesisSurface<Scalar> renderer(Tool<Scalar>(burr, SurfaceCounts::thesis()));
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
  ThesisSurface<Scalar> huge(Tool<Scalar>(Burr{.tip_radius = 0.05, .shaft_length = 0}, SurfaceCounts::thesis()));
  const VoxelGrid<std::uint8_t> fine({.size = {40, 40, 40}, .spacing = Vec3d::Constant(1e-5), .outside = 0.0}, noise);
  const DensityField<std::uint8_t, Scalar> fine_base(fine, 127.5);
  const CountingField fine_field(fine_base);
  static_cast<void>(render_at(huge, fine_field, tool_at({2e-4, 2e-4, 0.0501}, Vec3d::UnitZ())));
  CHECK(fine_field.samples <= 32 + 26 * (64 * 16 + 14));
}

// Recorded from the main renderer with the thesis' choices, before it had none: ratio of Eq. 16, held forces, torque
// without force.
TEST_CASE("stored values of a path through a block with a hole and a rib: Surface") {
  const RasterOptions o{.size = {56, 56, 56}};
  const auto grid = rasterise<std::uint8_t>(block_with_hole_and_rib(o), o);
  const auto field = field_of<double>(grid, o);
  const Burr burr{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.012};
  check_path(ThesisSurface<double>(Tool<double>(burr, SurfaceCounts::thesis()), {.stiffness = 700}), field, o,
             {1141, 670, 4, 823.127773629, 1.71104091493});
}

}  // namespace
