// SPDX-License-Identifier: MIT
#include "render/render_helpers.hpp"
#include "support/cases.hpp"
#include "support/malloc_hook.hpp"

#include <trephine/render/thesis/line.hpp>
#include <trephine/render/thesis/surface.hpp>

#include <doctest/doctest.h>

#include <tuple>

/// What every renderer owes.
namespace {

using namespace trephine;
using namespace trephine::test;

const Burr kBurr{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.012};

template <class Scalar>
using Lines = std::tuple<LineApproxRenderer<Scalar>, LineApproxRenderer<Scalar, RayCast, Coulomb>, ThesisLine<Scalar>>;

template <class Scalar>
using Surfaces = std::tuple<SurfaceApproxRenderer<Scalar>, ThesisSurface<Scalar>>;

template <class R>
constexpr bool kIsLine = requires(const R& r) { r.report(); };

// The thesis' shaft gives torque without its force.
template <class R>
constexpr bool kTorqueAlone = false;
template <class Scalar>
constexpr bool kTorqueAlone<ThesisLine<Scalar>> = true;

template <class R>
R make() {
  using Tool = typename R::Tool;
  if constexpr (kIsLine<R>)
    return R(Tool(kBurr, {.shaft = 30}));
  else
    return R(Tool(kBurr, {.sphere = 26, .slices = 6, .per_slice = 8}));
}

// Calls f<R>() for every renderer.
template <class Scalar, class F>
void for_each_renderer(F&& f) {
  const auto all = [&]<class... R>(std::type_identity<std::tuple<R...>>) { (f(std::type_identity<R>{}), ...); };
  all(std::type_identity<Lines<Scalar>>{});
  all(std::type_identity<Surfaces<Scalar>>{});
}

template <class R, class Density>
auto field_for(const VoxelGrid<Density>& grid, double isovalue) {
  return DensityField<Density, typename R::Scalar, typename R::Gradient>(grid, isovalue);
}

// Bone with everything in it: a rough block with a hole and a rib.
RasterOptions scene_options() { return {.size = {56, 56, 56}}; }
auto scene_shape(const RasterOptions& o) {
  const Vec3d m = o.middle();
  return Either{Both{HalfSpace{m - Vec3d(0, 0, 0.001), Vec3d::UnitZ()},
                     Hollow{Rod{m + Vec3d(0.001, 0, 0), Vec3d::UnitZ(), 0.0022}}},
                Plate{m - Vec3d(0.005, 0, 0), Vec3d::UnitX(), 2 * kVoxel}};
}

// A random walk that goes in and out; `rough` adds jumps, half turns and far places.
struct Walk {
  Random random;
  RasterOptions o;
  bool rough;
  Posed X = Posed::Identity();
  Posed target = Posed::Identity();
  int left = 0;
  Walk(unsigned seed, bool is_rough) : random(seed), o(scene_options()), rough(is_rough) {
    X = tool_at(o.middle() + Vec3d(0, 0, 0.004), Vec3d::UnitZ());
    target = X;
  }
  Posed next() {
    if (left-- <= 0) {
      left = 20 + random.below(60);
      const Vec3d place =
          o.middle() + Vec3d{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1.5, 1)} * 0.004;
      target = tool_at(place, (random.unit() + 1.5 * Vec3d::UnitZ()).normalized());
      if (rough && random.uniform() < 0.2) X = random_pose(random, o.middle(), 0.05);
      if (rough && random.uniform() < 0.05) X.translation() *= 1e4;
      if (rough && random.uniform() < 0.1)
        X.linear() = Mat3d(X.linear() * rotation_from_vector(Vec3d(3.14159265358979, 0, 0)));
    }
    X = between(X, target, std::min(1.0, 1.5 / (left + 1.0)));
    return X;
  }
};

// Each is a renderer, on every kind of field.
template <class R>
constexpr bool kGood = Renderer<R, DensityField<std::uint8_t, typename R::Scalar, typename R::Gradient>> &&
                       Renderer<R, DensityField<std::int16_t, typename R::Scalar, typename R::Gradient>> &&
                       Renderer<R, DensityField<float, typename R::Scalar, typename R::Gradient>>;
