// SPDX-License-Identifier: MIT
#include "support/check_refused.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/structure/label_grid.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

using namespace trephine;
using trephine::test::refusal;

namespace {

constexpr unsigned kSeed = 71;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

void holds(const std::string& text, const std::string& part) {
  INFO(text);
  CHECK(text.find(part) != std::string::npos);
  CHECK(text.find('\n') == std::string::npos);
}

GridGeometry geometry(const std::array<int, 3>& size) { return {.size = size, .spacing = {1e-3, 2e-3, 3e-3}}; }

template <VoxelLabel Label>
std::string refusal_of(const std::vector<Label>& voxels, const std::vector<Structure>& structures,
                       const LabelGridOptions& options = {}) {
  const int n = static_cast<int>(voxels.size());
  return refusal([&] { LabelGrid<Label>(geometry({n, 1, 1}), voxels, structures, options); });
}

using Voxels8 = std::vector<std::uint8_t>;
using Voxels16 = std::vector<std::uint16_t>;

}  // namespace

static_assert(VoxelLabel<std::uint8_t> && VoxelLabel<std::uint16_t>);
static_assert(!VoxelLabel<std::int16_t> && !VoxelLabel<float> && !VoxelLabel<bool>);
static_assert(std::is_nothrow_move_constructible_v<LabelGrid<std::uint8_t>>);

TEST_CASE_TEMPLATE("counts, boxes and labels agree with a search of all voxels", Label, std::uint8_t, std::uint16_t) {
  std::mt19937 random(kSeed);
  CAPTURE(kSeed);
  const std::array size{13, 9, 7};
  constexpr bool kWide = sizeof(Label) == 2;
  const std::array<std::uint16_t, 4> labels{0, 7, kWide ? std::uint16_t{65535} : std::uint16_t{255}, 1};
  std::vector<Label> voxels;
  for (int i = 0; i < size[0] * size[1] * size[2]; ++i)
    voxels.push_back(static_cast<Label>(labels[std::min<std::size_t>(random() % 40, 3)]));
  voxels[5] = 7;
  const std::vector<Structure> structures{{7, "facial nerve", {1, 0, 0}}, {labels[2], "dura"}, {1, "sinus"}};
  const LabelGrid<Label> grid(geometry(size), voxels, structures);

  CHECK(grid.size() == size);
  CHECK(grid.spacing() == Vec3d(1e-3, 2e-3, 3e-3));
  CHECK(grid.structures().size() == 3);
  CHECK(std::vector<Label>(grid.voxels().begin(), grid.voxels().end()) == voxels);
  for (const Structure& s : structures) {
    CAPTURE(s.name);
    std::size_t count = 0;
    VoxelBox box{size, {-1, -1, -1}};
    for (int k = 0; k < size[2]; ++k)
      for (int j = 0; j < size[1]; ++j)
        for (int i = 0; i < size[0]; ++i) {
          if (voxels[static_cast<std::size_t>((k * size[1] + j) * size[0] + i)] != s.label) continue;
          CHECK(grid.at(i, j, k) == s.label);
          ++count;
          const std::array at{i, j, k};
          for (std::size_t a = 0; a < 3; ++a) {
            box.lo[a] = std::min(box.lo[a], at[a]);
            box.hi[a] = std::max(box.hi[a], at[a]);
          }
        }
    CHECK(grid.voxel_count(s.label) == count);
    CHECK(grid.box_of(s.label).lo == box.lo);
    CHECK(grid.box_of(s.label).hi == box.hi);
    REQUIRE(grid.find(s.label) != nullptr);
    CHECK(grid.find(s.label)->name == s.name);
    REQUIRE(grid.find(s.name) != nullptr);
    CHECK(grid.find(s.name)->label == s.label);
  }
  CHECK(grid.find("facial nerve")->colour == std::array<float, 3>{1, 0, 0});
  for (const std::uint16_t other : std::array<std::uint16_t, 3>{0, 2, 300}) {
    CHECK(grid.find(other) == nullptr);
    CHECK(grid.voxel_count(other) == 0);
    CHECK(grid.box_of(other).empty());
  }
  CHECK(grid.find("") == nullptr);
  CHECK(grid.bytes() >= voxels.size() * sizeof(Label));
  CHECK(grid.bytes() < voxels.size() * sizeof(Label) + 1000);
}

TEST_CASE("labels beyond the grid are 0") {
  const LabelGrid<std::uint8_t> grid(geometry({2, 3, 4}), Voxels8(24, 9), {{9, "all"}});
  for (const int at : {-1, 2, std::numeric_limits<int>::max(), std::numeric_limits<int>::lowest()}) {
    CHECK(grid.at(at, 0, 0) == 0);
    CHECK_FALSE(grid.contains(at, 0, 0));
  }
  CHECK(grid.at(0, -1, 0) == 0);
  CHECK(grid.at(0, 3, 0) == 0);
  CHECK(grid.at(0, 0, -1) == 0);
  CHECK(grid.at(0, 0, 4) == 0);
  CHECK(grid.at(1, 2, 3) == 9);
}

