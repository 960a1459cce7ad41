// SPDX-License-Identifier: MIT
#include "pick_options.hpp"

#include "pick_text.hpp"

#include <trephine/core/number.hpp>
#include <trephine/device/presets.hpp>
#include <trephine/tool/named_tools.hpp>

#include <array>
#include <cmath>
#include <optional>
#include <string_view>

namespace pick {
namespace {

double number(const std::string& given, double least, double most, const char* unit) {
  const std::optional<double> v = trephine::parse_number(given);
  if (!v) throw UsageError("'" + given + "' is not a number");
  if (*v < least || *v > most) throw UsageError("'" + given + text("' must be from %g to %g%s", least, most, unit));
  return *v;
}

double metres(const std::string& given) { return 1e-3 * number(given, 0.01, 1000, " mm"); }
double half_metres(const std::string& given) { return 0.5 * metres(given); }

/// The name, where the library takes it.
template <class Lookup>
std::string known(const std::string& given, const Lookup& lookup) {
  try {
    (void)lookup(given);
  } catch (const std::invalid_argument& e) {
    throw UsageError(e.what());
  }
  return given;
}

/// One row of the only list of options there is.
struct Entry {
  std::string_view name;
  const char* shown;  ///< its value, empty where it takes none
  const char* help;
  void (*take)(Options&, const std::string&);
};

constexpr std::array kEntries{
    Entry{"--skull", "DIR", "InVesalius project's folder with matrix.dat and main.plist",
          [](Options& o, const std::string& v) { o.skull = v; }},
    Entry{"--ct", "PATH", "CT volume: DICOM folder, NRRD, NIfTI or MetaImage (needs a build with ITK)",
          [](Options& o, const std::string& v) { o.ct = v; }},
    Entry{"--series", "N|UID", "which series of a DICOM folder that holds several",
          [](Options& o, const std::string& v) { o.series = v; }},
    Entry{"--isovalue", "V", "bone is where the density is at least V (skull and CT: 300 HU)",
          [](Options& o, const std::string& v) { o.isovalue = number(v, -1e9, 1e9, ""); }},
    Entry{"--largest-piece", "",
          "leave out what hangs apart from the largest piece of bone: a head rest (--skull: always)",
          [](Options& o, const std::string&) { o.largest_piece = true; }},
    Entry{"--tool", "NAME-MM", "a tool by name and diameter instead of a round burr: match-head-3, twist-3.2",
          [](Options& o, const std::string& v) { o.tool = known(v, trephine::tool_by_name); }},
    Entry{"--burr-diameter", "MM", "burr's diameter (six voxels, at least)",
          [](Options& o, const std::string& v) { o.tip_radius = half_metres(v); }},
    Entry{"--shaft-diameter", "MM", "shaft's diameter (0.53 of the burr's)",
          [](Options& o, const std::string& v) { o.shaft_radius = half_metres(v); }},
    Entry{"--shaft-length", "MM", "from the burr's centre (40)",
          [](Options& o, const std::string& v) { o.shaft_length = metres(v); }},
    Entry{"--device", "NAME", "a preset, for stiffness and limits; the list is below",
          [](Options& o, const std::string& v) { o.device = known(v, trephine::device_preset); }},
    Entry{"--stiffness", "N/M", "of the contact (800)",
          [](Options& o, const std::string& v) { o.stiffness = number(v, 1, 1e6, " N/m"); }},
    Entry{"--max-force", "N", "the device's limit (3.3)",
          [](Options& o, const std::string& v) { o.max_force = number(v, 0.1, 1000, " N"); }},
    Entry{"--max-torque", "NM", "the device's limit, 0: it gives none (0.1)",
          [](Options& o, const std::string& v) { o.max_torque = number(v, 0, 100, " N m"); }},
    Entry{"--budget", "US", "time a tick may take, in all but one of 1000 ticks [microseconds] (50)",
          [](Options& o, const std::string& v) { o.budget_us = number(v, 0.001, 1e6, " us"); }},
    Entry{"--rate", "HZ", "instead: the loop's rate, of whose period a tick may take half",
          [](Options& o, const std::string& v) { o.rate_Hz = number(v, 1, 1e6, " Hz"); }},
    Entry{"--force-error", "PERCENT", "95 % of the ticks are to be nearer to the truth than this (3.5)",
          [](Options& o, const std::string& v) { o.limits.force = 0.01 * number(v, 0.001, 100, " %"); }},
    Entry{"--direction-error", "DEG", "the same for the force's direction, 99 % (5)",
          [](Options& o, const std::string& v) { o.limits.direction_deg = number(v, 0.001, 180, " degrees"); }},
    Entry{"--torque-error", "PERCENT", "the same for torque, 95 % (6)",
          [](Options& o, const std::string& v) { o.limits.torque = 0.01 * number(v, 0.001, 100, " %"); }},
    Entry{"--algorithm", "line|surface|coupled|all", "what to choose from (all)",
          [](Options& o, const std::string& v) {
            std::vector<Algorithm> chosen;
            for (const Algorithm a : kAlgorithms)
              if (v == name_of(a) || v == "all") chosen.push_back(a);
            if (chosen.empty()) throw UsageError("'" + v + "' is none of line, surface, coupled, all");
            o.algorithms = chosen;
          }},
    Entry{"--seed", "N", "another seed tries other places on the bone (1)",
          [](Options& o, const std::string& v) { o.seed = static_cast<unsigned>(number(v, 0, 1e9, "")); }},
    Entry{"--quick", "", "fewer places and settings: a first look",
          [](Options& o, const std::string&) { o.quick = true; }},
    Entry{"--out", "DIR", "where settings.csv goes (build/report/pick_counts)",
          [](Options& o, const std::string& v) { o.out = v; }},
    Entry{"--help", "", "this text", [](Options& o, const std::string&) { o.help = true; }},
};

const Entry& entry_named(const std::string& name) {
  for (const Entry& e : kEntries)
    if (e.name == name || (name == "-h" && e.name == "--help")) return e;
  throw UsageError("unknown option '" + name + "'; --help lists what there is");
}

}  // namespace

Options parse_options(int argc, const char* const* argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  Options options;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const Entry& e = entry_named(arguments[i]);
    const std::string name(e.name);
    const bool takes = *e.shown != '\0';
    // Another option's name instead of a value means that the value was forgotten; "-5" is a number.
    if (takes && (i + 1 == arguments.size() || arguments[i + 1].starts_with("--")))
      throw UsageError(name + " needs " + e.shown + "; --help says more");
    try {
      e.take(options, takes ? arguments[++i] : std::string());
    } catch (const UsageError& error) {
      throw UsageError(name + ": " + error.what());
    }
  }
  if (!options.skull.empty() && !options.ct.empty()) throw UsageError("--skull and --ct: give one of them");
  if (!options.series.empty() && options.ct.empty()) throw UsageError("--series needs --ct with a DICOM folder");
  if (options.budget_us && options.rate_Hz) throw UsageError("--budget and --rate: give one of them");
  if (!options.tool.empty() && (options.tip_radius || options.shaft_radius || options.shaft_length))
    throw UsageError("--tool: its name says its measures; leave out those of a burr");
  if (!options.device.empty() && (options.stiffness || options.max_force || options.max_torque))
    throw UsageError("--device: its name says stiffness and limits; leave out --stiffness, --max-force, --max-torque");
  if (options.out.empty()) throw UsageError("--out: the folder's name is empty");
  return options;
}

