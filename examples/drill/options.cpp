// SPDX-License-Identifier: MIT
#include "options.hpp"

#include <trephine/core/number.hpp>
#include <trephine/tool/named_tools.hpp>

#include <array>
#include <cmath>
#include <cstdio>
#include <span>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace drill {
namespace {

using Values = std::span<const std::string>;

double number(const std::string& text, double least, double most, const char* unit) {
  const std::optional<double> v = trephine::parse_number(text);
  if (!v) throw UsageError("'" + text + "' is not a number");
  if (*v < least || *v > most) {
    std::array<char, 96> range{};
    std::snprintf(range.data(), range.size(), "must be from %g to %g%s", least, most, unit);
    throw UsageError("'" + text + "' " + range.data());
  }
  return *v;
}

int whole(const std::string& text, int least, int most) {
  const double v = number(text, least, most, "");
  if (v != std::floor(v)) throw UsageError("'" + text + "' is not a whole number");
  return static_cast<int>(v);
}

double metres(const std::string& text) { return 1e-3 * number(text, 0.01, 1000, " mm"); }
double half_metres(const std::string& text) { return 0.5 * metres(text); }

/// One row of the only list of options there is.
struct Entry {
  std::string_view name;
  std::size_t values;
  const char* shown;
  const char* help;
  void (*take)(Options&, Values);
};

constexpr std::array kEntries{
    Entry{"--skull", 1, "DIR", "InVesalius project's folder with matrix.dat and main.plist",
          [](Options& o, Values v) { o.skull = v[0]; }},
    Entry{"--ct", 1, "PATH", "CT volume: DICOM folder, NRRD, NIfTI or MetaImage (needs a build with ITK)",
          [](Options& o, Values v) { o.ct = v[0]; }},
    Entry{"--series", 1, "N|UID", "which series of a DICOM folder that holds several",
          [](Options& o, Values v) { o.series = v[0]; }},
    Entry{"--largest-piece", 0, "",
          "leave out what hangs apart from the largest piece of bone: a head rest (--skull: always)",
          [](Options& o, Values) { o.largest_piece = true; }},
    Entry{"--phantom", 1, "NAME",
          "tooth, or temporal: a temporal bone with structures (tooth, without --skull and --ct)",
          [](Options& o, Values v) {
            if (v[0] != "tooth" && v[0] != "temporal") throw UsageError("'" + v[0] + "' is none of tooth, temporal");
            o.phantom = v[0] == "tooth" ? Phantom::kTooth : Phantom::kTemporalBone;
          }},
    Entry{"--isovalue", 1, "V", "bone is where the density is at least V (skull and CT: 300 HU)",
          [](Options& o, Values v) { o.isovalue = number(v[0], -1e9, 1e9, ""); }},
    Entry{"--algorithm", 1, "NAME", "line, surface, coupled or all (all)",
          [](Options& o, Values v) {
            if (v[0] != "line" && v[0] != "surface" && v[0] != "coupled" && v[0] != "all")
              throw UsageError("'" + v[0] + "' is none of line, surface, coupled, all");
            const bool all = v[0] == "all";
            o.line = all || v[0] == "line";
            o.surface = all || v[0] == "surface";
            o.coupled = all || v[0] == "coupled";
          }},
    Entry{"--at", 3, "X Y Z", "drill at the bone nearest to this place [mm, from the first voxel; CT: patient's space]",
          [](Options& o, Values v) {
            trephine::Vec3d p;
            for (int a = 0; a < 3; ++a) p[a] = 1e-3 * number(v[static_cast<std::size_t>(a)], -1e5, 1e5, " mm");
            o.at = p;
          }},
    Entry{"--tool", 1, "NAME-MM", "a tool by name and diameter instead of a round burr: match-head-3, twist-3.2",
          [](Options& o, Values v) {
            try {
              (void)trephine::tool_by_name(v[0]);
            } catch (const std::invalid_argument& e) {
              throw UsageError(e.what());
            }
            o.tool = v[0];
          }},
    Entry{"--burr-diameter", 1, "MM", "burr's diameter (six voxels, at least)",
          [](Options& o, Values v) { o.tip_radius = half_metres(v[0]); }},
    Entry{"--shaft-diameter", 1, "MM", "shaft's diameter (0.53 of the burr's)",
          [](Options& o, Values v) { o.shaft_radius = half_metres(v[0]); }},
    Entry{"--shaft-length", 1, "MM", "from the burr's centre (40)",
          [](Options& o, Values v) { o.shaft_length = metres(v[0]); }},
    Entry{"--voxel", 1, "MM", "resample around the spot to this spacing, 0: as read (0.4 where it is coarser)",
          [](Options& o, Values v) { o.voxel = 1e-3 * number(v[0], 0, 10, " mm"); }},
    Entry{"--line-vertices", 1, "N", "Line: vertices along the shaft (50)",
          [](Options& o, Values v) { o.line_vertices = whole(v[0], 1, 100000); }},
    Entry{"--sphere-vertices", 1, "N", "Surface: vertices on the burr (260)",
          [](Options& o, Values v) { o.sphere_vertices = whole(v[0], 4, 100000); }},
    Entry{"--slices", 1, "N", "Surface: slices of the shaft (70)",
          [](Options& o, Values v) { o.slices = whole(v[0], 1, 10000); }},
    Entry{"--per-slice", 1, "N", "Surface: vertices on a slice (8)",
          [](Options& o, Values v) { o.per_slice = whole(v[0], 3, 1000); }},
    Entry{"--structures", 0, "", "only drill toward made structures, with nothing, a guard, and a guard and a veto",
          [](Options& o, Values) { o.structures = true; }},
    Entry{"--tools", 0, "", "only press three tools by name into the bone, without and with the cutting law",
          [](Options& o, Values) { o.tools = true; }},
    Entry{"--seconds", 1, "S", "simulated length of an algorithm's run (8)",
          [](Options& o, Values v) { o.seconds = number(v[0], 2, 600, " s"); }},
    Entry{"--real-time", 0, "", "keep pace with the clock instead of running as fast as possible",
          [](Options& o, Values) { o.real_time = true; }},
    Entry{"--out", 1, "DIR", "where logs, plots and pictures go (build/drill)",
          [](Options& o, Values v) { o.out = v[0]; }},
    Entry{"--no-pictures", 0, "", "leave out the pictures", [](Options& o, Values) { o.pictures = false; }},
    Entry{"--help", 0, "", "this text", [](Options& o, Values) { o.help = true; }},
};

const Entry& entry_named(const std::string& name) {
  for (const Entry& e : kEntries)
    if (e.name == name || (name == "-h" && e.name == "--help")) return e;
  throw UsageError("unknown option '" + name + "'; --help lists what there is");
}

}  // namespace

