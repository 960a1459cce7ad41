// SPDX-License-Identifier: MIT
#pragma once

#include "workbench.hpp"

namespace live {

/// The panels over the picture: what the hand feels, what the tick took, what the drill did, and sliders. They read the
/// workbench and post through its inboxes. Needs a current Dear ImGui frame. Window thread.
class Instruments {
 public:
  void draw(Workbench& bench, double seconds);

 private:
  static void state(Workbench& bench);
  static void structures(Workbench& bench);
  static void tools(Workbench& bench);
  static void plots(Workbench& bench);
  void sliders(Workbench& bench);
  static void help();
  static void hints(const Workbench& bench, double seconds);

  // While a slider is dragged whose value starts the loop again.
  float stiffness_ = 800, scale_ = 1;
};

}  // namespace live
