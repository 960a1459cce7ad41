// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

/// Counts what a thread takes from the heap. The C functions are hooked, not only operator new: Eigen's aligned buffers
/// come from malloc. Where the hook cannot be (sanitizers bring their own allocator, other C libraries than glibc),
/// `available()` is false and every count stays 0.
namespace trephine::test {

/// Allocations and frees of the present thread while the guard lives. Guards may nest.
///
///     const AllocationGuard guard;
///     scene.tick(input, dt);
///     const auto allocations = guard.allocations();  // before the CHECK, which itself allocates
///     CHECK(allocations == 0);
class AllocationGuard {
 public:
  AllocationGuard() noexcept;
  AllocationGuard(const AllocationGuard&) = delete;
  AllocationGuard& operator=(const AllocationGuard&) = delete;

  [[nodiscard]] static bool available() noexcept;

  /// Calls of malloc, calloc, realloc, memalign, posix_memalign, aligned_alloc (and so of new) since construction.
  [[nodiscard]] std::int64_t allocations() const noexcept;
  /// Calls of free (and so of delete) with memory since construction.
  [[nodiscard]] std::int64_t frees() const noexcept;

 private:
  std::int64_t allocations_before_;
  std::int64_t frees_before_;
};

/// Allocations and frees that calling `f` costs this thread.
template <class F>
[[nodiscard]] std::int64_t heap_calls(F&& f) {
  const AllocationGuard guard;
  f();
  return guard.allocations() + guard.frees();
}

}  // namespace trephine::test
