// SPDX-License-Identifier: MIT
#include "cutting/milling.hpp"
#include "cutting/membranes.hpp"

#include <trephine/core/number.hpp>
#include <trephine/stage/driven_by.hpp>

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
/// tool, chisel, a factor on its edge's thrust, and stall, the spindle's stall torque [N mm]; or motor=NAME.
/// With edge=1 it prints the law of an edge of 1 mm whose chip is `depth` thick, and with membrane=dura where the tool
/// ruptures it.
namespace {

using namespace trephine;

/// An edge of 1 mm alone, by a chip's thickness [m].
int print_edge(double chip) {
  const CuttingLaw law;
  const double edges = law.edge_share(chip), along = law.energy * chip;
  const double tangential = 1e-3 * (along + law.edge_force * edges);
  std::printf("thrust %.5g\ntangential %.5g\nenergy %.5g\n",
              1e-3 * (law.thrust_ratio * along + law.edge_thrust * edges), tangential, 1e-6 * tangential / chip);
  return 0;
}

int print_membrane(const std::string& name, const RevolvedTool& tool) {
  if (name != "dura") throw std::invalid_argument("not understood: membrane=" + name);
  const Membrane membrane = dura();
  const bench::Ruptured at = bench::press_until_rupture(tool, membrane);
  std::printf("depth %.5g\nforce %.5g\nstress %.5g\nmodulus %.5g\nstrain %.5g\n", 1e3 * at.depth, at.force,
              1e-6 * at.stress, 1e-6 * membrane.modulus, 100 * at.stress / membrane.modulus);
  return 0;
}

int run(int argc, char** argv) {
  std::map<std::string, double> numbers{
      {"speed", 40'000}, {"feed", 2},   {"depth", 0},
      {"load", 0},       {"tilt", 0},   {"strength", 1},
      {"wear", 0},       {"flutes", 0}, {"stall", std::numeric_limits<double>::infinity()},
      {"chisel", 1},     {"edge", 0}};
  std::map<std::string, std::string> names{{"tool", "round-4"}, {"motor", ""}, {"membrane", ""}};
  for (int i = 1; i < argc; ++i) {
    const std::string text = argv[i];
    const std::size_t at = text.find('=');
    const std::string key = text.substr(0, at), value = at == std::string::npos ? "" : text.substr(at + 1);
    if (names.count(key) != 0) {
      names[key] = value;
      continue;
    }
    const auto number = parse_number(value);
    if (numbers.count(key) == 0 || !number) throw std::invalid_argument("not understood: " + text);
    numbers[key] = *number;
  }
  const auto of = [&](const char* key) { return numbers.at(key); };
  NamedTool tool = tool_by_name(names.at("tool"));
  if (of("edge") > 0) return print_edge(1e-3 * of("depth"));
  if (!names.at("membrane").empty()) return print_membrane(names.at("membrane"), tool.tool);
  tool.edges.wear = of("wear");
  if (of("flutes") > 0) tool.edges.flutes = static_cast<int>(of("flutes"));
  CuttingForce::Options options{
      .edges = tool.edges, .speed = rpm(of("speed")), .stall_torque = 1e-3 * of("stall"), .inertia = 1e-8};
  options.law.chisel *= of("chisel");
  if (!names.at("motor").empty()) options = driven_by(options, motor_by_name(names.at("motor")));
  const bench::Milled cut = bench::mill(tool.tool, options,
                                        {.feed = 1e-3 * of("feed"),
                                         .depth = 1e-3 * of("depth"),
                                         .load = of("load"),
                                         .tilt = of("tilt") * std::numbers::pi / 180,
                                         .strength = of("strength")});
  std::printf("thrust %.5g\nnormal %.5g\ntangential %.5g\ntorque %.5g\nspeed %.5g\nrate %.5g\nenergy %.5g\n",
              cut.thrust, cut.normal, cut.tangential, 1e3 * cut.torque, cut.spindle / rpm(1), cut.rate, cut.energy());
  std::printf("lost %.5g\nsound %.5g\n", 1 - cut.spindle / options.speed, cut.sound);
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
