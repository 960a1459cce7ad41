// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/friction.hpp>
#include <trephine/guide/guide_options.hpp>
#include <trephine/render/coupled/coupled_options.hpp>
#include <trephine/render/line/line_options.hpp>
#include <trephine/render/surface/surface_options.hpp>
#include <trephine/stage/cutting_force_options.hpp>
#include <trephine/stage/cutting_options.hpp>
#include <trephine/stage/damping.hpp>
#include <trephine/stage/device_limits.hpp>
#include <trephine/stage/first_order_filter.hpp>
#include <trephine/stage/hunt_crossley.hpp>
#include <trephine/stage/milling_vibration.hpp>
#include <trephine/stage/passivity_options.hpp>
#include <trephine/stage/release_limit.hpp>
#include <trephine/stage/wrench_rate_limit.hpp>
#include <trephine/tool/counts.hpp>
#include <trephine/voxel/any_cut.hpp>

#include <cstdint>
#include <optional>

/// What a compiled scene is made of, by the headers' own options.
namespace trephine::inline TREPHINE_ALIGNED::compiled {

enum class RendererKind : std::uint8_t { kCoupled, kLine, kSurface };

/// Which renderer, and its options; those of the other renderers are not read. Laws and searches are the headers'
/// defaults.
struct RendererOptions {
  RendererKind renderer = RendererKind::kCoupled;
  std::optional<Coulomb> friction{};  ///< of the coupled tool and Line; absent: frictionless. Surface has none
  CoupledOptions coupled{};           ///< an infinite rotational stiffness: translation alone, without torque
  LineOptions line{};
  LineCounts line_counts{};
  SurfaceOptions surface{};
  SurfaceCounts surface_counts{};
};

/// The parts of a scene, in the order in which they run; an absent one changes no bit of the wrench. The guard of
/// `set_structures` runs between guides and passivity control.
struct StageOptions {
  AnyCut cut{};  ///< GeometricCut{}, RateLimitedCut<>{…}, AdvancingCut{…} or PressureCut{}; none removes nothing
  CuttingOptions cutting{};
  /// Forces of cutting, and with a PressureCut the feed by the thrust, which is for the coupled tool alone. Each tick
  /// reports the true forces (`TickResult::cutting`). Edges are the tool's (`tool_by_name`).
  std::optional<CuttingForceOptions> law{};
  std::optional<ReleaseLimit::Options> release_limit{};
  std::optional<HuntCrossley::Options> hunt_crossley{};
  std::optional<MillingVibration::Options> vibration{};
  std::optional<Damping::Options> damping{};
  std::optional<FirstOrderFilter::Options> filter{};
  std::optional<AxisGuideOptions> axis_guide{};
  std::optional<DepthStopOptions> depth_stop{};
  std::optional<PassivityOptions> passivity{};
  std::optional<WrenchRateLimit::Options> rate_limit{};
  DeviceLimits limits{};  ///< unlimited unless given

  /// Throws std::invalid_argument where an option is out of range.
  void validate() const {
    cut.validate();
    cutting.validate();
    const auto validate_given = [](const auto&... options) { (..., (options ? options->validate() : void())); };
    validate_given(law, release_limit, hunt_crossley, vibration, damping, filter, axis_guide, depth_stop, passivity,
                   rate_limit);
    limits.validate();
    if (cut.kind() == CutKind::kByPressure && !law)
      refuse("compiled::StageOptions", "a PressureCut needs a law: give `law`", "none");
  }
};

/// What was counted of a structure since its protection came into the scene.
struct StructureTotals {
  int breaches = 0;        ///< times that the tool went into it while it was guarded (`StructureGuard::breaches`)
  double refused_mm3 = 0;  ///< protected bone that cuts would have taken [mm³]
  double taken_mm3 = 0;    ///< bone that cuts took of it while it was watched [mm³]
};

}  // namespace trephine::compiled
