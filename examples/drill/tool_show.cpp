// SPDX-License-Identifier: MIT
#include "tool_show.hpp"

#include "algorithms.hpp"
#include "checks.hpp"
#include "csv.hpp"
#include "cutting.hpp"
#include "roughness.hpp"
#include "run.hpp"
#include "scene.hpp"

#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/cutting_force.hpp>
#include <trephine/tool/named_tools.hpp>
#include <trephine/voxel/pressure_cut.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <limits>
#include <optional>
#include <type_traits>

namespace drill {
namespace {

using namespace trephine;

constexpr double kWorkTolerance = 0.02;  // of the work on chips; deposits that are not taken out yet are less

constexpr double kRadius = 1.5e-3;  // of the burrs [m]
// Finer voxels show no more of these tools, and a tick in them takes milliseconds.
constexpr double kFinest = 0.2e-3, kCoarser = 0.3e-3;  // [m]
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// How a tool is used.
struct Use {
  SpindleUse spindle;
  double down;   ///< speed of the hand toward the bone [m/s]
  double deep;   ///< where the hand ends below first touch [m]
  double along;  ///< and its speed sideways from there [m/s]
};
constexpr Use kBurr{.spindle = kBurrUse, .down = 6e-3, .deep = 5e-3, .along = 2.5e-3};
constexpr Use kDrill{.spindle = kDrillUse, .down = 4e-3, .deep = 12e-3, .along = 0};

/// A hand that presses straight down, slides along and withdraws.
class PressingHand {
 public:
  PressingHand(const Surgeon& surgeon, const Use& use, double radius)
      : use_(use),
        frame_W_(surgeon.frame_W()),
        // The tool's foremost point is a radius before its origin.
        start_W_(surgeon.spot().p_W + (radius + kClearance + surgeon.spot().unevenness) * frame_W_.col(2)),
        touches_((kClearance + surgeon.spot().unevenness) / use.down),
        // The slot's middle is the spot.
        back_(use.along * (kWithdraws - touches_ - use.deep / use.down) / 2) {}

  [[nodiscard]] HandTarget operator()(double time) const noexcept {
    const double still = std::min(time, kWithdraws);
    const double down = std::min(use_.down * still, use_.down * touches_ + use_.deep);
    const double along = use_.along * std::max(still - touches_ - use_.deep / use_.down, 0.0) - back_;
    const double up = std::max(time - kWithdraws, 0.0) * kUp;
    return {make_pose<double>(frame_W_, start_W_ + along * frame_W_.col(0) + (up - down) * frame_W_.col(2)), 1U};
  }
  [[nodiscard]] double seconds() const noexcept { return kSeconds; }

  static constexpr double kWithdraws = 2.5, kSeconds = 2.8;  // when it begins and ends to withdraw [s]

 private:
  static constexpr double kUp = 60e-3;        // [m/s]
  static constexpr double kClearance = 1e-3;  // between tool and bone at the start [m]

