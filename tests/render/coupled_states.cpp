// SPDX-License-Identifier: MIT
// How the coupled tool starts, jumps and takes what is no pose.
#include "render/coupled_helpers.hpp"
#include "support/cases.hpp"
#include "support/malloc_hook.hpp"
#include "support/near.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;
using namespace trephine::test::coupled;

constexpr unsigned kSeed = 341;
constexpr double R = kDrill.tip_radius;
constexpr double kFree = 1e-4;  // [N]: near bone a search in the air leaves a share of its last step

TEST_CASE("coupled states: a start deep in bone says so and is without force until the tool is out") {
  const ImageOptions o;
  const Vec3d up = Vec3d::UnitZ();
  Bone bone = image(HalfSpace{o.middle(), up}, o);
  const auto pose = [&](double deep) { return tool_at(o.middle() + (R - deep) * up, up); };
  for (const Burr& burr : {kBall, kDrill}) {
    auto scene = coupled_scene(bone, burr);
    int unflagged = 0, felt = 0, inside = 0;
    bool was_out = false;
    for (int i = 0; i < 400; ++i) {
      const double deep = 4e-3 - 1.5e-5 * std::max(0, i - 50);
      const TickResult r = scene.tick({.X_WT = pose(deep)}, kDt);
      const bool core_in_bone = deep > 2 * R + kH;
      const bool out = deep < -kH;
      if (core_in_bone || (deep > R + kH && !was_out)) {
        ++inside;
        unflagged += r.status == Status::kStartedInside ? 0 : 1;
        felt += r.wrench == Wrenchd::zero() ? 0 : 1;
      }
      was_out = was_out || out;
      if (out) {
        felt += r.wrench.force.norm() <= kFree ? 0 : 1;
        unflagged += r.status == Status::kOk ? 0 : 1;
      }
    }
    CHECK(inside > 100);
    CHECK(was_out);
    CHECK(unflagged == 0);
    CHECK(felt == 0);
  }
  // Shallow: in contact at once, and said to be.
  auto shallow = coupled_scene(bone, kBall);
  const TickResult first = shallow.tick({.X_WT = pose(1e-3)}, kDt);
  CHECK(first.status == Status::kStartedInside);
  CHECK(is_finite(first.wrench));
  TickResult then;
  for (int i = 0; i < 5; ++i) then = shallow.tick({.X_WT = pose(1e-3)}, kDt);
  CHECK(then.status == Status::kOk);
  CHECK(then.wrench.force.norm() == near(kK * 1e-3, 6.2e-5));
  CHECK(angle_deg(then.wrench.force, up) < 3.1e-6);
  // A start that touches nothing is none to speak of.
  auto free = coupled_scene(bone, kBall);
  CHECK(free.tick({.X_WT = pose(-2e-4)}, kDt).status == Status::kOk);
}

TEST_CASE("coupled states: jumps are told; the tool appears where that is free, and follows where it is not") {
  const ImageOptions o{.size = {120, 40, 40}};
  const Vec3d m = o.middle(), up = Vec3d::UnitZ();
  Bone bone = image(
      Either{Block{m - Vec3d(0.01, 0, 0), Vec3d(0.003, 1, 1)}, Block{m + Vec3d(0.012, 0, 0), Vec3d(0.003, 1, 1)}}, o);
  auto scene = coupled_scene(bone, kBall);
  const auto pose = [&](double x) { return tool_at(m + Vec3d(x, 0, 0), up); };
  const auto jump = [&](double from, double to) {
    scene.reset();
    lead(scene, pose(from), pose(from), 3);
    return scene.tick({.X_WT = pose(to)}, kDt);
  };
  TickResult r = jump(-0.016, 0.001);  // over a block, into the air between them
  CHECK(r.status == Status::kJump);
  CHECK(r.wrench == Wrenchd::zero());
  CHECK((scene.proxy_pose_W().translation() - pose(0.001).translation()).norm() <= 1e-12);
  CHECK(scene.tick({.X_WT = pose(0.001)}, kDt).status == Status::kOk);
  r = jump(0.0, 0.012);  // into a block: held before it
  CHECK(r.status == Status::kJump);
  for (int i = 0; i < 100; ++i) r = scene.tick({.X_WT = pose(0.012)}, kDt);
  CHECK(r.status == Status::kOk);
  CHECK(r.wrench.force.norm() == near(kForce));
  CHECK(angle_deg(r.wrench.force, -Vec3d::UnitX()) < 2.9e-6);
  CHECK(scene.proxy_pose_W().translation().x() < m.x() + 0.009 - R + 0.5 * kH);
  CHECK(jump(0.0, 0.001).status == Status::kOk);  // as far as a hand goes in a tick
  CHECK(jump(0.0, 0.0011).status == Status::kJump);
}

