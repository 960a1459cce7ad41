// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/tool/counts.hpp>

#include <optional>
#include <stdexcept>
#include <string>

namespace drill {

/// A wrong argument, in one line.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Bone made of formulas.
enum class Phantom { kTooth, kTemporalBone };

/// The command line. Lengths in SI units; unset ones are chosen to fit the volume.
struct Options {
  bool help = false;
  std::string skull;   ///< folder with matrix.dat and main.plist
  std::string ct;      ///< file or DICOM folder
  std::string series;  ///< of a DICOM folder: UID or number
  std::optional<Phantom> phantom;
  std::optional<double> isovalue;
  bool largest_piece = false;  ///< leave out what hangs apart from the largest piece of bone; always done for `skull`
  bool line = true;
  bool surface = true;
  bool coupled = true;
  std::optional<trephine::Vec3d> at;                             ///< where to drill, in the volume's world [m]
  std::optional<double> tip_radius, shaft_radius, shaft_length;  // [m]
  std::string tool;                                              ///< as `trephine::tool_by_name`; empty: a burr
  std::optional<double> voxel;                                   // around the spot [m]; 0: as read
  int line_vertices = 50;
  std::optional<int> sphere_vertices, slices, per_slice;
  bool structures = false;  ///< only the part with labelled structures
  bool tools = false;       ///< only the part with tools by name
  double seconds = 8;
  bool real_time = false;
  std::string out = "build/drill";
  bool pictures = true;
};

/// What the command line says of the counts, and the algorithm's own for the rest.
[[nodiscard]] trephine::SurfaceCounts counts_of(const Options& options, const trephine::SurfaceCounts& own);

/// Throws UsageError with one clear line.
[[nodiscard]] Options parse_options(int argc, const char* const* argv);
/// What --help prints.
[[nodiscard]] std::string usage();

}  // namespace drill
