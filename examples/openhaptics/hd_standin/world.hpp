// SPDX-License-Identifier: MIT
#pragma once

#include "hd_standin.hpp"

#include <array>
#include <atomic>
#include <condition_variable>
#include <list>
#include <memory>
#include <mutex>
#include <thread>

/// The stand-in's state: all of it in one place, behind one lock.
namespace hd_standin {

struct AnyHand {
  std::function<trephine::HandTarget(double)> script;
  trephine::HandTarget operator()(double time) const { return script(time); }
};

/// An opened device.
struct Opened {
  Opened(const Model& m, HHD h) : model(m), mechanics(mechanics_of(m), hand_of(m)), handle(h) {}

  static trephine::SimulatedDeviceOptions mechanics_of(const Model& m) {
    trephine::SimulatedDeviceOptions options = m.mechanics;
    options.output_dof = m.output_dof;
    return options;
  }
  static AnyHand hand_of(const Model& m) {
    if (m.hand) return {m.hand};
    return {[X_DH = m.mechanics.X_DH](double) { return trephine::HandTarget(X_DH); }};
  }

  Model model;
  trephine::SimulatedDevice<AnyHand> mechanics;
  HHD handle;
  bool enabled = false;  // HD_FORCE_OUTPUT
  bool in_frame = false;
  std::uint64_t frame_tick = 0;             // tick of the last frame; 0: none yet
  std::array<double, 3> force{}, torque{};  // as set in this frame [N, mN·m]
  std::array<double, 16> transform{};       // of the last frame [mm]
  std::array<double, 3> velocity{};         // of the last frame [mm/s]
  int buttons = 0;
  double unpowered = 0;  // time left without power [s]
  int calibrating = 0;   // ticks left; 0: not at it
  bool broken_pose = false;
  double offset_mm = 0;
  Witness witness;
};

/// A scheduled callback.
struct Entry {
  HDSchedulerHandle handle = 0;
  HDSchedulerCallback callback = nullptr;
  void* user = nullptr;
  HDushort priority = 0;
  bool done = false;
};

struct World {
  static World& get();

  // The servo thread holds it for a whole tick: a call from another thread sees a state between ticks.
  std::recursive_mutex mutex;
  std::condition_variable_any ticked;

  std::vector<Model> models{Model{}};
  std::list<Opened> opened;
  HHD current = HD_INVALID_HANDLE;
  HHD next_handle = 1;

  std::vector<HDErrorInfo> errors;  // the last one is the newest
  std::map<HDerror, int> counts;
  std::vector<Injection> injections;

  std::list<Entry> entries;  // by falling priority
  HDSchedulerHandle next_entry = 1;
  std::thread thread;
  std::atomic<bool> running{false};
  std::thread::id servo_thread;
  HDulong rate = 1000;
  std::uint64_t tick = 0;
  bool hung = false;
  double tick_began = 0;

  static constexpr std::size_t kMaxEntries = 16;
  static constexpr std::size_t kMaxErrors = 256;

  void push(HDerror code, HHD device);
  void push(HDerror code) { push(code, current); }
  /// Pushes what was injected for this place; true if there was something.
  bool injected(At at, const Opened* device);
  Opened* find(HHD handle);
  Opened* find(const std::string& name);
  [[nodiscard]] bool in_servo_thread() const { return running && std::this_thread::get_id() == servo_thread; }
  void serve();
  void serve_tick(double dt);
};

/// A device as it is between frames, in the interface's units.
void take_pose(Opened& device);
/// What was set goes to the motors, as far as they are enabled and powered.
void send(Opened& device);

}  // namespace hd_standin
