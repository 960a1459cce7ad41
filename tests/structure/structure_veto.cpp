// SPDX-License-Identifier: MIT
// No cut takes a structure: adversarial ticks of whole scenes, against the structures' formulas.
#include "structure/phantom.hpp"
#include "support/cases.hpp"
#include "support/densities.hpp"
#include "support/figures.hpp"
#include "support/near.hpp"
#include "support/random.hpp"

#include <trephine/core/units.hpp>
#include <trephine/everything.hpp>
#include <trephine/stage/veto.hpp>
#include <trephine/structure/structure_guard.hpp>
#include <trephine/structure/structure_veto.hpp>
#include <trephine/tool/shapes/drill_bit.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <memory>
#include <vector>

using namespace trephine;
using namespace trephine::test;
using namespace trephine::literals;

namespace {

constexpr double kIso = 300;
constexpr int kSize = 48;
constexpr double kVoxel = 0.35e-3;
const Burr kBurr{.tip_radius = 1.5_mm, .shaft_radius = 0.8_mm, .shaft_length = 12_mm};
using Bone = VoxelGrid<std::int16_t>;

/// Bone with caves and its own surface, askew to the labels.
Bone cavernous(unsigned seed) {
  Random random(seed);
  std::vector<Vec3d> waves;
  for (int w = 0; w < 5; ++w) waves.push_back(random.arrow(0.2, 0.7));
  std::vector<std::int16_t> voxels;
  for (int k = 0; k < kSize; ++k)
    for (int j = 0; j < kSize; ++j)
      for (int i = 0; i < kSize; ++i) {
        double v = 700;
        for (const Vec3d& w : waves) v += 500 * std::sin(w.dot(Vec3d(i, j, k)));
        voxels.push_back(static_cast<std::int16_t>(std::clamp(v, -1000.0, 1500.0)));
      }
  return {{.size = {kSize, kSize, kSize}, .spacing = Vec3d::Constant(kVoxel), .outside = -1000}, voxels};
}

Posed askew() { return make_pose<double>(rotation_from_vector<double>(Vec3d(0.1, -0.15, 0.2)), Vec3d(0.5_mm, 0, 0)); }

/// Ticks a scene as no hand would: fast, with jumps, turns, bad poses, stalls and restores.
template <class Scene>
void rage(Scene& scene, Bone& bone, Random& random, int ticks, double& removed) {
  Posed X = make_pose<double>(random.rotation(),
                              kSize * kVoxel * Vec3d{random.uniform(), random.uniform(), random.uniform()});
  Vec3d v = Vec3d::Zero(), w = Vec3d::Zero();
  for (int n = 0; n < ticks; ++n) {
    if (random.below(40) == 0) v = random.arrow(0, 1);
    if (random.below(40) == 0) w = random.arrow(0, 30);
    const double dt = random.below(10) == 0 ? std::pow(10.0, random.uniform(-4, -2)) : 1e-3;
    X.translation() += dt * v;
    X.linear() = rotation_from_vector<double>(Vec3d(dt * w)) * X.linear();
    const Vec3d middle = Vec3d::Constant(0.5 * kSize * kVoxel);
    if (random.below(300) == 0 || (X.translation() - middle).norm() > 1.2 * kSize * kVoxel)
      X = make_pose<double>(random.rotation(), Vec3d(middle + random.arrow(0, 0.6) * kSize * kVoxel));
    TickInput input{.X_WT = X, .spindle_on = random.below(20) != 0};
    if (random.below(200) == 0) input.X_WT.translation()[random.below(3)] = std::numeric_limits<double>::quiet_NaN();
    if (random.below(200) == 0) input.X_WT.linear() *= 2;
    removed += scene.tick(input, random.below(300) == 0 ? std::numeric_limits<double>::quiet_NaN() : dt).removed_mm3;
    if (random.below(4000) == 0) (void)bone.restore(static_cast<std::size_t>(random.below(60)));
  }
}

}  // namespace

