// SPDX-License-Identifier: MIT
#pragma once

#include <stdexcept>
#include <string>

namespace openhaptics {

/// A wrong argument, in one line.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

enum class Algorithm { kLine, kSurface, kCoupled };

struct Arguments {
  bool help = false;
  std::string skull;   ///< folder with matrix.dat and main.plist; empty: the tooth phantom
  std::string device;  ///< as set up in the driver; empty: its default device
  double seconds = 0;  ///< 0: until Ctrl-C
  double scale = 1;    ///< how far the drill moves for a metre of the hand
  Algorithm algorithm = Algorithm::kLine;
  std::string tool;  ///< name as `trephine::tool_by_name`; empty: a round burr
};

/// Throws UsageError with one clear line.
[[nodiscard]] Arguments parse_arguments(int argc, const char* const* argv);
/// As the command line has it.
[[nodiscard]] const char* name_of(Algorithm algorithm);
/// What --help prints.
[[nodiscard]] std::string usage();

}  // namespace openhaptics
