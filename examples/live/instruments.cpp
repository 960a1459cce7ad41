// SPDX-License-Identifier: MIT
#include "instruments.hpp"

#include "panel_parts.hpp"
#include "words.hpp"

#include <trephine/core/units.hpp>
#include <trephine/tool/named_tools.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace live {
namespace {

constexpr std::size_t kShown = 3000;  // ticks in a plot
constexpr std::size_t kLegend = 12;   // structures named all at once, at most
constexpr int kPlots = 3;
constexpr float kMargin = 8;  // of the panel from the window's edge [pixels]

[[nodiscard]] float width_of_panel(float scale) {
  return std::min(16 * scale * ImGui::GetFontSize(), 0.6F * ImGui::GetIO().DisplaySize.x);
}

}  // namespace

bool Instruments::close_list() {
  closes_lists_ = ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopupId | ImGuiPopupFlags_AnyPopupLevel);
  return closes_lists_;
}

void Instruments::draw(Workbench& bench, double seconds) {
  if (bench.panels()) panel(bench);
  closes_lists_ = false;
  if (bench.help())
    help();
  else if (bench.panels())
    hints(bench, seconds);
}

void Instruments::panel(Workbench& bench) {
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  const panel::Fitted fitted(60, 44);
  const float width = width_of_panel(fitted.scale());
  const float most = std::max(display.y - 2 * kMargin, 40.0F);
  ImGui::SetNextWindowPos(ImVec2(display.x - width - kMargin, kMargin), ImGuiCond_Always);
  ImGui::SetNextWindowSize(ImVec2(width, 0), ImGuiCond_Always);
  ImGui::SetNextWindowSizeConstraints(ImVec2(width, 0), ImVec2(width, most));
  ImGui::SetNextWindowBgAlpha(0.82F);
  ImGui::Begin("Instruments", nullptr,
               ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing);
  ImGui::SetWindowFontScale(fitted.scale());
  const float line = ImGui::GetTextLineHeight();
  plot_height_ = std::floor(std::clamp((most - rest_) / kPlots, 0.8F * line, 3.2F * line));
  ImGui::PushTextWrapPos();
  state(bench);
  if (bench.session().options().drill.renderer == Renderer::kCoupled) tools(bench);
  if (bench.guarded() != nullptr) structures(bench);
  plots(bench);
  sliders(bench);
  ImGui::PopTextWrapPos();
  rest_ = ImGui::GetCursorPosY() + ImGui::GetStyle().WindowPadding.y - kPlots * plot_height_;
  ImGui::End();
}

void Instruments::state(Workbench& bench) {
  const TickView& v = bench.view();
  const DrillSettings& drill = bench.session().options().drill;
  ImGui::TextUnformatted(title_of(drill).c_str());
  const ImVec4 plain = ImGui::GetStyleColorVec4(ImGuiCol_Text), pale = ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled);
  if (v.spindle_on)
    panel::beside(ImVec4(1, 0.62F, 0.25F, 1), "spindle on");
  else
    panel::beside(pale, "spindle off");
  panel::beside(v.passes ? panel::kAlert : plain, touch_in_words(v));
  const bool well = v.status == trephine::Status::kOk;
  ImGui::TextColored(well ? panel::kCalm : panel::kAlert, "%s", state_in_words(v));
  ImGui::Text("removed %.1f mm3", v.removed_mm3);
  if (drill.mills_by_law()) {
    ImGui::Text("true thrust %.1f N, torque %.1f mN m", v.cutting.thrust, 1e3 * v.cutting.torque);
    ImGui::Text("spindle %.0f rpm", v.cutting.spindle / trephine::rpm(1));
  }
  if (bench.session().failed()) ImGui::TextColored(panel::kAlarm, "the device failed");
  ImGui::TextDisabled("%s", bench.session().report().c_str());
  if (!bench.note().empty()) ImGui::TextColored(panel::kAlert, "%s", bench.note().c_str());
}

/// Kinds of tools; a choice has about the diameter of the last one.
void Instruments::tools(Workbench& bench) const {
  const DrillSettings& drill = bench.session().options().drill;
  const std::string_view chosen = family_of(drill.tool_name);
  if (panel::begin_list("tool", chosen, closes_lists_)) {
    const auto offer = [&](std::string_view family) {
      const bool is_chosen = family == chosen;
      if (ImGui::Selectable(std::string(family).c_str(), is_chosen) && !is_chosen) bench.choose_family(family);
    };
    offer(kBurrName);
    for (const trephine::ToolFamily& family : trephine::kToolFamilies) offer(family.name);
    ImGui::EndCombo();
  }
  bool law = drill.law;
  if (ImGui::Checkbox("cutting forces (L)", &law)) bench.act(Action::kLaw);
}

void Instruments::structures(Workbench& bench) const {
  const GuardedBone& guarded = *bench.guarded();
  const StructureReport& r = bench.view().structures;
  ImGui::Separator();
  if (panel::begin_list("protection (G)", to_string(bench.protection()), closes_lists_)) {
    for (const Protection p : kProtections)
      if (ImGui::Selectable(std::string(to_string(p)).c_str(), p == bench.protection())) bench.protect(p);
    ImGui::EndCombo();
  }
  if (r.nearest < 0) return;
  const trephine::Structure& nearest = guarded.structures[static_cast<std::size_t>(r.nearest)];
  panel::swatch(nearest);
  const bool too_near = warns(bench.protection(), r);
  const ImVec4 plain = ImGui::GetStyleColorVec4(ImGuiCol_Text);
  const ImVec4 alarm = r.distance < 0 ? panel::kAlarm : panel::kAlert;
  ImGui::TextColored(too_near ? alarm : plain, "%s  %.2f mm", nearest.name.c_str(), 1e3 * r.distance);
  ImGui::TextColored(too_near ? alarm : ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled), "%s",
                     nearness_in_words(bench.protection(), r));
  if (const std::string felt = felt_in_words(guarded.structures, r); !felt.empty())
    ImGui::TextColored(r.torn >= 0 ? panel::kAlarm : plain, "%s", felt.c_str());
  ImGui::Text("guard pushes %.2f N", r.push_N);
  ImGui::Text("taken %.2f mm3, refused %.2f mm3", r.taken_mm3, r.refused_mm3);
  if (guarded.structures.size() <= kLegend) panel::legend(guarded.structures);
}