TEST_CASE("hostile ticks take none of a structure, under every policy") {
  const LabelledTubes truth = canals();
  const auto field = truth.field(5_mm);
  const Posed X_GS = askew(), X_SG = X_GS.inverse();
  const std::array<StructureVeto, 3> vetoes{StructureVeto{.margin = 0.4_mm}, StructureVeto{.margin = 0.8_mm},
                                            StructureVeto{.margin = 0}};
  const std::vector<GuardedStructure> guards(3);
  const auto potential = std::make_shared<const GuardPotential>(field, X_GS, kBurr, guards);
  Random random(21);
  const char* const wished = std::getenv("HOSTILE_TICKS");  // of all four together
  const int ticks = wished != nullptr ? std::atoi(wished) / 4 : kSanitized ? 2000 : 40000;
  double deepest = 0;
  int all_taken = 0;
  const auto judge = [&](auto policy, auto shape, bool guard, unsigned seed) {
    CAPTURE(seed);
    Bone bone = cavernous(seed);
    const std::vector<std::int16_t> before = densities(bone);
    const auto floor = make_cut_floor(*field, X_GS, bone, kIso, vetoes);
    double removed = 0;
    const Cutting milling{policy, {.follow_probe = true}, shape};
    if (guard) {
      HapticScene scene{bone,    kIso,        LineApproxRenderer{ToolDiscretization{kBurr, LineCounts{}}},
                        milling, Veto{floor}, StructureGuard{potential}};
      rage(scene, bone, random, ticks, removed);
    } else {
      HapticScene scene{bone, kIso, LineApproxRenderer{ToolDiscretization{kBurr, LineCounts{}}}, milling, Veto{floor}};
      rage(scene, bone, random, ticks, removed);
    }
    const std::vector<std::int16_t> after = densities(bone);
    int points = 0, taken = 0, elsewhere = 0, left = 0;
    for (int n = 0; n < 300000; ++n) {
      const Vec3d u = (kSize - 1.001) * Vec3d{random.uniform(), random.uniform(), random.uniform()};
      if (interpolated(before, kSize, u) < kIso) continue;
      const bool bone_now = interpolated(after, kSize, u) >= kIso;
      // What the veto protects: by the field's distances at the eight voxels around the point.
      bool guarded = false, far = true;
      for (int s = 0; s < 3; ++s) {
        const double margin = vetoes[static_cast<std::size_t>(s)].margin;
        double c = 0;
        const Vec3d lo = u.array().floor();
        for (int corner = 0; corner < 8; ++corner) {
          const Vec3d at = lo + Vec3d(corner & 1, corner >> 1 & 1, corner >> 2);
          const Vec3d weight = Vec3d::Ones() - (u - at).cwiseAbs();
          c += weight.prod() * (field->distance(s, X_SG * Vec3d(kVoxel * at)) - margin);
        }
        guarded = guarded || c <= 0;
        const double d = truth.distance(s, X_SG * Vec3d(kVoxel * u)) - margin;
        far = far && d > 2 * kVoxel;
        if (!bone_now) deepest = std::max(deepest, -d);
      }
      if (guarded) {
        ++points;
        taken += bone_now ? 0 : 1;
      } else if (far) {
        ++elsewhere;
        left += bone_now ? 1 : 0;
      }
    }
    CHECK(points > 1000);
    CHECK(taken == 0);
    all_taken += taken;
    CHECK(removed > 0);
    CHECK(floor->refused_mm3() > 0);
    if (!kSanitized) CHECK(left < 0.7 * elsewhere);
  };
  judge(GeometricCut{}, ToolHead{}, true, 31);
  judge(RateLimitedCut<>{.rate = 3e6}, ToolHead{}, false, 32);
  judge(AdvancingCut{.speed = 0.2}, ToolHead{}, false, 33);
  judge(GeometricCut{}, DrillBit{.radius = 1_mm, .length = 6_mm}, false, 34);
  MESSAGE((4 * ticks) << " ticks; the deepest cut lies " << deepest / truth.voxel
                      << " label voxels within a true margin");
  documented("labels", "Protected points taken in hostile ticks", all_taken);
  CHECK(deepest < 0.5 * truth.voxel);  // labels place a surface within half a voxel
}