template <class Scalar>
constexpr bool all_good() {
  const auto all = []<class... R>(std::type_identity<std::tuple<R...>>) { return (kGood<R> && ...); };
  return all(std::type_identity<Lines<Scalar>>{}) && all(std::type_identity<Surfaces<Scalar>>{});
}
static_assert(all_good<float>() && all_good<double>());

TEST_CASE_TEMPLATE("finite, no heap, summed contacts, rigid poses, along smooth and hostile walks", Scalar, float,
                   double) {
  const RasterOptions o = scene_options();
  const auto grid = rasterise<std::uint8_t>(scene_shape(o), o);
  for_each_renderer<Scalar>([&]<class R>(std::type_identity<R>) {
    R renderer = make<R>();
    const auto field = field_for<R>(grid, o.isovalue());
    for (const bool rough : {false, true}) {
      const unsigned seed = 91;
      CAPTURE(seed);
      CAPTURE(rough);
      Walk walk(seed, rough);
      std::int64_t allocations = 0;
      int bad = 0, touching = 0;
      double unsummed = 0, not_rigid = 0;
      for (int i = 0; i < 700; ++i) {
        const Pose<Scalar> X(walk.next().template cast<Scalar>());
        Rendered<Scalar> out;
        {
          const AllocationGuard guard;
          out = renderer.render(field, X);
          allocations += guard.allocations() + guard.frees();
        }
        bad += is_finite(out.wrench) && std::isfinite(out.contact.depth) ? 0 : 1;
        bad += out.contact.count == static_cast<int>(renderer.contacts().size()) ? 0 : 1;
        bad += (out.contact.count > 0) == (out.contact.tip || out.contact.shaft) ? 0 : 1;
        touching += out.contact.count > 0 ? 1 : 0;
        Vec3d sum = Vec3d::Zero(), groups = Vec3d::Zero();
        for (const auto& c : renderer.contacts()) {
          bad += is_finite(c.position) && is_finite(c.normal) && is_finite(c.force) ? 0 : 1;
          sum += c.force.template cast<double>();
        }
        if constexpr (kIsLine<R>) {
          groups = out.wrench.force.template cast<double>();
          if (kTorqueAlone<R> && out.contact.shaft) groups += renderer.contacts().back().force.template cast<double>();
        } else {
          for (const auto& g : renderer.groups()) groups += g.force.template cast<double>();
        }
        unsummed = std::max(unsummed, (sum - groups).norm() / (1 + groups.norm()));
        for (const auto& P : {renderer.proxy_pose(), renderer.cutting_pose(), renderer.visual_pose()})
          not_rigid = std::max(
              not_rigid, static_cast<double>((P.linear() * P.linear().transpose() - Mat3<Scalar>::Identity()).norm()));
        // Far away nothing is felt.
        if ((X.translation().template cast<double>() - o.middle()).norm() > 0.1 && out.status != Status::kJump)
          bad += out.wrench == Wrench<Scalar>{} ? 0 : 1;
      }
      CHECK(allocations == 0);
      CHECK(bad == 0);
      CHECK(touching > 50);
      CHECK(unsummed < 4.8e-7);
      CHECK(not_rigid < 3.4e-6);
    }
  });
}

TEST_CASE_TEMPLATE("two runs give the same bits; reset forgets everything", Scalar, float, double) {
  const RasterOptions o = scene_options();
  const auto grid = rasterise<std::uint8_t>(scene_shape(o), o);
  for_each_renderer<Scalar>([&]<class R>(std::type_identity<R>) {
    const auto field = field_for<R>(grid, o.isovalue());
    R one = make<R>(), two = make<R>();
    // `two` has lived before.
    Walk other(92, true);
    for (int i = 0; i < 150; ++i) static_cast<void>(render_at(two, field, other.next()));
    two.reset();
    CHECK(two.contacts().empty());
    Walk walk(93, true), again(93, true);
    int differ = 0;
    for (int i = 0; i < 500; ++i) {
      const auto a = render_at(one, field, walk.next());
      const auto b = render_at(two, field, again.next());
      differ += a.wrench == b.wrench && a.status == b.status && a.contact.count == b.contact.count ? 0 : 1;
    }
    CHECK(differ == 0);
  });
}

