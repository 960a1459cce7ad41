// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/device/servo_loop.hpp>

#include <chrono>
#include <concepts>

namespace trephine::inline TREPHINE_ALIGNED {

/// What two hands did: a report for each.
struct TwoReports {
  RunReport first, second;
};

/// Runs two servo loops in one thread, for two hands on one bone: a drill and a suction tube, or two drills.
///
/// The order never changes: in each period the first hand's tick ends, then the second's begins. So the second finds
/// the bone as the first left it, and the first finds the second's cuts one period later. Both scenes may share a grid,
/// since one thread writes.
///
/// Each loop ramps, limits and reports for itself. If a device faults, or `stop()` of either loop is called, both runs
/// end in that period with a zero wrench. The first loop keeps the periods; its device may be self-paced, the second's
/// is polled. The second measures its own dt.
///
/// Both loops must outlive this. Threads: as `ServoLoop`.
template <class First, class Second>
class TwoHands {
 public:
  TwoHands(First& first, Second& second) noexcept : first_(first), second_(second) {}

  /// Runs for a duration. The observers are called after each hand's tick, as those of `ServoLoop`. Throws as
  /// `ServoLoop::run_for`; exceptions of either observer end both runs first.
  template <class Rep, class Period, std::invocable<const TickRecord&> FirstObserver = NoObserver,
            std::invocable<const TickRecord&> SecondObserver = NoObserver>
  TwoReports run_for(std::chrono::duration<Rep, Period> duration, FirstObserver&& observe_first = {},
                     SecondObserver&& observe_second = {}) {
    const double seconds = std::chrono::duration<double>(duration).count();
    if (!(seconds >= 0)) refuse("TwoHands", "the duration must be >= 0 s", seconds);
    if (seconds < 0.5 * first_.period()) return {first_.run_for(duration), second_.run_for(duration)};
    const double last = seconds - 1.5 * first_.period();  // the time of the last tick, to the nearest
    return run_until([last](const TickRecord& tick) { return tick.time >= last; }, observe_first, observe_second);
  }

  /// Runs until `condition(const TickRecord&)` is true after both ticks of a period; the record is the first hand's.
  template <std::predicate<const TickRecord&> Condition, std::invocable<const TickRecord&> FirstObserver = NoObserver,
            std::invocable<const TickRecord&> SecondObserver = NoObserver>
  TwoReports run_until(Condition&& condition, FirstObserver&& observe_first = {},
                       SecondObserver&& observe_second = {}) {
    TwoReports reports;
    bool second_ends = false;
    second_.begin();
    const auto both_ticked = [&](const TickRecord& tick) {
      second_ends = !second_.step(observe_second);
      return condition(tick) || second_ends;
    };
    const auto run_first = [&] { reports.first = first_.run_until(both_ticked, observe_first); };
    std::exception_ptr thrown;
    catch_all(run_first, [&] { thrown = std::current_exception(); });
    reports.second = second_.finish();
    if (thrown) std::rethrow_exception(thrown);
    if (second_ends) reports.first.reason = "the second hand ended";
    return reports;
  }

 private:
  First& first_;
  Second& second_;
};

}  // namespace trephine
