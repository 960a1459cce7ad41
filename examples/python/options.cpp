// SPDX-License-Identifier: MIT
#include "bind.hpp"

#include <trephine/compiled/options.hpp>

using namespace trephine_python;

namespace {

void bind_renderers(py::module_& m) {
  OptionsClass<StiffnessBudget>(m, "StiffnessBudget",
                                "Largest tangent stiffness of a tool, for any number of contacts.")
      .field("linear", &StiffnessBudget::linear, "[N/m], > 0; must be given")
      .field("angular", &StiffnessBudget::angular, "about T [N m/rad], > 0; must be given")
      .done();
  OptionsClass<ProxyOptions>(m, "ProxyOptions", "Search steps and work limits of Line's proxies.")
      .field("step", &ProxyOptions::step, "largest tangential move and search step [voxels]")
      .field("iterations", &ProxyOptions::iterations, "tangential moves per tick")
      .field("path_steps", &ProxyOptions::path_steps, "samples along a path")
      .field("jump", &ProxyOptions::jump, "largest motion between two ticks, after which contact begins anew [m]")
      .field("slide", &ProxyOptions::slide, "longest way of the proxy over the probe's; None: no bound")
      .done();
  OptionsClass<CoupledOptions>(m, "CoupledOptions", "Options of the coupled tool: the device's gains.")
      .field("stiffness", &CoupledOptions::stiffness, "that the hand feels [N/m]")
      .field("rotational_stiffness", &CoupledOptions::rotational_stiffness,
             "[N m/rad]; infinity: translation alone, without torque")
      .field("force", &CoupledOptions::force, "largest force of the coupling: the device's [N]")
      .field("torque", &CoupledOptions::torque, "largest torque [N m]; 0 for devices without torque")
      .field("release", &CoupledOptions::release, "fastest change of the force besides stiffness times motion [N/s]")
      .field("jump", &CoupledOptions::jump, "largest motion between two ticks [m]; beyond it the tool is elsewhere")
      .field("bite", &CoupledOptions::bite, "by which the cutting pose lies ahead of the virtual tool [voxels]")
      .done();
  OptionsClass<LineOptions>(m, "LineOptions", "Options of the Line approximation.")
      .field("stiffness", &LineOptions::stiffness, "of the tip [N/m]")
      .field("shaft_stiffness", &LineOptions::shaft_stiffness, "of the shaft [N/m]; None: as the tip's")
      .field("proxy", &LineOptions::proxy, "steps and work limits")
      .field("rest_threshold", &LineOptions::rest_threshold, "motion up to which the tool rests [m]")
      .field("drawn_rate", &LineOptions::drawn_rate, "largest motion of the drawn tool over the tool's own")
      .field("budget", &LineOptions::budget, "limits the tangent stiffness; None: no limit")
      .done();
  OptionsClass<LineCounts>(m, "LineCounts", "Number of Line's vertices.")
      .field("shaft", &LineCounts::shaft, "along the shaft's centreline")
      .done();
  OptionsClass<SurfaceOptions>(m, "SurfaceOptions", "Options of the Surface approximation.")
      .field("stiffness", &SurfaceOptions::stiffness, "of the tip at a depth of half its radius [N/m]")
      .field("search_step", &SurfaceOptions::search_step, "of a vertex's search [voxels]")
      .field("jump", &SurfaceOptions::jump, "largest motion between two ticks, after which contact begins anew [m]")
      .field("budget", &SurfaceOptions::budget, "limits the tangent stiffness; None: no limit")
      .done();
  OptionsClass<SurfaceCounts>(m, "SurfaceCounts", "Numbers of Surface's vertices.")
      .field("sphere", &SurfaceCounts::sphere, "on the ball")
      .field("slices", &SurfaceCounts::slices, "slices along the shaft")
      .field("per_slice", &SurfaceCounts::per_slice, "round each slice")
      .done()
      .def_static("thesis", &SurfaceCounts::thesis, "The counts of the thesis.");
  py::class_<Coulomb>(m, "Coulomb", "Friction with a static and a kinetic coefficient, 0 <= kinetic <= static.")
      .def(py::init<>())
      .def(py::init<double>(), py::arg("static_coefficient"))
      .def(py::init<double, double>(), py::arg("static_coefficient"), py::arg("kinetic_coefficient"))
      .def_property_readonly("static_coefficient", &Coulomb::static_coefficient, "of a tool that sticks")
      .def_property_readonly("kinetic_coefficient", &Coulomb::kinetic_coefficient, "of a tool that slides")
      .def(
          py::pickle([](const Coulomb& c) { return py::make_tuple(c.static_coefficient(), c.kinetic_coefficient()); },
                     [](const py::tuple& state) { return Coulomb(state[0].cast<double>(), state[1].cast<double>()); }));
  py::enum_<compiled::RendererKind>(m, "RendererKind", "The three renderers.")
      .value("COUPLED", compiled::RendererKind::kCoupled)
      .value("LINE", compiled::RendererKind::kLine)
      .value("SURFACE", compiled::RendererKind::kSurface);
  using compiled::RendererOptions;
  OptionsClass<RendererOptions>(m, "RendererOptions", "Which renderer, and its options; the others' are not read.")
      .field("renderer", &RendererOptions::renderer, "which of the three")
      .field("friction", &RendererOptions::friction, "of the coupled tool and Line; None: frictionless")
      .field("coupled", &RendererOptions::coupled, "of the coupled tool")
      .field("line", &RendererOptions::line, "of Line")
      .field("line_counts", &RendererOptions::line_counts, "Line's vertices")
      .field("surface", &RendererOptions::surface, "of Surface")
      .field("surface_counts", &RendererOptions::surface_counts, "Surface's vertices")
      .done();
}

void bind_cuts(py::module_& m) {
  OptionsClass<GeometricCut>(m, "GeometricCut", "Removes all bone that the tool covers, at once.").done();
  OptionsClass<RateLimitedCut<>>(m, "RateLimitedCut", "Approaches the geometric cut in time.")
      .field("rate", &RateLimitedCut<>::rate, "that a wholly covered voxel loses [densities/s]")
      .field("reference_force", &RateLimitedCut<>::reference_force,
             "at which the rate holds, proportional to it [N]; 0: force plays no part")
      .field("most_force_factor", &RateLimitedCut<>::most_force_factor, "bound of force over reference_force")
      .done();
  OptionsClass<AdvancingCut>(m, "AdvancingCut", "Moves the bone's surface back at a speed.")
      .field("speed", &AdvancingCut::speed, "of a wholly covered surface [m/s], at most 1")
      .field("reference_force", &AdvancingCut::reference_force,
             "at which the speed holds, proportional to it [N]; 0: force plays no part")
      .field("most_force_factor", &AdvancingCut::most_force_factor, "bound of force over reference_force")
      .done();
  OptionsClass<PressureCut>(m, "PressureCut",
                            "Cuts as far as the thrust of a law allows, for the coupled tool: give `law` too.")
      .done();
  OptionsClass<CuttingOptions>(m, "CuttingOptions", "Options of every cut.")
      .field("slope", &CuttingOptions::slope, "of the cut [densities per voxel]; 0: chosen by the bone")
      .field("follow_probe", &CuttingOptions::follow_probe, "cut along the device's pose instead of the renderer's")
      .field("blocks", &CuttingOptions::blocks, "blocks of 16 voxels that a tick cuts, about; a large tool takes turns")
      .done();
  py::enum_<CuttingEdges::Kind>(m, "EdgeKind", "Edges along a head, or grains all over it.")
      .value("FLUTED", CuttingEdges::Kind::kFluted)
      .value("DIAMOND", CuttingEdges::Kind::kDiamond);
  OptionsClass<CuttingEdges>(m, "CuttingEdges", "Cutting edges of a tool.")
      .field("kind", &CuttingEdges::kind, "fluted or diamond")
      .field("flutes", &CuttingEdges::flutes, "edges round the axis; 0 for diamond")
      .field("chisel", &CuttingEdges::chisel, "a web on the axis presses bone aside: a twist drill")
      .field("wear", &CuttingEdges::wear, "share by which blunt edges' own forces have grown, 0 if sharp")
      .done();
  OptionsClass<BoneStrength>(m, "BoneStrength", "Strength of bone by its density, relative to cortical bone.")
      .field("soft", &BoneStrength::soft, "density without strength: of water")
      .field("cortical", &BoneStrength::cortical, "density of strength 1")
      .field("most", &BoneStrength::most, "upper bound of the strength")
      .done();
  OptionsClass<CuttingLaw>(m, "CuttingLaw", "A mechanistic law of cutting edges.")
      .field("energy", &CuttingLaw::energy, "of a chip by volume [J/m^3], of cortical bone")
      .field("thrust_ratio", &CuttingLaw::thrust_ratio, "thrust over force along the edge's way")
      .field("edge_force", &CuttingLaw::edge_force, "of an edge by length, along its way [N/m]")
      .field("edge_thrust", &CuttingLaw::edge_thrust, "likewise, against the feed [N/m]")
      .field("edge_radius", &CuttingLaw::edge_radius, "[m]")
      .field("grain_thrust", &CuttingLaw::grain_thrust, "thrust of a diamond's grains over their force along the way")
      .field("chisel", &CuttingLaw::chisel, "thrust of a twist drill's web by the drill's radius [N/m]")
      .done();
  OptionsClass<CuttingForceOptions>(m, "CuttingForceOptions", "Forces of cutting; the edges are the tool's.")
      .field("edges", &CuttingForceOptions::edges, "of the tool: `tool(...).edges`")
      .field("speed", &CuttingForceOptions::speed, "of the spindle without load [rad/s]")
      .field("clockwise", &CuttingForceOptions::clockwise, "seen from the handle")
      .field("stall_torque", &CuttingForceOptions::stall_torque, "at which the spindle stands [N m]")
      .field("inertia", &CuttingForceOptions::inertia, "of spindle and tool [kg m^2]")
      .field("strength", &CuttingForceOptions::strength, "of bone by its density")
      .field("law", &CuttingForceOptions::law, "of the edges")
      .field("force_scale", &CuttingForceOptions::force_scale, "share of the true forces that the device gets")
      .field("lag", &CuttingForceOptions::lag, "of the spindle [s]")
      .done();
}

void bind_stages(py::module_& m) {
  using Release = ReleaseLimit::Options;
  OptionsClass<Release>(m, "ReleaseLimit", "Keeps force and torque from stepping where bone gives way, for Line.")
      .field("stiffness", &Release::stiffness, "no less than the contact's tangent stiffness [N/m]")
      .field("rotational_stiffness", &Release::rotational_stiffness, "[N m/rad]")
      .field("release", &Release::release, "fastest change of the force besides stiffness times motion [N/s]")
      .done();
  using Impact = HuntCrossley::Options;
  OptionsClass<Impact>(m, "HuntCrossley", "Damping that grows with the contact's force.")
      .field("lambda_", &Impact::lambda, "lambda [s/m]: 1 adds 10 % at 0.1 m/s")
      .field("max_factor", &Impact::max_factor, "largest factor on the wrench")
      .field("lever", &Impact::lever, "longest lever arm of a contact [m]")
      .done();
  using Vibration = MillingVibration::Options;
  OptionsClass<Vibration>(m, "MillingVibration", "A sine on the force while the spindle turns in bone.")
      .field("frequency", &Vibration::frequency, "[Hz], at most 300")
      .field("per_force", &Vibration::per_force, "amplitude by contact force [N/N]")
      .field("per_removal", &Vibration::per_removal, "amplitude by removal rate [N/(mm^3/s)]")
      .field("amplitude_limit", &Vibration::amplitude_limit, "[N]")
      .done();
  OptionsClass<Damping::Options>(m, "Damping", "Viscous damping.")
      .field("linear", &Damping::Options::linear, "[N s/m]")
      .field("angular", &Damping::Options::angular, "[N m s/rad]")
      .field("only_in_contact", &Damping::Options::only_in_contact, "of the motion relative to the bone")
      .done();
  OptionsClass<FirstOrderFilter::Options>(m, "FirstOrderFilter", "Low-pass filter of force and torque.")
      .field("cutoff", &FirstOrderFilter::Options::cutoff, "[Hz]")
      .done();
  OptionsClass<AxisGuideOptions>(m, "AxisGuide", "Holds T's origin and +z on a line of the bone: a drill guide.")
      .field("point_G", &AxisGuideOptions::point_G, "a point of the line, three numbers in G [m]")
      .field("axis_G", &AxisGuideOptions::axis_G, "its direction out of the bone, as T's +z")
      .field("stiffness", &AxisGuideOptions::stiffness, "[N/m]")
      .field("angular_stiffness", &AxisGuideOptions::angular_stiffness, "[N m/rad]")
      .field("force", &AxisGuideOptions::force, "greatest [N]")
      .field("torque", &AxisGuideOptions::torque, "greatest [N m]")
      .field("damping", &AxisGuideOptions::damping, "across the line [N s/m]")
      .field("angular_damping", &AxisGuideOptions::angular_damping, "of the tilt [N m s/rad]")
      .field("capture_radius", &AxisGuideOptions::capture_radius, "at which the guide ends [m]")
      .field("capture_angle", &AxisGuideOptions::capture_angle, "likewise [rad]")
      .field("enabled", &AxisGuideOptions::enabled, "fades in and out")
      .field("ramp", &AxisGuideOptions::ramp, "of the fade [s]")
      .field("budget", &AxisGuideOptions::budget, "of this guide's stiffness")
      .done();
  OptionsClass<DepthStopOptions>(m, "DepthStop", "Pushes back along an axis beyond a plane across it.")
      .field("point_G", &DepthStopOptions::point_G, "where the axis meets the plane, three numbers in G [m]")
      .field("axis_G", &DepthStopOptions::axis_G, "direction of the push, out of the bone")
      .field("reach", &DepthStopOptions::reach, "of the tool beyond T's origin [m]: the tip's radius")
      .field("stiffness", &DepthStopOptions::stiffness, "[N/m]")
      .field("force", &DepthStopOptions::force, "greatest [N]")
      .field("damping", &DepthStopOptions::damping, "along the force [N s/m]")
      .field("capture_radius", &DepthStopOptions::capture_radius, "about the axis [m]; infinite: the whole plane")
      .field("enabled", &DepthStopOptions::enabled, "fades in and out")
      .field("ramp", &DepthStopOptions::ramp, "of the fade [s]")
      .field("budget", &DepthStopOptions::budget, "of this guide's stiffness")
      .done();
  using Passivity = PassivityOptions;
  OptionsClass<Passivity>(m, "PassivityController", "Injects damping where the loop would give energy to the hand.")
      .field("stiffness", &Passivity::stiffness, "rendered stably by the device [N/m]")
      .field("angular_stiffness", &Passivity::angular_stiffness, "[N m/rad]")
      .field("delay", &Passivity::delay, "of the loop, without the hold [s]")
      .field("quantum", &Passivity::quantum, "of position readings [m]")
      .field("angular_quantum", &Passivity::angular_quantum, "[rad]")
      .field("contact_stiffness", &Passivity::contact_stiffness, "largest of the law [N/m]; 0: unknown")
      .field("contact_angular_stiffness", &Passivity::contact_angular_stiffness, "[N m/rad]")
      .field("damping", &Passivity::damping, "largest injected [N s/m]")
      .field("angular_damping", &Passivity::angular_damping, "[N m s/rad]")
      .field("force", &Passivity::force, "largest injected [N]")
      .field("torque", &Passivity::torque, "largest injected [N m]")
      .field("force_rate", &Passivity::force_rate, "fastest change of the injected force [N/s]")
      .field("torque_rate", &Passivity::torque_rate, "[N m/s]")
      .field("reserve", &Passivity::reserve, "largest credit and excess [J]")
      .field("memory", &Passivity::memory, "time constant of an excess [s]")
      .done();
  using Rate = WrenchRateLimit::Options;
  OptionsClass<Rate>(m, "WrenchRateLimit", "Turns steps of the wrench into slopes.")
      .field("force", &Rate::force, "fastest change [N/s]")
      .field("torque", &Rate::torque, "fastest change [N m/s]")
      .done();
  OptionsClass<DeviceLimits>(m, "DeviceLimits", "Limits the magnitudes of force and torque.")
      .field("force", &DeviceLimits::force, "[N]")
      .field("torque", &DeviceLimits::torque, "[N m]; 0 for a device without torque")
      .done();
  using compiled::StageOptions;
  OptionsClass<StageOptions>(m, "StageOptions", "The parts of a scene, in the order in which they run; None: absent.")
      .field("cut", &StageOptions::cut, "GeometricCut, RateLimitedCut, AdvancingCut or PressureCut; None cuts nothing")
      .field("cutting", &StageOptions::cutting, "options of every cut")
      .field("law", &StageOptions::law, "forces of cutting")
      .field("release_limit", &StageOptions::release_limit, "for Line: no step where bone gives way")
      .field("hunt_crossley", &StageOptions::hunt_crossley, "damping by the contact's force")
      .field("vibration", &StageOptions::vibration, "of the spindle")
      .field("damping", &StageOptions::damping, "viscous")
      .field("filter", &StageOptions::filter, "low-pass")
      .field("axis_guide", &StageOptions::axis_guide, "drill guide")
      .field("depth_stop", &StageOptions::depth_stop, "stop at a depth")
      .field("passivity", &StageOptions::passivity, "passivity control")
      .field("rate_limit", &StageOptions::rate_limit, "of the wrench")
      .field("limits", &StageOptions::limits, "of the device; unlimited unless given")
      .done();
}

}  // namespace

void trephine_python::bind_options(py::module_& m) {
  bind_renderers(m);
  bind_cuts(m);
  bind_stages(m);
}
