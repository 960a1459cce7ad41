// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tolerances.hpp>
#include <trephine/device/device.hpp>
#include <trephine/device/device_match.hpp>
#include <trephine/device/pacing.hpp>
#include <trephine/device/ramp.hpp>
#include <trephine/device/realtime.hpp>
#include <trephine/device/registration.hpp>
#include <trephine/device/run_report.hpp>
#include <trephine/device/servo_options.hpp>
#include <trephine/device/stopwatch.hpp>
#include <trephine/device/tick_record.hpp>
#include <trephine/device/tickable_scene.hpp>

#include <atomic>
#include <chrono>
#include <concepts>
#include <exception>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace trephine {

/// Runs a scene on a haptic device: reads the handle, ticks the scene, writes the wrench, in the same tick. One loop
/// for polled devices, paced here at absolute times, and for self-paced ones, whose scheduler calls it.
///
/// What protects the hand:
/// - The wrench comes in over a ramp of `options.ramp` seconds after the start, after every status that asks for one
///   (`needs_ramp`), after a safety trip of the device, a non-finite wrench and a stall of the loop. The tick that
///   starts a ramp sends zero.
/// - While the device reports safety trips, zero is sent and the scene goes on ticking.
/// - A fault of the device ends the run. Every run, however it ends, ends with a read and a zero wrench (in a
///   self-paced device's last call). Exceptions of the observer, the condition or the simulated device end the run the
///   same way and are then thrown again to the caller of `run_for` / `run_until`; the scene's tick cannot throw.
/// - Force and torque are shortened to the device's capabilities at its reference point, whatever the scene's limits
///   about T allow, and are zero for axes that it does not have.
///
/// dt: the measured time between readings (or the device's own, where its state has one), clamped to
/// [kShortestDt, kLongestDt]; exactly the period with NoPacing and at the first tick.
///
/// A polled tick that ends after the next one was due goes on with the nearest point of the grid of periods, which is
/// at once or up to half a period later; each point that was due by then counts as a missed deadline.
///
/// The loop refers to device and scene, which must outlive it. It allocates nothing between the first tick and the
/// closing zero. Threads: `stop()` from any; everything else from one. A polled run ticks in the caller's thread, a
/// self-paced one in the device's, while the caller waits; observers and conditions run where the ticks do, after the
/// wrench has been committed, and must not allocate or wait either.
template <HapticDevice Device, TickableScene Scene, Pacing PacingPolicy = SleepPacing>
class ServoLoop {
  static_assert(PacingPolicy::kRealTime || AdvancedDevice<Device>,
                "NoPacing is for simulated devices, whose time the loop advances: real ones need a pacing policy");

 public:
  /// Throws std::invalid_argument on options out of range.
  ServoLoop(Device& device, Scene& scene, const Registration& registration, const ServoOptions& options = {},
            PacingPolicy pacing = {})
      : device_(device),
        scene_(scene),
        registration_(registration),
        options_(options),
        pacing_(std::move(pacing)),
        capabilities_(device.capabilities()),
        period_(1.0 / servo_rate(options, capabilities_)),
        ramp_(options.ramp),
        warnings_(match_device<Scene>(scene, capabilities_, registration, 1.0 / period_)) {}

  /// Sends a zero wrench once more if the last one could not be.
  ~ServoLoop() {
    if (wrench_out_) (void)device_.write(Wrenchd::zero());
  }
  ServoLoop(const ServoLoop&) = delete;
  ServoLoop& operator=(const ServoLoop&) = delete;

  /// Runs for a duration, to the nearest period; `observer(const TickRecord&)` is called after each tick. Throws
  /// std::invalid_argument on a negative duration.
  template <class Rep, class Period, std::invocable<const TickRecord&> Observer = NoObserver>
  RunReport run_for(std::chrono::duration<Rep, Period> duration, Observer&& observer = {}) {
    const double seconds = std::chrono::duration<double>(duration).count();
    if (!(seconds >= 0)) refuse("ServoLoop", "the duration must be >= 0 s", seconds);
    const auto never = [](const TickRecord&) { return false; };
    return run(seconds, never, observer);
  }

