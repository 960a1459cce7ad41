// SPDX-License-Identifier: MIT
#pragma once

#include "../examples/drill/phantom.hpp"
#include "common/percentile.hpp"
#include "common/table.hpp"

#include <trephine/everything.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

/// What speed is measured on: the thesis' tooth and the tools at its counts.
namespace trephine::bench::speed {

using Clock = std::chrono::steady_clock;
using Grid = VoxelGrid<std::uint8_t>;
using Field = DensityField<std::uint8_t, float>;
using Surface = SurfaceApproxRenderer<float>;
using Line = LineApproxRenderer<float>;
inline constexpr double kIsovalue = drill::PhantomDensities::kIsovalue;
#if defined(__clang__)
inline constexpr const char* kCompiler = "clang++";
#else
inline constexpr const char* kCompiler = "g++";
#endif

struct Options {
  std::string folder = "build/report";
  std::string march = "native";
  bool append = false;
  bool quick = false;
};

/// The thesis' tooth in voxels of another size [m].
[[nodiscard]] inline Grid tooth_of(double voxel) {
  const double shrink = 1e-4 / voxel;
  const int across = static_cast<int>(256 * shrink);
  return drill::tooth_phantom<std::uint8_t>(
      {.size = {across, across, static_cast<int>(176 * shrink)}, .spacing = voxel});
}

/// A tooth and poses of a tool that leans on its crown.
struct Scene {
  Grid tooth = drill::tooth_phantom<std::uint8_t>();
  Vec3d top;

  Scene() {
    const Field field(tooth, kIsovalue);
    top = 0.5e-4 * Vec3d(255, 255, 175);
    top.z() = 0.0175;
    while (top.z() > 0 && field.value(top.cast<float>()) < 0) top.z() -= 5e-5;
  }
  /// The ball's centre `height` above the crown.
  [[nodiscard]] Pose<float> pose(double height, double lean = 0.3) const {
    return make_pose<double>(rotation_from_vector(Vec3d(lean, 0.1, 0)), top + Vec3d(0, 0, height)).cast<float>();
  }
};

[[nodiscard]] inline Burr burr_of(double length = 40_mm) {
  return {.tip_radius = 1.5_mm, .shaft_radius = 0.8_mm, .shaft_length = length};
}
[[nodiscard]] inline Surface surface(double length = 40_mm) {
  return Surface(ToolDiscretization{burr_of(length), SurfaceCounts::thesis()});
}
[[nodiscard]] inline Line line() { return Line(ToolDiscretization{burr_of(), LineCounts{}}); }

template <Friction FrictionLaw = Frictionless>
[[nodiscard]] CoupledToolRenderer<BallAndShaft, FrictionLaw> coupled(const FrictionLaw& friction = {}) {
  return {burr_of(), CoupledOptions{}, friction};
}

/// A pose at which about `hits` of the tool's vertices are in bone.
[[nodiscard]] inline Pose<float> pose_of_hits(const Scene& scene, const Surface& like, int hits) {
  const Field field(scene.tooth, kIsovalue);
  const auto& tool = like.tool();
  std::vector<float> values(static_cast<std::size_t>(tool.padded()));
  for (double height = 0.002; height > -0.015; height -= 2e-5) {
    const Pose<float> X = scene.pose(height);
    field.values(X, tool.points().x.data(), tool.points().y.data(), tool.points().z.data(), values.data(),
                 tool.padded());
    if (std::count_if(values.begin(), values.begin() + tool.periphery(), [](float v) { return v >= 0; }) >= hits)
      return X;
  }
  return scene.pose(-0.015);
}

/// Worst cases; a servo loop; memory.
void measure_spread(const Options& options, const Scene& scene);
void measure_servo(const Options& options, const Scene& scene);
void measure_memory(const Options& options);

}  // namespace trephine::bench::speed
