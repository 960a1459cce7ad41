// SPDX-License-Identifier: MIT
#include "structure/label_shapes.hpp"

#include <trephine/structure/build_structure_field.hpp>

#include <doctest/doctest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <thread>

using namespace trephine;
using namespace trephine::test;

TEST_CASE("Four threads build a field while another one watches and cancels, and several read it") {
  constexpr unsigned kSeed = 28;
  Random rng(kSeed);
  Labels labels({48, 44, 40}, Vec3d::Constant(3e-4));
  for (int s = 0; s < 5; ++s)
    labels.fill(random_shape(s, 0.5 * labels.end() + rng.arrow(1e-3, 4e-3), 2e-4, rng).distance, s + 1);
  int cancelled = 0, finished = 0;
  // Cancels later and later, until a build ends before.
  for (int wait = 0; finished == 0; wait = 2 * wait + 1) {
    BuildProgress progress;
    std::atomic<bool> ended{false};
    bool falls = false;
    std::thread watcher([&] {
      float before = 0;
      const auto until = std::chrono::steady_clock::now() + std::chrono::milliseconds(wait);
      while (!ended && std::chrono::steady_clock::now() < until) {
        const float done = progress.done;
        falls = falls || done < before || done > 1;
        before = done;
        std::this_thread::yield();
      }
      progress.cancel = true;
    });
    const std::unique_ptr<const StructureField> field = build_structure_field(labels.view(), {.threads = 4}, &progress);
    ended = true;
    watcher.join();
    CHECK_FALSE(falls);
    if (field == nullptr) {
      ++cancelled;
      continue;
    }
    ++finished;
    CHECK(progress.done == 1.0F);
    std::atomic<int> near{0};
    const auto read = [&](unsigned seed) {
      Random points(seed);
      for (int n = 0; n < 2000; ++n) {
        const Vec3d p = labels.end().cwiseProduct(Vec3d{points.uniform(), points.uniform(), points.uniform()});
        if (field->nearest(p).distance < 1e-3 && field->distance(0, p) < 1e-3) ++near;
      }
    };
    std::thread other(read, 1U);
    read(2U);
    other.join();
    CHECK(near > 0);
  }
  CHECK(cancelled > 0);
}
