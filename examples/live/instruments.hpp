// SPDX-License-Identifier: MIT
#pragma once

#include "workbench.hpp"

namespace live {

/// The panels over the picture: what the hand feels, what the tick took, what the drill did, and sliders. They read the
/// workbench and post through its inboxes. Needs a current Dear ImGui frame. Window thread.
class Instruments {
 public:
  explicit Instruments(const Workbench& bench);
  void draw(Workbench& bench, double seconds);

 private:
  void state(Workbench& bench);
  static void structures(Workbench& bench);
  void plots(Workbench& bench);
  void sliders(Workbench& bench);
  static void help();
  static void hints(const Workbench& bench, double seconds);

  // What the sliders show, in their own units.
  float feed_mm_s_, damping_, vibration_, force_limit_, stiffness_, scale_;
};

}  // namespace live