TEST_CASE("a structure that may break is counted, and a free one is not") {
  const LabelledTubes truth = canals();
  const auto field = truth.field(3_mm);
  const std::vector<std::int16_t> voxels(static_cast<std::size_t>(kSize) * kSize * kSize, 1200);
  Bone bone({.size = {kSize, kSize, kSize}, .spacing = Vec3d::Constant(kVoxel), .outside = -1000}, voxels);
  using Mode = StructureVeto::Mode;
  const std::array<StructureVeto, 3> vetoes{StructureVeto{.mode = Mode::kFree}, StructureVeto{.mode = Mode::kWatch},
                                            StructureVeto{.mode = Mode::kProtect}};
  const auto floor = make_cut_floor(*field, Posed::Identity(), bone, kIso, vetoes);
  Cutting milling;
  const Burr huge{.tip_radius = 16_mm};
  const Posed X = make_pose<double>(Mat3d::Identity(), Vec3d::Constant(0.5 * kSize * kVoxel));
  (void)milling.carve(bone, kIso, X, X, huge, {.dt = 1e-3}, floor.get());
  const auto volume = [](const Tube& t) {
    const double r = 1e3 * t.radius;
    return 3.14159265 * r * r * (1e3 * (t.to - t.from).norm() + 4.0 / 3 * r);
  };
  CHECK(floor->taken_mm3(0) == 0);
  // Labels place the surface of a tube of two voxels radius within a tenth of a voxel: a tenth of its volume.
  CHECK(floor->taken_mm3(1) == near(volume(truth.tubes[1]), 0.1));
  CHECK(floor->refused_mm3(2) == near(volume(truth.tubes[2]), 0.04));
  CHECK(floor->refused_mm3(1) == 0);
}

TEST_CASE("hostile ticks take nothing outside of planned cavities") {
  // A nerve crosses a wide tube that a ball touches; both are to be drilled out, but for the nerve.
  const auto mm = [](double x, double y, double z) { return Vec3d(x * 1_mm, y * 1_mm, z * 1_mm); };
  const LabelledTubes truth{.tubes = {{mm(8, 2, 9), mm(8, 15, 8), 0.7_mm},
                                      {mm(4, 7, 8), mm(10, 8, 9), 2.6_mm},
                                      {mm(12, 11, 9), mm(12, 11, 9), 2.5_mm}},
                            .structure = {1, 0, 2},
                            .size = {58, 58, 58}};
  const auto field = truth.field(5_mm);
  const Posed X_GS = askew(), X_SG = X_GS.inverse();
  using Mode = StructureVeto::Mode;
  const std::array<StructureVeto, 3> vetoes{StructureVeto{.mode = Mode::kKeepIn, .margin = 0.1_mm},
                                            StructureVeto{.mode = Mode::kProtect, .margin = 0.2_mm},
                                            StructureVeto{.mode = Mode::kKeepIn}};
  Random random(23);
  const auto judge = [&](auto policy, auto shape, unsigned seed) {
    CAPTURE(seed);
    Bone bone = cavernous(seed);
    const std::vector<std::int16_t> before = densities(bone);
    const auto floor = make_cut_floor(*field, X_GS, bone, kIso, vetoes);
    double removed = 0;
    HapticScene scene{bone, kIso, LineApproxRenderer{ToolDiscretization{kBurr, LineCounts{}}},
                      Cutting{policy, {.follow_probe = true}, shape}, Veto{floor}};
    rage(scene, bone, random, kSanitized ? 2000 : 40000, removed);
    const std::vector<std::int16_t> after = densities(bone);
    int outside = 0, taken = 0, inside = 0, left = 0;
    for (int n = 0; n < 300000; ++n) {
      const Vec3d u = (kSize - 1.001) * Vec3d{random.uniform(), random.uniform(), random.uniform()};
      if (interpolated(before, kSize, u) < kIso) continue;
      const bool bone_now = interpolated(after, kSize, u) >= kIso;
      const Vec3d p_S = X_SG * Vec3d(kVoxel * u);
      const double c = std::min(truth.distance(0, p_S) + 0.1_mm, truth.distance(2, p_S));
      const double d = truth.distance(1, p_S) - 0.2_mm;
      // Labels place a surface within half a voxel.
      if (c > truth.voxel / 2 || d < -truth.voxel / 2) {
        ++outside;
        taken += bone_now ? 0 : 1;
      } else if (c < -2 * kVoxel && d > 2 * kVoxel) {
        ++inside;
        left += bone_now ? 1 : 0;
      }
    }
    CHECK(outside > 1000);
    CHECK(taken == 0);
    CHECK(removed > 0);
    CHECK(floor->refused_mm3(0) > 0);
    CHECK(floor->refused_mm3(1) > 0);
    CHECK(floor->refused_mm3(2) > 0);
    if (!kSanitized) CHECK(left < 0.8 * inside);  // the drill reaches what it may take
  };
  judge(GeometricCut{}, ToolHead{}, 41);
  judge(AdvancingCut{.speed = 0.2}, ToolHead{}, 43);
  judge(GeometricCut{}, DrillBit{.radius = 1_mm, .length = 6_mm}, 44);
}

