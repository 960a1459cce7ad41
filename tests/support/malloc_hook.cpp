// SPDX-License-Identifier: MIT
#include "malloc_hook.hpp"

#include <cerrno>
#include <cstddef>
#include <cstdlib>

// Which allocator there is can only be asked of the preprocessor, and functions cannot be defined conditionally without
// it.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define TREPHINE_TEST_SANITIZER 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define TREPHINE_TEST_SANITIZER 1
#endif
#endif
#if defined(__GLIBC__) && !defined(TREPHINE_TEST_SANITIZER)
#define TREPHINE_TEST_HOOK 1
#endif

namespace trephine::test {
namespace {

// Constant-initialised and of the executable itself: access to them never allocates, even in a thread's first call.
constinit thread_local std::int64_t allocation_count = 0;
constinit thread_local std::int64_t free_count = 0;

}  // namespace

bool AllocationGuard::available() noexcept {
#ifdef TREPHINE_TEST_HOOK
  return true;
#else
  return false;
#endif
}

AllocationGuard::AllocationGuard() noexcept : allocations_before_(allocation_count), frees_before_(free_count) {}
std::int64_t AllocationGuard::allocations() const noexcept { return allocation_count - allocations_before_; }
std::int64_t AllocationGuard::frees() const noexcept { return free_count - frees_before_; }

}  // namespace trephine::test

#ifdef TREPHINE_TEST_HOOK

// glibc's own functions under their second names. An executable's definitions of malloc and its kin replace the
// library's for every caller, the C++ runtime included.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* memory);

void* malloc(std::size_t size) {
  ++trephine::test::allocation_count;
  return __libc_malloc(size);
}

void* calloc(std::size_t count, std::size_t size) {
  ++trephine::test::allocation_count;
  return __libc_calloc(count, size);
}

void* realloc(void* memory, std::size_t size) {
  ++trephine::test::allocation_count;
  return __libc_realloc(memory, size);
}

void* memalign(std::size_t alignment, std::size_t size) {
  ++trephine::test::allocation_count;
  return __libc_memalign(alignment, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++trephine::test::allocation_count;
  return __libc_memalign(alignment, size);
}

int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  ++trephine::test::allocation_count;
  if (alignment % sizeof(void*) != 0 || alignment == 0 || (alignment & (alignment - 1)) != 0) return EINVAL;
  void* got = __libc_memalign(alignment, size);
  if (got == nullptr) return ENOMEM;
  *memory = got;
  return 0;
}

void free(void* memory) {
  if (memory != nullptr) ++trephine::test::free_count;
  __libc_free(memory);
}
}  // extern "C"

#endif
