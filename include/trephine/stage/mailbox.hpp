// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace trephine {

/// One value on its way from one thread to another: options from a user interface to the haptic thread. A pose on its
/// way to the drawing thread (`Mailbox<Posed>`) takes one too. The latest value wins; unread ones are lost.
///
/// Exactly one thread may post and exactly one may take. Neither waits, locks or allocates: three slots, one each for
/// the writer, the reader and the exchange, and one atomic byte that says which slot lies in the exchange and whether
/// it is new. Each side swaps its slot with that one.
template <class T>
class Mailbox {
  // What owns nothing copies without memory or lock. Eigen's fixed sizes do, and are not trivially copyable.
  static_assert(
      std::is_trivially_destructible_v<T> && std::is_copy_assignable_v<T> && std::is_default_constructible_v<T>,
      "trephine::Mailbox: T must own nothing (trivially destructible), be copyable and default constructible");

 public:
  Mailbox() = default;  ///< empty
  Mailbox(const Mailbox&) = delete;
  Mailbox& operator=(const Mailbox&) = delete;

  /// Producer. Where T has `validate()`, that is called first, here, on the producer's thread, and may throw
  /// std::invalid_argument: the reader only ever sees valid values.
  void post(const T& value) noexcept(!requires { value.validate(); }) {
    if constexpr (requires { value.validate(); }) value.validate();
    slots_[back_].value = value;
    back_ = exchange_.exchange(static_cast<std::uint8_t>(back_ | kNew), std::memory_order_acq_rel) & kIndex;
  }

  /// Consumer: the latest value if one came since the last call, else nullptr. Valid until the next call.
  [[nodiscard]] const T* take() noexcept {
    if ((exchange_.load(std::memory_order_relaxed) & kNew) == 0) return nullptr;
    front_ = exchange_.exchange(front_, std::memory_order_acq_rel) & kIndex;
    return &slots_[front_].value;
  }

 private:
  static_assert(std::atomic<std::uint8_t>::is_always_lock_free);
  static constexpr std::uint8_t kNew = 4;
  static constexpr std::uint8_t kIndex = 3;
  static constexpr std::size_t kCacheLine = 64;  // so that the two threads do not share lines needlessly
  struct alignas(kCacheLine) Slot {
    T value{};
  };

  std::array<Slot, 3> slots_{};
  alignas(kCacheLine) std::atomic<std::uint8_t> exchange_{1};
  alignas(kCacheLine) std::uint8_t back_ = 0;   // producer's
  alignas(kCacheLine) std::uint8_t front_ = 2;  // consumer's
};

}  // namespace trephine
