// SPDX-License-Identifier: MIT
#pragma once

#include "common/cuts.hpp"
#include "support/raster.hpp"

#include <trephine/everything.hpp>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

/// Tools by name, so that one measurement serves every renderer, choice and stack of stages; bones of known shape, and
/// how a tool comes to touch them.
namespace trephine::bench {

using Bone = VoxelGrid<std::int16_t>;

/// Stages that are on.
struct Stack {
  std::optional<HuntCrossley::Options> hunt_crossley{};
  std::optional<Damping::Options> damping{};
  std::optional<FirstOrderFilter::Options> filter{};
  std::optional<PassivityController::Options> passivity{};
  std::optional<ReleaseLimit::Options> release{};
  std::optional<WrenchRateLimit::Options> rate{};
  DeviceLimits limits{1e3, 1e2};
};

struct Setup {
  std::string renderer = "line";    ///< "line", "surface", "coupled"
  std::string options = "default";  ///< "default", "thesis", or Surface's "thesis' counts"
  Burr burr{.tip_radius = 1.5e-3, .shaft_radius = 0.8e-3, .shaft_length = 0};
  double stiffness = 800;  ///< as the renderers mean it [N/m]
  double friction = 0;     ///< Line, Coupled: μ
  std::optional<StiffnessBudget> budget{};
  Cut cut = Cut::kByRate;    ///< while the spindle turns
  double mill_rate = 1;      ///< of a cut by rate [densities/s]
  CoupledOptions coupled{};  ///< Coupled: its gains, but for the stiffness
  Stack stack{};
};

/// Line and Surface with the defaults and the thesis' choices, the coupled tool without and with friction, then `more`.
[[nodiscard]] std::vector<Setup> usual_setups(const std::vector<Setup>& more = {});

/// Those of a Surface scene that names none, or the thesis'.
[[nodiscard]] inline SurfaceCounts counts_of(const Setup& setup) {
  const bool few = setup.options == "thesis" || setup.options == "thesis' counts";
  return few ? SurfaceCounts::thesis() : SurfaceCounts{};
}

class AnyTool {
 public:
  virtual ~AnyTool() = default;
  [[nodiscard]] virtual TickResult tick(const TickInput& input, double dt) noexcept = 0;
  virtual void reset() noexcept = 0;  ///< as before the first tick: no wrench acts
};

/// The bone must outlive it and, without milling, is only read. Throws std::invalid_argument for a name it has not.
[[nodiscard]] std::unique_ptr<AnyTool> make_tool(const Setup& setup, Bone& bone, double isovalue);
[[nodiscard]] std::unique_ptr<AnyTool> make_line_tool(const Setup& setup, Bone& bone, double isovalue);
[[nodiscard]] std::unique_ptr<AnyTool> make_surface_tool(const Setup& setup, Bone& bone, double isovalue);

/// The options of a setup in words: "default + friction 0.3".
[[nodiscard]] std::string label(const Setup& setup);

/// The law of a ball pressed `depth` [m] into a plane with outward normal n, in closed form over its vertices [N], for
/// the scene that `setup` makes of voxels as the places have them. Coupled: its coupling.
class PlaneLaw {
 public:
  PlaneLaw(const Setup& setup, const Vec3d& n);
  [[nodiscard]] double force(double depth) const;
  /// dF/dδ where the force is `newton` [N/m].
  [[nodiscard]] double tangent_at(double newton) const;
  [[nodiscard]] double depth_at(double newton) const;

 private:
  double k_ = 0;  // Line, Coupled
  double edge_ = 0, radius_ = 0;
  std::vector<double> table_;  // Surface: force at even steps of depth up to the radius
};

/// `setup` with its stiffness chosen so that the tangent stiffness at `newton` on that plane is K.
[[nodiscard]] Setup with_tangent(Setup setup, const Vec3d& n, double K, double newton = 1);

/// Takes the tool from one pose to another in 1/`ticks` steps, so that it arrives in contact as it would in use.
Wrenchd lead_tool(AnyTool& tool, const Posed& from, const Posed& to, int ticks = 40);

inline constexpr double kPlaceVoxel = 3e-4;

struct Place {
  std::string name;
  Burr burr{};
  std::shared_ptr<Bone> bone;  ///< only read
  double isovalue = 0;
  Posed touching = Posed::Identity();       ///< the ball (or the shaft) just touches, for Surface
  Posed touching_line = Posed::Identity();  ///< the same for Line's point tip and centreline
  Vec3d outward = Vec3d::UnitZ();           ///< the way out
  Vec3d across = Vec3d::UnitX();            ///< a way to slide
  double room = 1e-3;                       ///< that far off on the way out it is free [m]
  bool by_shaft = false;                    ///< the shaft holds the tool, so that it turns about where it does
  bool rolls = false;                       ///< without friction the ball rolls over what holds it, an edge or a corner
  double mill_rate = 1;                     ///< of a cut by rate that suits the bone [densities/s]
  [[nodiscard]] const Posed& start(const Setup& setup) const {
    return setup.renderer == "line" ? touching_line : touching;
  }
};

[[nodiscard]] Place make_place(const std::string& name);
[[nodiscard]] std::vector<std::string> place_names();
/// Those where a tool is pressed the way in until it is held, for the greatest stable stiffness.
[[nodiscard]] std::vector<std::string> pressed_place_names();
/// On the skull's CT (without its folder: the phantom) where a surgeon would begin, or at the bottom of a pit milled
/// there. The bone is the place's own.
[[nodiscard]] Place scanned_place(const std::string& skull, bool milled);

/// Scanned bone round the place, `half` [m] to each side.
[[nodiscard]] std::unique_ptr<Bone> round(const Place& place, double half);
/// A copy: what a run may carve, and no other.
[[nodiscard]] std::shared_ptr<Bone> copy_of(const Bone& bone);

/// Any shape as a grid of `n` voxels a side whose middle is the world's origin.
[[nodiscard]] std::shared_ptr<Bone> make_bone(const std::function<double(const Vec3d&)>& shape, int n = 64);
inline constexpr double kPlaceIsovalue = 127.5;

/// T at p, shaft (handle) along `shaft`.
[[nodiscard]] Posed tool_pose(const Vec3d& p, const Vec3d& shaft);

/// X_WT moved by a vector in W.
[[nodiscard]] inline Posed moved(Posed X, const Vec3d& by) {
  X.translation() += by;
  return X;
}

}  // namespace trephine::bench
