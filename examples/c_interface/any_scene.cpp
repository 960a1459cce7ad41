// SPDX-License-Identifier: MIT
#include "any_scene.hpp"

#include "guard.hpp"

#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/stage/damping.hpp>
#include <trephine/stage/device_limits.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/stage/milling.hpp>

#include <limits>
#include <utility>

using namespace trephine;

namespace trephine_c {
namespace {

/// The carver chosen at run time.
class AnyMilling {
 public:
  explicit AnyMilling(const trephine_scene_options& o) : kind_(o.milling) {
    require(kind_ >= TREPHINE_MILL_NOTHING && kind_ <= TREPHINE_MILL_RATE_LIMITED,
            "trephine_scene_create: no such milling: ", kind_);
    if (kind_ == TREPHINE_MILL_RATE_LIMITED)
      limited_ = Milling{RateLimitedCut<>{.rate = o.milling_rate, .reference_force = o.milling_force}};
  }

  template <class Grid>
  double carve(Grid& grid, double isovalue, const Posed& X_GT_previous, const Posed& X_GT, const Burr& burr,
               const CarveContext& context) noexcept {
    if (kind_ == TREPHINE_MILL_GEOMETRIC) return geometric_.carve(grid, isovalue, X_GT_previous, X_GT, burr, context);
    if (kind_ == TREPHINE_MILL_RATE_LIMITED) return limited_.carve(grid, isovalue, X_GT_previous, X_GT, burr, context);
    return 0;
  }
  void reset() noexcept {
    geometric_.reset();
    limited_.reset();
  }

 private:
  std::int32_t kind_;
  Milling<> geometric_{};
  Milling<RateLimitedCut<>> limited_{};
};

template <VoxelDensity Density, class ContactRenderer>
class SceneOf final : public Scene {
 public:
  SceneOf(std::shared_ptr<VoxelGrid<Density>> grid, const trephine_scene_options& o, ContactRenderer renderer)
      : grid_(std::move(grid)),
        scene_(*grid_, o.isovalue, std::move(renderer), AnyMilling(o),
               Damping({.linear = o.damping, .angular = o.angular_damping, .only_in_contact = true}),
               DeviceLimits{.force = o.force_limit, .torque = o.torque_limit}) {}

  TickResult tick(const TickInput& input, double dt) noexcept override { return scene_.tick(input, dt); }
  Posed visual_pose() const noexcept override { return scene_.visual_pose_W(); }
  void reset() noexcept override { scene_.reset(); }

 private:
  std::shared_ptr<VoxelGrid<Density>> grid_;
  HapticScene<Density, ContactRenderer, AnyMilling, Damping, DeviceLimits> scene_;
};

template <VoxelDensity Density, class ContactRenderer>
std::unique_ptr<Scene> scene_of(const std::shared_ptr<VoxelGrid<Density>>& grid, const trephine_scene_options& o,
                                ContactRenderer renderer) {
  return std::make_unique<SceneOf<Density, ContactRenderer>>(grid, o, std::move(renderer));
}

template <CoupledMotion Motion, VoxelDensity Density>
std::unique_ptr<Scene> coupled_scene(const std::shared_ptr<VoxelGrid<Density>>& grid, const trephine_scene_options& o,
                                     const Burr& burr) {
  CoupledOptions options{
      .stiffness = o.stiffness, .rotational_stiffness = o.rotational_stiffness, .force = o.force_limit};
  if (Motion::kDof == 6) options.torque = o.torque_limit;
  return scene_of(grid, o,
                  CoupledToolRenderer<double, BallAndShaft, Coulomb, Motion>(
                      burr, options, Coulomb{o.static_friction, o.kinetic_friction}));
}

}  // namespace

trephine_scene_options default_scene_options() {
  const Burr burr;
  trephine_scene_options o{};
  o.algorithm = TREPHINE_SURFACE;
  o.isovalue = std::numeric_limits<double>::quiet_NaN();
  o.tool = {burr.tip_radius, burr.shaft_radius, burr.shaft_length};
  o.stiffness = SurfaceOptions{}.stiffness;
  o.sphere_vertices = SurfaceCounts{}.sphere;
  o.slices = SurfaceCounts{}.slices;
  o.per_slice = SurfaceCounts{}.per_slice;
  o.shaft_vertices = LineCounts{}.shaft;
  o.milling = TREPHINE_MILL_GEOMETRIC;
  o.milling_rate = RateLimitedCut<>{}.rate;
  o.force_limit = 3.3;
  o.torque_limit = 0.1;
  o.rotational_stiffness = CoupledOptions{}.rotational_stiffness;
  return o;
}

std::unique_ptr<Scene> make_scene(const AnyGrid& grid, const trephine_scene_options& o) {
  require(o.algorithm >= TREPHINE_LINE && o.algorithm <= TREPHINE_COUPLED,
          "trephine_scene_create: no such algorithm: ", o.algorithm);
  const Burr burr{o.tool.tip_radius, o.tool.shaft_radius, o.tool.shaft_length};
  return std::visit(
      [&](const auto& g) {
        if (o.algorithm == TREPHINE_LINE)
          return scene_of(g, o,
                          LineApproxRenderer{ToolDiscretization{burr, LineCounts{.shaft = o.shaft_vertices}},
                                             LineOptions{.stiffness = o.stiffness}, TranslateRotate{},
                                             Coulomb{o.static_friction, o.kinetic_friction}});
        if (o.algorithm == TREPHINE_SURFACE) {
          const ToolDiscretization tool{
              burr, SurfaceCounts{.sphere = o.sphere_vertices, .slices = o.slices, .per_slice = o.per_slice}};
          return scene_of(g, o, SurfaceApproxRenderer{tool, SurfaceOptions{.stiffness = o.stiffness}});
        }
        // Without motors for torque the tool turns as the device does.
        return o.torque_limit == 0 ? coupled_scene<TranslationOnly>(g, o, burr) : coupled_scene<SixDof>(g, o, burr);
      },
      grid);
}

}  // namespace trephine_c
