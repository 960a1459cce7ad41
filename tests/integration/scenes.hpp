// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/everything.hpp>

#include <cstdint>
#include <random>
#include <utility>
#include <vector>

/// Whole scenes for the integration tests: a block of bone with a blurred surface, a drill, and every stage there is.
namespace trephine::test {

inline constexpr double kVoxel = 0.5e-3;
inline constexpr int kBlockSize = 48;
inline constexpr double kSurfaceHeight = 24.3 * kVoxel;  ///< bone below this height
inline constexpr double kIsovalue = 127.5;

/// Bone fills z < kSurfaceHeight, its density falling over about four voxels round the surface.
template <class Density>
[[nodiscard]] VoxelGrid<Density> make_block(const GridOptions& options = {}) {
  std::vector<Density> voxels;
  voxels.reserve(std::size_t{kBlockSize} * kBlockSize * kBlockSize);
  for (int k = 0; k < kBlockSize; ++k)
    for (int j = 0; j < kBlockSize; ++j)
      for (int i = 0; i < kBlockSize; ++i) {
        const double density = kIsovalue + 60 * (kSurfaceHeight / kVoxel - k);
        voxels.push_back(static_cast<Density>(std::min(std::max(density, 0.0), 255.0)));
      }
  const int n = kBlockSize;
  return VoxelGrid<Density>({.size = {n, n, n}, .spacing = {kVoxel, kVoxel, kVoxel}}, voxels, options);
}

inline constexpr Burr kDrill{.tip_radius = 1.5e-3, .shaft_radius = 0.8e-3, .shaft_length = 20e-3};

template <class S>
[[nodiscard]] auto make_line() {
  using Tool = ToolDiscretization<LineCounts, S>;
  return LineApproxRenderer<S, TranslateRotate, Coulomb>(Tool(kDrill, LineCounts{}));
}
template <class S>
[[nodiscard]] auto make_thesis_line() {
  using Tool = ToolDiscretization<LineCounts, S>;
  return ThesisLine<S>(Tool(kDrill, LineCounts{}), {.friction = 0.15, .ray_casting = true});
}
template <class S>
[[nodiscard]] auto make_surface() {
  using Tool = ToolDiscretization<SurfaceCounts, S>;
  return SurfaceApproxRenderer<S>(Tool(kDrill, SurfaceCounts::thesis()));
}
template <class S>
[[nodiscard]] auto make_thesis_surface() {
  using Tool = ToolDiscretization<SurfaceCounts, S>;
  return ThesisSurface<S>(Tool(kDrill, SurfaceCounts::thesis()));
}

/// With friction.
[[nodiscard]] inline auto make_coupled() { return CoupledToolRenderer<BallAndShaft, Coulomb>(kDrill); }

inline constexpr double kForceLimit = 3.3;
inline constexpr double kTorqueLimit = 0.1;
inline constexpr double kBlockMiddle = 0.5 * kBlockSize * kVoxel;
inline constexpr double kGuideForce = 0.02;  ///< [N] weak, so that guides do not hold the drill off the bone

/// The renderer with everything a scene can list.
template <class Density, class R>
[[nodiscard]] auto make_full_scene(VoxelGrid<Density>& bone, R renderer) {
  return HapticScene{bone,
                     kIsovalue,
                     std::move(renderer),
                     Cutting{{.rate = 2e4}},
                     ReleaseLimit{},
                     Damping({.linear = 0.5, .angular = 1e-4}),
                     HuntCrossley(HuntCrossley::Options{}),
                     MillingVibration(MillingVibration::Options{}),
                     FirstOrderFilter(FirstOrderFilter::Options{}),
                     AxisGuide({.point_G = {kBlockMiddle, kBlockMiddle, 0}, .force = kGuideForce, .torque = 1e-3}),
                     DepthStop({.point_G = {0, 0, kSurfaceHeight - 2e-3}, .force = kGuideForce}),
                     PassivityController(PassivityController::Options{}),
                     WrenchRateLimit(WrenchRateLimit::Options{}),
                     DeviceLimits{kForceLimit, kTorqueLimit}};
}

/// A hand that lowers the drill into the block, leans it over, turns it and takes it out, in one second.
[[nodiscard]] inline Posed drilling_pose(double t) {
  const double down = t < 0.4 ? t / 0.4 : t < 0.8 ? 1.0 : 1.0 - (t - 0.8) / 0.2;
  const double lean = t < 0.4 ? 0.0 : t < 0.8 ? 0.6 * std::sin((t - 0.4) / 0.4 * 3.14159265358979) : 0.0;
  const Mat3d R = rotation_from_vector(Vec3d(0, lean, 0)) * rotation_from_vector(Vec3d(0, 0, 3 * t));
  return make_pose<double>(R, Vec3d(kBlockMiddle + 1e-3 * t, kBlockMiddle, kSurfaceHeight + 2e-3 - 5e-3 * down));
}

}  // namespace trephine::test
