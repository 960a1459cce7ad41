// SPDX-License-Identifier: MIT
#include "cutting/milling.hpp"

#include <trephine/core/number.hpp>

#include <cstdio>
#include <exception>
#include <limits>
#include <map>
#include <numbers>
#include <stdexcept>
#include <string>

/// One cut by the cutting law, run in bone: `bench_milling tool=round-4 speed=40000 feed=2 depth=0.5`.
/// Means of its second half are printed, a name and a number a line. Reads tool=NAME, speed [1/min], feed [mm/s], depth
/// [mm] of a slot, load [N] that presses the tool on the bone, tilt [deg], strength of the bone, wear and flutes of the
/// tool, and stall, the spindle's stall torque [N mm].
namespace {

using namespace trephine;

int run(int argc, char** argv) {
  std::map<std::string, double> numbers{
      {"speed", 40'000}, {"feed", 2},   {"depth", 0},
      {"load", 0},       {"tilt", 0},   {"strength", 1},
      {"wear", 0},       {"flutes", 0}, {"stall", std::numeric_limits<double>::infinity()}};
  std::string name = "round-4";
  for (int i = 1; i < argc; ++i) {
    const std::string text = argv[i];
    const std::size_t at = text.find('=');
    const std::string key = text.substr(0, at), value = at == std::string::npos ? "" : text.substr(at + 1);
    if (key == "tool") {
      name = value;
      continue;
    }
    const auto number = parse_number(value);
    if (numbers.count(key) == 0 || !number) throw std::invalid_argument("not understood: " + text);
    numbers[key] = *number;
  }
  const auto of = [&](const char* key) { return numbers.at(key); };
  NamedTool tool = tool_by_name(name);
  tool.edges.wear = of("wear");
  if (of("flutes") > 0) tool.edges.flutes = static_cast<int>(of("flutes"));
  const bench::Milled cut = bench::mill(
      tool.tool, {.edges = tool.edges, .speed = rpm(of("speed")), .stall_torque = 1e-3 * of("stall"), .inertia = 1e-8},
      {.feed = 1e-3 * of("feed"),
       .depth = 1e-3 * of("depth"),
       .load = of("load"),
       .tilt = of("tilt") * std::numbers::pi / 180,
       .strength = of("strength")});
  std::printf("thrust %.5g\nnormal %.5g\ntangential %.5g\ntorque %.5g\nspeed %.5g\nrate %.5g\nenergy %.5g\n",
              cut.thrust, cut.normal, cut.tangential, 1e3 * cut.torque, cut.spindle / rpm(1), cut.rate, cut.energy());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_milling: %s\n", error.what());
    return 2;
  }
}
