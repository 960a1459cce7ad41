// SPDX-License-Identifier: MIT
#pragma once

#include "workbench.hpp"

namespace live {

/// The panels over the picture: what the hand feels, what the tick took, what the drill did, and sliders. They read the
/// workbench and post through its inboxes. Each fits into the window: fonts and plots shrink, texts wrap, and what
/// still is too long scrolls. Needs a current Dear ImGui frame. Window thread.
class Instruments {
 public:
  void draw(Workbench& bench, double seconds);
  /// Closes a list that is open; false if there is none. Between frames.
  [[nodiscard]] bool close_list();

 private:
  void panel(Workbench& bench);
  static void state(Workbench& bench);
  void tools(Workbench& bench) const;
  void structures(Workbench& bench) const;
  void plots(Workbench& bench) const;
  void sliders(Workbench& bench);
  static void help();
  static void hints(const Workbench& bench, double seconds);

  // While a slider is dragged whose value starts the loop again.
  double stiffness_ = 800, scale_ = 1;
  float rest_ = 0;         // height of the panel without its plots, in the last frame
  float plot_height_ = 0;  // of each plot
  bool closes_lists_ = false;
};

}  // namespace live