TEST_CASE_TEMPLATE("no force outside bone", Scalar, float, double) {
  const RasterOptions o = scene_options();
  const auto grid = rasterise<std::uint8_t>(Ball{o.middle(), 0.003}, o);
  for_each_renderer<Scalar>([&]<class R>(std::type_identity<R>) {
    const auto field = field_for<R>(grid, o.isovalue());
    R renderer = make<R>();
    Random random(94);
    int felt = 0;
    Vec3d p = o.middle() + Vec3d(0, 0, 0.006);
    for (int i = 0; i < 500; ++i) {
      const Vec3d out = (p + 0.0015 * random.unit() - o.middle()).normalized();
      p = o.middle() + (0.0047 + 0.002 * random.uniform()) * out;  // the ball's surface stays .2 mm and more away
      const auto r = render_at(renderer, field, tool_at(p, (out + 0.3 * random.unit()).normalized()));
      felt += r.wrench == Wrench<Scalar>{} && r.contact.count == 0 && r.status == Status::kOk ? 0 : 1;
    }
    CHECK(felt == 0);
  });
}

TEST_CASE_TEMPLATE("grids of one voxel, two voxels, empty, full, and places far from them", Scalar, float, double) {
  const Vec3d h = Vec3d::Constant(kVoxel);
  const VoxelGrid<std::uint8_t> one({.size = {1, 1, 1}, .spacing = h, .outside = 0.0}, std::vector<std::uint8_t>{255});
  const VoxelGrid<std::uint8_t> two({.size = {2, 1, 1}, .spacing = h, .outside = 0.0},
                                    std::vector<std::uint8_t>{255, 255});
  const VoxelGrid<std::uint8_t> empty({.size = {16, 16, 16}, .spacing = h, .outside = 0.0},
                                      std::vector<std::uint8_t>(4096, 0));
  const VoxelGrid<std::uint8_t> full({.size = {16, 16, 16}, .spacing = h, .outside = 255.0},
                                     std::vector<std::uint8_t>(4096, 255));
  for_each_renderer<Scalar>([&]<class R>(std::type_identity<R>) {
    for (const auto* grid : {&one, &two, &empty, &full}) {
      const auto field = field_for<R>(*grid, 127.5);
      R renderer = make<R>();
      Random random(95);
      int bad = 0, felt = 0;
      for (int i = 0; i < 300; ++i) {
        const double far = i % 50 == 49 ? 1e3 : i % 10 == 9 ? 1.0 : 0.004;
        const Posed X = random_pose(random, Vec3d::Zero(), far);
        const auto out = render_at(renderer, field, X);
        bad += is_finite(out.wrench) ? 0 : 1;
        felt += out.wrench == Wrench<Scalar>{} ? 0 : 1;
      }
      CHECK(bad == 0);
      if (grid == &empty || (grid == &full && kIsLine<R>)) CHECK(felt == 0);
    }
  });
}

