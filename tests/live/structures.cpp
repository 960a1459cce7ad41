// SPDX-License-Identifier: MIT
// Structures in the window: how they are guarded, what the burr takes of them, and how pictures show them.
#include "held_drill.hpp"
#include "left_structures.hpp"
#include "support/near.hpp"
#include "window_bench.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/structure/labelled_field.hpp>
#include <trephine/tool/named_tools.hpp>

#include <doctest/doctest.h>
#include <support/malloc_hook.hpp>
#include <support/random.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

using trephine::test::near;

namespace {

using namespace live_test;
using trephine::LabelGrid;

/// A nerve: a tube through the ball of bone, across the drill's way.
struct Tube {
  static constexpr double kDepth = 2.5e-3;   // of its axis below the spot [m]
  static constexpr double kRadius = 1.0e-3;  // [m]
  static constexpr double kHalf = 3.5e-3;    // of its length, within the ball [m]
  Vec3d middle_W, along_W;

  explicit Tube(const drill::Spot& spot, double depth = kDepth)
      : middle_W(spot.p_W - depth * spot.normal_W), along_W(spot.normal_W.unitOrthogonal()) {}
  /// Distance from its surface, beside its ends.
  [[nodiscard]] double distance(const Vec3d& p_W) const { return (p_W - middle_W).cross(along_W).norm() - kRadius; }
  [[nodiscard]] bool ends_near(const Vec3d& p_W, double reach) const {
    return std::abs((p_W - middle_W).dot(along_W)) > kHalf - reach;
  }
};

constexpr std::array<std::uint8_t, 3> kYellow{255, 204, 51};

/// Labels of the tube in voxels of 0.2 mm, askew to everything.
std::shared_ptr<const GuardedBone> guarded_tube(const drill::Bone& bone, const drill::Spot& spot, double depth) {
  constexpr int kSide = 72;
  constexpr double kSpacing = 0.2e-3;
  const Tube tube(spot, depth);
  const trephine::Mat3d R = trephine::rotation_from_vector<double>(Vec3d(0.4, 0.1, -0.7));
  const Posed X_WS =
      trephine::make_pose<double>(R, Vec3d(tube.middle_W - R * Vec3d::Constant(0.5 * kSpacing * (kSide - 1))));
  std::vector<std::uint8_t> voxels;
  for (int k = 0; k < kSide; ++k)
    for (int j = 0; j < kSide; ++j)
      for (int i = 0; i < kSide; ++i) {
        const Vec3d p = X_WS * Vec3d(kSpacing * Vec3d(i, j, k));
        voxels.push_back(tube.distance(p) < 0 && !tube.ends_near(p, 0) ? 7 : 0);
      }
  const LabelGrid<std::uint8_t> labels(
      {.size = {kSide, kSide, kSide}, .spacing = Vec3d::Constant(kSpacing), .X_WG = X_WS}, voxels,
      {{.label = 7, .name = "nerve", .colour = {1, 0.8F, 0.2F}}});
  return guard_bone(bone, labels, 0.8e-3);
}
std::shared_ptr<const GuardedBone> nerve(const drill::Bone& bone, const drill::Spot& spot) {
  return guarded_tube(bone, spot, Tube::kDepth);
}

/// Voxels of bone in the tube.
std::vector<std::array<int, 3>> bone_in_tube(const Bench& b) {
  std::vector<std::array<int, 3>> found;
  const drill::Bone& bone = b.bench.bone();
  const Tube tube(b.spot);
  const Reader reader(bone.grid, false);
  for (int k = 0; k < reader.size()[2]; ++k)
    for (int j = 0; j < reader.size()[1]; ++j)
      for (int i = 0; i < reader.size()[0]; ++i) {
        const Vec3d p = b.bench.X_WG() * Vec3d(reader.spacing().cwiseProduct(Vec3d(i, j, k)));
        if (reader.voxel(i, j, k) >= bone.isovalue && tube.distance(p) < 0 && !tube.ends_near(p, 0))
          found.push_back({i, j, k});
      }
  return found;
}
std::ptrdiff_t gone(const Bench& b, const std::vector<std::array<int, 3>>& voxels) {
  const Reader reader(b.bench.bone().grid, false);
  return std::count_if(voxels.begin(), voxels.end(),
                       [&](const auto& v) { return reader.voxel(v[0], v[1], v[2]) < b.bench.bone().isovalue; });
}

/// Pixels of the flat picture, 160 x 120, that have the nerve's colour.
std::vector<bool> yellow(Bench& b) {
  b.draw_bone();
  const auto rgb = gl::read_pixels<std::uint8_t>(160, 120, 3, GL_RGB, GL_UNSIGNED_BYTE);
  std::vector<bool> out;
  for (std::size_t i = 0; i < rgb.size(); i += 3) {
    bool same = true;
    for (std::size_t c = 0; c < 3; ++c) same = same && std::abs(rgb[i + c] - kYellow[c]) <= 2;
    out.push_back(same);
  }
  return out;
}
std::ptrdiff_t count(const std::vector<bool>& pixels) { return std::count(pixels.begin(), pixels.end(), true); }

struct Samples {
  int rays;
  double mean;
  int most;
};
/// How many samples of structures the shader's march takes in the last picture, counted by the same march here.
Samples samples_of(Bench& b) {
  const std::vector<float> depth = b.depths();
  const SceneView v = b.bench.scene_view();
  const GuardedBone& guarded = *b.bench.guarded();
  const LeftStructures& left = b.bench.structures()->left();
  const Posed X_SW = (b.bench.X_WG() * guarded.X_GS).inverse();
  const double h = left.spacing().minCoeff();
  const Vec3d lo = left.first_S();
  const Vec3d hi = lo + left.spacing().cwiseProduct(Vec3d(left.size()[0] - 1, left.size()[1] - 1, left.size()[2] - 1));
  Samples out{0, 0, 0};
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x) {
      const ViewRay ray = v.camera.ray(x + 0.5, y + 0.5, 160, 120);
      const Vec3d o = X_SW * ray.origin, d = X_SW.linear() * ray.direction;
      const Vec3d p = (lo - o).cwiseQuotient(d), q = (hi - o).cwiseQuotient(d);
      double t = std::max(p.cwiseMin(q).maxCoeff(), ScenePicture::kNear);
      if (v.clip) {
        const double rate = v.clip->normal_W.dot(ray.direction);
        const double at = (v.clip->offset - v.clip->normal_W.dot(ray.origin)) / rate;
        if (rate < 0) t = std::max(t, at);
      }
      const double along = ray.direction.dot(-v.camera.axes().col(2));
      const double seen = static_cast<double>(depth[static_cast<std::size_t>(160 * y + x)]) / along;
      const double end = std::min(p.cwiseMax(q).minCoeff(), seen + 1e-6);
      int taken = 0;
      while (t <= end) {
        ++taken;
        const double s = guarded.field->nearest(o + t * d).distance;
        if (s < 0.02 * h) break;
        t += std::max(0.95 * s, 0.08 * h);
      }
      if (taken == 0) continue;
      ++out.rays;
      out.mean += taken;
      out.most = std::max(out.most, taken);
    }
  out.mean /= std::max(out.rays, 1);
  return out;
}

