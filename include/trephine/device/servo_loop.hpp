// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/throwing.hpp>
#include <trephine/core/tolerances.hpp>
#include <trephine/device/device.hpp>
#include <trephine/device/device_match.hpp>
#include <trephine/device/leap.hpp>
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

namespace trephine::inline TREPHINE_ALIGNED {

/// Runs a scene on a haptic device: each tick reads the handle, ticks the scene and writes the wrench. The same loop
/// serves polled devices, which it paces at absolute times, and self-paced devices, whose scheduler calls it.
///
/// Protection of the hand:
/// - The wrench rises over a ramp of `options.ramp` seconds after the start. It also does so after a status that
///   requires it (`needs_ramp`; none of a jump where the scene bounds its wrench), a safety trip of the device, a
///   non-finite wrench, a stall of the loop, or a reading that no hand can have moved to (`leaps`). The tick that
///   starts a ramp sends zero.
/// - While the device reports safety trips, the loop sends zero and the scene continues to tick.
/// - A fault of the device ends the run. Every run ends with a read and a zero wrench, in a self-paced device's last
///   call. Exceptions of the observer, the condition or the simulated device end the run in the same way. The loop
///   then throws them again from `run_for` / `run_until`. The scene's tick cannot throw.
/// - Force and torque are limited to the device's capabilities at its reference point, also if the scene's limits
///   about T are wider. They are zero for axes that the device does not have.
///
/// dt is the measured time between readings, or the device's own if its state has a time, clamped to
/// [kShortestDt, kLongestDt]. It is exactly the period with NoPacing and at the first tick.
///
/// If a polled tick ends late, the next tick starts at the nearest multiple of the period: at once, or up to half a
/// period later. Each multiple that was due by then counts as a missed deadline.
///
/// Device and scene must outlive the loop. It allocates nothing between the first tick and the closing zero. Threads:
/// call `stop()` from any thread and everything else from a single thread. A polled run ticks in the caller's thread. A
/// self-paced run ticks in the device's thread while the caller waits. Observers and conditions run in the ticking
/// thread, after the wrench is committed, and must not allocate or wait.
template <HapticDevice Device, TickableScene Scene, Pacing PacingPolicy = SleepPacing>
class ServoLoop {
  static_assert(PacingPolicy::kRealTime || AdvancedDevice<Device>,
                "NoPacing is for simulated devices, whose time the loop advances: real ones need a pacing policy");

 public:
  /// Throws std::invalid_argument if an option is out of range.
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

  /// Sends a zero wrench again if the closing zero failed.
  ~ServoLoop() {
    if (wrench_may_act_) (void)device_.write(Wrenchd::zero());
  }
  ServoLoop(const ServoLoop&) = delete;
  ServoLoop& operator=(const ServoLoop&) = delete;

  /// Runs for a duration, rounded to periods, and calls `observer(const TickRecord&)` after each tick. Throws
  /// std::invalid_argument if the duration is negative.
  template <class Rep, class Period, std::invocable<const TickRecord&> Observer = NoObserver>
  RunReport run_for(std::chrono::duration<Rep, Period> duration, Observer&& observer = {}) {
    const double seconds = std::chrono::duration<double>(duration).count();
    if (!(seconds >= 0)) refuse("ServoLoop", "the duration must be >= 0 s", seconds);
    const auto never = [](const TickRecord&) { return false; };
    return run(seconds, never, observer);
  }

  /// Runs until `condition(const TickRecord&)` is true after a tick, which is the last, until `stop()`, or until a
  /// fault.
  template <std::predicate<const TickRecord&> Condition, std::invocable<const TickRecord&> Observer = NoObserver>
  RunReport run_until(Condition&& condition, Observer&& observer = {}) {
    return run(std::numeric_limits<double>::infinity(), condition, observer);
  }

  /// A run whose periods another loop keeps, for two hands in one thread (`TwoHands`): `begin`, then `step` once a
  /// period until it returns false, then `finish`, which sends the closing zero and reports. Polled devices only; as
  /// `run_until` in all else. `finish` throws what the observer threw.
  void begin() noexcept
    requires(!SelfPacedDevice<Device>)
  {
    begin_run(std::numeric_limits<double>::infinity());
    run_.report.priority = "the thread of another loop";
  }
  template <std::invocable<const TickRecord&> Observer = NoObserver>
  bool step(Observer&& observer = {}) noexcept
    requires(!SelfPacedDevice<Device>)
  {
    const auto never = [](const TickRecord&) { return false; };
    if (!is_over()) step_once(never, observer);
    return !run_.is_ending;
  }
  RunReport finish()
    requires(!SelfPacedDevice<Device>)
  {
    send_closing_zero();
    return finish_report();
  }

  /// Ends the present run before its next tick; without a present run, the next run ends at once. Any thread,
  /// wait-free.
  void stop() noexcept { stop_requested_.store(true, std::memory_order_release); }

