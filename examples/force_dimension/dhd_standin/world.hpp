// SPDX-License-Identifier: MIT
#pragma once

#include "dhd_standin.hpp"

#include <iterator>
#include <list>
#include <mutex>

/// The stand-in's state: all of it in one place, behind one lock.
namespace dhd_standin {

struct AnyHand {
  std::function<trephine::HandTarget(double)> script;
  trephine::HandTarget operator()(double time) const { return script(time); }
};

/// A plugged device.
struct Plugged {
  explicit Plugged(const Model& m);

  /// Lives on to `now`: the hand moves, the watchdog runs out, too high a speed brakes.
  void live(double now);
  void brake(int cause, double at);
  void command(const trephine::Wrenchd& wrench);
  /// What the handle's sensors say.
  [[nodiscard]] trephine::Posed sensed(Fault fault) const;

  Model model;
  trephine::SimulatedDevice<AnyHand> mechanics;
  bool open = false;
  bool calibrated;
  bool compensates = true;
  double gripper_angle = 0.4;  // [rad]
  double watchdog = 0;         // [s]; 0: none
  double lived = 0;            // until then [s]
  double commanded = 0;        // when the last command came [s]
  double read_at = -1;         // when the last new pose was read [s]
  trephine::Posed read = trephine::Posed::Identity();
  Witness witness;
};

struct World {
  static World& get();
  /// The open device of an ID, brought to the present, or nothing: then the thread's error is set.
  Plugged* find(char id);

  std::recursive_mutex mutex;
  std::list<Plugged> devices;
  Fault fault = Fault::kNone;
  bool expert = false;
};

/// Sets the calling thread's error and returns -1.
int fail(int error);

}  // namespace dhd_standin