/// Looks down the hole.
void look_in(Bench& b) {
  Event e;
  e.kind = Event::Kind::kView;
  e.camera = b.bench.camera();
  e.camera.focus_W = b.spot.p_W - Tube::kDepth * b.spot.normal_W;
  e.camera.look_from(b.spot.normal_W);
  e.camera.distance = 0.03;
  b.bench.apply(e);
}

/// Drills far into the tube with a protection, and withdraws.
void drill_at_tube(Bench& b, Protection protection) {
  b.bench.protect(protection);
  go(b, 3, 1.2);
  b.bench.act(Action::kSpindle);
  go(b, 1.2, -1);
  go(b, -1, -3.2);
  b.run(0.5);
  b.bench.act(Action::kSpindle);
  go(b, -3.2, 4);
  b.run(0.3);
}

TEST_CASE("burr path: pieces join up, and a reader that falls behind gets longer ones") {
  BurrPath path;
  const auto at = [](int i) { return Vec3d(1e-4 * i, 0, 0); };
  for (int i = 0; i < 10; ++i) path.follow(false, at(i), 1e-3);
  int pieces = 0;
  path.take([&](const BurrPiece&) { ++pieces; });
  CHECK(pieces == 0);
  const int ticks = 2 * static_cast<int>(BurrPath::kSize);
  for (int i = 0; i < ticks; ++i) path.follow(true, at(i), 1e-3);
  Vec3d end = at(0);
  path.take([&](const BurrPiece& p) {
    CHECK(p.from == end);
    end = p.to;
    ++pieces;
  });
  CHECK(pieces == static_cast<int>(BurrPath::kSize));
  path.follow(true, at(ticks), 1e-3);
  path.take([&](const BurrPiece& p) {
    CHECK(p.from == end);
    CHECK(p.to == at(ticks));
  });
  // A still burr writes nothing, and a larger one starts anew.
  pieces = 0;
  path.follow(true, at(ticks), 1e-3);
  path.follow(true, at(ticks), 2e-3);
  path.take([&](const BurrPiece& p) {
    CHECK(p.radius == 2e-3);
    ++pieces;
  });
  CHECK(pieces == 1);
}

