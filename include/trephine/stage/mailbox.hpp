// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace trephine::inline TREPHINE_ALIGNED {

/// A wait-free triple buffer that passes the latest value from one thread to another. It carries options from a user
/// interface to the haptic thread, or poses to a drawing thread (`Mailbox<Posed>`). A new value replaces an unread one.
///
/// Exactly one thread may post and exactly one may take. Neither waits, locks or allocates. Writer, reader and exchange
/// hold one slot each. One atomic byte stores the slot in the exchange and a flag for an unread value; each side swaps
/// its own slot with that slot.
template <class T>
class Mailbox {
  // A type without owned memory copies without allocation or lock. Trivial copyability would exclude Eigen's fixed
  // sizes.
  static_assert(
      std::is_trivially_destructible_v<T> && std::is_copy_assignable_v<T> && std::is_default_constructible_v<T>,
      "trephine::Mailbox: T must own nothing (trivially destructible), be copyable and default constructible");

 public:
  Mailbox() = default;  ///< empty
  Mailbox(const Mailbox&) = delete;
  Mailbox& operator=(const Mailbox&) = delete;

  /// Publishes a value; producer thread. If T has `validate()`, it is called first, on this thread, and may throw
  /// std::invalid_argument. So the reader receives valid values only.
  void post(const T& value) noexcept(!requires { value.validate(); }) {
    if constexpr (requires { value.validate(); }) value.validate();
    slots_[back_].value = value;
    back_ = exchange_.exchange(static_cast<std::uint8_t>(back_ | kNew), std::memory_order_acq_rel) & kIndex;
  }

  /// Returns the latest value if it was posted since the last call, else nullptr; consumer thread. The pointer is valid
  /// until the next call.
  [[nodiscard]] const T* take() noexcept {
    if ((exchange_.load(std::memory_order_relaxed) & kNew) == 0) return nullptr;
    front_ = exchange_.exchange(front_, std::memory_order_acq_rel) & kIndex;
    return &slots_[front_].value;
  }

 private:
  static_assert(std::atomic<std::uint8_t>::is_always_lock_free);
  static constexpr std::uint8_t kNew = 4;
  static constexpr std::uint8_t kIndex = 3;
  static constexpr std::size_t kCacheLine = 64;  // [bytes] keeps data of the two threads in separate lines
  struct alignas(kCacheLine) Slot {
    T value{};
  };

  std::array<Slot, 3> slots_{};
  alignas(kCacheLine) std::atomic<std::uint8_t> exchange_{1};
  alignas(kCacheLine) std::uint8_t back_ = 0;   // written by the producer
  alignas(kCacheLine) std::uint8_t front_ = 2;  // read by the consumer
};

}  // namespace trephine
