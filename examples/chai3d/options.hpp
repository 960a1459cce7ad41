// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/number.hpp>

#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>
#include <string_view>

namespace chai3d_host {

/// The command line.
struct Options {
  bool help = false, simulated = false, headless = false;
  double seconds = 0;   ///< 0: until the window is closed, or Ctrl-C
  std::string picture;  ///< file of a picture at the end; empty: none
};

inline constexpr const char* kUsage =
    "usage: chai3d_drill [--simulated] [--headless] [--seconds S] [--picture FILE.png]\n"
    "Drills a dome of bone with CHAI3D's first device, or with a simulated hand. --headless shows no window.\n";

/// Throws std::invalid_argument.
inline Options parse_options(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string_view name = argv[i];
    const char* value = i + 1 < argc ? argv[i + 1] : "";
    if (name == "--help") {
      options.help = true;
    } else if (name == "--simulated") {
      options.simulated = true;
    } else if (name == "--headless") {
      options.headless = true;
    } else if (name == "--seconds" && ++i > 0) {
      options.seconds = trephine::parse_number(value).value_or(0);
      if (!(options.seconds > 0 && options.seconds <= 86400))
        throw std::invalid_argument("--seconds takes a number from 0 to 86400");
    } else if (name == "--picture" && ++i > 0) {
      options.picture = value;
      if (options.picture.empty()) throw std::invalid_argument("--picture takes the name of a file");
    } else {
      throw std::invalid_argument("unknown argument '" + std::string(name) + "', see --help");
    }
  }
  return options;
}

/// Runs a program with its options; its status is 2 for a wrong command line and 1 for any other failure.
template <class Run>
int guarded_main(int argc, char** argv, Run&& run) {
  try {
    const Options options = parse_options(argc, argv);
    if (!options.help) return run(options);
    std::fputs(kUsage, stdout);
    return 0;
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "chai3d_drill: %s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "chai3d_drill: %s\n", error.what());
    return 1;
  }
}

}  // namespace chai3d_host
