// SPDX-License-Identifier: MIT
// The fuzzer's scenes and sessions from seeded random bytes: random_ticks [TICKS] [SEED]. For long runs under
// sanitizers.
#include "drive.hpp"
#include "read_session.hpp"

#include <random>

int main(int argc, char** argv) {
  const long wanted = argc > 1 ? std::atol(argv[1]) : 20000;
  const unsigned seed = argc > 2 ? static_cast<unsigned>(std::atol(argv[2])) : 20081;
  long ticks = 0, runs = 0;
  while (ticks < wanted) {
    // A seed of its own for each run, so that one that fails is found again alone.
    std::mt19937 random(seed + static_cast<unsigned>(runs));
    std::vector<std::uint8_t> bytes(256 + random() % 65536);
    for (auto& b : bytes) b = static_cast<std::uint8_t>(random() >> 11);
    std::fflush(stdout);
    ticks += trephine::fuzz::drive(bytes);
    trephine::fuzz::read_session(bytes);
    ++runs;
    if (runs % 500 == 0) std::printf("random_ticks: %ld ticks in %ld scenes\n", ticks, runs);
  }
  std::printf("random_ticks: %ld ticks in %ld scenes from seed %u: nothing found\n", ticks, runs, seed);
}