  /// Returns the scene's warnings and one sentence for each mismatch between scene and device, found at construction.
  [[nodiscard]] const std::vector<std::string>& warnings() const noexcept { return warnings_; }
  [[nodiscard]] const DeviceCapabilities& capabilities() const noexcept { return capabilities_; }
  [[nodiscard]] const Registration& registration() const noexcept { return registration_; }
  /// Returns the loop's period [s].
  [[nodiscard]] double period() const noexcept { return period_; }

 private:
  using TimePoint = ServoClock::time_point;

  static double seconds(ServoClock::duration d) noexcept { return std::chrono::duration<double>(d).count(); }

  /// The state of one run. The ticking thread writes it; the caller reads it after the run.
  struct Run {
    double duration = 0;
    RunReport report;
    TickRecord record;
    TimeHistogram tick_time, cpu_time, lateness;
    TimePoint start, last_reading;
    std::optional<double> last_device_time;
    Vec3d last_p_DH = Vec3d::Zero();
    std::exception_ptr thrown;
    bool is_ending = false;
    bool tripped = false;  // the last write reported a safety trip
    const char* reason = "";
  };

  void begin_run(double duration) noexcept {
    run_ = Run{};
    run_.duration = duration;
    ramp_.restart();
    run_.report.ramps = 1;
    if (duration < 0.5 * period_) end(RunEnd::kFinished, "the duration is over");
    run_.start = run_.last_reading = ServoClock::now();
  }

  template <class Condition, class Observer>
  RunReport run(double duration, Condition& condition, Observer& observer) {
    begin_run(duration);
    if constexpr (SelfPacedDevice<Device>) {
      run_self_paced(condition, observer);
    } else if constexpr (PacingPolicy::kRealTime) {
      const RealtimeScope scope(options_.realtime);
      run_.report.priority = scope.text();
      run_polled(condition, observer);
    } else {
      run_.report.priority = "simulated time, no real-time priority requested";
      while (!is_over()) step_once(condition, observer);
      send_closing_zero();
    }
    return finish_report();
  }

  template <class Condition, class Observer>
  void run_polled(Condition& condition, Observer& observer) noexcept {
    const auto period = std::chrono::round<ServoClock::duration>(std::chrono::duration<double>(period_));
    TimePoint due = ServoClock::now();
    run_.start = run_.last_reading = due;
    while (!is_over()) {
      pacing_.wait_until(due);
      if (is_over()) break;  // `stop()` was called during the wait
      run_.lateness.add(seconds(ServoClock::now() - due));
      step_once(condition, observer);
      due += period;
      const ServoClock::duration behind = ServoClock::now() - due;
      if (behind < ServoClock::duration::zero()) continue;
      run_.report.missed_deadlines += static_cast<std::uint64_t>(behind / period) + 1;
      due += (behind + period / 2) / period * period;
    }
    send_closing_zero();
  }

