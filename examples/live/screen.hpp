// SPDX-License-Identifier: MIT
#pragma once

#include "instruments.hpp"
#include "window.hpp"
#include "workbench.hpp"

#include <cstdint>
#include <vector>

namespace live {

/// Puts workbench and instruments into a window and hands it what mouse and keys do. Main thread.
class Screen {
 public:
  /// `by_hand`: mouse and keys count; a script is not to be disturbed by them.
  Screen(Window& window, Workbench& bench, bool by_hand);
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  /// Events, picture, instruments: one frame, `dt` [s] after the last one and `time` after the start.
  void frame(double dt, double time);
  /// Draws scene and instruments in full and returns them, 8-bit RGB, top row first.
  [[nodiscard]] std::vector<std::uint8_t> shot(double time);
  /// Does what a key of this code of GLFW's does. Escape closes an open list first, then the help, then the window.
  void press(int key);
  /// Whether the mouse moves the drill: not while a session is replayed. It turns the view in any case.
  void follow_mouse(bool follows) { follows_mouse_ = follows; }
  /// Draws the instruments for a monitor of this scale, 1 for the usual 96 dots per inch. Between frames.
  void set_content_scale(float scale);
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  /// Returns the keys that the user pressed since the last call.
  [[nodiscard]] std::vector<Action> pressed() { return std::exchange(pressed_, {}); }

 private:
  void on_button(int button, bool down);
  void on_move(double x, double y);
  void on_wheel(double notches);
  void on_focus(bool has);
  void lay_out_instruments(double time);
  void draw_instruments(double time);
  void read_size();
  [[nodiscard]] bool shift() const;
  [[nodiscard]] bool control() const;

  static constexpr double kWheelStep = 0.4e-3;  // of a notch [m]
  static constexpr double kDragStep = 0.05e-3;  // of a pixel [m]

  Window& window_;
  Workbench& bench_;
  Instruments instruments_;
  std::vector<Action> pressed_;
  Vec2d mouse_ = Vec2d::Zero();
  double pixels_ = 1;  // of the framebuffer a unit of the mouse
  int width_ = 0, height_ = 0;
  bool middle_ = false, right_ = false, left_ = false;
  bool entered_ = false, follows_mouse_ = true;
};

}  // namespace live
