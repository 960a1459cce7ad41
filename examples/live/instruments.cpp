// SPDX-License-Identifier: MIT
#include "instruments.hpp"

#include <trephine/core/units.hpp>
#include <trephine/tool/named_tools.hpp>

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <string>
#include <vector>

namespace live {
namespace {

constexpr std::size_t kShown = 3000;  // ticks in a plot
constexpr std::size_t kLegend = 12;   // structures named all at once, at most

/// The status in words for the one who drills.
const char* in_words(trephine::Status s) {
  using trephine::Status;
  switch (s) {
    case Status::kOk:
      return "all well";
    case Status::kWorkBound:
      return "search cut short, goes on in the next tick";
    case Status::kStartedInside:
      return "drill starts in bone: force fades in";
    case Status::kJump:
      return "the hand jumped: nothing is cut, force fades in";
    case Status::kBadInput:
      return "the device's pose is no pose: no force";
    case Status::kNonFinite:
      return "force is not finite: none is sent";
    case Status::kFarAway:
      return "the drill is metres from the bone: are poses in metres?";
  }
  return "";
}

/// A square in the structure's colour, with room for text after it.
void swatch(const trephine::Structure& s) {
  const float side = ImGui::GetTextLineHeight();
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  ImGui::GetWindowDrawList()->AddRectFilled(
      corner, ImVec2(corner.x + side, corner.y + side),
      ImGui::ColorConvertFloat4ToU32(ImVec4(s.colour[0], s.colour[1], s.colour[2], 1)), 3);
  ImGui::Dummy(ImVec2(side, side));
  ImGui::SameLine(0, 0.3F * side);
}

/// Names and colours, as many on a line as fit.
void legend(const std::vector<trephine::Structure>& structures) {
  const float gap = ImGui::GetFontSize(), width = ImGui::GetContentRegionAvail().x;
  float used = 0;
  for (const trephine::Structure& s : structures) {
    const float own = 1.3F * ImGui::GetTextLineHeight() + ImGui::CalcTextSize(s.name.c_str()).x;
    if (used > 0 && used + gap + own <= width) {
      ImGui::SameLine(0, gap);
      used += gap + own;
    } else {
      used = own;
    }
    swatch(s);
    ImGui::TextDisabled("%s", s.name.c_str());
  }
}

/// A plot with its greatest value and a limit; each column shows the largest of the samples it covers.
void plot(const char* title, const char* unit, const std::vector<float>& values, float limit, float least_top) {
  float top = least_top, last = 0, most = 0;
  if (!values.empty()) {
    most = *std::max_element(values.begin(), values.end());
    last = values.back();
  }
  top = std::max(top, 1.15F * most);
  const float width = ImGui::GetContentRegionAvail().x, height = 3.2F * ImGui::GetTextLineHeight();
  ImGui::Text("%s  %.2f %s", title, static_cast<double>(last), unit);
  ImGui::SameLine(0.62F * width);
  ImGui::TextDisabled("most %.2f", static_cast<double>(most));
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  ImDrawList* const list = ImGui::GetWindowDrawList();
  list->AddRectFilled(corner, ImVec2(corner.x + width, corner.y + height), IM_COL32(16, 20, 26, 255), 3);
  const auto y = [&](float v) { return corner.y + height * (1 - std::min(v / top, 1.0F)); };
  const int columns = std::max(1, static_cast<int>(width));
  if (!values.empty())
    for (int c = 0; c < columns; ++c) {
      const auto from = static_cast<std::size_t>(c) * values.size() / static_cast<std::size_t>(columns);
      const auto to =
          std::max(from + 1, (static_cast<std::size_t>(c) + 1) * values.size() / static_cast<std::size_t>(columns));
      float v = 0;
      for (std::size_t i = from; i < std::min(to, values.size()); ++i) v = std::max(v, values[i]);
      const float x = corner.x + static_cast<float>(c);
      list->AddLine(ImVec2(x, corner.y + height), ImVec2(x, y(v)), IM_COL32(86, 156, 214, 255));
    }
  if (limit > 0 && limit < top)
    list->AddLine(ImVec2(corner.x, y(limit)), ImVec2(corner.x + width, y(limit)), IM_COL32(230, 90, 70, 220));
  ImGui::Dummy(ImVec2(width, height));
}

}  // namespace

void Instruments::draw(Workbench& bench, double seconds) {
  const ImGuiIO& io = ImGui::GetIO();
  if (bench.panels()) {
    const float width = 17.5F * ImGui::GetFontSize();
    ImGui::SetNextWindowPos(ImVec2(io.DisplaySize.x - width - 8, 8), ImGuiCond_Always);
    ImGui::SetNextWindowSize(ImVec2(width, 0), ImGuiCond_Always);
    ImGui::SetNextWindowBgAlpha(0.82F);
    constexpr ImGuiWindowFlags kFixed = ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize |
                                        ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoSavedSettings |
                                        ImGuiWindowFlags_NoFocusOnAppearing;
    ImGui::Begin("Instruments", nullptr, kFixed);
    state(bench);
    if (bench.session().options().drill.renderer == Renderer::kCoupled) tools(bench);
    if (bench.guarded() != nullptr) structures(bench);
    plots(bench);
    // Where there is room for them.
    const bool law = bench.session().options().drill.mills_by_law();
    const float lines = (bench.guarded() != nullptr ? 38.0F : 32.0F) + (law ? 3.0F : 0.0F);
    if (io.DisplaySize.y > lines * ImGui::GetTextLineHeightWithSpacing()) sliders(bench);
    ImGui::End();
  }
  if (bench.help())
    help();
  else if (bench.panels())
    hints(bench, seconds);
}

void Instruments::state(Workbench& bench) {
  const TickView& v = bench.view();
  const SessionOptions& o = bench.session().options();
  if (o.drill.shape() != nullptr)
    ImGui::Text("%s, %s mm", to_string(o.drill.renderer), o.drill.tool_name.c_str());
  else
    ImGui::Text("%s, burr diameter %.1f mm", to_string(o.drill.renderer), 2e3 * o.drill.burr.tip_radius);
  ImGui::SameLine();
  if (v.spindle_on)
    ImGui::TextColored(ImVec4(1, 0.62F, 0.25F, 1), "spindle on");
  else
    ImGui::TextDisabled("spindle off");
  const bool well = v.status == trephine::Status::kOk;
  ImGui::TextColored(well ? ImVec4(0.55F, 0.85F, 0.55F, 1) : ImVec4(1, 0.7F, 0.3F, 1), "%s", in_words(v.status));
  ImGui::Text("removed %.1f mm3", v.removed_mm3);
  if (o.drill.mills_by_law()) {
    ImGui::Text("true thrust %.1f N, torque %.1f mN m", v.cutting.thrust, 1e3 * v.cutting.torque);
    ImGui::Text("spindle %.0f rpm", v.cutting.spindle / trephine::rpm(1));
  }
  const char* touching = v.contact.tip && v.contact.shaft ? "tip and shaft touch"
                         : v.contact.tip                  ? "tip touches"
                         : v.contact.shaft                ? "shaft touches"
                                                          : "in the air";
  ImGui::Text("%s", touching);
  if (bench.session().failed()) ImGui::TextColored(ImVec4(1, 0.4F, 0.3F, 1), "the device failed");
  ImGui::PushTextWrapPos();
  ImGui::TextDisabled("%s", bench.session().report().c_str());
  if (!bench.note().empty()) ImGui::TextColored(ImVec4(1, 0.7F, 0.3F, 1), "%s", bench.note().c_str());
  ImGui::PopTextWrapPos();
}

/// Kinds of tools; a choice has about the diameter of the last one.
void Instruments::tools(Workbench& bench) {
  const DrillSettings& drill = bench.session().options().drill;
  const std::string_view chosen = family_of(drill.tool_name);
  const std::string shown(chosen);
  ImGui::PushItemWidth(8.0F * ImGui::GetFontSize());
  if (ImGui::BeginCombo("tool", shown.c_str())) {
    const auto offer = [&](std::string_view family) {
      const bool is_chosen = family == chosen;
      if (ImGui::Selectable(std::string(family).c_str(), is_chosen) && !is_chosen) bench.choose_family(family);
    };
    offer(kBurrName);
    for (const trephine::ToolFamily& family : trephine::kToolFamilies) offer(family.name);
    ImGui::EndCombo();
  }
  ImGui::PopItemWidth();
  bool law = drill.law;
  if (ImGui::Checkbox("cutting forces (L)", &law)) bench.act(Action::kLaw);
}

void Instruments::structures(Workbench& bench) {
  const GuardedBone& guarded = *bench.guarded();
  const StructureReport& r = bench.view().structures;
  ImGui::Separator();
  int protection = static_cast<int>(bench.protection());
  ImGui::PushItemWidth(8.0F * ImGui::GetFontSize());
  if (ImGui::Combo("protection (G)", &protection, kProtectionItems))
    bench.protect(kProtections[static_cast<std::size_t>(protection)]);
  ImGui::PopItemWidth();
  if (r.nearest < 0) return;
  const trephine::Structure& nearest = guarded.structures[static_cast<std::size_t>(r.nearest)];
  swatch(nearest);
  const bool warns = bench.protection() != Protection::kOff && r.in_margin;
  const ImVec4 plain = ImGui::GetStyleColorVec4(ImGuiCol_Text);
  const ImVec4 alarm = r.distance < 0 ? ImVec4(1, 0.35F, 0.3F, 1) : ImVec4(1, 0.7F, 0.3F, 1);
  ImGui::TextColored(warns ? alarm : plain, "%s  %.2f mm", nearest.name.c_str(), 1e3 * r.distance);
  ImGui::TextColored(warns ? alarm : ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled), "%s",
                     !r.in_margin      ? "no structure is too near"
                     : !warns          ? "protection is off"
                     : r.distance >= 0 ? "too near this structure"
                                       : "the drill is in this structure");
  ImGui::Text("guard pushes %.2f N", r.push_N);
  ImGui::Text("taken %.2f mm3, refused %.2f mm3", r.taken_mm3, r.refused_mm3);
  if (guarded.structures.size() <= kLegend) legend(guarded.structures);
}

