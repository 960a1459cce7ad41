// SPDX-License-Identifier: MIT
#include "malloc_hook.hpp"

#include <doctest/doctest.h>

#include <Eigen/Core>

#include <malloc.h>
#include <cstdlib>
#include <memory>
#include <thread>
#include <vector>

using trephine::test::AllocationGuard;
using trephine::test::heap_calls;

namespace {

// Through a volatile pointer, or the optimiser removes pairs of malloc and free.
void* volatile kept = nullptr;

void keep_and_free(void* memory) {
  kept = memory;
  std::free(kept);
}

struct alignas(64) Overaligned {
  double values[8];
};

}  // namespace

TEST_CASE("the allocation guard counts every way to the heap") {
  if (!AllocationGuard::available()) return;
  CHECK(heap_calls([] {}) == 0);
  CHECK(heap_calls([] { keep_and_free(std::malloc(100)); }) == 2);
  CHECK(heap_calls([] { keep_and_free(std::calloc(10, 10)); }) == 2);
  CHECK(heap_calls([] {
          kept = std::malloc(10);
          keep_and_free(std::realloc(kept, 100000));
        }) == 3);
  CHECK(heap_calls([] { keep_and_free(memalign(64, 128)); }) == 2);
  CHECK(heap_calls([] { keep_and_free(std::aligned_alloc(64, 128)); }) == 2);
  CHECK(heap_calls([] {
          void* memory = nullptr;
          CHECK_UNARY(posix_memalign(&memory, 64, 128) == 0);
          keep_and_free(memory);
        }) >= 2);
  CHECK(heap_calls([] {
          auto* p = new int[100];
          kept = p;
          delete[] p;
        }) == 2);
  CHECK(heap_calls([] {
          auto* p = new Overaligned;
          kept = p;
          CHECK_UNARY(reinterpret_cast<std::uintptr_t>(p) % 64 == 0);
          delete p;
        }) >= 2);
  CHECK(heap_calls([] { std::free(nullptr); }) == 0);
}

TEST_CASE("the allocation guard sees Eigen's own buffers, which escape operator new") {
  if (!AllocationGuard::available()) return;
  const auto calls = heap_calls([] {
    Eigen::VectorXd v = Eigen::VectorXd::Ones(100);
    kept = v.data();
  });
  CHECK(calls == 2);
  const auto fixed = heap_calls([] {
    Eigen::Matrix3d m = Eigen::Matrix3d::Identity();
    kept = m.data();
  });
  CHECK(fixed == 0);
}

TEST_CASE("allocation guards count their own thread and nest") {
  if (!AllocationGuard::available()) return;
  const AllocationGuard outer;
  keep_and_free(std::malloc(10));
  const AllocationGuard inner;
  keep_and_free(std::malloc(10));
  const auto inner_count = inner.allocations();
  const auto outer_count = outer.allocations();
  const auto outer_frees = outer.frees();
  CHECK(inner_count == 1);
  CHECK(outer_count == 2);
  CHECK(outer_frees == 2);

  std::int64_t of_the_other = -1;
  std::thread other([&of_the_other] {
    const AllocationGuard guard;
    for (int i = 0; i < 1000; ++i) keep_and_free(std::malloc(10));
    of_the_other = guard.allocations();
  });
  const AllocationGuard here;
  other.join();
  const auto here_count = here.allocations();
  CHECK(of_the_other == 1000);
  CHECK(here_count == 0);
}