  /// The caller's part of a self-paced run: starts the device, waits and stops it. A device that no longer calls is a
  /// fault.
  template <class Condition, class Observer>
  void run_self_paced(Condition& condition, Observer& observer) {
    struct Call {
      ServoLoop& loop;
      Condition& condition;
      Observer& observer;
    } call{*this, condition, observer};
    const ServoCallback on_tick = [](void* user) noexcept {
      auto& c = *static_cast<Call*>(user);
      return c.loop.on_device_call(c.condition, c.observer);
    };
    run_.report.priority = "the device's own thread, its priority is the driver's";
    closed_.store(false, std::memory_order_relaxed);
    calls_.store(0, std::memory_order_relaxed);
    const bool started = device_.start(on_tick, &call) != DeviceStatus::kFault;
    bool timed_out = false;
    std::uint64_t last_calls = 0;
    TimePoint last_call = ServoClock::now();
    while (started && !timed_out && !closed_.load(std::memory_order_acquire)) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));  // resolution of the timeout and of the end
      const std::uint64_t calls = calls_.load(std::memory_order_relaxed);
      const TimePoint now = ServoClock::now();
      if (calls != last_calls) last_call = now;
      last_calls = calls;
      timed_out = seconds(now - last_call) > options_.callback_timeout;
    }
    device_.stop();
    if (!started) {
      run_.is_ending = false;
      end(RunEnd::kFault, "the device did not start");
      run_.report.zeroed = true;  // no wrench was sent
      return;
    }
    if (timed_out && !closed_.load(std::memory_order_acquire)) {
      run_.report.end = RunEnd::kFault;
      run_.reason = "the device stopped calling";
      run_.report.wall_time = seconds(ServoClock::now() - run_.start);
    }
    if (!closed_.load(std::memory_order_acquire)) wrench_may_act_ = false;  // stop() removed the force
  }

  /// Handles a call of a self-paced device, in its thread.
  template <class Condition, class Observer>
  bool on_device_call(Condition& condition, Observer& observer) noexcept {
    if (closed_.load(std::memory_order_relaxed)) return false;
    const TimePoint now = ServoClock::now();
    if (calls_.load(std::memory_order_relaxed) == 0) {
      run_.start = run_.last_reading = now;
    } else {
      const double late = seconds(now - run_.last_reading) - period_;
      run_.lateness.add(late);
      if (late > 0.5 * period_) run_.report.missed_deadlines += static_cast<std::uint64_t>(late / period_ + 0.5);
    }
    calls_.fetch_add(1, std::memory_order_relaxed);
    if (!is_over()) {
      step_once(condition, observer);
      return true;  // the closing zero is sent by a call of its own
    }
    send_closing_zero();
    closed_.store(true, std::memory_order_release);
    return false;
  }

  /// Returns true if no further tick follows.
  bool is_over() noexcept {
    if (stop_requested_.load(std::memory_order_acquire)) end(RunEnd::kStopped, "stop was called");
    return run_.is_ending;
  }

  /// Runs one tick with observer and condition. Every failure sets `run_.is_ending`; the caller then sends the closing
  /// zero.
  template <class Condition, class Observer>
  void step_once(Condition& condition, Observer& observer) noexcept {
    const auto tick_and_observe = [&] {
      tick();
      if (run_.record.read_status == DeviceStatus::kFault)
        return end(RunEnd::kFault, run_.report.ticks == 0
                                       ? "the device failed to read at its first tick: is it connected and opened?"
                                       : "the device failed to read");
      observer(std::as_const(run_.record));
      if (run_.record.write_status == DeviceStatus::kFault) return end(RunEnd::kFault, "the device failed to write");
      if (condition(std::as_const(run_.record))) end(RunEnd::kFinished, "the condition is true");
    };
    catch_all(tick_and_observe, [&] {
      run_.thrown = std::current_exception();
      end(RunEnd::kStopped, "an exception");
    });
    const double done = PacingPolicy::kRealTime ? seconds(run_.last_reading - run_.start) + period_
                                                : static_cast<double>(run_.report.ticks) * period_;
    if (done >= run_.duration - 0.5 * period_) end(RunEnd::kFinished, "the duration is over");
  }

  /// Advances a simulated device, reads, ticks the scene and writes. Throws exceptions of a simulated device's script.
  void tick() {
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

  /// Returns the wrench for the device: the scene's wrench about H in D axes, limited to the device's range, then
  /// ramped.
  Wrenchd hand_wrench(double interval) noexcept {
    TickRecord& record = run_.record;
    const bool stalled = interval > options_.stall_time;
    const bool leapt = record.index > 0 && leaps(run_.last_p_DH, record.state.X_DH.translation(), interval);
    run_.last_p_DH = record.state.X_DH.translation();
    const bool tripped = run_.tripped || record.read_status == DeviceStatus::kSafetyTrip;
    Wrenchd wrench = registration_.device_wrench(record.result.wrench, record.state.X_DH);
    const bool finite = is_finite(wrench);
    if (stalled) ++run_.report.stalls;
    if (leapt) ++run_.report.leaps;
    if (tripped) ++run_.report.safety_trips;
    if (limit_to(capabilities_, wrench)) ++run_.report.limited;
    if (stalled || leapt || tripped || !finite || needs_ramp(std::as_const(scene_), record.result)) {
      if (ramp_.restart()) ++run_.report.ramps;
    } else if (record.index > 0) {
      ramp_.advance(record.dt);
    }
    record.ramp = ramp_.gain();
    if (!finite || !(record.ramp > 0)) return Wrenchd::zero();
    wrench *= record.ramp;  // after the limits, so that a limited wrench rises as slowly as any other
    return wrench;
  }

  void send(const Wrenchd& wrench) noexcept {
    run_.record.sent = wrench;
    wrench_may_act_ = true;
    run_.record.write_status = device_.write(wrench);
    run_.tripped = run_.record.write_status == DeviceStatus::kSafetyTrip;
  }

  /// The closing tick: one read, then a zero wrench for every status of the read. A failed write is tried again once.
  void send_closing_zero() noexcept {
    DeviceState state;
    (void)device_.read(state);
    DeviceStatus status = device_.write(Wrenchd::zero());
    if (status == DeviceStatus::kFault) status = device_.write(Wrenchd::zero());
    wrench_may_act_ = status == DeviceStatus::kFault;
    run_.report.zeroed = !wrench_may_act_;
    run_.report.wall_time = seconds(ServoClock::now() - run_.start);
  }

  /// Ends the run; the report gives the first reason.
  void end(RunEnd cause, const char* reason) noexcept {
    if (run_.is_ending) return;
    run_.is_ending = true;
    run_.report.end = cause;
    run_.reason = reason;
  }

  RunReport finish_report() {
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

  /// Returns the interval by the device's clock [s], or the measured interval if the device has none.
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
  bool wrench_may_act_ = false;  // the last write is no confirmed zero
  std::atomic<bool> stop_requested_{false};
  std::atomic<bool> closed_{true};       // the self-paced device's last call is done
  std::atomic<std::uint64_t> calls_{0};  // calls of the self-paced device in this run
};

}  // namespace trephine
