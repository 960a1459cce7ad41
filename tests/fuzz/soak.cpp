// SPDX-License-Identifier: MIT
// Hours of drilling in minutes: soak [SECONDS OF SIMULATED TIME]. The bone grows back every minute, so that the last
// minute must answer as the first did: no drift, no growth of memory, no NaN.
#include <trephine/everything.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

namespace {

using namespace trephine;

constexpr double kTick = 1e-3;
constexpr int kMinute = 60000;

VoxelGrid<std::int16_t> block() {
  const int n = 40;
  std::vector<std::int16_t> voxels;
  for (int k = 0; k < n; ++k)
    for (int i = 0; i < n * n; ++i)
      voxels.push_back(static_cast<std::int16_t>(std::clamp(300 + 500 * (25 - k), -1000, 1500)));
  return VoxelGrid<std::int16_t>({.size = {n, n, n}, .spacing = Vec3d::Constant(5e-4)}, voxels);
}

/// Down, about and out again, four times a minute.
Posed path(int tick) {
  const double t = kTick * (tick % kMinute);
  const double in = std::min(1.0, 4 * std::abs(std::sin(0.2094395102393195 * t)));
  const Mat3d R = rotation_from_vector<double>(Vec3d(0.3 * std::sin(1.1 * t), 0.2 * std::sin(0.7 * t), 2 * t));
  return make_pose<double>(
      R, Vec3d(0.01 + 3e-3 * std::sin(0.9 * t), 0.01 + 3e-3 * std::cos(1.3 * t), 0.0155 - 4.5e-3 * in));
}

/// Resident memory [kB], where the system tells.
long resident() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.rfind("VmRSS:", 0) == 0) return std::atol(line.c_str() + 6);
  return 0;
}

struct Minute {
  double force = 0, torque = 0, removed = 0, peak = 0;
  [[nodiscard]] bool operator==(const Minute&) const = default;
};

template <class Renderer>
bool soak(const char* name, const Renderer& renderer, int minutes) {
  auto bone = block();
  HapticScene scene{bone,
                    300,
                    renderer,
                    Cutting{{.rate = 2e4}},
                    HuntCrossley(HuntCrossley::Options{}),
                    PassivityController(PassivityController::Options{}),
                    WrenchRateLimit(WrenchRateLimit::Options{}),
                    DeviceLimits{3.3, 0.1}};
  Minute first, last;
  long memory = 0;
  for (int m = 0; m < minutes; ++m) {
    Minute now;
    for (int i = 0; i < kMinute; ++i) {
      const TickResult r = scene.tick({.X_WT = path(i), .spindle_on = i % 8000 > 1000}, kTick);
      const double f = r.wrench.force.norm();
      if (!is_finite(r.wrench) || f > 3.3 || r.wrench.torque.norm() > 0.1 || r.status == Status::kNonFinite) {
        std::printf("soak: %s: minute %d tick %d: %g N, %s\n", name, m, i, f, to_string(r.status));
        return false;
      }
      now.force += f;
      now.torque += r.wrench.torque.norm();
      now.removed += r.removed_mm3;
      now.peak = std::max(now.peak, f);
    }
    bone.restore();
    scene.reset();
    if (m == 0) first = now;
    if (m == 1) memory = resident();
    last = now;
  }
  const long grown = minutes > 1 ? resident() - memory : 0;
  // A scene that was reset on a bone that is whole again answers with the same bits; only dithering goes on.
  const bool same = first == last;
  std::printf(
      "soak: %s: %d minutes; mean %.6g N, peak %.4g N, %.6g mm3 a minute; last minute %s the first; memory grown by "
      "%ld kB\n",
      name, minutes, last.force / kMinute, last.peak, last.removed, same ? "equals" : "DIFFERS FROM", grown);
  return same && grown < 256;
}

}  // namespace

int main(int argc, char** argv) {
  const int minutes = argc > 1 ? std::max(1, static_cast<int>(std::atof(argv[1]) / 60)) : 60;
  const Burr burr{.tip_radius = 1.5e-3, .shaft_radius = 8e-4, .shaft_length = 20e-3};
  const LineApproxRenderer<float, TranslateRotate, Coulomb> line(
      ToolDiscretization<LineCounts, float>(burr, LineCounts{}));
  const SurfaceApproxRenderer<float> surface(ToolDiscretization<SurfaceCounts, float>(burr, SurfaceCounts::thesis()));
  const CoupledToolRenderer coupled{burr};
  bool well = soak("line", line, minutes);
  well = soak("surface", surface, minutes) && well;
  well = soak("coupled", coupled, minutes) && well;
  return well ? 0 : 1;
}
