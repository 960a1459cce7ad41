// SPDX-License-Identifier: MIT
// Compiled without exceptions: a refusal ends the program with its message.
#include <trephine/tool/named_tools.hpp>

#include <csignal>
#include <cstdio>
#include <cstdlib>

int main() {
  if (trephine::tool_by_name("round-3").edges.flutes != 8) return 1;
  std::signal(SIGABRT, [](int) {
    std::fputs("aborted\n", stderr);
    std::_Exit(0);
  });
  (void)trephine::tool_by_name("ball-3");
  return 1;
}
