// SPDX-License-Identifier: MIT
// Built once with each level of optimisation. The linker keeps one of two functions of one name, so each has names of
// its own.
#if defined(SPEED_AT_O2)
#define trephine trephine_at_o2
#define Eigen Eigen_at_o2
#define SPEED_WORK work_at_o2
#else
#define trephine trephine_at_o3
#define Eigen Eigen_at_o3
#define SPEED_WORK work_at_o3
#endif

#include "speed/levels.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>

#include <benchmark/benchmark.h>

#include <cstdint>
#include <memory>

namespace speed_levels {
namespace {

using namespace trephine;
using Field = DensityField<std::uint8_t, float>;
using Surface = SurfaceApproxRenderer<float>;

struct Bone {
  static constexpr int kLevel = 88;  // voxels
  VoxelGrid<std::uint8_t> grid{{.size = {256, 256, 176}, .spacing = Vec3d::Constant(1e-4)}, flat_voxels(kLevel)};
};

/// A drill that lies along the bone, its shaft's axis `height` [m] above it.
[[nodiscard]] Pose<float> lying(double height) {
  const Mat3d R = rotation_from_vector(Vec3d(-1.5708, 0, 0)) * rotation_from_vector(Vec3d(0, 0, 0.3));
  return make_pose<double>(R, 1e-4 * Vec3d(128, 30, Bone::kLevel) + Vec3d(0, 0, height)).cast<float>();
}

}  // namespace

Work SPEED_WORK() {
  const auto bone = std::make_shared<Bone>();
  const Burr burr{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.02};
  const ToolDiscretization<SurfaceCounts, float> tool(burr, SurfaceCounts{.sphere = 26, .slices = 20, .per_slice = 8});
  Work work;
  work.emplace_back("sampling", [bone, tool, X = lying(0.003),
                                 out = std::vector<float>(static_cast<std::size_t>(tool.padded()))]() mutable {
    const auto& p = tool.points();
    Field(bone->grid, 127).values(X, p.x.data(), p.y.data(), p.z.data(), out.data(), tool.padded());
    benchmark::DoNotOptimize(out.data());
    benchmark::ClobberMemory();
  });
  for (const auto& [name, height] : {std::pair("no-contact tick", 0.003), std::pair("contact tick", 0.0007)})
    work.emplace_back(name, [bone, renderer = Surface(tool), X = lying(height)]() mutable {
      benchmark::DoNotOptimize(renderer.render(Field(bone->grid, 127), X));
    });
  return work;
}

}  // namespace speed_levels
