// SPDX-License-Identifier: MIT
#include "scene.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

using namespace trephine_python;

namespace {

using compiled::LabelGeometry;

StructuresPointer make_structures(const py::object& from, const Numbers& spacing, const std::optional<Numbers>& X_GS,
                                  double reach, bool smooth, int threads) {
  const char* const who = "Structures";
  const py::array labels = to_array(who, "labels", from);
  LabelGeometry geometry{.size = size_of(who, labels), .spacing = to_spacing(who, spacing)};
  geometry.field = {.smooth = smooth, .reach = reach, .threads = threads};
  if (X_GS) geometry.X_GS = to_pose(who, *X_GS);
  if (!py::isinstance<py::array_t<std::uint8_t>>(labels))
    refuse(who, "labels must be uint8; see numpy.astype", std::string(py::str(labels.dtype())));
  const auto whole = py::array_t<std::uint8_t, py::array::c_style>::ensure(labels);
  std::vector<std::uint8_t> voxels(whole.data(), whole.data() + whole.size());
  const py::gil_scoped_release release;
  return std::make_shared<PythonStructures>(geometry, std::move(voxels));
}

/// The arguments that make them again. How many threads do so changes no bit.
py::tuple state_of(const PythonStructures& self) {
  const auto& [size, spacing, X_GS, field] = self.geometry;
  const py::array_t<std::uint8_t> labels({size[2], size[1], size[0]}, self.labels.data());
  return py::make_tuple(labels, from_vector(spacing), from_pose(X_GS), field.reach, field.smooth, field.threads);
}
StructuresPointer structures_of_state(const py::tuple& state) {
  return make_structures(state[0], state[1].cast<Numbers>(), state[2].cast<Numbers>(), state[3].cast<double>(),
                         state[4].cast<bool>(), state[5].cast<int>());
}

SceneStructures chosen(const StructuresPointer& structures, std::optional<std::vector<ProtectedStructure>> each,
                       const ProtectionOptions& options) {
  if (!each) each = std::vector<ProtectedStructure>(static_cast<std::size_t>(structures->count()));
  return {structures, std::move(*each), options};
}

/// A protection, with what copies of the scene need once it is in.
struct PythonProtection {
  compiled::Protection protection;
  std::optional<SceneStructures> structures;
};

void set_structures(PythonScene& scene, const StructuresPointer& structures,
                    std::optional<std::vector<ProtectedStructure>> each, const ProtectionOptions& options) {
  SceneStructures made = chosen(structures, std::move(each), options);
  const Work work(scene.bone);
  const py::gil_scoped_release release;
  scene.set_structures(std::move(made));
}

PythonProtection make_protection(const PythonScene& scene, const std::optional<StructuresPointer>& structures,
                                 std::optional<std::vector<ProtectedStructure>> each,
                                 const ProtectionOptions& options) {
  if (!structures) return {scene.scene.make_protection(), {}};
  SceneStructures made = chosen(*structures, std::move(each), options);
  const py::gil_scoped_release release;
  return {scene.scene.make_protection(*made.distances, made.each, made.options), made};
}

void exchange(PythonScene& scene, PythonProtection& protection) {
  scene.bone->require_idle();
  scene.scene.exchange(protection.protection);
  std::swap(scene.structures, protection.structures);
}

}  // namespace