template <class Scene>
int hostile(Scene& scene, const Vec3d& m) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  int wrong = 0;
  const Posed good = tool_at(m + Vec3d(0, 0, R - 5e-4), Vec3d::UnitZ());
  lead(scene, tool_at(m + Vec3d(0, 0, R + 3e-4), Vec3d::UnitZ()), good, 50);
  const Wrenchd before = scene.tick({.X_WT = good}, kDt).wrench;
  for (const double bad : {nan, inf, -inf, 1e300})
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 4; ++column) {
        Posed X = good;
        X.matrix()(row, column) = bad;
        const TickResult r = scene.tick({.X_WT = X}, kDt);
        wrong += r.status == Status::kBadInput && r.wrench == Wrenchd::zero() ? 0 : 1;
        const TickResult next = scene.tick({.X_WT = good}, kDt);
        wrong += next.status == Status::kOk && (next.wrench.force - before.force).norm() < 1e-4 ? 0 : 1;
      }
  // Anywhere and any way round.
  Random random(kSeed + 3);
  std::int64_t heap = 0;
  for (int i = 0; i < 600; ++i) {
    const double far = i % 50 == 49 ? 1e2 : i % 10 == 9 ? 0.1 : 0.006;
    TickResult r;
    const Posed X = random_pose(random, m, far);
    heap += heap_calls([&] { r = scene.tick({.X_WT = X}, kDt); });
    wrong +=
        is_finite(r.wrench) && r.wrench.force.norm() <= kForce * 1.000001 && r.wrench.torque.norm() <= 0.100001 ? 0 : 1;
    wrong +=
        scene.proxy_pose_W().matrix().allFinite() && scene.renderer().steps() <= CoupledToolRenderer<>::kMaxSteps + 1
            ? 0
            : 1;
  }
  CHECK(heap == 0);
  return wrong;
}

// From one side of a plate, pressed on it, to the other, just free of it; and turned over there at once.
TEST_CASE("coupled states: a jump past bone leaves nothing of the contact that was") {
  const ImageOptions o;
  const Vec3d m = o.middle();
  constexpr double kThick = 12 * kH, kClear = 1e-4;
  Bone bone = image(Plate{m, Vec3d::UnitZ(), kThick}, o);
  auto scene = coupled_scene(bone, kBall);
  const double reach = kThick / 2 + kBall.tip_radius;
  const auto at = [&](double z) { return tool_at(m + Vec3d(1e-4, 0, z), Vec3d::UnitZ()); };
  for (const double side : {1.0, -1.0, 1.0}) {
    const TickResult pressed = lead(scene, at(side * (reach + 2e-4)), at(side * (reach - 1e-3)), 100);
    REQUIRE(pressed.wrench.force.norm() > 0.5);
    const Posed X = at(-side * (reach + kClear));
    const TickResult r = scene.tick({.X_WT = X}, kDt);
    CHECK(r.status == Status::kJump);
    CHECK(r.wrench.force.norm() == 0);
    CHECK((scene.proxy_pose_W().translation() - X.translation()).norm() <= 1e-9);
  }
  const Posed X = at(reach + kClear);
  static_cast<void>(scene.tick({.X_WT = X}, kDt));
  const Posed over = make_pose<double>(rotation_from_vector(Vec3d(kPi, 0, 0)) * X.linear(), X.translation());
  CHECK(scene.tick({.X_WT = over}, kDt).status == Status::kJump);
}

