// SPDX-License-Identifier: MIT
#pragma once

#include "workbench.hpp"

#include <iosfwd>
#include <span>
#include <string>

namespace live {

/// Writes what happens on a workbench, frame by frame, as a session that plays it again.
class SessionWriter {
 public:
  /// `out` must outlive it.
  SessionWriter(std::ostream& out, const Workbench& bench)
      : events_(out), spindle_(bench.spindle()), protection_(bench.protection()), tool_(tool_of(bench)) {}

  /// After a frame at `time` [s] since the start, in which these keys were pressed.
  void frame(double time, const Workbench& bench, std::span<const Action> pressed) {
    for (const Action a : pressed)
      if (a != Action::kSpindle && a != Action::kProtection) events_.key(time, a);
    if (tool_of(bench) != tool_) events_.tool(time, tool_of(bench));
    if (bench.spindle() != spindle_) events_.spindle(time, bench.spindle());
    if (bench.protection() != protection_) events_.protect(time, bench.protection());
    events_.hand(time, bench.hand().pose());
    events_.view(time, bench.camera());
    spindle_ = bench.spindle();
    protection_ = bench.protection();
    tool_ = tool_of(bench);
  }
  /// The session is over.
  void quit(double time) { events_.quit(time); }

 private:
  [[nodiscard]] static std::string tool_of(const Workbench& bench) {
    const std::string& name = bench.session().options().drill.tool_name;
    return name.empty() ? std::string(kBurrName) : name;
  }

  EventWriter events_;
  bool spindle_;
  Protection protection_;
  std::string tool_;
};

}  // namespace live
