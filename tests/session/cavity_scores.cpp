// SPDX-License-Identifier: MIT
// Scores of drilled cavities, whose volumes are counted or known in closed form.
#include <doctest/doctest.h>

#include <trephine/core/rotation.hpp>
#include <trephine/core/units.hpp>
#include <trephine/session/bone_over.hpp>
#include <trephine/session/cavity_scores.hpp>

#include "support/near.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace trephine;
using test::near;
using test::within;

constexpr double kIsovalue = 300;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
using Bone = VoxelGrid<std::int16_t>;
using Labels = LabelGrid<std::uint8_t>;
using Inside = std::function<bool(int, int, int)>;

/// A pose that is no identity, so that frames that are mixed up show.
Posed some_pose() {
  return make_pose<double>(rotation_from_vector<double>(Vec3d(0.4, -0.7, 1.1)), Vec3d(0.3, -0.2, 1));
}

/// All bone, of n voxels each way but for one layer of air at x = 0.
Bone solid(int n, double h, const Posed& X_WG = some_pose(), bool keep = true) {
  std::vector<std::int16_t> voxels(static_cast<std::size_t>(n * n * n), 1200);
  for (std::size_t v = 0; v < voxels.size(); v += static_cast<std::size_t>(n)) voxels[v] = -1000;
  return Bone({.size = {n, n, n}, .spacing = Vec3d::Constant(h), .X_WG = X_WG}, voxels, {.keep_original = keep});
}
void remove(Bone& bone, const Inside& inside) {
  for (int k = 0; k < bone.size()[2]; ++k)
    for (int j = 0; j < bone.size()[1]; ++j)
      bone.lower_row(j, k, 0, bone.size()[0] - 1,
                     [&](int i, std::int16_t old) { return inside(i, j, k) ? std::int16_t{-1000} : old; });
  bone.commit();
}
Labels labelled(int n, double h, const Posed& X_WS, const std::function<int(int, int, int)>& label,
                std::vector<Structure> structures = {{.label = 1, .name = "nerve"}}) {
  std::vector<std::uint8_t> voxels;
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) voxels.push_back(static_cast<std::uint8_t>(label(i, j, k)));
  return Labels({.size = {n, n, n}, .spacing = Vec3d::Constant(h), .X_WG = X_WS}, voxels, std::move(structures));
}

