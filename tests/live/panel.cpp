// SPDX-License-Identifier: MIT
// The instruments and the help fit into windows of any usual size, and Escape closes what is open.
#include "window_bench.hpp"

#include <doctest/doctest.h>
#include <imgui.h>
#include <imgui_internal.h>

#include <cstdlib>
#include <utility>
#include <vector>

namespace {

using namespace live_test;

/// A workbench and its screen, some frames old.
struct Drawn {
  Drawn(int width, int height, bool structures)
      : window(width, height, true, true), bench(made(structures), LiveOptions{}), screen(window, bench, true) {
    frames();
  }
  static Loaded made(bool structures) {
    drill::Bone bone = structures ? tooth() : ball(Vec3d::Constant(0.4e-3), 8e-3);
    const drill::Spot spot = drill::find_spot(bone);
    std::shared_ptr<const GuardedBone> guarded;
    if (structures) guarded = guard_made_structures(bone, spot, 1e-3);
    return {std::move(bone), spot, std::move(guarded)};
  }
  void frames() {
    for (int i = 0; i < 6; ++i) screen.frame(0.016, 1);
  }

  Window window;
  Workbench bench;
  Screen screen;
};

/// A window of Dear ImGui that shows all of itself.
void check_fits(const char* name, int width, int height) {
  CAPTURE(name);
  CAPTURE(width);
  const ImGuiWindow* const w = ImGui::FindWindowByName(name);
  REQUIRE(w != nullptr);
  CHECK(w->Active);
  CHECK(w->Pos.x >= 0);
  CHECK(w->Pos.y >= 0);
  CHECK(w->Pos.x + w->Size.x <= static_cast<float>(width));
  CHECK(w->Pos.y + w->Size.y <= static_cast<float>(height));
  CHECK(w->ContentSize.x <= w->WorkRect.GetWidth() + 1);
}

TEST_SUITE("picture") {
  TEST_CASE("panel: no text is cut and no slider is left out, with any tool and structures") {
    for (const auto& [width, height] : {std::pair{640, 480}, std::pair{700, 500}, std::pair{1000, 760}})
      for (const bool structures : {false, true}) {
        CAPTURE(structures);
        Drawn d(width, height, structures);
        const auto check = [&] {
          d.frames();
          check_fits("Instruments", width, height);
          const ImGuiWindow* const panel = ImGui::FindWindowByName("Instruments");
          CHECK(panel->Size.x <= 0.3F * static_cast<float>(width));
          if (!structures) CHECK(panel->ScrollMax.y == 0);
        };
        check();
        d.bench.choose_tool("match-head-2.5");
        check();
        d.bench.act(Action::kLaw);
        d.bench.act(Action::kSpindle);
        check();
        d.bench.choose_tool("twist-99");  // a long note
        CHECK(!d.bench.note().empty());
        d.frames();
        check_fits("Instruments", width, height);
      }
  }

  TEST_CASE("panel: in a window too small for it, it scrolls") {
    Drawn d(320, 240, true);
    check_fits("Instruments", 320, 240);
    CHECK(ImGui::FindWindowByName("Instruments")->ScrollMax.y > 0);
  }

  TEST_CASE("panel: a shot shows it as a frame does, once and with its sizes") {
    Drawn d(640, 480, false);
    d.bench.act(Action::kPanels);
    (void)d.screen.shot(1);
    d.bench.act(Action::kPanels);
    // Beside plots and figures that change: the panel's lower left corner and the hint's, within and outside.
    struct Corner {
      int x, y, within, outside;
    };
    const auto corners = [&] {
      const std::vector<std::uint8_t> rgb = d.screen.shot(1);
      const auto pixel = [&](int x, int y) { return int{rgb[3 * static_cast<std::size_t>(y * 640 + x)]}; };
      std::vector<Corner> out;
      for (const char* const name : {"Instruments", "hint"}) {
        const ImGuiWindow* const w = ImGui::FindWindowByName(name);
        REQUIRE(w != nullptr);
        const int x = static_cast<int>(w->Pos.x) + 2, y = static_cast<int>(w->Pos.y + w->Size.y) - 4;
        out.push_back({x, y, pixel(x, y), pixel(x - 4, y)});
      }
      return out;
    };
    const std::vector<Corner> at_once = corners();
    // A line that tells of the loop may wrap in one shot and not in the next.
    std::vector<Corner> later = corners();
    for (int shots = 0; shots < 20 && later[0].y != at_once[0].y; ++shots) later = corners();
    for (std::size_t i = 0; i < later.size(); ++i) {
      REQUIRE(at_once[i].x == later[i].x);
      REQUIRE(at_once[i].y == later[i].y);
      CHECK(at_once[i].within == later[i].within);
      CHECK(std::abs(at_once[i].outside - later[i].outside) <= 2);
    }
    // A panel is darker than what is beside it.
    CHECK(at_once[0].within < at_once[0].outside - 20);
  }

  TEST_CASE("help: all keys are seen at once") {
    for (const auto& [width, height] : {std::pair{640, 480}, std::pair{1000, 760}}) {
      Drawn d(width, height, false);
      d.bench.act(Action::kHelp);
      d.frames();
      check_fits("Keys and mouse", width, height);
      CHECK(ImGui::FindWindowByName("Keys and mouse")->ScrollMax.y == 0);
    }
  }

  TEST_CASE("Escape closes an open list, then the help, and only then the window") {
    constexpr int kEscape = 256;
    Drawn d(640, 480, false);
    ImGuiContext& context = *ImGui::GetCurrentContext();
    ImGuiWindow* const panel = ImGui::FindWindowByName("Instruments");
    // As a click on the list of tools does.
    context.CurrentWindow = panel;
    ImGui::OpenPopupEx(ImHashStr("##ComboPopup", 0, panel->GetID("##tool")));
    context.CurrentWindow = nullptr;
    ImGui::FocusWindow(panel);
    d.frames();
    REQUIRE(context.OpenPopupStack.Size == 1);
    d.screen.press(kEscape);
    d.frames();
    CHECK(context.OpenPopupStack.Size == 0);
    CHECK(!d.bench.quit());
    d.bench.act(Action::kHelp);
    d.screen.press(kEscape);
    CHECK(!d.bench.help());
    CHECK(!d.bench.quit());
    for (const Action a : d.screen.pressed()) CHECK(a != Action::kQuit);
    d.screen.press(kEscape);
    CHECK(d.bench.quit());
  }
}

}  // namespace