std::string usage() {
  std::string all =
      "usage: pick_counts [options]\n"
      "Finds vertex, slice and step counts for your bone, tool, device and time: places the tool at many contacts on\n"
      "that bone, measures error against the finest setting and time for a grid of settings, and recommends the\n"
      "quickest that keeps to the limits, as code. Without --skull or --ct the bone is a built-in tooth phantom.\n\n";
  for (const Entry& e : kEntries) all += text("  %-32s %s\n", (std::string(e.name) + " " + e.shown).c_str(), e.help);
  all += "\nTools: a family and a diameter in mm:";
  for (const trephine::ToolFamily& f : trephine::kToolFamilies)
    all += text("%s%s-%s to %g", &f == trephine::kToolFamilies.data() ? " " : ",\n  ", std::string(f.name).c_str(),
                trephine::number_text(f.least).c_str(), f.most);
  all += "\nDevices:";
  for (const auto name : trephine::device_preset_names())
    all += (name == trephine::device_preset_names().front() ? " " : ", ") + std::string(name);
  return all +
         "\n\nThe limits' defaults are half of what people can just tell apart. Exit code: 0; 1 where results could "
         "not "
         "be\n"
         "written; 2 for a wrong argument or file; 3 where nothing keeps to limits and budget.\n";
}

}  // namespace pick