void Instruments::plots(Workbench& bench) const {
  const std::vector<TickSample> samples = bench.session().history().last(kShown);
  std::vector<float> force, torque, time;
  for (const TickSample& s : samples) {
    force.push_back(s.force);
    torque.push_back(1e3F * s.torque);
    time.push_back(s.tick_us);
  }
  ImGui::Separator();
  const auto limit = static_cast<float>(bench.session().options().drill.tuning.force);
  panel::plot("force", "N", force, limit, 2, plot_height_);
  panel::plot("torque", "mN m", torque, static_cast<float>(1e3 * kMaxTorque), 20, plot_height_);
  panel::plot("tick", "us", time, 0, 50, plot_height_);
  ImGui::TextDisabled("%llu late; picture %.0f ms", static_cast<unsigned long long>(bench.view().missed),
                      bench.draw_ms());
}

void Instruments::sliders(Workbench& bench) {
  ImGui::Separator();
  Tuning tuning = bench.session().options().drill.tuning;
  if (const DrillSettings& drill = bench.session().options().drill; drill.mills_by_law()) {
    const trephine::CuttingForce::Options law = drill.cutting();
    double turns = law.speed / trephine::rpm(1), force_scale = law.force_scale;
    constexpr ImGuiSliderFlags kLog = ImGuiSliderFlags_Logarithmic;
    if (panel::slider("spindle %.0f rpm", turns, 1, 500, 500'000, kLog)) tuning.turns = turns;
    if (panel::slider("force scale %.3f", force_scale, 1, 0.01F, 1, kLog)) tuning.force_scale = force_scale;
    panel::slider("teeth %.2f", tuning.teeth, 1, 0, 1);
  } else {
    panel::slider("feed %.2f mm/s", tuning.feed, 1e-3, 0.5F, 30);
    panel::slider("vibration %.3f N/N", tuning.vibration, 1, 0, 0.3F);
  }
  panel::slider("damping %.2f N s/m", tuning.damping, 1, 0, 4);
  panel::slider("limit %.2f N", tuning.force, 1, 0.5F, static_cast<float>(kMaxForce));
  bench.session().tune(tuning);
  // These start the loop again, so they wait until the slider is let go.
  SessionOptions o = bench.session().options();
  panel::slider("stiffness %.0f N/m", stiffness_, 1, 100, 2000);
  if (ImGui::IsItemDeactivatedAfterEdit()) {
    o.drill.stiffness = stiffness_;
    bench.session().change(o);
  }
  panel::slider("scale %.2f", scale_, 1, 0.1F, 2);
  if (ImGui::IsItemDeactivatedAfterEdit()) {
    o.scale = scale_;
    bench.session().change(o);
  }
}

void Instruments::help() {
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  const panel::Fitted fitted(44, 42);
  ImGui::SetNextWindowPos(ImVec2(0.5F * display.x, 0.5F * display.y), ImGuiCond_Always, ImVec2(0.5F, 0.5F));
  ImGui::SetNextWindowSizeConstraints(ImVec2(0, 0), ImVec2(std::max(display.x, 40.0F), std::max(display.y, 40.0F)));
  ImGui::SetNextWindowBgAlpha(0.92F);
  ImGui::Begin("Keys and mouse", nullptr,
               ImGuiWindowFlags_NoMove | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse |
                   ImGuiWindowFlags_NoSavedSettings);
  ImGui::SetWindowFontScale(fitted.scale());
  if (ImGui::BeginTable("keys", 2, ImGuiTableFlags_SizingFixedFit)) {
    const auto row = [](std::string_view key, std::string_view text) {
      ImGui::TableNextRow();
      ImGui::TableNextColumn();
      ImGui::TextColored(ImVec4(0.55F, 0.78F, 1, 1), "%.*s", static_cast<int>(key.size()), key.data());
      ImGui::TableNextColumn();
      ImGui::TextUnformatted(text.data(), text.data() + text.size());
    };
    for (const MouseHelp& m : kMouseHelp) row(m.gesture, m.help);
    for (const Key& k : kKeys) row(k.name, k.help);
    ImGui::EndTable();
  }
  ImGui::End();
}

void Instruments::hints(const Workbench& bench, double seconds) {
  const char* const text = hint_for(bench, seconds);
  if (text == nullptr) return;
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  const panel::Fitted fitted(60, 44);
  // Beside the panel.
  const float free = display.x - width_of_panel(fitted.scale()) - 5 * kMargin;
  ImGui::SetNextWindowPos(ImVec2(kMargin, display.y - kMargin), ImGuiCond_Always, ImVec2(0, 1));
  ImGui::SetNextWindowBgAlpha(0.6F);
  ImGui::Begin("hint", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoInputs |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing);
  ImGui::SetWindowFontScale(fitted.scale());
  ImGui::PushTextWrapPos(std::max(free, 8 * ImGui::GetFontSize()));
  ImGui::TextUnformatted(text);
  ImGui::PopTextWrapPos();
  ImGui::End();
}

}  // namespace live
