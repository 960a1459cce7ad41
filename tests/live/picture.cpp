// SPDX-License-Identifier: MIT
// The window's pictures, drawn by OpenGL in a virtual screen: against rays cast through the same grid on the processor,
// and while a scripted hand drills.
#include "../examples/devices/kinds.hpp"
#include "pictured_bone.hpp"
#include "support/near.hpp"
#include "window_bench.hpp"

#include <doctest/doctest.h>
#include <support/random.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>
#include <vector>

namespace {

using namespace live_test;
using trephine::test::near;
using trephine::test::Random;

TEST_SUITE("picture") {
  TEST_CASE(
      "pictures: surface and depth are those of rays cast through the grid, on three volumes, before and after "
      "drilling") {
    Random random(11);
    const auto check = [&](drill::Bone made) {
      CAPTURE(made.name);
      CAPTURE(made.grid.spacing().transpose());
      Bench b(std::move(made));
      for (const bool drilled : {false, true}) {
        if (drilled) drill_in(b);
        const drill::Bone& bone = b.bench.bone();
        if (drilled) CHECK(b.bench.view().removed_mm3 > 0.2);
        const drill::PicturedBone reference(bone.grid, bone.isovalue);
        const double voxel = bone.grid.spacing().minCoeff();
        b.bench.zoom(drilled ? 0 : 5);
        b.bench.orbit(random.uniform(-30, 30), random.uniform(-20, 20));
        const std::vector<float> depth = b.depths();
        const Posed X_GW = b.bench.X_WG().inverse(Eigen::Isometry);
        const OrbitCamera& camera = b.bench.camera();
        int bone_pixels = 0, different = 0;
        std::vector<double> apart;
        for (int y = 0; y < 120; ++y)
          for (int x = 0; x < 160; ++x) {
            const ViewRay ray = camera.ray(x + 0.5, y + 0.5, 160, 120);
            const drill::Ray r{(X_GW * ray.origin).cast<float>(), (X_GW.linear() * ray.direction).cast<float>()};
            const auto hit = reference.hit(r, 0.001F, 1.0F, 0.25F);
            const double drawn = static_cast<double>(depth[static_cast<std::size_t>(y * 160 + x)]);
            const bool shown = drawn < 0.9 * ScenePicture::kFar;
            bone_pixels += hit ? 1 : 0;
            different += hit.has_value() != shown ? 1 : 0;
            if (hit && shown)
              apart.push_back(std::abs(static_cast<double>(*hit) * ray.direction.dot(-camera.axes().col(2)) - drawn) /
                              voxel);
          }
        REQUIRE(bone_pixels > 2000);
        std::sort(apart.begin(), apart.end());
        const double p99 = apart[apart.size() * 99 / 100];
        MESSAGE(b.bench.bone().name, drilled ? " drilled" : "", ": ", bone_pixels, " pixels of bone, ", different,
                " differ; depth off by median ", apart[apart.size() / 2], ", p99 ", p99, " voxels");
        CHECK(different <= bone_pixels / 100);
        CHECK(p99 <= 0.25);
      }
    };
    check(ball(Vec3d::Constant(0.4e-3), 8e-3));
    check(ball(Vec3d(0.3e-3, 0.4e-3, 0.6e-3), 8e-3));
    check(tooth());
  }

  TEST_CASE("pictures: drilling changes the picture where it drilled, within two frames, and nowhere else") {
    Bench b(ball(Vec3d::Constant(0.4e-3), 8e-3));
    const std::vector<float> before = b.depths();
    // Touch the bone first, so that the first tick that cuts is seen at once.
    go(b, 3, 0.5);
    REQUIRE(b.bench.view().contact.count > 0);
    b.bench.act(Action::kSpindle);
    const double shallow = b.bench.bone().grid.spacing().minCoeff();
    int frames_late = -1;
    double removed_at = 0;
    for (int frame = 0; frame < 400 && frames_late < 0; ++frame) {
      b.bench.update(0.016, 320, 240);
      // A cut too thin for a pixel's depth to tell is none yet.
      if (b.bench.view().removed_mm3 < 0.2) {
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
        continue;
      }
      removed_at = b.bench.view().removed_mm3;
      for (int late = 1; late <= 2 && frames_late < 0; ++late) {
        const std::vector<float> now = b.depths();
        for (std::size_t i = 0; i < now.size(); ++i)
          if (now[i] - before[i] > 0.1 * static_cast<float>(shallow)) frames_late = late;
        b.bench.update(0.016, 320, 240);
      }
      break;
    }
    MESSAGE("after ", removed_at, " mm3 the picture changed in frame ", frames_late);
    CHECK(frames_late >= 1);
    b.bench.act(Action::kSpindle);
    drill_in(b);
    // What changed lies within the burr's way.
    const std::vector<float> after = b.depths();
    const OrbitCamera& camera = b.bench.camera();
    const Vec3d from = b.spot.p_W, along = b.spot.normal_W;
    const double reach = b.bench.bone().burr.tip_radius + 2.5 * shallow;
    int changed = 0, astray = 0;
    for (int y = 0; y < 120; ++y)
      for (int x = 0; x < 160; ++x) {
        const std::size_t i = static_cast<std::size_t>(y * 160 + x);
        if (std::abs(after[i] - before[i]) < 0.05F * static_cast<float>(shallow)) continue;
        ++changed;
        const ViewRay ray = camera.ray(x + 0.5, y + 0.5, 160, 120);
        const double t = static_cast<double>(before[i]) / ray.direction.dot(-camera.axes().col(2));
        const Vec3d p = ray.origin + t * ray.direction;
        if ((p - from).cross(along).norm() > reach) ++astray;
      }
    MESSAGE(changed, " pixels changed, ", astray, " of them astray");
    CHECK(changed > 40);
    CHECK(astray == 0);
  }

  TEST_CASE("keys: each does what the help says") {
    Bench b(ball(Vec3d::Constant(0.4e-3), 8e-3));
    Workbench& w = b.bench;
    const auto settings = [&] { return w.session().options().drill; };
    for (const Key& k : kKeys) {
      CAPTURE(k.name);
      switch (k.action) {
        case Action::kNone:
          FAIL("a key without an action");
          break;
        case Action::kHelp:
          w.act(k.action);
          CHECK(w.help());
          w.act(k.action);
          CHECK(!w.help());
          break;
        case Action::kSpindle:
          w.act(k.action);
          b.run(0.1);
          CHECK(w.view().spindle_on);
          w.act(k.action);
          b.run(0.1);
          CHECK(!w.view().spindle_on);
          break;
        case Action::kRenderer:
          for (const Renderer next : {Renderer::kLine, Renderer::kSurface, Renderer::kCoupled}) {
            w.act(k.action);
            const auto ticks = w.view().tick;
            b.run(0.3);
            CHECK(settings().renderer == next);
            CHECK(w.view().tick > ticks);
          }
          break;
        case Action::kLaw:
          for (const bool on : {true, false}) {
            w.act(k.action);
            b.run(0.1);
            CHECK(settings().mills_by_law() == on);
          }
          break;
        case Action::kLargerBurr:
        case Action::kSmallerBurr: {
          if (k.action == Action::kSmallerBurr) w.act(Action::kLargerBurr);
          const double radius = settings().burr.tip_radius;
          w.act(k.action);
          b.run(0.1);
          CHECK((settings().burr.tip_radius > radius) == (k.action == Action::kLargerBurr));
          CHECK(settings().burr.tip_radius != radius);
          break;
        }
        case Action::kUndo:
        case Action::kRestore: {
          w.act(Action::kHome);
          b.run(0.4);
          const std::vector<float> before = b.depths();
          drill_in(b);
          const std::vector<float> drilled = b.depths();
          CHECK(drilled != before);
          w.act(k.action);
          b.run(0.4);
          CHECK(b.depths() == before);
          break;
        }
        case Action::kClip: {
          const std::vector<float> before = b.depths();
          w.act(k.action);
          CHECK(w.clipped());
          const std::vector<float> open = b.depths();
          CHECK(open != before);
          w.act(k.action);
          CHECK(!w.clipped());
          CHECK(b.depths() == before);
          break;
        }
        case Action::kProtection: {
          // Without structures there is nothing to protect.
          const Protection before = w.protection();
          w.act(k.action);
          CHECK(w.protection() == before);
          CHECK(w.structures() == nullptr);
          break;
        }
        case Action::kMarks:
          w.act(Action::kHome);
          b.run(0.4);
          go(b, 3, 0.2);
          CHECK(!w.scene_view().sprites.empty());
          CHECK(!w.scene_view().triangles.empty());
          w.act(k.action);
          CHECK(w.scene_view().sprites.empty());
          CHECK(w.scene_view().triangles.empty());
          w.act(k.action);
          break;
        case Action::kPanels:
          w.act(k.action);
          CHECK(!w.panels());
          w.act(k.action);
          CHECK(w.panels());
          break;
        case Action::kPlace: {
          const auto p = w.bone_under(150, 130);
          REQUIRE(p.has_value());
          w.mouse_at(150, 130);
          w.act(k.action);
          CHECK((w.hand().pose().translation() - *p).norm() < 4 * settings().burr.tip_radius);
          break;
        }
        case Action::kHome: {
          w.act(k.action);
          const Vec3d home = w.hand().pose().translation(), eye = w.camera().eye_W();
          w.orbit(30, 20);
          w.push_drill(-5e-3);
          w.act(k.action);
          CHECK((w.hand().pose().translation() - home).norm() < 1e-9);
          CHECK((w.camera().eye_W() - eye).norm() < 1e-9);
          break;
        }
        case Action::kShot:
          w.act(k.action);
          CHECK(w.take_shot());
          CHECK(!w.take_shot());
          break;
        case Action::kCloser:
        case Action::kFarther: {
          const double distance = w.camera().distance;
          w.act(k.action);
          CHECK((w.camera().distance < distance) == (k.action == Action::kCloser));
          break;
        }
        case Action::kQuit:
          CHECK(!w.quit());
          w.act(k.action);
          CHECK(w.quit());
          break;
      }
    }
  }

  TEST_CASE("a still scene is drawn in full and then left alone; any motion draws it anew") {
    Bench b(tooth());
    bool drew = true;
    int frames = 0;
    for (; frames < 200 && drew; ++frames) {
      b.bench.update(0.016, 320, 240);
      drew = b.bench.draw();
    }
    CHECK(!drew);
    CHECK(b.bench.still());
    CHECK(b.bench.picture().width() == 320);
    b.bench.orbit(10, 0);
    CHECK(b.bench.draw());
    CHECK(!b.bench.still());
  }

  TEST_CASE("a device drills in the window as the mouse's arm does, whichever its axes") {
    for (const devices::Kind& kind : devices::kinds()) {
      if (!kind.simulated || !kind.look().usable) continue;
      CAPTURE(kind.name);
      drill::Bone bone = ball(Vec3d::Constant(0.4e-3), 8e-3);
      const drill::Spot spot = drill::find_spot(bone);
      LiveOptions options;
      options.device = kind.name;
      Window window(320, 240, true, true);
      Workbench bench({std::move(bone), spot}, options);
      for (int i = 0; i < 400 && bench.view().removed_mm3 < 0.2; ++i) {
        bench.update(0.016, 320, 240);
        Posed X = bench.view().probe;
        X.translation() -= 4e-3 * spot.normal_W;
        bench.session().wish({X, true});
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
      }
      MESSAGE(bench.session().report());
      CHECK(!bench.session().failed());
      CHECK(bench.view().spindle_on);
      CHECK(bench.view().removed_mm3 >= 0.2);
    }
  }

  TEST_CASE("the window takes any size and survives being minimised") {
    Window window(320, 240, true, true);
    drill::Bone bone = ball(Vec3d::Constant(0.5e-3), 6e-3);
    const drill::Spot spot = drill::find_spot(bone);
    Workbench bench({std::move(bone), spot}, LiveOptions{});
    {
      Screen screen(window, bench, true);
      screen.frame(0.016, 0);
      for (const auto& [w, h] :
           {std::pair{16, 16}, std::pair{333, 77}, std::pair{640, 480}, std::pair{0, 0}, std::pair{320, 240}}) {
        bench.update(0.016, std::max(w, 16), std::max(h, 16));
        if (w > 0) {
          (void)bench.draw();
          bench.draw_full();
          CHECK(bench.picture().width() == w);
        }
      }
      const auto rgb = screen.shot(1);
      CHECK(rgb.size() == 3U * static_cast<unsigned>(screen.width()) * static_cast<unsigned>(screen.height()));
      CHECK(*std::max_element(rgb.begin(), rgb.end()) > 150);
    }
    CHECK(window.gl_errors() == "");
  }

  TEST_CASE("the instruments follow the scale of the monitor, there and back") {
    Window window(640, 480, true, true);
    drill::Bone bone = ball(Vec3d::Constant(0.5e-3), 6e-3);
    const drill::Spot spot = drill::find_spot(bone);
    Workbench bench({std::move(bone), spot}, LiveOptions{});
    {
      Screen screen(window, bench, true);
      // Columns from the first that the panel changes to the window's right side.
      const auto panel_width = [&](float scale) {
        screen.set_content_scale(scale);
        (void)screen.shot(1);  // panels take their sizes from the last frame
        const auto with = screen.shot(1);
        bench.act(Action::kPanels);
        const auto without = screen.shot(1);
        bench.act(Action::kPanels);
        const auto columns = static_cast<std::size_t>(screen.width());
        for (std::size_t x = 0; x < columns; ++x)
          for (std::size_t y = 12; y < 40; ++y)
            if (with[3 * (y * columns + x)] != without[3 * (y * columns + x)]) return static_cast<double>(columns - x);
        return 0.0;
      };
      const double usual = panel_width(1), doubled = panel_width(2), again = panel_width(1);
      CHECK(usual > 100);
      CHECK(doubled / usual == near(2, 0.05));
      CHECK(again == usual);
    }
    CHECK(window.gl_errors() == "");
  }
}

}  // namespace
