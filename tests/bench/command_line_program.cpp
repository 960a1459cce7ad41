// SPDX-License-Identifier: MIT
// The least program with the benchmarks' command line.
#include "common/command_line.hpp"

int main(int argc, char** argv) {
  const trephine::bench::CommandLine line(argc, argv);
  return line.quick ? 0 : 1;
}