template <class Call>
std::string refusal(const Call& call) {
  try {
    call();
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
  return "none";
}

TEST_CASE("cavity scores: a box that is drilled half a box beside the plan overlaps by half") {
  Bone bone = solid(40, 0.5_mm);
  const auto in = [](int u, int from) { return u >= from && u < from + 10; };
  // The plan is a structure in a frame of its own, moved by 2 voxels against the bone's.
  const Posed X_WS = make_pose<double>(some_pose().linear(), some_pose() * Vec3d(1_mm, 1_mm, 1_mm));
  const Labels plan =
      labelled(36, 0.5_mm, X_WS, [&](int i, int j, int k) { return in(i, 8) && in(j, 8) && in(k, 8) ? 7 : 0; },
               {{.label = 7, .name = "cavity"}});
  CavityScores scores = cavity_scores(bone, kIsovalue, plan, 7);
  CHECK(scores.planned_mm3 == near(125));
  CHECK(scores.removed_mm3 == 0);
  CHECK(scores.dice() == 0);
  remove(bone, [&](int i, int j, int k) { return in(i, 15) && in(j, 10) && in(k, 10); });
  scores = cavity_scores(bone, kIsovalue, plan, 7);
  CHECK(scores.planned_mm3 == near(125));
  CHECK(scores.removed_mm3 == near(125));
  CHECK(scores.overlap_mm3 == near(62.5));
  CHECK(scores.missed_mm3() == near(62.5));
  CHECK(scores.excess_mm3() == near(62.5));
  CHECK(scores.dice() == near(0.5));
  // The air at x = 0 is neither planned nor removed, wherever the plan is.
  const auto everywhere = cavity_scores(bone, kIsovalue, [](const Vec3d&) { return true; });
  CHECK(everywhere.planned_mm3 == near(39 * 40 * 40 * 0.125));
  CHECK(everywhere.overlap_mm3 == near(125));
  CHECK(everywhere.dice() == near(2.0 * 1000 / (39 * 40 * 40 + 1000)));
  remove(bone, [&](int i, int j, int k) { return in(i, 10) && in(j, 10) && in(k, 10); });
  CHECK(cavity_scores(bone, kIsovalue, plan, 7).overlap_mm3 == near(125));
  CHECK(CavityScores{}.dice() == 1);
}

TEST_CASE("cavity scores: two balls of one radius, half of it apart, overlap by their lens") {
  constexpr double kRadius = 8e-3, kApart = 4e-3;
  Bone bone = solid(60, 0.4_mm);
  const Vec3d centre_G(10_mm, 12_mm, 12_mm);
  remove(bone, [&](int i, int j, int k) { return (0.4_mm * Vec3d(i, j, k) - centre_G).norm() < kRadius; });
  const Vec3d planned_W = some_pose() * (centre_G + Vec3d(0, 0, kApart));
  const CavityScores scores =
      cavity_scores(bone, kIsovalue, [&](const Vec3d& p_WQ) { return (p_WQ - planned_W).norm() < kRadius; });
  const double ball = 4.0 / 3 * std::numbers::pi * 512;
  const double lens = std::numbers::pi / 12 * (4 * 8 + 4) * (2 * 8 - 4) * (2 * 8 - 4);
  CHECK(scores.planned_mm3 == near(ball, 0.01));
  CHECK(scores.removed_mm3 == near(ball, 0.01));
  CHECK(scores.overlap_mm3 == near(lens, 0.01));
  CHECK(scores.dice() == near(lens / ball, 0.01));
}

TEST_CASE("label scores: bone before and removed of each structure, and of none") {
  Bone bone = solid(30, 0.5_mm);
  const Labels labels = labelled(30, 0.5_mm, some_pose(), [](int i, int, int k) { return i > 20  ? 9
                                                                                         : k < 5 ? 2
                                                                                                 : 0; },
                                 {{.label = 9, .name = "nerve"}, {.label = 2, .name = "dura"}});
  remove(bone, [](int, int j, int k) { return j < 10 && k < 10; });
  const std::vector<LabelScores> scores = label_scores(bone, kIsovalue, labels);
  REQUIRE(scores.size() == 3);
  CHECK(scores[0].label == 0);
  CHECK(scores[0].before_mm3 == near(20 * 30 * 25 * 0.125));
  CHECK(scores[0].removed_mm3 == near(20 * 10 * 5 * 0.125));
  CHECK(scores[1].label == 9);
  CHECK(scores[1].before_mm3 == near(9 * 30 * 30 * 0.125));
  CHECK(scores[1].removed_mm3 == near(9 * 10 * 10 * 0.125));
  CHECK(scores[2].label == 2);
  CHECK(scores[2].before_mm3 == near(20 * 30 * 5 * 0.125));
  CHECK(scores[2].removed_mm3 == near(20 * 10 * 5 * 0.125));
}

TEST_CASE("bone over a structure: what is left within the reach, and its thinnest place") {
  // A slab is the structure, k < 10; a pit goes down to k = 14, which leaves 4 voxels.
  Bone bone = solid(40, 0.5_mm);
  const Labels labels = labelled(40, 0.5_mm, some_pose(), [](int, int, int k) { return k < 10 ? 1 : 0; });
  BoneOver over = bone_over(bone, kIsovalue, labels, 1, 3.1_mm);
  CHECK(over.before_mm3 == near(39 * 40 * 6 * 0.125));  // k from 10 to 15
  CHECK(over.left_mm3 == over.before_mm3);
  CHECK(over.thinnest == std::numeric_limits<double>::infinity());
  remove(bone, [](int i, int j, int k) { return i >= 10 && i < 20 && j < 20 && k >= 14; });
  over = bone_over(bone, kIsovalue, labels, 1, 3.1_mm);
  CHECK(over.before_mm3 == near(39 * 40 * 6 * 0.125));
  CHECK(over.left_mm3 == near((39 * 40 * 6 - 10 * 20 * 2) * 0.125));
  CHECK(over.thinnest == within(2_mm, 1e-9));
  CHECK(bone_over(bone, kIsovalue, labels, 1, 2.4_mm).thinnest == std::numeric_limits<double>::infinity());
  remove(bone, [](int i, int j, int k) { return i == 12 && j == 3 && k >= 10; });
  CHECK(bone_over(bone, kIsovalue, labels, 1, 3.1_mm).thinnest == within(0, 1e-9));
}

TEST_CASE("bone over a structure: distances are those of a search through all voxels") {
  Bone bone = solid(24, 0.7_mm);
  const auto in_structure = [](int i, int j, int k) { return std::hypot(j - 11.3, k - 8.2) < 2.5 && i > 4 && i < 18; };
  const Labels labels =
      labelled(24, 0.7_mm, some_pose(), [&](int i, int j, int k) { return in_structure(i, j, k) ? 1 : 0; });
  const auto removed = [](int i, int j, int k) { return Vec3d(i - 9, j - 18, k - 14).norm() < 5.5; };
  remove(bone, removed);
  constexpr double kReach = 3e-3;
  std::size_t before = 0, left = 0;
  double thinnest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 24; ++k)
    for (int j = 0; j < 24; ++j)
      for (int i = 1; i < 24; ++i) {
        double d = std::numeric_limits<double>::infinity();
        for (int w = 0; w < 24; ++w)
          for (int v = 0; v < 24; ++v)
            for (int u = 5; u < 18; ++u)
              if (in_structure(u, v, w)) d = std::min(d, 0.7e-3 * Vec3d(u - i, v - j, w - k).norm());
        if (d > kReach) continue;
        if (removed(i, j, k)) thinnest = std::min(thinnest, std::max(0.0, d - 0.7e-3));
        before += d > 0;
        left += d > 0 && !removed(i, j, k);
      }
  const BoneOver over = bone_over(bone, kIsovalue, labels, 1, kReach);
  REQUIRE(left < before);
  CHECK(over.before_mm3 == near(static_cast<double>(before) * 0.343));
  CHECK(over.left_mm3 == near(static_cast<double>(left) * 0.343));
  CHECK(over.thinnest == within(thinnest, 1e-9));
  // A structure that lies elsewhere has no bone over it.
  const Labels elsewhere = labelled(8, 0.7_mm, make_pose<double>(Mat3d::Identity(), Vec3d(5, 0, 0)),
                                    [](int i, int, int) { return i > 3 ? 1 : 0; });
  CHECK(bone_over(bone, kIsovalue, elsewhere, 1, kReach).before_mm3 == 0);
}