TEST_CASE("left structures: the burr's way is taken out as brute force finds it, and undo brings back every sample") {
  trephine::test::Random random(5);
  const double h = 0.3e-3;
  std::vector<std::uint8_t> voxels;
  for (int k = 0; k < 30; ++k)
    for (int j = 0; j < 30; ++j)
      for (int i = 0; i < 30; ++i) voxels.push_back(h * (Vec3d(i, j, k) - Vec3d(15, 14, 16)).norm() < 2e-3 ? 1 : 0);
  const LabelGrid<std::uint8_t> labels({.size = {30, 30, 30}, .spacing = Vec3d::Constant(h)}, voxels,
                                       {{.label = 1, .name = "ball"}});
  const auto field = trephine::build_structure_field(labels, {.reach = 1e-3});
  LeftStructures left(*field, labels.box_of(1), 1e-3);
  const auto same = [](const LeftStructures::Sample& s) { return s.left == s.whole; };
  REQUIRE(std::all_of(left.samples().begin(), left.samples().end(), same));
  std::vector<std::vector<LeftStructures::Sample>> before;
  const auto now = [&] { return left.samples(); };
  std::vector<double> cleared(left.samples().size(), -1);
  for (int stroke = 0; stroke < 3; ++stroke) {
    left.begin_stroke();
    before.push_back(now());
    for (int piece = 0; piece < 8; ++piece) {
      const auto point = [&] {
        return Vec3d(h * Vec3d(random.uniform(5, 25), random.uniform(5, 25), random.uniform(5, 25)));
      };
      const BurrPiece p{point(), point(), random.uniform(0.4e-3, 1.2e-3)};
      left.take(p);
      std::size_t v = 0;
      for (int k = 0; k < left.size()[2]; ++k)
        for (int j = 0; j < left.size()[1]; ++j)
          for (int i = 0; i < left.size()[0]; ++i, ++v) {
            const Vec3d q = left.first_S() + left.spacing().cwiseProduct(Vec3d(i, j, k));
            const Vec3d way = p.to - p.from;
            double least = 1;  // of many points on the way
            for (int n = 0; n <= 200; ++n) least = std::min(least, (q - p.from - n / 200.0 * way).norm());
            cleared[v] = std::max(cleared[v], p.radius - least);
          }
    }
    constexpr double kSampled = 0.02e-3;  // half the distance of two of the points on a way, and quanta
    std::size_t wrong = 0;
    for (std::size_t v = 0; v < cleared.size(); ++v) {
      const double whole = left.quantum() * left.samples()[v].whole, got = left.quantum() * left.samples()[v].left;
      // Deep in what is left, distances to the way do not matter.
      const double expected = std::max(whole, cleared[v]);
      if (std::abs(std::max(got, -h) - std::max(expected, -h)) > kSampled) ++wrong;
    }
    CHECK(wrong == 0);
  }
  const auto equal = [](const auto& a, const auto& b) {
    return std::equal(a.begin(), a.end(), b.begin(),
                      [](const auto& x, const auto& y) { return x.left == y.left && x.whole == y.whole; });
  };
  for (; !before.empty(); before.pop_back()) {
    left.undo();
    CHECK(equal(now(), before.back()));
  }
  CHECK(left.undo().hi[0] < 0);
  CHECK(left.take({Vec3d::Constant(1), Vec3d::Constant(1.1), 1e-3}).hi[0] < 0);
  left.take({Vec3d::Constant(15 * h), Vec3d::Constant(15 * h), 1e-3});
  left.restore();
  CHECK(std::all_of(left.samples().begin(), left.samples().end(), same));
}

