// SPDX-License-Identifier: MIT
#include <trephine/stage/mailbox.hpp>

#include <doctest/doctest.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <thread>

using trephine::Mailbox;

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
