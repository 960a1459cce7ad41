// SPDX-License-Identifier: MIT
#include "arguments.hpp"

#include <trephine/core/number.hpp>
#include <trephine/tool/named_tools.hpp>

#include <cmath>
#include <optional>
#include <sstream>
#include <stdexcept>

namespace openhaptics {
namespace {

double number(const std::string& name, const std::string& text, double least, double most) {
  const std::optional<double> v = trephine::parse_number(text);
  if (!v || !(*v >= least && *v <= most)) {
    std::ostringstream s;
    s << name << ": '" << text << "' is not a number from " << least << " to " << most;
    throw UsageError(s.str());
  }
  return *v;
}

Algorithm algorithm(const std::string& text) {
  for (const Algorithm a : {Algorithm::kLine, Algorithm::kSurface, Algorithm::kCoupled})
    if (text == name_of(a)) return a;
  throw UsageError("--algorithm: '" + text + "' is none of line, surface and coupled");
}

std::string tool(const std::string& name) {
  try {
    (void)trephine::tool_by_name(name);
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("--tool: ") + error.what());
  }
  return name;
}

}  // namespace

const char* name_of(Algorithm algorithm) {
  return algorithm == Algorithm::kLine ? "line" : algorithm == Algorithm::kSurface ? "surface" : "coupled";
}

Arguments parse_arguments(int argc, const char* const* argv) {
  Arguments out;
  std::optional<Algorithm> chosen;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (name == "--help" || name == "-h") {
      out.help = true;
      return out;
    }
    if (name != "--seconds" && name != "--device" && name != "--algorithm" && name != "--skull" && name != "--scale" &&
        name != "--tool")
      throw UsageError("unknown option '" + name + "'; --help lists what there is");
    if (++i == argc) throw UsageError(name + " needs a value");
    const std::string value = argv[i];
    if (value.empty()) throw UsageError(name + ": the value is empty");
    if (name == "--seconds") out.seconds = number(name, value, 0.1, 86400);
    if (name == "--scale") out.scale = number(name, value, 0.05, 2);
    if (name == "--device") out.device = value;
    if (name == "--skull") out.skull = value;
    if (name == "--tool") out.tool = tool(value);
    if (name == "--algorithm") chosen = algorithm(value);
  }
  out.algorithm = chosen.value_or(out.tool.empty() ? Algorithm::kLine : Algorithm::kCoupled);
  if (!out.tool.empty() && out.algorithm != Algorithm::kCoupled)
    throw UsageError("--tool: line and surface have a round burr; use --algorithm coupled");
  return out;
}

std::string usage() {
  return "usage: openhaptics_drill [options]\n"
         "Drills a skull CT, or a built-in tooth phantom, by hand with a device behind the OpenHaptics HD interface\n"
         "(this program is not affiliated with OpenHaptics). Button 1 turns the spindle; button 2 is a clutch: while "
         "it\n"
         "is held the drill stays and the hand moves on. Built without the SDK it drills with a simulated device and\n"
         "hand, named 'Default Device', '6-DOF' (the same) and '3-DOF' (force alone).\n\n"
         "  --skull DIR      InVesalius project's folder with matrix.dat and main.plist (the phantom);\n"
         "                   build/data/cranium once examples/run has fetched the skull\n"
         "  --algorithm A    what computes the force: line, surface or coupled (line; coupled with --tool)\n"
         "  --tool NAME-MM   a tool by name and diameter instead of a round burr: match-head-3, twist-3.2\n"
         "  --device NAME    as set up in the driver (its default device)\n"
         "  --scale S        the drill moves S metres for a metre of the hand, 0.05 to 2 (1)\n"
         "  --seconds S      end by itself (run until Ctrl-C)\n"
         "  --help           this text\n";
}

}  // namespace openhaptics
