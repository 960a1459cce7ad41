// SPDX-License-Identifier: MIT
#include "simulate.hpp"

#include <algorithm>
#include <utility>

namespace live {

Simulated simulate(Loaded loaded, const LiveOptions& options, std::vector<Event> events) {
  constexpr double kFrame = 1.0 / 60;  // [s]
  Workbench bench(std::move(loaded), options, Showing::kSimulated);
  Playback playback(std::move(events), Playback::End::kProgram);
  int width = options.width, height = options.height;
  double next = 0, most_second_N = 0;
  bench.session().simulate([&](double time) {
    if (time < next) return true;
    next += kFrame;
    bench.update(kFrame, width, height);
    most_second_N = std::max(most_second_N, bench.view().second_N);
    return playback.play(time, [&](const Event& e) {
      if (e.kind == Event::Kind::kSize) {
        width = static_cast<int>(e.numbers[0]);
        height = static_cast<int>(e.numbers[1]);
      }
      bench.apply(e);
    });
  });
  const TickView& last = bench.session().view();
  return {.removed_mm3 = last.removed_mm3,
          .force = last.wrench.force,
          .ticks = last.tick,
          .most_second_N = most_second_N,
          .tick_us_median = 1e6 * bench.session().end().p50};
}

}  // namespace live
