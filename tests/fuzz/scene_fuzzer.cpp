// SPDX-License-Identifier: MIT
// For libFuzzer: clang++ -fsanitize=fuzzer,address,undefined. `.ci/run fuzz` builds and runs it for a minute.
#include "drive.hpp"
#include "read_session.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static_cast<void>(trephine::fuzz::drive({data, size}));
  trephine::fuzz::read_session({data, size});
  return 0;
}