  /// Runs until `condition(const TickRecord&)` is true after a tick (the last one), `stop()`, or a fault.
  template <std::predicate<const TickRecord&> Condition, std::invocable<const TickRecord&> Observer = NoObserver>
  RunReport run_until(Condition&& condition, Observer&& observer = {}) {
    return run(std::numeric_limits<double>::infinity(), condition, observer);
  }

  /// Ends the run in progress before its next tick; without one, the next run ends at once. Any thread, wait-free.
  void stop() noexcept { stop_requested_.store(true, std::memory_order_release); }

  /// What does not fit between scene and device, in words; empty when all does. Known from construction.
  [[nodiscard]] const std::vector<std::string>& warnings() const noexcept { return warnings_; }
  [[nodiscard]] const DeviceCapabilities& capabilities() const noexcept { return capabilities_; }
  [[nodiscard]] const Registration& registration() const noexcept { return registration_; }
  /// [s]
  [[nodiscard]] double period() const noexcept { return period_; }

 private:
  using TimePoint = ServoClock::time_point;

  static double seconds(ServoClock::duration d) noexcept { return std::chrono::duration<double>(d).count(); }

  /// Everything that begins anew with a run; written by the thread that ticks, read by the caller after it has ended.
  struct Run {
    double duration = 0;
    RunReport report;
    TickRecord record;
    TimeHistogram tick_time, cpu_time, lateness;
    TimePoint began, last_reading;
    std::optional<double> last_device_time;
    std::exception_ptr thrown;
    bool ending = false;
    bool tripped = false;  // the last write reported a safety trip
    const char* reason = "";
  };

  template <class Condition, class Observer>
  RunReport run(double duration, Condition& condition, Observer& observer) {
    run_ = Run{};
    run_.duration = duration;
    ramp_.restart();
    run_.report.ramps = 1;
    if (duration < 0.5 * period_) end(RunEnd::kFinished, "the duration is over");
    run_.began = run_.last_reading = ServoClock::now();
    if constexpr (SelfPacedDevice<Device>) {
      run_self_paced(condition, observer);
    } else if constexpr (PacingPolicy::kRealTime) {
      const RealtimeScope scope(options_.realtime);
      run_.report.priority = scope.text();
      run_polled(condition, observer);
    } else {
      run_.report.priority = "simulated time, no real-time priority asked for";
      while (!over()) step(condition, observer);
      quiet();
    }
    return closing();
  }

  template <class Condition, class Observer>
  void run_polled(Condition& condition, Observer& observer) noexcept {
    const auto period = std::chrono::round<ServoClock::duration>(std::chrono::duration<double>(period_));
    TimePoint due = ServoClock::now();
    run_.began = run_.last_reading = due;
    while (!over()) {
      pacing_.wait_until(due);
      if (over()) break;  // stopped while it slept
      run_.lateness.add(seconds(ServoClock::now() - due));
      step(condition, observer);
      due += period;
      const ServoClock::duration behind = ServoClock::now() - due;
      if (behind < ServoClock::duration::zero()) continue;
      run_.report.missed_deadlines += static_cast<std::uint64_t>(behind / period) + 1;
      due += (behind + period / 2) / period * period;
    }
    quiet();
  }