TEST_CASE("a point has the label of the nearest voxel, with any spacing") {
  Voxels16 voxels(5 * 4 * 3);
  std::vector<Structure> structures;
  for (std::size_t v = 0; v < voxels.size(); ++v) {
    voxels[v] = static_cast<std::uint16_t>(v + 1);
    structures.push_back({voxels[v], "voxel " + std::to_string(v)});
  }
  const LabelGrid<std::uint16_t> grid({.size = {5, 4, 3}, .spacing = {0.2e-3, 0.5e-3, 1.7e-3}}, voxels, structures);
  std::mt19937 random(kSeed);
  CAPTURE(kSeed);
  std::uniform_real_distribution<double> share(-1, 6);
  for (int point = 0; point < 2000; ++point) {
    const Vec3d p = Vec3d(share(random), share(random), share(random)).cwiseProduct(grid.spacing());
    std::uint16_t nearest = 0;
    double least = kInf;
    for (int k = -2; k < 9; ++k)
      for (int j = -2; j < 9; ++j)
        for (int i = -2; i < 9; ++i) {
          const Vec3d centre = grid.spacing().cwiseProduct(Vec3d(i, j, k));
          if ((p - centre).norm() < least) {
            least = (p - centre).norm();
            nearest = grid.at(i, j, k);
          }
        }
    CHECK(grid.label_at(p) == nearest);
  }
  CHECK(grid.label_at(Vec3d(-0.1e-3, 0, 0)) == 1);  // midway belongs to the higher index
  CHECK(grid.label_at(Vec3d(0.1e-3, 0, 0)) == 2);
  CHECK(grid.label_at(Vec3d(0.9e-3, 0, 0)) == 0);
  for (const double bad : {kNan, kInf, -kInf, 1e300, -1e300}) {
    CHECK(grid.label_at(Vec3d(bad, 0, 0)) == 0);
    CHECK(grid.label_at(Vec3d(0, bad, 0)) == 0);
    CHECK(grid.label_at(Vec3d(0, 0, bad)) == 0);
  }
}

TEST_CASE("a rotated grid has its labels in its own frame") {
  GridGeometry turned = geometry({2, 1, 1});
  turned.X_WG = make_pose<double>(rotation_from_vector<double>({0.2, -0.4, 1}), Vec3d(0.1, -0.2, 0.3));
  LabelGrid<std::uint8_t> grid(turned, Voxels8{0, 5}, {{5, "nerve"}});
  CHECK(grid.X_WS().matrix() == turned.X_WG.matrix());
  const Vec3d p_W = grid.X_WS() * Vec3d(1.2e-3, -0.5e-3, 1e-3);
  const auto label_in_world = [&] { return grid.label_at(grid.X_WS().inverse() * p_W); };
  CHECK(label_in_world() == 5);
  Posed moved = turned.X_WG;
  moved.translation().x() += 1;
  grid.set_X_WS(moved);
  CHECK(grid.X_WS().matrix() == moved.matrix());
  CHECK(label_in_world() == 0);
  Posed bad = moved;
  bad.linear() *= 1.1;
  holds(refusal([&] { grid.set_X_WS(bad); }), "LabelGrid: X_WS must hold a right-handed rotation");
  bad = moved;
  bad.linear().col(0) = -bad.linear().col(0);
  holds(refusal([&] { grid.set_X_WS(bad); }), "right-handed");
  bad = moved;
  bad.translation().y() = kNan;
  holds(refusal([&] { grid.set_X_WS(bad); }), "X_WS must lie within 1 km");
  CHECK(grid.X_WS().matrix() == moved.matrix());
}

TEST_CASE("no structure, one voxel, and a grid of one label are grids too") {
  const LabelGrid<std::uint8_t> none(geometry({3, 2, 2}), Voxels8(12), {});
  CHECK(none.structures().empty());
  CHECK(none.label_at(Vec3d(1e-3, 0, 0)) == 0);
  const LabelGrid<std::uint8_t> one(geometry({1, 1, 1}), Voxels8{255}, {{255, "x"}});
  CHECK(one.voxel_count(255) == 1);
  CHECK(one.box_of(255).lo == std::array{0, 0, 0});
  CHECK(one.box_of(255).hi == std::array{0, 0, 0});
  const LabelGrid<std::uint16_t> full(geometry({3, 2, 2}), Voxels16(12, 700), {{700, "all"}});
  CHECK(full.voxel_count(700) == 12);
  CHECK(full.box_of(700).hi == std::array{2, 1, 1});
}

TEST_CASE("structures that touch keep their voxels") {
  const LabelGrid<std::uint8_t> grid(geometry({6, 1, 1}), Voxels8{1, 1, 2, 2, 3, 1}, {{2, "b"}, {1, "a"}, {3, "c"}});
  CHECK(grid.voxel_count(1) == 3);
  CHECK(grid.box_of(1).hi[0] == 5);
  CHECK(grid.box_of(2).lo[0] == 2);
  CHECK(grid.box_of(2).hi[0] == 3);
  CHECK(grid.voxel_count(3) == 1);
}

