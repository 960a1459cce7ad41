// SPDX-License-Identifier: MIT
#include "tool.hpp"

#include "bind.hpp"

#include <trephine/device/presets.hpp>

#include <map>
#include <string>
#include <utility>
#include <vector>

using namespace trephine_python;

void trephine_python::bind_tools(py::module_& m) {
  OptionsClass<Burr>(m, "Burr", "A ball at T's origin and a shaft along +z. Radii, not diameters.")
      .field("tip_radius", &Burr::tip_radius, "of the ball [m]")
      .field("shaft_radius", &Burr::shaft_radius, "[m]")
      .field("shaft_length", &Burr::shaft_length, "from the ball's centre to the shaft's end [m]; 0: no shaft")
      .done();
  const auto made = [](const std::string& name) { return PythonTool{tool_by_name(name), name}; };
  py::class_<PythonTool>(m, "NamedTool", "A tool of a catalogue, which `tool` makes; for the coupled tool alone.")
      .def_readonly("name", &PythonTool::name, "from which `tool` made it")
      .def_readonly("edges", &PythonTool::edges, "its cutting edges, for CuttingForceOptions")
      .def(py::pickle([](const PythonTool& t) { return t.name; }, made));
  m.def(
      "tool", made, py::arg("name"),
      "The tool with a name such as \"round-3\", \"match-head-3\" or \"twist-2.5\": a family and a diameter in mm.\n\n"
      "Raises ValueError, with all families and their diameters, for another name.");
  m.def(
      "tool_families",
      [] {
        std::map<std::string, std::pair<double, double>> families;
        for (const ToolFamily& f : kToolFamilies) families[std::string(f.name)] = {f.least, f.most};
        return families;
      },
      "The families of tools, each with its least and greatest diameter [mm].");

  OptionsClass<DeviceCapabilities>(m, "DeviceCapabilities", "What a device can do.")
      .field("name", &DeviceCapabilities::name, "")
      .field("input_dof", &DeviceCapabilities::input_dof, "3: position; 6: position and rotation")
      .field("output_dof", &DeviceCapabilities::output_dof, "3: force; 6: force and torque")
      .field("max_force", &DeviceCapabilities::max_force, "[N]")
      .field("max_torque", &DeviceCapabilities::max_torque, "[N m]")
      .field("stiffness", &DeviceCapabilities::stiffness, "largest that it renders stably at `rate` [N/m]")
      .field("angular_stiffness", &DeviceCapabilities::angular_stiffness, "[N m/rad]")
      .field("rate", &DeviceCapabilities::rate, "[Hz]")
      .done();
  OptionsClass<DevicePreset>(m, "DevicePreset", "Options of a scene for a device, to start tuning from.")
      .field("capabilities", &DevicePreset::capabilities, "of the device")
      .field("stiffness", &DevicePreset::stiffness, "option of the renderer [N/m]")
      .field("budget", &DevicePreset::budget, "of Line and Surface")
      .field("hunt_crossley", &DevicePreset::hunt_crossley, "stage")
      .field("passivity", &DevicePreset::passivity, "stage")
      .field("rate", &DevicePreset::rate, "stage: `rate_limit`")
      .field("limits", &DevicePreset::limits, "stage")
      .done()
      .def(
          "coupled", [](const DevicePreset& p) { return static_cast<CoupledOptions>(p); },
          "Options of the coupled tool; a Scene takes the preset itself as its renderer too.");
  m.def(
      "device_preset", [](const std::string& name) { return device_preset(name); }, py::arg("name"),
      "Options for a device by its name. Raises ValueError, with all names, for another.");
  m.def(
      "device_preset_names",
      [] {
        const auto names = device_preset_names();
        return std::vector<std::string>(names.begin(), names.end());
      },
      "The names of all presets.");
}