TEST_CASE("float and double agree") {
  const RasterOptions o = scene_options();
  // Smooth: where algorithms decide (which vertex, which side) rounding may decide otherwise.
  const auto grid = rasterise<std::uint8_t>(Ball{o.middle() - Vec3d(0, 0, 0.006), 0.006}, o);
  const auto compare = [&]<class F, class D>(std::type_identity<F>, std::type_identity<D>) {
    const auto field_f = field_for<F>(grid, o.isovalue());
    const auto field_d = field_for<D>(grid, o.isovalue());
    F f = make<F>();
    D d = make<D>();
    double worst = 0;
    for (int i = 0; i < 300; ++i) {
      const double t = i / 300.0;
      const Vec3d tip = o.middle() + Vec3d(0.002 * t, 0.001 * std::sin(5 * t), 0.002 - 0.0025 * std::sin(3.1 * t));
      const Posed X = tool_at(tip, Vec3d(0.4 * t, 0.2, 1).normalized());
      const auto a = in_double(render_at(f, field_f, X).wrench);
      const auto b = in_double(render_at(d, field_d, X).wrench);
      worst = std::max({worst, (a.force - b.force).norm(), 50 * (a.torque - b.torque).norm()});
    }
    // A thousandth of a voxel, the surface search's tolerance, at 800 N/m is .24 mN; a proxy's tangential rest may
    // differ by the moves it does not bother with.
    CHECK(worst < 0.0029);
    return worst;
  };
  double worst = 0;
  worst = std::max(worst, compare(std::type_identity<LineApproxRenderer<float>>{},
                                  std::type_identity<LineApproxRenderer<double>>{}));
  worst = std::max(worst, compare(std::type_identity<SurfaceApproxRenderer<float>>{},
                                  std::type_identity<SurfaceApproxRenderer<double>>{}));
  MESSAGE("float against double: ", worst, " N");
}

TEST_CASE_TEMPLATE("turn bone and tool together and the wrench turns along", Scalar, float, double) {
  const RasterOptions o{.size = {72, 72, 72}};
  const Vec3d m = o.middle();
  // Bone: a ball and a bar; the tool leans on both.
  const auto shape =
      Either{Ball{m - Vec3d(0, 0, 0.006), 0.006}, Rod{m + Vec3d(0.004, 0, 0.0035), Vec3d::UnitY(), 0.0015}};
  Random random(96);
  const auto turned = [&]<class R>(std::type_identity<R>, double height, double tolerance_N, double tolerance_Nm) {
    Wrenchd first;
    double force = 0, torque = 0;
    Random same(97);
    for (int turn = 0; turn < (kSanitized ? 2 : 6); ++turn) {
      // About the middle, so that it stays in the grid.
      const Mat3d Q = turn == 0 ? Mat3d::Identity() : same.rotation();
      const Posed X = make_pose<double>(Q, m + (turn == 0 ? Vec3d::Zero() : Vec3d(0.2 * kVoxel * same.unit())) - Q * m);
      const auto grid = rasterise<std::uint8_t>(Moved{shape, X}, o);
      const auto field = field_for<R>(grid, o.isovalue());
      R renderer = make<R>();
      const Posed start = tool_at(m + Vec3d(0, 0, 0.0025), Vec3d(0.1, 0, 1).normalized());
      const Posed end = tool_at(m + Vec3d(0.0002, 0.0001, height), Vec3d(0.75, 0.05, 1).normalized());
      Wrenchd w;
      for (int i = 0; i <= 120; ++i)
        w = in_double(render_at(renderer, field, Posed(X * between(start, end, std::min(1.0, i / 80.0)))).wrench);
      const Wrenchd back = w.rotated(Q.transpose());
      if (turn == 0) first = back;
      CHECK(first.force.norm() > 0.2);
      CHECK(first.torque.norm() > 1e-3);
      force = std::max(force, (back.force - first.force).norm());
      torque = std::max(torque, (back.torque - first.torque).norm());
    }
    MESSAGE("turned: force ", first.force.norm(), " N differs by ", force, ", torque ", 1e3 * first.torque.norm(),
            " mN·m by ", 1e3 * torque);
    CHECK(force < tolerance_N);
    CHECK(torque < tolerance_Nm);
  };
  // Line: proxies come to rest where the image's normal, good to 7 degrees on a bar this thin, faces the probe.
  turned(std::type_identity<LineApproxRenderer<Scalar>>{}, -0.0006, 0.08, 1e-3);
  // Surface: the tool's vertices turn along, so only the image of the surface differs, by up to 1/(4 · 5) voxel on the
  // bar: 15 µm at up to 3 N/mm each for the ball and two or three slices.
  turned(std::type_identity<SurfaceApproxRenderer<Scalar>>{}, 0.0006, 0.05, 1e-3);
}

}  // namespace
