// SPDX-License-Identifier: MIT
#include "settings.hpp"

#include "text.hpp"

#include <algorithm>
#include <cmath>

namespace pick {
namespace {

constexpr int kDefaultIterations = 16;
constexpr double kReach = 8;  // voxels that the default 16 moves of half a voxel cover

std::string burr_code(const trephine::Burr& b) {
  return text("const trephine::Burr burr{.tip_radius = %.6g, .shaft_radius = %.6g, .shaft_length = %.6g};  // metres\n",
              b.tip_radius, b.shaft_radius, b.shaft_length);
}

std::string renderer_code(const LineSetting& s, const Scene& scene) {
  const char* stepping = s.ray_cast ? "RayCast" : "TranslateRotate";
  return text("const trephine::ToolDiscretization tool{burr, trephine::LineCounts{.shaft = %d}};\n", s.vertices) +
         text("const trephine::LineOptions options{.stiffness = %.6g, .proxy = {.step = %.6g, .iterations = %d}};\n",
              scene.stiffness, s.step, s.iterations()) +
         text("const trephine::%s stepping{.stepping = {.step = %.6g}};\n", stepping, s.step) +
         "trephine::LineApproxRenderer renderer{tool, options, stepping};\n";
}

std::string renderer_code(const SurfaceSetting& s, const Scene& scene) {
  return text("const trephine::SurfaceCounts counts{.sphere = %d, .slices = %d, .per_slice = %d};\n", s.sphere,
              s.slices, s.per_slice) +
         "const trephine::ToolDiscretization tool{burr, counts};\n" +
         text("const trephine::SurfaceOptions options{.stiffness = %.6g, .search_step = %.6g};\n", scene.stiffness,
              s.search_step) +
         (s.patches ? "trephine::SurfaceApproxRenderer renderer{tool, options};\n"
                    : "trephine::SurfaceApproxRenderer<float, trephine::AreaWeights> renderer{tool, options};\n");
}

std::string renderer_code(const CoupledSetting&, const Scene& scene) {
  return text("const trephine::CoupledOptions options{.stiffness = %.6g, .force = %.6g, .torque = %.6g};\n",
              scene.stiffness, scene.max_force, scene.max_torque) +
         "trephine::CoupledToolRenderer renderer{burr, options};\n";
}

}  // namespace

int LineSetting::iterations() const {
  return std::clamp(static_cast<int>(std::ceil(kReach / step)), kDefaultIterations, 1000);
}

Algorithm algorithm_of(const Setting& setting) { return kAlgorithms[setting.index()]; }

std::string describe(const Setting& setting) {
  if (const auto* l = std::get_if<LineSetting>(&setting))
    return text("%d vertices, %s in steps of %.4g voxel", l->vertices, l->ray_cast ? "ray cast" : "translate-rotate",
                l->step);
  if (std::holds_alternative<CoupledSetting>(setting)) return "nothing to choose";
  const auto& s = std::get<SurfaceSetting>(setting);
  return text("sphere %d, %d slices of %d%s, search in steps of %.4g voxel", s.sphere, s.slices, s.per_slice,
              s.patches ? ", patches" : "", s.search_step);
}

std::string as_code(const Setting& setting, const Scene& scene) {
  return burr_code(scene.burr) + std::visit([&](const auto& s) { return renderer_code(s, scene); }, setting) +
         text("const trephine::DeviceLimits limits{.force = %.6g, .torque = %.6g};\n", scene.max_force,
              scene.max_torque) +
         text("trephine::HapticScene scene{bone, %.6g, renderer, trephine::Milling{}, limits};\n", scene.isovalue);
}

std::vector<Setting> settings_to_try(Algorithm algorithm, bool quick) {
  using Ints = std::vector<int>;
  using Steps = std::vector<double>;
  std::vector<Setting> all;
  if (algorithm == Algorithm::kLine) {
    const Ints vertices =
        quick ? Ints{20, 50, 100, 200, 400} : Ints{10, 20, 35, 50, 75, 100, 150, 200, 300, 400, 600, 1000};
    const Steps steps = {1, 0.5, 0.25};
    for (const int n : vertices)
      for (const double step : steps)
        for (const bool ray_cast : {false, true}) all.emplace_back(LineSetting{n, step, ray_cast});
    return all;
  }
  if (algorithm == Algorithm::kCoupled) return {CoupledSetting{}};
  const Ints sphere = quick ? Ints{26, 100, 400} : Ints{26, 50, 100, 200, 400, 800};
  const Ints slices = quick ? Ints{20, 40, 80, 160} : Ints{10, 20, 40, 80, 160, 320};
  const Ints per_slice = quick ? Ints{8, 16, 32} : Ints{4, 8, 16, 32};
  const Steps steps = quick ? Steps{0.5} : Steps{1, 0.5};
  for (const int a : sphere)
    for (const int b : slices)
      for (const int c : per_slice) {
        // Fine along the shaft and coarse round it, or the other way, is waste.
        if (c > 2 * b || b > 20 * c) continue;
        for (const double step : steps) all.emplace_back(SurfaceSetting{a, b, c, step, false});
        if (!quick) all.emplace_back(SurfaceSetting{a, b, c, 0.5, true});
      }
  return all;
}

Setting truth_setting(Algorithm algorithm, bool quick) {
  if (algorithm == Algorithm::kLine) return LineSetting{quick ? 2000 : 4000, quick ? 0.0625 : 0.03125, false};
  if (algorithm == Algorithm::kCoupled) return CoupledSetting{};
  return quick ? SurfaceSetting{4000, 320, 64, 0.125, false} : SurfaceSetting{8000, 640, 128, 0.0625, false};
}

Setting check_setting(Algorithm algorithm, bool quick) {
  if (algorithm == Algorithm::kLine) return LineSetting{quick ? 1000 : 2000, quick ? 0.125 : 0.0625, false};
  if (algorithm == Algorithm::kCoupled) return CoupledSetting{};
  return quick ? SurfaceSetting{2000, 160, 32, 0.25, false} : SurfaceSetting{4000, 320, 64, 0.125, false};
}

}  // namespace pick