TEST_CASE("cavity scores: what cannot be scored is refused") {
  const Bone bone = solid(8, 0.5_mm), forgetful = solid(8, 0.5_mm, some_pose(), false);
  const Labels labels = labelled(8, 0.5_mm, some_pose(), [](int i, int, int) { return i > 3 ? 1 : 0; });
  const auto has = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  const auto plan = [](const Vec3d&) { return true; };
  CHECK(has(refusal([&] { (void)cavity_scores(forgetful, kIsovalue, plan); }), "keep its original"));
  CHECK(has(refusal([&] { (void)label_scores(forgetful, kIsovalue, labels); }), "keep its original"));
  CHECK(has(refusal([&] { (void)bone_over(forgetful, kIsovalue, labels, 1, 1e-3); }), "keep its original"));
  CHECK(has(refusal([&] { (void)cavity_scores(bone, kIsovalue, labels, 2); }), "the label must be a structure"));
  CHECK(has(refusal([&] { (void)bone_over(bone, kIsovalue, labels, 0, 1e-3); }), "the label must be a structure"));
  for (const double reach : {0.0, -1.0, kNaN})
    CHECK(has(refusal([&] { (void)bone_over(bone, kIsovalue, labels, 1, reach); }), "reach must be > 0"));
  CHECK(has(refusal([&] { (void)bone_over(bone, kIsovalue, labels, 1, 1.0); }), "did you mean"));
}

}  // namespace