  /// The caller's side of a self-paced run: start, wait, stop. A device that no longer calls is a fault.
  template <class Condition, class Observer>
  void run_self_paced(Condition& condition, Observer& observer) {
    struct Call {
      ServoLoop& loop;
      Condition& condition;
      Observer& observer;
    } call{*this, condition, observer};
    const ServoCallback on_tick = [](void* user) noexcept {
      auto& c = *static_cast<Call*>(user);
      return c.loop.called(c.condition, c.observer);
    };
    run_.report.priority = "the device's own thread, its priority is the driver's";
    closed_.store(false, std::memory_order_relaxed);
    calls_.store(0, std::memory_order_relaxed);
    const bool started = device_.start(on_tick, &call) != DeviceStatus::kFault;
    bool silent = false;
    std::uint64_t calls_seen = 0;
    TimePoint last_call = ServoClock::now();
    while (started && !silent && !closed_.load(std::memory_order_acquire)) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      const std::uint64_t calls = calls_.load(std::memory_order_relaxed);
      const TimePoint now = ServoClock::now();
      if (calls != calls_seen) last_call = now;
      calls_seen = calls;
      silent = seconds(now - last_call) > options_.callback_timeout;
    }
    device_.stop();
    if (!started) {
      run_.ending = false;
      end(RunEnd::kFault, "the device did not start");
      run_.report.zeroed = true;  // nothing was ever sent
      return;
    }
    if (silent && !closed_.load(std::memory_order_acquire)) {
      run_.report.end = RunEnd::kFault;
      run_.reason = "the device stopped calling";
      run_.report.wall_time = seconds(ServoClock::now() - run_.began);
    }
    if (!closed_.load(std::memory_order_acquire)) wrench_out_ = false;  // stop() took the force off
  }

  /// One call of a self-paced device, in its thread.
  template <class Condition, class Observer>
  bool called(Condition& condition, Observer& observer) noexcept {
    if (closed_.load(std::memory_order_relaxed)) return false;
    const TimePoint now = ServoClock::now();
    if (calls_.load(std::memory_order_relaxed) == 0) {
      run_.began = run_.last_reading = now;
    } else {
      const double late = seconds(now - run_.last_reading) - period_;
      run_.lateness.add(late);
      if (late > 0.5 * period_) run_.report.missed_deadlines += static_cast<std::uint64_t>(late / period_ + 0.5);
    }
    calls_.fetch_add(1, std::memory_order_relaxed);
    if (!over()) {
      step(condition, observer);
      return true;  // the closing zero needs a call of its own
    }
    quiet();
    closed_.store(true, std::memory_order_release);
    return false;
  }

  /// Whether the next tick is not to come.
  bool over() noexcept {
    if (stop_requested_.load(std::memory_order_acquire)) end(RunEnd::kStopped, "stop was called");
    return run_.ending;
  }

  /// One tick. Whatever goes wrong sets `run_.ending`; the closing zero follows from the caller.
  template <class Condition, class Observer>
  void step(Condition& condition, Observer& observer) noexcept {
    try {
      exchange();
      if (run_.record.read_status == DeviceStatus::kFault)
        return end(RunEnd::kFault, run_.report.ticks == 0
                                       ? "the device failed to read at its first tick: is it connected and opened?"
                                       : "the device failed to read");
      observer(std::as_const(run_.record));
      if (run_.record.write_status == DeviceStatus::kFault) return end(RunEnd::kFault, "the device failed to write");
      if (condition(std::as_const(run_.record))) end(RunEnd::kFinished, "the condition came true");
    } catch (...) {
      run_.thrown = std::current_exception();
      end(RunEnd::kStopped, "an exception");
    }
    const double done = PacingPolicy::kRealTime ? seconds(run_.last_reading - run_.began) + period_
                                                : static_cast<double>(run_.report.ticks) * period_;
    if (done >= run_.duration - 0.5 * period_) end(RunEnd::kFinished, "the duration is over");
  }

  /// Advance, read, tick, write. Throws what a simulated device's script throws.
  void exchange() {
    const bool first = run_.report.ticks == 0;
    TickRecord& record = run_.record;
    const TimePoint reading = PacingPolicy::kRealTime ? ServoClock::now() : TimePoint{};
    const double measured = first || !PacingPolicy::kRealTime ? period_ : seconds(reading - run_.last_reading);
    run_.last_reading = reading;
    if constexpr (AdvancedDevice<Device>) {
      if (!first) device_.advance(clamped(measured));
    }
    const Stopwatch watch(options_.measure);
    record.read_status = device_.read(record.state);
    if (record.read_status == DeviceStatus::kFault) {
      send(Wrenchd::zero());
      return;
    }
    const double interval = first ? period_ : device_interval(measured);
    run_.last_device_time = record.state.time;
    record.dt = clamped(interval);
    record.index = run_.report.ticks++;
    if (!first)
      record.time = PacingPolicy::kRealTime ? record.time + record.dt : static_cast<double>(record.index) * period_;
    run_.report.scene_time += record.dt;
    record.input = {.X_WT = registration_.tool_pose(record.state.X_DH),
                    .spindle_on = (record.state.buttons & options_.spindle_buttons) != 0};
    record.result = scene_.tick(record.input, record.dt);
    send(hand_wrench(interval));
    watch.stop(run_.tick_time, run_.cpu_time);
  }

  /// The scene's wrench as the hand may have it: ramped, at H in D axes, within the device's means.
  Wrenchd hand_wrench(double interval) noexcept {
    TickRecord& record = run_.record;
    const bool stalled = interval > options_.stall_time;
    const bool tripped = run_.tripped || record.read_status == DeviceStatus::kSafetyTrip;
    Wrenchd wrench = registration_.device_wrench(record.result.wrench, record.state.X_DH);
    const bool finite = is_finite(wrench);
    if (stalled) ++run_.report.stalls;
    if (tripped) ++run_.report.safety_trips;
    if (limit_to(capabilities_, wrench)) ++run_.report.limited;
    if (stalled || tripped || !finite || needs_ramp(record.result.status)) {
      if (ramp_.restart()) ++run_.report.ramps;
    } else if (record.index > 0) {
      ramp_.advance(record.dt);
    }
    record.ramp = ramp_.gain();
    if (!finite || !(record.ramp > 0)) return Wrenchd::zero();
    wrench *= record.ramp;  // after the limits: a clamped wrench must come in as gently as any other
    return wrench;
  }

  void send(const Wrenchd& wrench) noexcept {
    run_.record.sent = wrench;
    wrench_out_ = true;
    run_.record.write_status = device_.write(wrench);
    run_.tripped = run_.record.write_status == DeviceStatus::kSafetyTrip;
  }

  /// The closing tick: a reading, and zero whatever it says.
  void quiet() noexcept {
    DeviceState state;
    (void)device_.read(state);
    DeviceStatus status = device_.write(Wrenchd::zero());
    if (status == DeviceStatus::kFault) status = device_.write(Wrenchd::zero());
    wrench_out_ = status == DeviceStatus::kFault;
    run_.report.zeroed = !wrench_out_;
    run_.report.wall_time = seconds(ServoClock::now() - run_.began);
  }

  /// The first reason to end is the one reported.
  void end(RunEnd how, const char* reason) noexcept {
    if (run_.ending) return;
    run_.ending = true;
    run_.report.end = how;
    run_.reason = reason;
  }

  RunReport closing() {
    stop_requested_.store(false, std::memory_order_relaxed);
    if (run_.thrown) std::rethrow_exception(std::exchange(run_.thrown, nullptr));
    RunReport& report = run_.report;
    report.reason = run_.reason;
    if constexpr (requires {
                    { std::as_const(device_).fault_text() } -> std::convertible_to<std::string>;
                  }) {
      if (report.end == RunEnd::kFault) report.reason += ": " + std::string(std::as_const(device_).fault_text());
    }
    report.tick_time = run_.tick_time.summary();
    report.cpu_time = run_.cpu_time.summary();
    report.lateness = run_.lateness.summary();
    return report;
  }

  double device_interval(double measured) const noexcept {
    if (!run_.record.state.time || !run_.last_device_time) return measured;
    const double interval = *run_.record.state.time - *run_.last_device_time;
    return interval > 0 ? interval : measured;
  }

  static double clamped(double dt) noexcept {
    return dt > kShortestDt ? (dt < kLongestDt ? dt : kLongestDt) : kShortestDt;
  }

  Device& device_;
  Scene& scene_;
  Registration registration_;
  ServoOptions options_;
  [[no_unique_address]] PacingPolicy pacing_;
  DeviceCapabilities capabilities_;
  double period_;
  Ramp ramp_;
  std::vector<std::string> warnings_;
  Run run_;
  bool wrench_out_ = false;  // a wrench other than a confirmed zero may be on the hand
  std::atomic<bool> stop_requested_{false};
  std::atomic<bool> closed_{true};       // the self-paced device has had its last call
  std::atomic<std::uint64_t> calls_{0};  // of the self-paced device in this run
};

}  // namespace trephine