TEST_CASE("255 structures fit, and no more") {
  Voxels16 voxels;
  std::vector<Structure> structures;
  for (std::uint16_t s = 1; s <= 255; ++s) {
    voxels.push_back(static_cast<std::uint16_t>(100 * s));
    structures.push_back({voxels.back(), "s" + std::to_string(s)});
  }
  CHECK(refusal_of(voxels, structures) == "");
  voxels.push_back(1);
  structures.push_back({1, "one more"});
  holds(refusal_of(voxels, structures), "LabelGrid: at most 255 structures fit, got 256");
}

TEST_CASE("lists of structures that mean nothing are refused with the reason") {
  const Voxels8 voxels{0, 1, 2};
  const auto list = [&](const Structure& first, const Structure& second) {
    return refusal_of(voxels, {first, second});
  };
  CHECK(list({1, "a"}, {2, "b"}) == "");
  holds(list({0, "nothing"}, {2, "b"}), "trephine::LabelGrid: label 0 means no structure");
  holds(list({0, "nothing"}, {2, "b"}), "'nothing'");
  holds(list({1, "a"}, {1, "b"}), "each label must be listed once, got 1 for 'a' and 'b'");
  holds(list({1, "a"}, {2, "a"}), "each name must be listed once, got 'a' for labels 1 and 2");
  holds(list({1, ""}, {2, "b"}), "each structure needs a name, got none for label 1");
  for (const std::string bad : {"a\nb", "a\tb", " a", "a "})
    holds(list({1, bad}, {2, "b"}), "a name must be one line without spaces at its ends, got '");
  holds(list({256, "far"}, {2, "b"}), "labels must fit the voxels' type, got 256 for 'far'");
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const float bad : {-0.1F, 1.1F, nan, 255.0F})
    holds(list({1, "a", {0, bad, 0}}, {2, "b"}), "colours must lie in 0 to 1");
  holds(refusal_of(voxels, {{1, "a"}, {2, "b"}, {3, "c"}}),
        "each structure must have a voxel, got none of 'c' (label 3)");
  holds(refusal_of(Voxels8(4), {{3, "c"}}), "none of 'c'");
}

TEST_CASE("voxels of no listed structure are refused, or counted as none") {
  const Voxels8 voxels{0, 1, 7, 7, 9, 2, 0};
  holds(refusal_of(voxels, {{1, "a"}, {2, "b"}, {9, "c"}}),
        "must be listed, or ignored (ignore_unlisted), got label 7 in 2 voxels");
  holds(refusal_of(voxels, {{1, "a"}, {2, "b"}, {7, "c"}}), "label 9 in 1 voxel");
  holds(refusal_of(voxels, {{1, "a"}}), "label 2 in 1 voxel and 2 more");
  const LabelGrid<std::uint8_t> grid(geometry({7, 1, 1}), voxels, {{1, "a"}, {2, "b"}}, {.ignore_unlisted = true});
  CHECK(Voxels8(grid.voxels().begin(), grid.voxels().end()) == Voxels8{0, 1, 0, 0, 0, 2, 0});
  CHECK(grid.voxel_count(7) == 0);
  CHECK(grid.at(2, 0, 0) == 0);
  // A misspelt label is still noticed.
  holds(refusal_of(voxels, {{1, "a"}, {3, "b"}}, {.ignore_unlisted = true}), "none of 'b'");
}

TEST_CASE("geometry out of reason is refused as that of the bone is") {
  const auto make = [](const GridGeometry& g, std::size_t count) {
    return refusal([&] { LabelGrid<std::uint8_t>(g, Voxels8(count), {}); });
  };
  CHECK(make(geometry({2, 2, 2}), 8) == "");
  holds(make(geometry({2, 2, 2}), 7), "trephine::LabelGrid: the buffer must hold 8 voxels, got 7");
  holds(make(geometry({2, 0, 2}), 0), "each size must be >= 1 voxel");
  holds(make(geometry({-2, -2, 2}), 8), "each size must be >= 1 voxel");
  holds(make(geometry({1 << 21, 1, 1}), 8), "at most 2^20");
  holds(make(geometry({1 << 20, 1 << 20, 1 << 20}), 8), "at most 2^31");
  for (const double bad : {0.0, -1e-3, kNan, 1e-12, 0.5, kInf}) {
    GridGeometry g = geometry({2, 2, 2});
    g.spacing.y() = bad;
    holds(make(g, 8), "spacing must be");
  }
  GridGeometry g = geometry({2, 2, 2});
  g.outside = 0;
  CHECK(make(g, 8) == "");
  g.outside = -1000;
  holds(make(g, 8), "outside must be 0 or not given, got -1000");
  g.outside = kNan;
  holds(make(g, 8), "outside must be 0");
  g = geometry({2, 2, 2});
  g.X_WG.linear().setZero();
  holds(make(g, 8), "X_WS must hold a right-handed rotation");
}
