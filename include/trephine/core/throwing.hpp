// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

#include <cstdio>
#include <cstdlib>
#include <string>

/// The places where exceptions are thrown and caught, for hosts that are compiled without (-fno-exceptions, as Unreal's
/// modules): there an error ends the program with its message.
namespace trephine::inline TREPHINE_ALIGNED {

/// Throws an Error; without exceptions, writes the message to the standard error stream and aborts.
template <class Error>
[[noreturn]] void throw_error(const std::string& message) {
#if defined(__cpp_exceptions) || defined(_CPPUNWIND)
  throw Error(message);
#else
  std::fprintf(stderr, "%s\n", message.c_str());
  std::abort();
#endif
}

/// Does the work, and calls `caught` within the handler of whatever it throws.
template <class Work, class Caught>
void catch_all(const Work& work, [[maybe_unused]] const Caught& caught) {
#if defined(__cpp_exceptions) || defined(_CPPUNWIND)
  try {
    work();
  } catch (...) {
    caught();
  }
#else
  work();
#endif
}

}  // namespace trephine
