// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

#include <atomic>
#include <type_traits>

/// Atomic access to plain memory that threads share. A single thread, the haptic thread, writes voxels and versions
/// with `store_relaxed` and `store_release`, and may read its own data plainly. Every other thread reads only through
/// `load_relaxed` and `load_acquire`. A version stored with release after the voxels makes them visible to each thread
/// that loads this version with acquire. A single writer needs no read-modify-write: every access is wait-free.
namespace trephine::inline TREPHINE_ALIGNED {

#if defined(__cpp_lib_atomic_ref)

template <class T>
[[nodiscard]] T load_relaxed(const T& x) noexcept {
  return std::atomic_ref<T>(const_cast<T&>(x)).load(std::memory_order_relaxed);
}
template <class T>
[[nodiscard]] T load_acquire(const T& x) noexcept {
  return std::atomic_ref<T>(const_cast<T&>(x)).load(std::memory_order_acquire);
}
template <class T>
void store_relaxed(T& x, std::type_identity_t<T> v) noexcept {
  std::atomic_ref<T>(x).store(v, std::memory_order_relaxed);
}
template <class T>
void store_release(T& x, std::type_identity_t<T> v) noexcept {
  std::atomic_ref<T>(x).store(v, std::memory_order_release);
}

#else  // libraries without std::atomic_ref (libc++ before 19) use the compiler's built-ins

template <class T>
[[nodiscard]] T load_relaxed(const T& x) noexcept {
  T v;
  __atomic_load(&x, &v, __ATOMIC_RELAXED);
  return v;
}
template <class T>
[[nodiscard]] T load_acquire(const T& x) noexcept {
  T v;
  __atomic_load(&x, &v, __ATOMIC_ACQUIRE);
  return v;
}
template <class T>
void store_relaxed(T& x, std::type_identity_t<T> v) noexcept {
  __atomic_store(&x, &v, __ATOMIC_RELAXED);
}
template <class T>
void store_release(T& x, std::type_identity_t<T> v) noexcept {
  __atomic_store(&x, &v, __ATOMIC_RELEASE);
}

#endif

}  // namespace trephine
