// SPDX-License-Identifier: MIT
#include <trephine/core/tick.hpp>
#include <trephine/stage/mailbox.hpp>

#include <doctest/doctest.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <thread>
#include <type_traits>

using trephine::Mailbox;
using trephine::Posed;

TEST_CASE("mailbox: across threads values come whole, in order, and the last one arrives") {
  struct Letter {
    std::array<std::uint64_t, 64> pages{};
  };
  constexpr std::uint64_t kLetters = 100000;
  Mailbox<Letter> box;
  std::atomic<bool> done{false};
  std::thread writer([&] {
    Letter letter;
    for (std::uint64_t i = 1; i <= kLetters; ++i) {
      letter.pages.fill(i);
      box.post(letter);
      if (i % 16 == 0) std::this_thread::yield();
    }
    done.store(true, std::memory_order_release);
  });
  std::uint64_t last = 0;
  std::uint64_t torn = 0;
  std::uint64_t backwards = 0;
  const auto read = [&] {
    const Letter* letter = box.take();
    if (letter == nullptr) return false;
    for (const std::uint64_t page : letter->pages) torn += page != letter->pages[0] ? 1 : 0;
    backwards += letter->pages[0] <= last ? 1 : 0;
    last = letter->pages[0];
    return true;
  };
  while (!done.load(std::memory_order_acquire))
    if (!read()) std::this_thread::yield();
  (void)read();
  writer.join();
  CHECK(torn == 0);
  CHECK(backwards == 0);
  CHECK(last == kLetters);
  CHECK(box.take() == nullptr);
}

TEST_CASE("mailbox: poses and what a tick answers come whole") {
  static_assert(std::is_default_constructible_v<Mailbox<trephine::TickResult>>);
  constexpr int kPoses = 100000;
  Mailbox<Posed> box;
  std::atomic<bool> done{false};
  std::thread haptic([&] {
    Posed X = Posed::Identity();
    for (int i = 1; i <= kPoses; ++i) {
      X.matrix().topRows<3>().setConstant(i);
      box.post(X);
      if (i % 16 == 0) std::this_thread::yield();
    }
    done.store(true, std::memory_order_release);
  });
  double last = 0;
  int torn = 0;
  const auto read = [&] {
    const Posed* X = box.take();
    if (X == nullptr) return;
    last = X->matrix()(0, 0);
    torn += (X->matrix().topRows<3>().array() == last).all() ? 0 : 1;
  };
  while (!done.load(std::memory_order_acquire)) read();
  read();
  haptic.join();
  CHECK(torn == 0);
  CHECK(last == kPoses);
}
