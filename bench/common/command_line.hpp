// SPDX-License-Identifier: MIT
#pragma once

#include "../../examples/drill/writable.hpp"

#include <cstdlib>
#include <exception>
#include <initializer_list>
#include <iostream>
#include <string>
#include <utility>

namespace trephine::bench {

/// Reads a program's command line: --quick, --out DIR (made if missing) and further switches and options. Anything
/// else, and a folder that cannot be written, ends the program with a line on standard error and exit code 2.
struct CommandLine {
  bool quick = false;
  std::string folder = "build/report";

  CommandLine(int argc, char** argv, std::initializer_list<std::pair<const char*, std::string*>> options = {},
              std::initializer_list<std::pair<const char*, bool*>> switches = {}) {
    const auto take = [](const auto& known, const std::string& name, const auto& set) {
      for (const auto& [called, target] : known)
        if (name == called) return set(*target), true;
      return false;
    };
    for (int i = 1; i < argc; ++i) {
      const std::string name = argv[i];
      const auto on = [](bool& b) { b = true; };
      const auto value = [&](std::string& s) { s = argv[++i]; };
      if (name == "--quick") {
        quick = true;
      } else if (name == "--out" && i + 1 < argc) {
        value(folder);
      } else if (!take(switches, name, on) && !(i + 1 < argc && take(options, name, value))) {
        std::cerr << argv[0] << ": unknown argument " << name << '\n';
        std::exit(2);
      }
    }
    try {
      drill::require_writable_folder("--out", folder);
    } catch (const std::exception& error) {
      std::cerr << argv[0] << ": " << error.what() << '\n';
      std::exit(2);
    }
  }
};

}  // namespace trephine::bench