TEST_CASE("coupled states: what is no pose and what is anywhere leaves it finite, bounded and without heap") {
  const ImageOptions o;
  const Vec3d m = o.middle();
  Bone bone = image(HalfSpace{m, Vec3d::UnitZ()}, o);
  HapticScene plain{bone, kIso, CoupledToolRenderer<>{kDrill, kGains}};
  CHECK(hostile(plain, m) == 0);
  HapticScene held{bone, kIso, CoupledToolRenderer<BallAndShaft, Coulomb>{kDrill, kGains, Coulomb(0.3, 0.2)}};
  CHECK(hostile(held, m) == 0);
  using Tool = CoupledToolRenderer<>;
  static_assert(noexcept(
      std::declval<Tool&>().render(std::declval<const BoneSurfaceView<float>&>(), std::declval<const Posed&>())));
  static_assert(noexcept(plain.tick(std::declval<const TickInput&>(), kDt))&& noexcept(plain.reset()));
  static_assert(Renderer<Tool, BoneSurfaceView<std::uint8_t>> && Renderer<Tool, BoneSurfaceView<float>>);
  // Volumes of one voxel, of none but air, of none but bone.
  for (const auto& [n, density, outside] :
       {std::array{1, 1000, -1000}, std::array{16, -1000, -1000}, std::array{16, 1000, 1000}}) {
    const std::vector<std::int16_t> voxels(static_cast<std::size_t>(n * n * n), static_cast<std::int16_t>(density));
    const double h = n == 1 ? 2e-3 : kH;  // larger than the burr
    Bone odd({.size = {n, n, n}, .spacing = Vec3d::Constant(h), .outside = outside}, voxels);
    HapticScene scene{odd, kIso, Tool{kDrill, kGains}};
    Random random(kSeed + 4);
    int bad = 0, felt = 0;
    for (int i = 0; i < 100; ++i) {
      const TickResult r = scene.tick({.X_WT = random_pose(random, Vec3d::Zero(), 0.004)}, kDt);
      bad += is_finite(r.wrench) ? 0 : 1;
      felt += r.wrench.force.norm() > kFree ? 1 : 0;
    }
    CHECK(bad == 0);
    if (n != 16) continue;
    CHECK(felt == 0);
    // Turned by up to 30 degrees a tick there is none.
    scene.reset();
    int smoothly = 0;
    for (int i = 0; i < 300; ++i) {
      const double a = 0.5 * i;
      const Posed X =
          tool_at(0.002 * Vec3d(std::sin(a), std::cos(a), 0), Vec3d(std::cos(a), std::sin(a), 0.3).normalized());
      smoothly += scene.tick({.X_WT = X}, kDt).wrench == Wrenchd::zero() ? 0 : 1;
    }
    CHECK(smoothly == 0);
  }
}

// The same way in ticks of a millisecond and of a fiftieth: the forces at the same poses, while contact begins.
TEST_CASE("coupled states: an oblique impact with friction is felt as in fine steps") {
  CAPTURE(kSeed);
  constexpr int kFine = 50;
  Random random(kSeed + 9);
  Figures off;
  double most = 0;
  for (const double speed : {0.3, 1.0, 3.0})
    for (int n = 0; n < cases(24); ++n) {
      // So wide that no way leads off its edge: the fall of a force begins at a tick.
      const ImageOptions o{.size = {100, 100, 100}, .sigma = n % 3 == 0 ? 0.5 : n % 3 == 1 ? 0.7 : 1.0};
      const Vec3d up = random.unit(), top = o.near_middle(random), axis = (up + 0.6 * random.unit()).normalized();
      Bone bone = image(HalfSpace{top, up}, o);
      const double slope = random.uniform(0.2, 1.2), begin = random.uniform();
      const Vec3d way = std::cos(slope) * up.unitOrthogonal() - std::sin(slope) * up;
      const int ticks = std::max(2, static_cast<int>(2.5 / (speed * std::sin(slope))));
      const auto forces = [&](int each) {
        auto scene = coupled_scene(bone, kDrill, Coulomb(0.3, 0.3));
        std::vector<Vec3d> f;
        for (int i = -3 * each; i <= ticks * each; ++i) {
          const double t = (static_cast<double>(i) / each + begin - 1) * kDt;
          const TickResult r = scene.tick({.X_WT = tool_at(top + R * up + speed * t * way, axis)}, kDt / each);
          if (i % each == 0) f.push_back(r.wrench.force);
        }
        return f;
      };
      const std::vector<Vec3d> coarse = forces(1), fine = forces(kFine);
      for (std::size_t i = 0; i < fine.size(); ++i) {
        off.add((coarse[i] - fine[i]).norm());
        most = std::max(most, fine[i].norm());
      }
    }
  MESSAGE("off fine steps [N] ", off, ", of at most ", most);
  CHECK(most > 2);
  CHECK(off.worst() <= 0.039);
}

}  // namespace
