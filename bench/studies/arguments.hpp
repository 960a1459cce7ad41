// SPDX-License-Identifier: MIT
#pragma once

#include <initializer_list>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

namespace trephine::bench {

/// Reads a program's command line: switches, options with a value, and, where `others` is given, words. False, and a
/// line on standard error, for anything else.
[[nodiscard]] inline bool read_arguments(int argc, char** argv, const char* program,
                                         std::initializer_list<std::pair<const char*, bool*>> switches,
                                         std::initializer_list<std::pair<const char*, std::string*>> options,
                                         std::vector<std::string>* others = nullptr) {
  for (int i = 1; i < argc; ++i) {
    const std::string a = argv[i];
    bool known = false;
    for (const auto& [name, on] : switches)
      if (a == name) *on = known = true;
    for (const auto& [name, value] : options)
      if (a == name && i + 1 < argc && !known) {
        *value = argv[++i];
        known = true;
      }
    if (known) continue;
    if (!others) {
      std::cerr << program << ": unknown argument " << a << '\n';
      return false;
    }
    others->push_back(a);
  }
  return true;
}

}  // namespace trephine::bench
