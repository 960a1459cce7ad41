// SPDX-License-Identifier: MIT
#pragma once

#include "burr_path.hpp"
#include "heard_drill.hpp"
#include "held_drill.hpp"
#include "mouse_hand.hpp"
#include "passing_drill.hpp"
#include "second_hand.hpp"
#include "strokes.hpp"

#include <trephine/device/device.hpp>
#include <trephine/device/run_report.hpp>
#include <trephine/device/statistics.hpp>

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace live {

/// What the window shows of a tick. Poses and points in W.
struct TickView {
  static constexpr std::size_t kContacts = 24;
  std::uint64_t tick = 0;
  Posed probe = Posed::Identity();  ///< the device's tool pose
  Posed tool = Posed::Identity();   ///< the tool that rests on the bone
  trephine::Wrenchd wrench;
  trephine::ContactSummary contact{};
  trephine::Status status = trephine::Status::kOk;
  bool spindle_on = false;
  trephine::CuttingSummary cutting{};  ///< true forces, by the law of cutting
  bool passes = false;                 ///< bone neither holds the drill nor is cut, until the drill is out of it
  double removed_mm3 = 0;              ///< of the bone as loaded
  std::uint64_t missed = 0;            ///< periods without a tick
  StructureReport structures{};        ///< of this tick
  StructureReport closest{};           ///< of the tick that was nearest to a structure, since the start or `restore`
  double most_push_N = 0;              ///< of the guard, likewise
  Posed second = Posed::Identity();    ///< the second hand's tube that rests on the bone
  double second_N = 0;                 ///< that its hand feels
  std::array<Vec3d, kContacts> contacts{};
  std::size_t contact_count = 0;
};

/// One tick in the instruments' history.
struct TickSample {
  float force = 0;    ///< [N]
  float torque = 0;   ///< [N·m]
  float tick_us = 0;  ///< processor's wall time in the scene [µs]
};

/// The last ticks, written by the haptic thread and read by the window; neither waits.
class History {
 public:
  static constexpr std::size_t kSize = 8192;

  void add(const TickSample& s) noexcept {
    const std::uint64_t at = count_.load(std::memory_order_relaxed);
    auto& slot = slots_[at % kSize];
    slot[0].store(s.force, std::memory_order_relaxed);
    slot[1].store(s.torque, std::memory_order_relaxed);
    slot[2].store(s.tick_us, std::memory_order_relaxed);
    count_.store(at + 1, std::memory_order_release);
  }
  /// Copies the last `most` samples, oldest first; the half of the buffer that may be overwritten meanwhile stays out.
  [[nodiscard]] std::vector<TickSample> last(std::size_t most) const {
    const std::uint64_t end = count_.load(std::memory_order_acquire);
    const std::uint64_t n = std::min<std::uint64_t>({most, end, kSize / 2});
    std::vector<TickSample> out;
    out.reserve(n);
    for (std::uint64_t i = end - n; i < end; ++i) {
      const auto& slot = slots_[i % kSize];
      out.push_back({slot[0].load(std::memory_order_relaxed), slot[1].load(std::memory_order_relaxed),
                     slot[2].load(std::memory_order_relaxed)});
    }
    return out;
  }
  [[nodiscard]] std::uint64_t count() const noexcept { return count_.load(std::memory_order_acquire); }

 private:
  std::array<std::array<std::atomic<float>, 3>, kSize> slots_{};
  std::atomic<std::uint64_t> count_{0};
};

/// The simulated arm that the mouse holds, as --device has it.
inline constexpr const char* kMouse = "mouse";

/// How a session runs.
struct SessionOptions {
  DrillSettings drill{};
  double rate = 1000;  ///< of the servo loop [Hz]
  double scale = 1;    ///< tool's motion over the hand's
  /// What holds the tool: the mouse, or a kind of `devices::kinds()`; the mouse is also the hand of simulated ones.
  std::string device = kMouse;
  /// The user's axes in W: x, y, z point right, up and out of the screen at the start.
  Mat3d R_WU = Mat3d::Identity();
  bool second_hand = false;  ///< a simulated one, which holds a suction tube beside the drill
  bool simulated = false;    ///< no thread and no clock: `Session::simulate` ticks
};

/// The haptic side: a servo loop on a thread of its own, which alone touches the bone. The window posts wishes and
/// commands and reads views. Commands run between two runs of the loop, which then ramps its force up again.
class Session {
 public:
  /// Starts the loop with the hand at `start`. The bone must outlive the session. Throws std::exception with one line
  /// where the device or the drill cannot be made.
  Session(drill::Grid& bone, double isovalue, const SessionOptions& options, const Posed& start);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  // Window thread.
  void wish(const HandWish& wish) noexcept { wishes_.post(wish); }
  /// The same for a hand that is set elsewhere: the drill passes bone on its way. A device's own hand stays where it
  /// is.
  void carry(const HandWish& wish) noexcept;
  /// Returns the latest tick's view.
  [[nodiscard]] const TickView& view() noexcept;
  [[nodiscard]] const History& history() const noexcept { return history_; }
  /// What is heard of the last tick, for the sound's thread.
  [[nodiscard]] trephine::Mailbox<trephine::CuttingSoundState>& heard() noexcept { return heard_; }
  /// Takes what the sliders show; a drill that is made later has it too. Throws std::invalid_argument.
  void tune(const Tuning& tuning);
  /// The turning burr's way since the last look; only with structures.
  [[nodiscard]] BurrPath& path() noexcept { return path_; }
  /// Takes another protection at the next tick; the guard's force fades in or out.
  void protect(Protection protection);
  [[nodiscard]] const SessionOptions& options() const noexcept { return options_; }
  /// Takes other settings; the loop starts again with a ramp. A tool that does not fit where the drill is passes bone
  /// until it is out (`PassingDrill`), as it does where bone is put back around it. Throws std::invalid_argument, and
  /// then all stays.
  void change(const SessionOptions& options);
  /// Puts the whole bone back, and mends soft structures.
  void restore();
  /// Puts the bone back to what it was, and the volume removed; soft structures are whole again.
  void bring_back(PastBone past);
  /// Returns what the loop last said of itself: device, priority, warnings; or why it ended.
  [[nodiscard]] std::string report() const;
  /// Ticks on the calling thread, as fast as it can, in simulated time, until `after_tick` returns false of a time [s].
  /// The device is the simulated one. Only where the options say so; throws std::exception as the loop.
  void simulate(std::function<bool(double time)> after_tick);
  /// Ends the loop and returns how long its ticks took in the scene [s].
  [[nodiscard]] trephine::TimeSummary end();
  [[nodiscard]] bool failed() const noexcept { return failed_.load(std::memory_order_acquire); }

 private:
  void run();
  template <class Pacing, class Device>
  void run_on(Device& device);
  void run_on_opened();
  template <class Pacing, class Loop, class Ends, class Observe>
  trephine::RunReport run_both(Loop& loop, const Ends& ends, const Observe& observe);
  void command(std::function<void()> work);
  void say(const std::string& text);

  drill::Grid& bone_;
  double isovalue_;
  SessionOptions options_;  // of the window
  Posed start_;
  Inboxes inboxes_;
  trephine::Mailbox<HandWish> wishes_;
  bool follows_wishes_ = true;  // what the mouse wishes is where the hand goes
  trephine::Mailbox<TickView> views_;
  trephine::Mailbox<trephine::CuttingSoundState> heard_;
  TickView view_;
  History history_;
  BurrPath path_;

  // The haptic thread's, and its commands'.
  SessionOptions running_;
  trephine::Registration registration_;
  trephine::Registration wished_;   // of the user's axes about the device's middle: where the mouse's hand is
  Posed X_DH_ = Posed::Identity();  // at the last tick
  TickView view_in_tick_;           // of the next post
  PassingDrill drill_;
  std::unique_ptr<SecondHand> second_;  // nothing if there is none
  HeardDrill heard_drill_;
  double removed_mm3_ = 0;
  StructureReport closest_{};
  double most_push_N_ = 0;
  std::uint64_t missed_ = 0;
  std::uint64_t ticks_ = 0;
  trephine::TimeHistogram tick_time_;

  mutable std::mutex between_;  // commands and report; the loop never takes it while it ticks
  std::vector<std::function<void()>> commands_;
  std::string report_;
  std::atomic<bool> pending_{false};
  std::atomic<bool> over_{false};
  std::atomic<bool> failed_{false};
  std::function<bool(double)> after_tick_;  // in simulated time
  std::thread thread_;
};

}  // namespace live
