// SPDX-License-Identifier: MIT
#pragma once

#include "../drill/options.hpp"
#include "held_drill.hpp"
#include "session.hpp"

#include <optional>
#include <string>

namespace live {

/// The command line of the window.
struct LiveOptions {
  drill::Options bone;  ///< volume, isovalue, place, burr, voxel
  Renderer renderer = Renderer::kCoupled;
  bool law = false;                        ///< mills by the law of cutting
  std::optional<trephine::Motor> motor{};  ///< of the spindle, for the law
  std::string device = kMouse;             ///< as `SessionOptions`
  std::string labels;                      ///< segmentation's file; empty: none
  Protection protection = Protection::kWarn;
  double margin = 1e-3;  ///< of warning and guard [m]
  bool second_hand = false;
  double rate = 1000;  ///< [Hz]
  double scale = 1;
  double aside = 0.17;             ///< heights of the picture from its middle to the start, left of the instruments
  int width = 1280, height = 800;  ///< [pixels]
  std::string script;              ///< file to play, then quit
  std::string replay;              ///< file to play, then go on by hand
  std::string record;              ///< file to write
  std::string simulate;            ///< file to play in simulated time, without a window
  double fps = 60;                 ///< pictures a second at most
  bool mute = false;
  bool debug = false;  ///< a debug context, whose errors end the program
};

/// Ends the program's start: text for standard output (--help) or one line for standard error, with an exit code.
struct Exit {
  int code;
  std::string text;
};

/// Returns the options, or how the program ends at once: 0 for --help, 2 for a wrong argument.
struct Parsed {
  LiveOptions options;
  std::optional<Exit> exit;
};
[[nodiscard]] Parsed parse_live_options(int argc, const char* const* argv);

}  // namespace live