TEST_CASE("a huge burr drills a planned cavity and no more, and what lies far outside takes little memory") {
  const LabelledTubes truth{
      .tubes = {{Vec3d::Constant(8.4_mm), Vec3d::Constant(8.4_mm), 3_mm}}, .structure = {0}, .size = {58, 58, 58}};
  const auto field = truth.field(5_mm);
  const std::vector<std::int16_t> voxels(static_cast<std::size_t>(kSize) * kSize * kSize, 1200);
  Bone bone({.size = {kSize, kSize, kSize}, .spacing = Vec3d::Constant(kVoxel), .outside = -1000}, voxels);
  const std::array vetoes{StructureVeto{.mode = StructureVeto::Mode::kKeepIn, .margin = 0.4_mm}};
  const auto floor = make_cut_floor(*field, Posed::Identity(), bone, kIso, vetoes);
  const Posed X = make_pose<double>(Mat3d::Identity(), Vec3d::Constant(0.5 * kSize * kVoxel));
  const Burr huge{.tip_radius = 20_mm};
  const Cutting milling;
  const double removed = Cutting(milling).carve(bone, kIso, X, X, huge, {.dt = 1e-3}, floor.get());
  const double cavity = 4.0 / 3 * 3.14159265 * std::pow(2.6, 3), all = std::pow(kSize * kVoxel * 1e3, 3);
  // What exact distances leave of the same bone: voxels so large cut the corners of so small a ball.
  Bone ideal({.size = {kSize, kSize, kSize}, .spacing = Vec3d::Constant(kVoxel), .outside = -1000}, voxels);
  const auto exact = std::make_shared<CutFloor<std::int16_t>>(ideal, kIso);
  exact->protect(0, {{0, 0, 0}, {kSize - 1, kSize - 1, kSize - 1}},
                 [&](int i, int j, int k) { return -(truth.distance(0, kVoxel * Vec3d(i, j, k)) + 0.4_mm); });
  exact->seal(ideal);
  const double expected = Cutting(milling).carve(ideal, kIso, X, X, huge, {.dt = 1e-3}, exact.get());
  MESSAGE(removed << " mm³ removed, " << expected << " mm³ with exact distances, " << cavity << " mm³ by formula");
  CHECK(removed == near(expected, 0.01));
  CHECK(expected == near(cavity, 0.03));
  CHECK(floor->refused_mm3(0) == near(all - cavity, 0.003));
  // A second carving takes nothing and counts nothing anew; reset counts anew.
  const double refused = floor->refused_mm3();
  CHECK(Cutting(milling).carve(bone, kIso, X, X, huge, {.dt = 1e-3}, floor.get()) == 0);
  CHECK(floor->refused_mm3() == refused);
  floor->reset_counts();
  CHECK(floor->refused_mm3() == 0);
  (void)Cutting(milling).carve(bone, kIso, X, X, huge, {.dt = 1e-3}, floor.get());
  CHECK(floor->refused_mm3() == refused);
  CHECK(static_cast<double>(floor->bytes()) < 1.8 * kSize * kSize * kSize);
}

TEST_CASE("what a veto cannot use is refused") {
  const LabelledTubes truth = canals();
  const auto field = truth.field(1_mm);
  const Bone bone = cavernous(3);
  const std::array<StructureVeto, 2> few{};
  CHECK_THROWS_AS((void)make_cut_floor(*field, Posed::Identity(), bone, kIso, few), std::invalid_argument);
  std::array<StructureVeto, 3> vetoes{};
  vetoes[1].margin = 0.9_mm;
  CHECK_THROWS_AS((void)make_cut_floor(*field, Posed::Identity(), bone, kIso, vetoes), std::invalid_argument);
  vetoes[1].margin = -1;
  CHECK_THROWS_AS((void)make_cut_floor(*field, Posed::Identity(), bone, kIso, vetoes), std::invalid_argument);
  vetoes[1].margin = 0;
  Posed scaled = Posed::Identity();
  scaled.linear() *= 2;
  CHECK_THROWS_AS((void)make_cut_floor(*field, scaled, bone, kIso, vetoes), std::invalid_argument);
  CHECK(make_cut_floor(*field, Posed::Identity(), bone, kIso, vetoes) != nullptr);
  // The reach that is asked for is enough, and little less is not.
  vetoes[1].margin = 0.9_mm;
  const double reach = required_veto_reach(bone, 0.9_mm);
  CHECK(make_cut_floor(*truth.field(1.001 * reach), Posed::Identity(), bone, kIso, vetoes) != nullptr);
  CHECK_THROWS_AS((void)make_cut_floor(*truth.field(0.999 * reach), Posed::Identity(), bone, kIso, vetoes),
                  std::invalid_argument);
}