TEST_CASE("held drills: switching protection takes no memory in a tick, with every renderer") {
  drill::Bone bone = ball(Vec3d::Constant(0.4e-3), 8e-3);
  const drill::Spot spot = drill::find_spot(bone);
  DrillSettings settings{.burr = bone.burr, .guarded = nerve(bone, spot)};
  settings.potential = potential_for(*settings.guarded, settings.burr);
  for (const bool law : {false, true})
    for (const Renderer r : {Renderer::kCoupled, Renderer::kLine, Renderer::kSurface}) {
      CAPTURE(to_string(r));
      CAPTURE(law);
      settings.renderer = r;
      settings.law = law;
      settings.strength = {.soft = 0, .cortical = 2400};
      Inboxes inboxes;
      double thrust = 0, removed = 0;
      const auto drill = make_drill(bone.grid, bone.isovalue, settings, inboxes);
      Posed X = Posed::Identity();
      X.linear() = trephine::rotation_between<double>(Vec3d::UnitZ(), spot.normal_W);
      std::int64_t heap = 0;
      for (int tick = 0; tick < 400; ++tick) {
        X.translation() = spot.p_W + (1e-3 - 1e-5 * tick) * spot.normal_W;
        const Protection p = kProtections[static_cast<std::size_t>(tick / 50 % 4)];
        inboxes.guard.post(guard_options(p));
        inboxes.refuses.post(p == Protection::kVeto);
        inboxes.law.post(settings.cutting());
        trephine::TickResult result;
        heap += trephine::test::heap_calls([&] { result = drill->tick({.X_WT = X, .spindle_on = true}, 1e-3); });
        thrust = std::max(thrust, result.cutting.thrust);
        removed += result.removed_mm3;
      }
      CHECK(heap == 0);
      CHECK(drill->structures().nearest == 0);
      CHECK(removed > 0.1);
      // The law is the coupled tool's.
      CHECK((thrust > 0.3) == settings.mills_by_law());
      bone.grid.restore();
    }
}

TEST_CASE("teeth: a drill by the law vibrates as they pass, and the slider takes all of it") {
  drill::Bone bone = ball(Vec3d::Constant(0.4e-3), 8e-3);
  const drill::Spot spot = drill::find_spot(bone);
  const trephine::NamedTool twist = trephine::tool_by_name("twist-3.2");
  DrillSettings settings{.burr = bone.burr, .tool_name = "twist-3.2", .tool = twist.tool, .law = true};
  settings.strength = {.soft = 0, .cortical = 2400};
  // Torque about the axis swings by more than the law's own noise; pushes and cuts are the same.
  const auto drilled = [&](double teeth, double later) {
    settings.tuning.teeth = teeth;
    Inboxes inboxes;
    const auto drill = make_drill(bone.grid, bone.isovalue, settings, inboxes);
    Posed X = Posed::Identity();
    X.linear() = trephine::rotation_between<double>(Vec3d::UnitZ(), spot.normal_W);
    double last = 0, swing = 0, removed = 0;
    for (int tick = 0; tick < 1500; ++tick) {
      X.translation() = spot.p_W + (bone.burr.tip_radius + 0.2e-3 - 2e-6 * tick) * spot.normal_W;
      if (tick == 1000) {
        settings.tuning.teeth = later;
        inboxes.teeth.post(settings.tuning.teeth_passing());
      }
      const trephine::TickResult result = drill->tick({.X_WT = X, .spindle_on = true}, 1e-3);
      const double torque = spot.normal_W.dot(result.wrench.torque);
      if (tick > 1100) swing += std::abs(torque - last);
      last = torque;
      removed += result.removed_mm3;
    }
    bone.grid.restore();
    CHECK(removed > 1);
    return std::pair(swing, removed);
  };
  const auto [still, removed] = drilled(0, 0);
  const auto [shaken, as_much] = drilled(0, 1);
  CHECK(shaken > 3 * still);
  CHECK(as_much == removed);
  CHECK(drilled(1, 0).first == still);
}

