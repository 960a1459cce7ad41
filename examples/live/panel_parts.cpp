// SPDX-License-Identifier: MIT
#include "panel_parts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

namespace live::panel {

Fitted::Fitted(float columns, float rows) {
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  const float em = ImGui::GetFontSize();
  const float fit = std::clamp(std::min(display.x / (columns * em), display.y / (rows * em)), 0.75F, 1.0F);
  scale_ = std::floor(fit * em) / em;  // lines of whole pixels, or a window has a scroll bar for a part of one
  const ImGuiStyle& style = ImGui::GetStyle();
  const auto scaled = [&](ImGuiStyleVar which, const ImVec2& v) {
    ImGui::PushStyleVar(which, ImVec2(scale_ * v.x, std::floor(scale_ * v.y)));
  };
  scaled(ImGuiStyleVar_FramePadding, style.FramePadding);
  scaled(ImGuiStyleVar_ItemSpacing, style.ItemSpacing);
  scaled(ImGuiStyleVar_WindowPadding, style.WindowPadding);
  scaled(ImGuiStyleVar_CellPadding, style.CellPadding);
  ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, ImVec2(1, 1));  // a hint is a line high
}

Fitted::~Fitted() { ImGui::PopStyleVar(5); }

void same_line_if_fits(float width) {
  const float gap = ImGui::GetStyle().ItemSpacing.x;
  const float end = ImGui::GetWindowPos().x + ImGui::GetWindowContentRegionMax().x;
  if (ImGui::GetItemRectMax().x + gap + width <= end) ImGui::SameLine(0, gap);
}

void beside(const ImVec4& colour, const char* text) {
  same_line_if_fits(ImGui::CalcTextSize(text).x);
  ImGui::TextColored(colour, "%s", text);
}

void swatch(const trephine::Structure& s) {
  const float side = ImGui::GetTextLineHeight();
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  ImGui::GetWindowDrawList()->AddRectFilled(
      corner, ImVec2(corner.x + side, corner.y + side),
      ImGui::ColorConvertFloat4ToU32(ImVec4(s.colour[0], s.colour[1], s.colour[2], 1)), 3);
  ImGui::Dummy(ImVec2(side, side));
  ImGui::SameLine(0, 0.3F * side);
}

void legend(const std::vector<trephine::Structure>& structures) {
  bool first = true;
  for (const trephine::Structure& s : structures) {
    if (!std::exchange(first, false))
      same_line_if_fits(1.3F * ImGui::GetTextLineHeight() + ImGui::CalcTextSize(s.name.c_str()).x);
    swatch(s);
    ImGui::TextDisabled("%s", s.name.c_str());
  }
}

void plot(const char* title, const char* unit, const std::vector<float>& values, float limit, float least_top,
          float height) {
  float top = least_top, last = 0, most = 0;
  if (!values.empty()) {
    most = *std::max_element(values.begin(), values.end());
    last = values.back();
  }
  top = std::max(top, 1.15F * most);
  const float width = ImGui::GetContentRegionAvail().x;
  // About as long for every value: a line more would move all below it.
  const auto digits = [](float value) { return value < 100 ? 2 : 0; };
  ImGui::Text("%s  %.*f %s", title, digits(last), static_cast<double>(last), unit);
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "most %.*f", digits(most), static_cast<double>(most));
  beside(ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled), text.data());
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

bool slider(const char* format, double& value, double unit, float least, float most, ImGuiSliderFlags flags) {
  float shown = static_cast<float>(value / unit);
  ImGui::PushID(format);
  ImGui::SetNextItemWidth(-1);
  const bool moved = ImGui::SliderFloat("##", &shown, least, most, format, flags);
  ImGui::PopID();
  if (moved) value = unit * static_cast<double>(shown);
  return moved;
}

bool begin_list(std::string_view name, std::string_view chosen, bool closes) {
  const std::string label = "##" + std::string(name), shown = std::string(name) + ": " + std::string(chosen);
  ImGui::SetNextItemWidth(-1);
  if (!ImGui::BeginCombo(label.c_str(), shown.c_str())) return false;
  if (closes) ImGui::CloseCurrentPopup();
  return true;
}

}  // namespace live::panel
