// SPDX-License-Identifier: MIT
#include "support/malloc_hook.hpp"

#include <doctest/doctest.h>

#include <cstdio>

int main(int argc, char** argv) {
  if (!trephine::test::AllocationGuard::available())
    std::puts("Heap calls are not counted in this build (sanitizer or other C library): those checks pass unseen.");
  doctest::Context context(argc, argv);
  return context.run();
}