trephine::SurfaceCounts counts_of(const Options& options, const trephine::SurfaceCounts& own) {
  return {.sphere = options.sphere_vertices.value_or(own.sphere),
          .slices = options.slices.value_or(own.slices),
          .per_slice = options.per_slice.value_or(own.per_slice)};
}

Options parse_options(int argc, const char* const* argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  Options options;
  for (std::size_t i = 0; i < arguments.size();) {
    const Entry& e = entry_named(arguments[i++]);
    // Another option's name instead of a value means that the value was forgotten; "-5" is a number.
    std::size_t given = 0;
    while (given < e.values && i + given < arguments.size() && !arguments[i + given].starts_with("--")) ++given;
    const std::string name(e.name);
    if (given < e.values) throw UsageError(name + " needs " + e.shown + "; --help says more");
    try {
      e.take(options, Values(arguments).subspan(i, e.values));
    } catch (const UsageError& error) {
      throw UsageError(name + ": " + error.what());
    }
    i += e.values;
  }
  if (!options.skull.empty() && !options.ct.empty()) throw UsageError("--skull and --ct: give one of them");
  if (options.phantom && !(options.skull.empty() && options.ct.empty()))
    throw UsageError("--phantom: give it, or --skull, or --ct");
  if (!options.series.empty() && options.ct.empty()) throw UsageError("--series needs --ct with a DICOM folder");
  if (options.structures && options.tools) throw UsageError("--structures and --tools: give one of them");
  if (!options.tool.empty()) {
    if (options.tip_radius || options.shaft_radius || options.shaft_length)
      throw UsageError("--tool: its name says its measures; leave out those of a burr");
    if (options.structures) throw UsageError("--tool: --structures has a round burr");
    if (options.tools) throw UsageError("--tool: --tools has tools of its own");
  }
  if (options.out.empty()) throw UsageError("--out: the folder's name is empty");
  return options;
}

std::string usage() {
  std::string text =
      "usage: drill [options]\n"
      "Drills a hole into a CT volume with a simulated device, leans the shaft on its rim, turns and withdraws, once\n"
      "with each algorithm. Then it repeats the thesis' verification on a block, and presses three tools into the "
      "bone,\n"
      "without and with a law of cutting forces. Without --skull or --ct it drills a built-in tooth phantom.\n\n";
  for (const Entry& e : kEntries) {
    std::array<char, 160> line{};
    const std::string left = std::string(e.name) + " " + e.shown;
    std::snprintf(line.data(), line.size(), "  %-32s %s\n", left.c_str(), e.help);
    text += line.data();
  }
  return text;
}

}  // namespace drill
