// SPDX-License-Identifier: MIT
#include "pick_study.hpp"
#include "pick_text.hpp"

namespace pick {
namespace {

/// A renderer's lines and the scene's parts that go with it: the cut, and stages before the device's limits.
struct Parts {
  std::string renderer;
  std::string listed;
};

std::string tool_code(const Scene& s) {
  if (!s.tool_name.empty())
    return text("const trephine::NamedTool drill = trephine::tool_by_name(\"%s\");\n", s.tool_name.c_str());
  return text(
      "const trephine::Burr drill{.tip_radius = %.6g, .shaft_radius = %.6g, .shaft_length = %.6g};  // metres\n",
      s.burr.tip_radius, s.burr.shaft_radius, s.burr.shaft_length);
}

std::string device_code(const Scene& s) {
  if (!s.device.empty())
    return text("const trephine::DevicePreset device = trephine::device_preset(\"%s\");\n", s.device.c_str());
  return text("const trephine::DeviceLimits limits{.force = %.6g, .torque = %.6g};\n", s.max_force, s.max_torque);
}

std::string stiffness_code(const Scene& s) {
  return s.device.empty() ? text("%.6g", s.stiffness) : std::string("device.stiffness");
}

// Its tip is a point: a cut at once leaves nothing to feel there, and it drops off edges without a limit. Tip and shaft
// add up, so the limit's stiffness is twice the renderer's.
Parts parts(const LineSetting& s, const Scene& scene) {
  const std::string stiffness = stiffness_code(scene);
  return {text("const trephine::ToolDiscretization tool{drill, trephine::LineCounts{.shaft = %d}};\n", s.vertices) +
              text("const trephine::LineOptions options{.stiffness = %s, .proxy = {.step = %.6g, .iterations = %d}};\n",
                   stiffness.c_str(), s.step, s.iterations()) +
              text("const trephine::TranslateRotate stepping{.stepping = {.step = %.6g}};\n", s.step) +
              "trephine::LineApproxRenderer renderer{tool, options, stepping};\n" +
              text("const trephine::ReleaseLimit release{{.stiffness = 2 * %s}};\n", stiffness.c_str()) +
              text("const trephine::AdvancingCut cut{.speed = %.6g};  // m/s: a radius deep in 0.2 s\n",
                   scene.burr.tip_radius / 0.2),
          "release, trephine::Cutting{cut}"};
}

// A device known by name gets the stages of its preset.
Parts parts(const SurfaceSetting& s, const Scene& scene) {
  const bool known = !scene.device.empty();
  return {text("const trephine::SurfaceCounts counts{.sphere = %d, .slices = %d, .per_slice = %d};\n", s.sphere,
               s.slices, s.per_slice) +
              "const trephine::ToolDiscretization tool{drill, counts};\n" +
              text("const trephine::SurfaceOptions options{.stiffness = %s, .search_step = %.6g%s};\n",
                   stiffness_code(scene).c_str(), s.search_step, known ? ", .budget = device.budget" : "") +
              "trephine::SurfaceApproxRenderer renderer{tool, options};\n" +
              (known ? "const trephine::HuntCrossley damping{device.hunt_crossley};\n"
                       "const trephine::PassivityController passivity{device.passivity};\n"
                       "const trephine::WrenchRateLimit rate{device.rate};\n"
                     : ""),
          known ? "trephine::Cutting{}, damping, passivity, rate" : "trephine::Cutting{}"};
}

Parts parts(const CoupledSetting&, const Scene& scene) {
  if (!scene.device.empty()) return {"trephine::CoupledToolRenderer renderer{drill, device};\n", "trephine::Cutting{}"};
  return {text("const trephine::CoupledOptions options{.stiffness = %.6g, .force = %.6g, .torque = %.6g};\n",
               scene.stiffness, scene.max_force, scene.max_torque) +
              "trephine::CoupledToolRenderer renderer{drill, options};\n",
          "trephine::Cutting{}"};
}

}  // namespace

std::string as_code(const Setting& setting, const Scene& scene) {
  const Parts p = std::visit([&](const auto& s) { return parts(s, scene); }, setting);
  return tool_code(scene) + device_code(scene) + p.renderer +
         text("trephine::HapticScene scene{bone, %.9g, renderer, %s, %s};\n", scene.density.value_or(scene.isovalue),
              p.listed.c_str(), scene.device.empty() ? "limits" : "device.limits");
}

}  // namespace pick