TEST_CASE("guarded bone: labels that lie beside the bone are refused") {
  const drill::Bone bone = ball(Vec3d::Constant(0.4e-3), 8e-3);
  const LabelGrid<std::uint8_t> labels(
      {.size = {2, 2, 2},
       .spacing = Vec3d::Constant(1e-3),
       .X_WG = trephine::make_pose<double>(trephine::Mat3d::Identity(), Vec3d(1, 0, 0))},
      std::vector<std::uint8_t>(8, 1), {{.label = 1, .name = "far"}});
  CHECK_THROWS_WITH_AS((void)guard_bone(bone, labels, 1e-3), doctest::Contains("another scan"), std::runtime_error);
}

TEST_CASE("guarded bone: structures farther from the bone than any guard reaches are told") {
  const drill::Bone bone = ball(Vec3d::Constant(0.4e-3), 8e-3);
  std::vector<std::uint8_t> voxels(100 * 4 * 4, 0);
  voxels[(2 * 4 + 2) * 100 + 4] = 1;
  voxels[(2 * 4 + 2) * 100 + 98] = 2;  // 98 mm along x, in a volume of 21 mm
  const LabelGrid<std::uint8_t> labels(
      {.size = {100, 4, 4}, .spacing = Vec3d::Constant(1e-3), .X_WG = bone.grid.X_WG()}, voxels,
      {{.label = 1, .name = "nerve"}, {.label = 2, .name = "other patient's"}});
  const auto guarded = guard_bone(bone, labels, 1e-3);
  REQUIRE(guarded->notes.size() == 1);
  CHECK(guarded->notes[0].starts_with("structure 'other patient's' lies "));
  CHECK(guarded->notes[0].find("farther than any guard reaches") != std::string::npos);
}

#ifdef TREPHINE_EXAMPLE_HAS_ITK
TEST_CASE("labels: a segmentation's file is read, and segments without a voxel are named") {
  const std::string path = "labels.seg.nrrd";
  std::ofstream(path) << "NRRD0004\ntype: unsigned char\ndimension: 3\nspace: left-posterior-superior\nsizes: 2 2 2\n"
                         "space directions: (1,0,0) (0,1,0) (0,0,1)\nkinds: domain domain domain\nencoding: ascii\n"
                         "space origin: (0,0,0)\nSegment0_ID:=a\nSegment0_Name:=nerve\nSegment0_LabelValue:=1\n"
                         "Segment0_Layer:=0\nSegment0_Color:=1 0.8 0.2\nSegment1_ID:=b\nSegment1_Name:=vein\n"
                         "Segment1_LabelValue:=2\nSegment1_Layer:=0\nSegment1_Color:=0 0 1\n\n0 1 1 0 0 0 0 1\n";
  std::vector<std::string> notes;
  const drill::AnyLabels labels = drill::load_labels(path, notes);
  std::remove(path.c_str());
  const auto* const bytes = std::get_if<LabelGrid<std::uint8_t>>(&labels);
  REQUIRE(bytes != nullptr);
  REQUIRE(bytes->structures().size() == 1);
  CHECK(bytes->structures()[0].name == "nerve");
  REQUIRE(notes.size() == 1);
  CHECK(notes[0].find("vein") != std::string::npos);
}
#endif

