// SPDX-License-Identifier: MIT
// same_bits KIND FILE: ticks a compiled scene by what Python wrote to FILE, writes the results to standard output and
// the seconds of the loop to standard error.
#include <trephine/compiled/scene.hpp>
#include <trephine/tool/named_tools.hpp>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

using namespace trephine;

namespace {

template <class Number>
std::vector<Number> take(std::istream& in, std::size_t count) {
  std::vector<Number> numbers(count);
  in.read(reinterpret_cast<char*>(numbers.data()), static_cast<std::streamsize>(count * sizeof(Number)));
  if (!in) throw std::runtime_error("the file ends early");
  return numbers;
}
template <class Number>
void give(const Number* numbers, std::size_t count) {
  std::cout.write(reinterpret_cast<const char*>(numbers), static_cast<std::streamsize>(count * sizeof(Number)));
}

compiled::Scene scene_of(const std::string& kind, const compiled::Bone& bone) {
  using compiled::RendererKind;
  const Burr burr{.tip_radius = 1.6e-3};
  if (kind == "coupled")
    return {bone,
            300,
            burr,
            {.friction = Coulomb{0.3, 0.2}, .coupled = {.stiffness = 700}},
            {.cut = GeometricCut{},
             .vibration = MillingVibration::Options{},
             .damping = Damping::Options{.linear = 1},
             .passivity = PassivityOptions{},
             .limits = {.force = 3, .torque = 0.1}}};
  if (kind == "line")
    return {bone,
            300,
            burr,
            {.renderer = RendererKind::kLine, .line = {.stiffness = 500}, .line_counts = {.shaft = 40}},
            {.cut = RateLimitedCut<>{.rate = 2e5}, .release_limit = ReleaseLimit::Options{.stiffness = 1000}}};
  if (kind == "surface")
    return {bone,
            300,
            burr,
            {.renderer = RendererKind::kSurface,
             .surface = {.budget = StiffnessBudget{900, 0.4}},
             .surface_counts = SurfaceCounts::thesis()},
            {.cut = AdvancingCut{.speed = 2e-3},
             .hunt_crossley = HuntCrossley::Options{.lambda = 2},
             .filter = FirstOrderFilter::Options{},
             .rate_limit = WrenchRateLimit::Options{}}};
  const NamedTool tool = tool_by_name("match-head-3");
  return {bone,
          300,
          tool.tool,
          {.coupled = {.stiffness = 2000}},
          {.cut = PressureCut{},
           .law = CuttingForceOptions{.edges = tool.edges, .stall_torque = 0.05, .strength = {.cortical = 1200}}}};
}

}  // namespace

int main(int, char** argv) {
  std::ifstream in(argv[2], std::ios::binary);
  const auto n = take<std::int32_t>(in, 4);  // x, y, z, ticks
  const auto spacing = take<double>(in, 3);
  const auto voxels = take<std::int16_t>(in, static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1] * n[2]));
  const auto poses = take<double>(in, 16 * static_cast<std::size_t>(n[3]));
  const auto spindle = take<std::uint8_t>(in, static_cast<std::size_t>(n[3]));

  compiled::Bone bone({.size = {n[0], n[1], n[2]}, .spacing = Vec3d(spacing[0], spacing[1], spacing[2])}, voxels);
  compiled::Scene scene = scene_of(argv[1], bone);
  std::vector<double> rows;
  rows.reserve(12 * spindle.size());
  const auto start = std::chrono::steady_clock::now();
  for (std::size_t t = 0; t < spindle.size(); ++t) {
    Posed X_WT = Posed::Identity();
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 4; ++j) X_WT(i, j) = poses[16 * t + static_cast<std::size_t>(4 * i + j)];
    const TickResult r = scene.tick({.X_WT = X_WT, .spindle_on = spindle[t] != 0}, 1e-3);
    const Vec3d &force = r.wrench.force, &torque = r.wrench.torque;
    const double row[]{force.x(),        force.y(),        force.z(),
                       torque.x(),       torque.y(),       torque.z(),
                       r.removed_mm3,    r.contact.depth,  static_cast<double>(r.status),
                       r.cutting.thrust, r.cutting.torque, r.cutting.spindle};
    rows.insert(rows.end(), std::begin(row), std::end(row));
  }
  std::cerr << std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() << '\n';
  give(rows.data(), rows.size());
  std::vector<std::int16_t> left(voxels.size());
  bone.copy_voxels(std::span<std::int16_t>(left));
  give(left.data(), left.size());
}
