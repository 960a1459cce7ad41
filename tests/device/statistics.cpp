// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <trephine/device/pacing.hpp>
#include <trephine/device/statistics.hpp>
#include <trephine/device/stopwatch.hpp>

#include "support/near.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace {

using namespace trephine;
using test::near;

constexpr double kAccuracy = 1.0 / 128;  // what the histogram promises

TEST_CASE("time histogram: quantiles against sorted samples, never understated") {
  std::mt19937 engine(5);
  std::lognormal_distribution<double> spread(std::log(20e-6), 1.5);
  TimeHistogram histogram;
  std::vector<double> samples;
  double sum = 0;
  for (int i = 0; i < 50000; ++i) {
    const double t = spread(engine);
    histogram.add(t);
    samples.push_back(t);
    sum += t;
  }
  std::sort(samples.begin(), samples.end());
  for (const double q : {0.0, 0.1, 0.5, 0.9, 0.99, 0.999, 0.9999, 1.0}) {
    const auto rank = static_cast<std::size_t>(std::max(1.0, std::ceil(q * 50000))) - 1;
    const double exact = samples[rank], found = histogram.quantile(q);
    CAPTURE(q);
    CHECK(found >= exact - 0.5e-9);  // whole nanoseconds
    CHECK(found <= exact * (1 + kAccuracy) + 0.5e-9);
  }
  const TimeSummary s = histogram.summary();
  CHECK(s.count == 50000);
  CHECK(std::abs(s.max - samples.back()) <= 0.5e-9);
  CHECK(s.mean == near(sum / 50000, 1e-12));
  CHECK(s.p50 <= s.p99);
  CHECK(s.p99 <= s.p99_9);
  CHECK(s.p99_9 <= s.p99_99);
  CHECK(s.p99_99 <= s.max);
}

TEST_CASE("time histogram: of an odd number the median is the middle one") {
  TimeHistogram histogram;
  for (const double t : {10e-9, 20e-9, 30e-9}) histogram.add(t);
  CHECK(histogram.quantile(0.5) == near(20e-9));
}

TEST_CASE("time histogram: small whole nanoseconds are exact, the ends of the range are kept") {
  for (const int ns : {0, 1, 5, 127, 128, 255}) {
    TimeHistogram histogram;
    histogram.add(ns * 1e-9);
    histogram.add(1.0);
    CHECK(std::abs(histogram.quantile(0.5) - ns * 1e-9) < 1e-20);
    CHECK(histogram.max() == near(1.0));
  }
  TimeHistogram histogram;
  histogram.add(-1.0);
  histogram.add(std::numeric_limits<double>::quiet_NaN());
  CHECK(histogram.count() == 2);
  CHECK(histogram.max() == 0.0);
  histogram.add(std::numeric_limits<double>::infinity());
  histogram.add(1e9);
  CHECK(histogram.max() == near(1099.5, 3.1e-5));
  CHECK(histogram.quantile(1.0) == histogram.max());
  histogram.clear();
  CHECK(histogram.count() == 0);
  CHECK(histogram.summary().p99 == 0.0);
}

TEST_CASE("time histogram: one sample in ten thousand is p99.99, not p99.9") {
  TimeHistogram histogram;
  for (int i = 0; i < 9999; ++i) histogram.add(10e-6);
  histogram.add(5e-3);
  CHECK(histogram.summary().p99_9 < 11e-6);
  CHECK(histogram.summary().p99_99 < 11e-6);
  CHECK(histogram.summary().max == near(5e-3));
  histogram.add(5e-3);
  CHECK(histogram.summary().p99_99 == near(5e-3, kAccuracy));
}

TEST_CASE("pacing: an absolute sleep never ends early, and a past one returns") {
  const auto begin = ServoClock::now();
  const auto due = begin + std::chrono::milliseconds(3);
  SleepPacing{}.wait_until(due);
  CHECK(ServoClock::now() >= due);
  SleepSpinPacing{}.wait_until(due + std::chrono::milliseconds(3));
  CHECK(ServoClock::now() >= due + std::chrono::milliseconds(3));
  const auto before = ServoClock::now();
  for (int i = 0; i < 100; ++i) SleepPacing{}.wait_until(begin);
  for (int i = 0; i < 100; ++i) SleepSpinPacing{}.wait_until(begin);
  // 200 waits of a wrongly relative clock would take more than half a second.
  CHECK(ServoClock::now() - before < std::chrono::milliseconds(250));
}

TEST_CASE("pacing: sleeps at 1 kHz mostly end within their millisecond") {
  std::vector<double> late;
  auto due = ServoClock::now();
  for (int i = 0; i < 301; ++i) {
    due += std::chrono::milliseconds(1);
    SleepPacing{}.wait_until(due);
    late.push_back(std::chrono::duration<double>(ServoClock::now() - due).count());
  }
  std::sort(late.begin(), late.end());
  MESSAGE("late by " << 1e3 * late[150] << " ms in the median, " << 1e3 * late[297] << " ms at 99 %");
  CHECK(late[150] < 1e-3);
}

TEST_CASE("stopwatch: sleeping takes wall time and next to no processor time") {
  if (thread_cpu_time() < 0) return;
  TimeHistogram wall, cpu;
  const Stopwatch watch(true);
  sleep_until(ServoClock::now() + std::chrono::milliseconds(20));
  watch.stop(wall, cpu);
  CHECK(wall.max() >= 0.02);
  CHECK(cpu.max() < 0.01);
  const Stopwatch busy(true);
  const double enough = thread_cpu_time() + 0.01;
  while (thread_cpu_time() < enough) {
  }
  busy.stop(wall, cpu);
  CHECK(cpu.max() >= 0.0099);
  const Stopwatch off(false);
  off.stop(wall, cpu);
  CHECK(wall.count() == 2);
}

}  // namespace