void Instruments::plots(Workbench& bench) {
  const std::vector<TickSample> samples = bench.session().history().last(kShown);
  std::vector<float> force, torque, time;
  for (const TickSample& s : samples) {
    force.push_back(s.force);
    torque.push_back(1e3F * s.torque);
    time.push_back(s.tick_us);
  }
  ImGui::Separator();
  plot("force", "N", force, static_cast<float>(bench.session().options().drill.tuning.force), 2);
  plot("torque", "mN m", torque, static_cast<float>(1e3 * kMaxTorque), 20);
  plot("tick", "us", time, 0, 50);
  ImGui::TextDisabled("missed %llu periods; picture %.0f ms", static_cast<unsigned long long>(bench.view().missed),
                      bench.draw_ms());
}

void Instruments::sliders(Workbench& bench) {
  ImGui::Separator();
  ImGui::PushItemWidth(8.0F * ImGui::GetFontSize());
  Tuning tuning = bench.session().options().drill.tuning;
  const auto slide = [](const char* name, double& value, double unit, float least, float most,
                        const char* format = "%.3f", ImGuiSliderFlags flags = 0) {
    float shown = static_cast<float>(value / unit);
    const bool moved = ImGui::SliderFloat(name, &shown, least, most, format, flags);
    if (moved) value = unit * static_cast<double>(shown);
    return moved;
  };
  if (const DrillSettings& drill = bench.session().options().drill; drill.mills_by_law()) {
    const trephine::CuttingForce::Options law = drill.cutting();
    double turns = law.speed / trephine::rpm(1), felt = law.felt;
    if (slide("spindle rpm", turns, 1, 500, 80'000, "%.0f", ImGuiSliderFlags_Logarithmic)) tuning.turns = turns;
    if (slide("felt share", felt, 1, 0.01F, 1, "%.3f", ImGuiSliderFlags_Logarithmic)) tuning.felt = felt;
  } else {
    slide("feed mm/s", tuning.feed, 1e-3, 0.5F, 30);
  }
  slide("damping N s/m", tuning.damping, 1, 0, 4);
  slide("vibration N/N", tuning.vibration, 1, 0, 0.3F);
  slide("limit N", tuning.force, 1, 0.5F, static_cast<float>(kMaxForce));
  bench.session().tune(tuning);
  // These start the loop again, so they wait until the slider is let go.
  SessionOptions o = bench.session().options();
  ImGui::SliderFloat("stiffness N/m", &stiffness_, 100, 2000, "%.0f");
  if (ImGui::IsItemDeactivatedAfterEdit()) {
    o.drill.stiffness = static_cast<double>(stiffness_);
    bench.session().change(o);
  }
  ImGui::SliderFloat("scale", &scale_, 0.1F, 2);
  if (ImGui::IsItemDeactivatedAfterEdit()) {
    o.scale = static_cast<double>(scale_);
    bench.session().change(o);
  }
  ImGui::PopItemWidth();
}

void Instruments::help() {
  const ImGuiIO& io = ImGui::GetIO();
  ImGui::SetNextWindowPos(ImVec2(0.5F * io.DisplaySize.x, 0.5F * io.DisplaySize.y), ImGuiCond_Always,
                          ImVec2(0.5F, 0.5F));
  ImGui::SetNextWindowBgAlpha(0.92F);
  ImGui::Begin("Keys and mouse", nullptr,
               ImGuiWindowFlags_NoMove | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse |
                   ImGuiWindowFlags_NoSavedSettings);
  if (ImGui::BeginTable("keys", 2)) {
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
  const TickView& v = bench.view();
  const char* text = nullptr;
  if (seconds < 6)
    text = "Move the mouse to move the drill. The wheel pushes it in. F1 shows all keys.";
  else if (v.removed_mm3 == 0 && !v.spindle_on && v.contact.count > 0)
    text = "The drill touches bone. Hold the left button, or press Space, and push.";
  else if (v.removed_mm3 == 0 && v.spindle_on && v.contact.count == 0)
    text = "Push the drill into the bone with the wheel.";
  else if (seconds < 14 && bench.guarded() != nullptr)
    text = "G changes how structures are protected: off, warn, push, veto.";
  else if (seconds < 90 && v.removed_mm3 > 5 && !v.spindle_on)
    text = "C cuts the picture open, U undoes, the middle button turns the view.";
  if (text == nullptr) return;
  const ImGuiIO& io = ImGui::GetIO();
  ImGui::SetNextWindowPos(ImVec2(12, io.DisplaySize.y - 12), ImGuiCond_Always, ImVec2(0, 1));
  ImGui::SetNextWindowBgAlpha(0.6F);
  ImGui::Begin("hint", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoInputs |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing);
  ImGui::TextUnformatted(text);
  ImGui::End();
}

}  // namespace live