  Use use_;
  Mat3d frame_W_;
  Vec3d start_W_;
  double touches_, back_;
};

/// Strengths by the image of the voxels that reach the isovalue before and not after: their own, and of the densest
/// voxel that the head may touch at the same time.
MeanStrength strength_of_removed(const Bone& before, const Grid& after, double radius) {
  const int near = static_cast<int>(std::ceil(2 * radius / before.grid.spacing().minCoeff()));
  const BoneStrength strength = strength_of(before);
  const auto& n = after.size();
  MeanStrength sum;
  int count = 0;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const double density = before.grid.at(i, j, k);
        if (density < before.isovalue || after.at(i, j, k) >= before.isovalue) continue;
        double densest = density;
        for (int c = std::max(k - near, 0); c <= std::min(k + near, n[2] - 1); ++c)
          for (int b = std::max(j - near, 0); b <= std::min(j + near, n[1] - 1); ++b)
            for (int a = std::max(i - near, 0); a <= std::min(i + near, n[0] - 1); ++a)
              densest = std::max<double>(densest, before.grid.at(a, b, c));
        sum.voxels += strength(density);
        sum.densest += strength(densest);
        ++count;
      }
  sum.voxels /= std::max(count, 1);
  sum.densest /= std::max(count, 1);
  return sum;
}

/// Runs one tool in one scene, which has a CuttingForce or not.
template <bool kLaw, class Scene>
ToolRun pressed(Scene& scene, const Bone& about, const Options& options, const PressingHand& hand, const Surgeon& at,
                const Use& use, const std::string& tool) {
  ToolRun run{.tool = tool, .law = kLaw, .force_scale = kLaw ? use.spindle.force_scale : 1, .rows = {}, .strength = {}};
  run.rows.reserve(static_cast<std::size_t>(1000 * hand.seconds()) + 16);
  const Vec3d up = at.frame_W().col(2);
  double strong_mm3 = 0, strength = 0;
  const auto watch = [&](const LogRow& row) noexcept {
    const double removed = row.removed_mm3 - (run.rows.empty() ? 0 : run.rows.back().removed_mm3);
    ToolRow now{.time = row.time,
                .force_W = row.wrench.force,
                .thrust = row.wrench.force.norm(),
                .torque = kNone,
                .spindle = kNone,
                .feed = kNone};
    const double radius = scene.renderer().shape().tip_radius;
    now.depth = -up.dot(row.drawn.translation() - radius * row.drawn.linear().col(2) - at.spot().p_W);
    now.removed_mm3 = row.removed_mm3;
    now.presses = row.contact.count > 0 && row.time < PressingHand::kWithdraws;
    now.status = row.status;
    if constexpr (kLaw) {
      const CuttingForce& cutting = scene.cutting().law();
      const CuttingSummary& c = row.cutting;
      now.thrust = c.thrust, now.torque = c.torque, now.spindle = c.spindle, now.feed = c.feed;
      run.chip_work = cutting.report().chip_work;
      // Mean over the head where it cuts; a cut that runs ahead of contact has that of the last contact.
      if (cutting.engagement().area > 0) strength = cutting.engagement().hard_area / cutting.engagement().area;
      strong_mm3 += strength * removed;
    }
    run.rows.push_back(now);
  };
  (void)perform("coupled", scene, hand, 0, options.real_time, tool + (kLaw ? ", cutting law" : ""), watch);
  run.strength = strength_of_removed(about, scene.bone(), scene.renderer().shape().tip_radius);
  run.strength.law = strong_mm3 / std::max(run.rows.back().removed_mm3, 1e-9);
  return run;
}

const char* name_of(const ToolRun& run) { return run.law ? "with" : "without"; }

}  // namespace

bool shown_tools_fit(const Bone& bone) { return 3 * bone.grid.spacing().minCoeff() <= kRadius; }

ToolShow show_tools(const Bone& read, const Options& options, const Surgeon& surgeon) {
  Options coarser;
  coarser.voxel = kCoarser;
  const std::optional<Bone> coarse =
      read.grid.spacing().maxCoeff() < kFinest ? resampled_around(read, surgeon.spot().p_W, coarser) : std::nullopt;
  const Bone& bone = coarse ? *coarse : read;
  ToolShow show{.runs = {}, .seconds = PressingHand::kSeconds, .voxel = bone.grid.spacing().maxCoeff()};
  Grid grid = fresh_copy(bone.grid);
  const DeviceLimits limits{.force = kMaxForce, .torque = kMaxTorque};
  const CoupledOptions gains{
      .stiffness = kStiffness, .rotational_stiffness = 0.3, .force = kMaxForce, .torque = kMaxTorque};
  for (const char* const name : kShownTools) {
    const NamedTool tool = tool_by_name(name);
    const Use& use = tool.edges.chisel ? kDrill : kBurr;
    const double radius = tool.tool.burr().tip_radius;
    const PressingHand hand(surgeon, use, radius);
    const CoupledToolRenderer renderer{tool.tool, gains};
    const auto run = [&]<bool kLaw>(std::bool_constant<kLaw>, auto&& scene) {
      show.runs.push_back(pressed<kLaw>(scene, bone, options, hand, surgeon, use, name));
      grid.restore();
    };
    run(std::false_type{}, HapticScene{grid, bone.isovalue, renderer, Cutting{bite(radius)}, limits});
    const CuttingForce law(cutting_with(tool.edges, strength_of(bone), use.spindle));
    run(std::true_type{}, HapticScene{grid, bone.isovalue, renderer, Cutting{PressureCut{}, law}, limits});
  }
  return show;
}

