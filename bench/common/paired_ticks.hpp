// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tick.hpp>
#include <trephine/device/pacing.hpp>

#include <cmath>
#include <cstdlib>
#include <vector>

namespace trephine::bench {

/// Times of a scene's ticks beside those of the same scene without a part, in the thread's own time [µs].
struct PairedTicks {
  std::vector<double> with{}, without{}, more{};

  /// Ticks both, in turn, so that neither is always the one that finds a cold cache. Times are kept if `keeps`.
  template <class With, class Without>
  void tick(With& one, Without& other, const TickInput& input, bool keeps) {
    double loaded, plain;
    first_ = !first_;
    if (first_) {
      loaded = took(one, input);
      plain = took(other, input);
    } else {
      plain = took(other, input);
      loaded = took(one, input);
    }
    if (!keeps) return;
    with.push_back(loaded);
    without.push_back(plain);
    more.push_back(loaded - plain);
  }

 private:
  template <class Scene>
  [[nodiscard]] static double took(Scene& scene, const TickInput& input) {
    const double begin = thread_cpu_time();
    const TickResult r = scene.tick(input, 1e-3);
    const double end = thread_cpu_time();
    if (!std::isfinite(r.wrench.force.x())) std::abort();
    return 1e6 * (end - begin);
  }

  bool first_ = false;
};

}  // namespace trephine::bench
