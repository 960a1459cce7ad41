// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/structure/label_grid.hpp>

#include <imgui.h>

#include <string_view>
#include <vector>

/// What the instruments are made of: texts, plots and sliders that never reach beyond their panel. Each needs a current
/// window of Dear ImGui.
namespace live::panel {

inline const ImVec4 kCalm{0.55F, 0.85F, 0.55F, 1}, kAlert{1, 0.7F, 0.3F, 1}, kAlarm{1, 0.35F, 0.3F, 1};

/// Shrinks the next window's font and spaces where the display is smaller than `columns` x `rows` of a line's height,
/// to three quarters at most. Ends with its scope.
class Fitted {
 public:
  Fitted(float columns, float rows);
  ~Fitted();
  Fitted(const Fitted&) = delete;
  Fitted& operator=(const Fitted&) = delete;
  [[nodiscard]] float scale() const { return scale_; }

 private:
  float scale_;
};

/// Continues the line if `width` more fits on it.
void same_line_if_fits(float width);
/// Writes a text, on the last one's line if it fits there.
void beside(const ImVec4& colour, const char* text);

/// A square in the structure's colour, with room for text after it.
void swatch(const trephine::Structure& s);
/// Names and colours, as many on a line as fit.
void legend(const std::vector<trephine::Structure>& structures);

/// A plot `height` high with its greatest value and a limit; each column shows the largest of the samples it covers.
void plot(const char* title, const char* unit, const std::vector<float>& values, float limit, float least_top,
          float height);

/// A slider as wide as the panel, with name and unit in it. Takes and returns `value` in units of `unit`; true if it
/// was moved.
bool slider(const char* format, double& value, double unit, float least, float most, ImGuiSliderFlags flags = 0);

/// Begins a list as wide as the panel that shows its name and the present choice; `closes` closes it.
[[nodiscard]] bool begin_list(std::string_view name, std::string_view chosen, bool closes);

}  // namespace live::panel