ToolFigures figures_of(const ToolRun& run) {
  ToolFigures f;
  std::vector<Vec3d> forces;
  for (const ToolRow& r : run.rows) {
    const double force = r.force_W.norm();
    // A NaN stays: std::max returns its first argument then.
    f.most_force = std::isnan(force) ? force : std::max(f.most_force, force);
    if (!r.presses) continue;
    forces.push_back(r.force_W);
    f.force += force;
    f.thrust += r.thrust;
    f.torque += r.torque;
    f.removed_mm3 = r.removed_mm3;
  }
  const auto n = static_cast<double>(std::max<std::size_t>(forces.size(), 1));
  f.force /= n, f.thrust /= n, f.torque /= n;
  f.ripple = roughness(forces);
  f.per_thrust = f.removed_mm3 / (1e-3 * n * f.thrust);
  return f;
}

void print_table(const ToolShow& show) {
  std::printf("\n%-13s %-8s %8s %8s %8s %8s %9s %11s\n", "tool", "law", "force", "ripple", "thrust", "torque",
              "removed", "by thrust");
  std::printf("%-13s %-8s %8s %8s %8s %8s %9s %11s\n", "", "", "N", "N", "N", "N mm", "mm3", "mm3/(N s)");
  for (const ToolRun& run : show.runs) {
    const ToolFigures f = figures_of(run);
    std::printf("%-13s %-8s %8.2f %8.3f %8.3g ", run.tool.c_str(), name_of(run), f.force, f.ripple, f.thrust);
    if (run.law)
      std::printf("%8.3g", 1e3 * f.torque);
    else
      std::printf("%8s", "-");
    std::printf(" %9.3g %11.3g\n", f.removed_mm3, f.per_thrust);
  }
  std::printf(
      "in voxels of %.3g mm; force: mean on the device while the tool presses; ripple: root mean square of it above\n"
      "10 Hz; thrust and torque: true ones. With the law the device gets a drill's divided by %.3g, and all of a "
      "burr's.\n",
      1e3 * show.voxel, 1 / kDrillUse.force_scale);
}

void write_csv(const ToolShow& show, const std::string& path) {
  Csv csv(path,
          "time_s,tool,law,force_N,fx_N,fy_N,fz_N,thrust_N,torque_Nm,spindle_rpm,feed_m_per_s,depth_m,removed_mm3,"
          "presses,status");
  for (const ToolRun& run : show.runs)
    for (const ToolRow& r : run.rows)
      csv.row(r.time, run.tool.c_str(), name_of(run), r.force_W.norm(), r.force_W, r.thrust, r.torque,
              r.spindle / rpm(1), r.feed, r.depth, r.removed_mm3, r.presses ? 1 : 0, to_string(r.status));
  csv.close();
}

int check(const ToolShow& show) {
  Checks checks;
  std::array<char, 200> text{};
  // The run before a tool's run with the law is the same without.
  double without = 0;
  for (const ToolRun& run : show.runs) {
    const std::string name = run.tool + ", " + name_of(run) + " law: ";
    const ToolFigures f = figures_of(run);
    const bool served =
        std::all_of(run.rows.begin(), run.rows.end(), [](const ToolRow& r) { return r.status <= Status::kWorkBound; });
    checks.expect(served, name + "no tick ends with a fault");
    std::snprintf(text.data(), text.size(), "force is finite and at most the device's: %.2f of %.2f N", f.most_force,
                  kMaxForce);
    checks.expect(f.most_force <= kMaxForce, name + text.data());
    if (!run.law) {
      without = f.per_thrust;
      continue;
    }
    const double worked = run.worked_strength();
    std::snprintf(text.data(), text.size(), "the spindle works u s V on chips: %.4g J, %.2g %% off (limit 2 %%)",
                  run.chip_work, 100 * std::abs(worked / run.strength.law - 1));
    checks.expect(std::abs(worked / run.strength.law - 1) <= kWorkTolerance, name + text.data());
    std::snprintf(text.data(), text.size(),
                  "that is bone of strength %.3f; by the image at least %.3f, at most %.3f near it", worked,
                  run.strength.voxels, run.strength.densest);
    checks.expect(worked >= run.strength.voxels && worked <= run.strength.densest, name + text.data());
    std::snprintf(text.data(), text.size(), "thrust removes less than without: %.3g of %.3g mm3/(N s)", f.per_thrust,
                  without);
    checks.expect(f.per_thrust < without, name + text.data());
  }
  return checks.failed();
}

}  // namespace drill