TEST_SUITE("picture") {
  TEST_CASE("structures: without any there is no texture, and none in the shader") {
    const auto uniform = [](Bench& b) {
      b.draw_bone();
      GLint program = 0;
      glGetIntegerv(GL_CURRENT_PROGRAM, &program);
      CHECK(glGetUniformLocation(static_cast<GLuint>(program), "densities") >= 0);
      return glGetUniformLocation(static_cast<GLuint>(program), "structure_distances");
    };
    Bench plain(ball(Vec3d::Constant(0.4e-3), 8e-3));
    CHECK(plain.bench.structures() == nullptr);
    CHECK(uniform(plain) == -1);
    CHECK(plain.bench.view().structures.nearest == -1);
  }

  TEST_CASE("structures: a clip plane shows their section where it is") {
    Bench b(ball(Vec3d::Constant(0.4e-3), 8e-3), nerve);
    REQUIRE(b.bench.structures() != nullptr);
    b.run(0.1);
    CHECK(count(yellow(b)) == 0);
    b.bench.zoom(5);
    b.bench.act(Action::kClip);
    const std::vector<bool> drawn = yellow(b);
    const SceneView v = b.bench.scene_view();
    REQUIRE(v.clip.has_value());
    const Tube tube(b.spot);
    int expected = 0, wrong = 0;
    for (int y = 0; y < 120; ++y)
      for (int x = 0; x < 160; ++x) {
        const ViewRay ray = v.camera.ray(x + 0.5, y + 0.5, 160, 120);
        const double t = (v.clip->offset - v.clip->normal_W.dot(ray.origin)) / v.clip->normal_W.dot(ray.direction);
        const Vec3d p = ray.origin + t * ray.direction;
        const bool inside = tube.distance(p) < 0 && !tube.ends_near(p, 0);
        expected += inside ? 1 : 0;
        // Half a label voxel is what labels tell of a surface.
        const bool sure =
            std::abs(tube.distance(p)) > 0.1e-3 && tube.ends_near(p, 0.2e-3) == tube.ends_near(p, -0.2e-3);
        if (sure && inside != drawn[static_cast<std::size_t>(160 * y + x)]) ++wrong;
      }
    MESSAGE(expected, " pixels of section, ", wrong, " wrong");
    CHECK(expected > 100);
    CHECK(wrong == 0);
    // The same view with and without structures, by turns, in the time of all processors that draw.
    ScenePicture plain;
    std::array<std::clock_t, 2> took{};
    for (int i = 0; i < 40; ++i)
      for (const bool with : {false, true}) {
        const std::clock_t start = std::clock();
        (with ? b.bench.picture() : plain).draw_moving(v, b.bench.texture(), b.bench.X_WG(), 160, 120);
        glFinish();
        took[with ? 1 : 0] += std::clock() - start;
      }
    const double ratio = static_cast<double>(took[1]) / static_cast<double>(took[0]);
    MESSAGE("a picture with structures takes ", ratio, " of the time of one without; ",
            b.bench.structures()->bytes() >> 10, " kB on the card");
    CHECK(ratio < 2);
  }

  TEST_CASE("structures: a hole shows them, what the burr takes is gone, and undo brings it back") {
    Bench b(ball(Vec3d::Constant(0.4e-3), 8e-3), nerve);
    look_in(b);
    b.run(0.1);
    const std::vector<float> whole = b.depths();
    CHECK(count(yellow(b)) == 0);
    const auto bone = bone_in_tube(b);
    REQUIRE(bone.size() > 100);
    drill_at_tube(b, Protection::kWarn);
    const TickView& view = b.bench.view();
    MESSAGE("taken ", view.structures.taken_mm3, " mm3, nearest ", 1e3 * view.closest.distance, " mm, ",
            count(yellow(b)), " pixels of it in the hole");
    // A straight hole shows little of its wall from above.
    CHECK(count(yellow(b)) > 20);
    const auto [rays, mean, most] = samples_of(b);
    MESSAGE(rays, " rays of ", 160 * 120, " meet the labels' box; ", mean, " samples each on the mean, ", most,
            " at most");
    CHECK(rays > 1000);
    CHECK(most < 128);
    CHECK(view.structures.refused_mm3 == 0);
    CHECK(view.structures.taken_mm3 == near(static_cast<double>(gone(b, bone)) * 0.4 * 0.4 * 0.4, 0.1));
    CHECK(view.closest.distance < 0);
    // Its middle is gone: there the picture shows the hole's ground below it.
    const Tube tube(b.spot);
    CHECK(view.structures.taken_mm3 > 3);
    b.bench.act(Action::kUndo);
    b.run(0.4);
    CHECK(count(yellow(b)) == 0);
    CHECK(b.depths() == whole);
    CHECK(view.structures.taken_mm3 == 0);
    CHECK(view.removed_mm3 == 0);
    b.bench.act(Action::kRestore);
    b.run(0.3);
    CHECK(view.structures.taken_mm3 == 0);
    CHECK(b.depths() == whole);
  }

  TEST_CASE("structures: with the veto nothing of them is taken, by every renderer") {
    Bench b(ball(Vec3d::Constant(0.4e-3), 8e-3), nerve);
    const auto bone = bone_in_tube(b);
    for (int renderer = 0; renderer < 3; ++renderer) {
      CAPTURE(renderer);
      drill_at_tube(b, Protection::kVeto);
      const TickView& view = b.bench.view();
      MESSAGE(view.removed_mm3, " mm3 removed, refused ", view.structures.refused_mm3, " mm3, nearest ",
              1e3 * view.closest.distance, " mm");
      CHECK(view.removed_mm3 > 1);
      CHECK(view.structures.refused_mm3 > 0);
      CHECK(view.structures.taken_mm3 == 0);
      CHECK(gone(b, bone) == 0);
      if (renderer == 0) CHECK(view.closest.distance > 0.2e-3);  // the coupled tool rests on what is left
      b.bench.act(Action::kRestore);
      b.bench.act(Action::kRenderer);
      b.run(0.5);
    }
  }

  TEST_CASE("structures: the guard fades in and out when it is switched where the drill is in a margin") {
    // A tube in the air above the bone, so that nothing else touches the drill.
    Bench b(ball(Vec3d::Constant(0.4e-3), 8e-3),
            [](const drill::Bone& bone, const drill::Spot& spot) { return guarded_tube(bone, spot, -2.2e-3); });
    const double radius = b.bench.session().options().drill.burr.tip_radius;
    const double height = (2.2e-3 + Tube::kRadius + radius + 0.2e-3) / radius;
    go(b, height + 2, height);
    b.run(0.3);
    CHECK(b.bench.view().structures.in_margin);
    CHECK(b.bench.view().wrench.force.norm() < 0.02);
    const auto switched = [&](Protection p) {
      const std::uint64_t from = b.bench.session().history().count();
      b.bench.act(Action::kProtection);
      REQUIRE(b.bench.protection() == p);
      b.run(0.6);
      const auto samples = b.bench.session().history().last(b.bench.session().history().count() - from);
      float step = 0;
      for (std::size_t i = 1; i < samples.size(); ++i)
        step = std::max(step, std::abs(samples[i].force - samples[i - 1].force));
      MESSAGE(std::string(to_string(p)), ": ", b.bench.view().wrench.force.norm(), " N, greatest step ", step, " N");
      return step;
    };
    REQUIRE(b.bench.protection() == Protection::kWarn);
    // The device tells places in steps of 0.03 mm, at the guard's 1000 N/m. A ramp of 0.25 s adds 2 mN a tick, and as
    // much again for each millisecond that a busy machine is late. A step of the guard's own would come at every
    // switch.
    constexpr float kStep = 0.04F;
    constexpr std::array kOrder{Protection::kPush, Protection::kVeto, Protection::kOff, Protection::kWarn};
    std::array<float, kOrder.size()> step{};
    step.fill(std::numeric_limits<float>::max());
    for (int round = 0; round < 3; ++round)
      for (std::size_t i = 0; i < kOrder.size(); ++i) {
        step[i] = std::min(step[i], switched(kOrder[i]));
        const bool pushes = kOrder[i] == Protection::kPush || kOrder[i] == Protection::kVeto;
        if (pushes) CHECK(b.bench.view().structures.push_N > 0.1);
        if (!pushes) CHECK(b.bench.view().wrench.force.norm() < 0.02);
      }
    for (const float s : step) CHECK(s < kStep);
  }
}

}  // namespace