void trephine_python::bind_structures(py::module_& m) {
  py::enum_<GuardMode>(m, "GuardMode", "What a guard does about a structure.")
      .value("OFF", GuardMode::kOff)
      .value("WARN", GuardMode::kWarn, "warns within its margin")
      .value("PUSH", GuardMode::kPush, "also pushes the tool out of its margin");
  py::enum_<StructureVeto::Mode>(m, "VetoMode", "What cuts may do to a structure.")
      .value("FREE", StructureVeto::Mode::kFree, "cuts take it")
      .value("WATCH", StructureVeto::Mode::kWatch, "cuts take it, and it is counted")
      .value("PROTECT", StructureVeto::Mode::kProtect, "no cut takes bone in it or within its margin")
      .value("KEEP_IN", StructureVeto::Mode::kKeepIn, "no cut takes bone outside of it: a planned cavity");
  OptionsClass<GuardedStructure>(m, "GuardedStructure", "How a guard keeps the tool from a structure.")
      .field("mode", &GuardedStructure::mode, "off, warn or push")
      .field("margin", &GuardedStructure::margin, "distance at which the push begins [m]")
      .field("stiffness", &GuardedStructure::stiffness, "of the push [N/m]")
      .field("greatest_force", &GuardedStructure::greatest_force, "the push grows no further [N]")
      .field("damping", &GuardedStructure::damping, "of motion toward the structure [N s/m]")
      .done();
  OptionsClass<StructureVeto>(m, "StructureVeto", "What cuts may do to a structure.")
      .field("mode", &StructureVeto::mode, "free, watch, protect or keep in")
      .field("margin", &StructureVeto::margin, "[m]")
      .done();
  OptionsClass<ProtectedStructure>(m, "ProtectedStructure", "What the guard and what cuts do about a structure.")
      .field("guard", &ProtectedStructure::guard, "of the tool")
      .field("veto", &ProtectedStructure::veto, "of cuts")
      .done();
  OptionsClass<GuardPotentialOptions>(m, "GuardPotentialOptions", "Smoothness and stiffness of a guard.")
      .field("smoothing", &GuardPotentialOptions::smoothing, "spacing of the knots of smooth distances [m]")
      .field("budget", &GuardPotentialOptions::budget, "of the whole guard; None: no limit")
      .done();
  OptionsClass<GuardOptions>(m, "GuardOptions", "The push of a guard.")
      .field("push", &GuardOptions::push, "False: no force, but a report")
      .field("ramp_time", &GuardOptions::ramp_time, "in which a push fades in and out [s]")
      .done();
  OptionsClass<ProtectionOptions>(m, "ProtectionOptions", "Options of a protection for all structures.")
      .field("potential", &ProtectionOptions::potential, "distances")
      .field("guard", &ProtectionOptions::guard, "push")
      .done();
  using compiled::StructureTotals;
  py::class_<StructureTotals>(m, "StructureTotals", "What was counted of a structure.")
      .def(pickled_members(&StructureTotals::breaches, &StructureTotals::refused_mm3, &StructureTotals::taken_mm3))
      .def_readonly("breaches", &StructureTotals::breaches, "times that the tool went into it")
      .def_readonly("refused_mm3", &StructureTotals::refused_mm3, "protected bone that cuts would have taken")
      .def_readonly("taken_mm3", &StructureTotals::taken_mm3, "bone that cuts took while it was watched");
  const LabelGeometry defaults;
  py::class_<PythonStructures, StructuresPointer>(
      m, "Structures",
      "Distances to the structures of a segmentation. Immutable, for any number of scenes.\n\n"
      "`labels` is uint8 (z, y, x): 0 for none, and s + 1 for structure s. `spacing` is one length\n"
      "or three along x, y, z [m], and `X_GS` the labels' pose in the bone's frame; None: both share\n"
      "a grid. `reach` [m] is at least a margin and the tool's largest radius. Takes seconds, on\n"
      "`threads` threads; 0: as many as the machine has.")
      .def(py::init(&make_structures), py::arg("labels"), py::arg("spacing"), py::arg("X_GS") = py::none(),
           py::arg("reach") = defaults.field.reach, py::arg("smooth") = defaults.field.smooth,
           py::arg("threads") = defaults.field.threads)
      .def(py::pickle(&state_of, &structures_of_state))
      .def_property_readonly(
          "count", [](const PythonStructures& s) { return s.count(); }, "number of structures: the highest label");
  py::class_<PythonProtection>(m, "Protection", "Guard and vetoes that were made for a scene and are not in it.")
      .def(
          "totals", [](const PythonProtection& p, int structure) { return p.protection.totals(structure); },
          py::arg("structure"), "What was counted of a structure until the protection left the scene.");
}

void trephine_python::bind_protection(py::class_<PythonScene, ScenePointer>& scene) {
  scene
      .def("set_structures", &set_structures, py::arg("structures"), py::arg("each") = py::none(),
           py::arg("options") = ProtectionOptions{},
           "Guards structures and keeps cuts from them, instead of those before. `each` has a ProtectedStructure for\n"
           "each of them; None: the defaults for all. Takes up to seconds.")
      .def(
          "clear_structures",
          [](PythonScene& s) {
            s.bone->require_idle();
            s.scene.clear_structures();
            s.structures.reset();
          },
          "Takes guard and vetoes out.")
      .def("make_protection", &make_protection, py::arg("structures") = py::none(), py::arg("each") = py::none(),
           py::arg("options") = ProtectionOptions{},
           "A Protection for `exchange`, made on any thread and while `run` is at work. None: protects nothing.")
      .def("exchange", &exchange, py::arg("protection"),
           "Puts guard and vetoes in, and those before into `protection`.")
      .def(
          "totals",
          [](const PythonScene& s, int structure) {
            s.bone->require_idle();
            return s.scene.totals(structure);
          },
          py::arg("structure"), "StructureTotals since the structure's protection came in.")
      .def(
          "set_push",
          [](PythonScene& s, bool on) {
            s.bone->require_idle();
            s.scene.set_push(on);
          },
          py::arg("on"), "Switches the guard's push, which fades in or out.");
}
