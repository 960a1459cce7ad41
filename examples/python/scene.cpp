// SPDX-License-Identifier: MIT
#include "scene.hpp"
#include "status.hpp"
#include "ticks.hpp"

#include <trephine/device/presets.hpp>

#include <array>
#include <span>
#include <string>
#include <utility>

using namespace trephine_python;

namespace {

using compiled::RendererKind;
using compiled::RendererOptions;
using compiled::StageOptions;

compiled::Scene make_scene(const compiled::Bone& bone, double isovalue, const SceneTool& tool,
                           const RendererOptions& renderer, const StageOptions& stages) {
  return std::visit([&](const auto& one) { return compiled::Scene(bone, isovalue, one, renderer, stages); }, tool);
}

RendererOptions renderer_of(const py::object& from) {
  RendererOptions o;
  if (py::isinstance<RendererOptions>(from)) return from.cast<RendererOptions>();
  if (py::isinstance<CoupledOptions>(from)) {
    o.coupled = from.cast<CoupledOptions>();
    return o;
  }
  if (py::isinstance<DevicePreset>(from)) {
    o.coupled = static_cast<CoupledOptions>(from.cast<const DevicePreset&>());
    return o;
  }
  if (py::isinstance<LineOptions>(from)) {
    o.renderer = RendererKind::kLine;
    o.line = from.cast<LineOptions>();
    return o;
  }
  if (py::isinstance<SurfaceOptions>(from)) {
    o.renderer = RendererKind::kSurface;
    o.surface = from.cast<SurfaceOptions>();
    return o;
  }
  const std::string name = py::str(from);
  for (const auto& [known, kind] : {std::pair{"coupled", RendererKind::kCoupled},
                                    {"line", RendererKind::kLine},
                                    {"surface", RendererKind::kSurface}})
    if (py::isinstance<py::str>(from) && name == known) {
      o.renderer = kind;
      return o;
    }
  refuse("Scene",
         "renderer must be coupled, line or surface, or CoupledOptions, LineOptions, SurfaceOptions, "
         "RendererOptions or a DevicePreset",
         std::string(py::repr(from)));
}

/// Splits keywords by the struct that has them: friction and counts are the renderer's, the rest are stages.
ScenePointer scene_of(const BonePointer& bone, double isovalue, const SceneTool& tool, const py::object& renderer,
                      const py::kwargs& parts) {
  bone->require_idle();
  RendererOptions by = renderer_of(renderer);
  py::dict of_renderer, of_stages;
  for (const auto& [key, value] : parts) {
    const bool own = py::type::of<RendererOptions>().attr("_fields").contains(key);
    (own ? of_renderer : of_stages)[key] = value;
  }
  StageOptions stages;
  set_options(by, of_renderer);
  set_options(stages, of_stages);
  return std::make_shared<PythonScene>(bone, isovalue, tool, by, stages);
}

TickResult tick(PythonScene& self, const Numbers& pose, bool spindle, double dt, const std::optional<LogPointer>& log,
                const std::optional<ScoresPointer>& scores) {
  self.bone->require_idle();
  if (!(dt > 0)) refuse("Scene.tick", "dt must be > 0 s", dt);
  const TickInput input{.X_WT = to_pose("Scene.tick", pose), .spindle_on = spindle};
  if (!log && !scores) return self.scene.tick(input, dt);
  const Work work(self.bone);
  const Observers observers(log, scores);
  const py::gil_scoped_release release;
  const TickResult result = self.scene.tick(input, dt);
  observers(input, dt, result);
  return result;
}

py::dict run(PythonScene& self, const Numbers& poses, const py::object& spindle, const py::object& dt,
             const std::optional<LogPointer>& log, const std::optional<ScoresPointer>& scores) {
  constexpr std::size_t kTicksBetweenSignals = 2048;
  const Work work(self.bone);
  const Inputs inputs("Scene.run", -1, poses, spindle, dt);
  const Observers observers(log, scores);
  Columns columns(inputs.shape(), self.structures.has_value(), self.scene.stages().law.has_value());
  {
    const py::gil_scoped_release release;
    for (std::size_t i = 0; i < inputs.ticks(); ++i) {
      const TickInput input = inputs.input(i);
      const TickResult result = self.scene.tick(input, inputs.dt(i));
      columns.put(i, result);
      observers(input, inputs.dt(i), result);
      if (i % kTicksBetweenSignals == kTicksBetweenSignals - 1) {
        const py::gil_scoped_acquire acquire;
        raise_signals();
      }
    }
  }
  return columns.dict();
}

void set_tool(PythonScene& self, const SceneTool& tool) {
  self.bone->require_idle();
  std::visit([&](const auto& one) { self.scene.set_tool(one); }, tool);
  self.tool = tool;
}

py::dict contacts(const PythonScene& self) {
  self.bone->require_idle();
  std::array<ContactPoint<double>, 4096> points;
  const std::size_t count = self.scene.contacts_W(points);
  const auto n = static_cast<py::ssize_t>(count);
  py::array_t<double> position({n, py::ssize_t{3}}), normal({n, py::ssize_t{3}}), force({n, py::ssize_t{3}});
  for (std::size_t i = 0; i < count; ++i)
    for (int a = 0; a < 3; ++a) {
      const auto row = static_cast<py::ssize_t>(i);
      position.mutable_at(row, a) = points[i].position[a];
      normal.mutable_at(row, a) = points[i].normal[a];
      force.mutable_at(row, a) = points[i].force[a];
    }
  py::dict made;
  made["position"] = position;
  made["normal"] = normal;
  made["force"] = force;
  return made;
}

void bind_results(py::module_& m) {
  int_enum(
      m, "Status",
      {{"OK", static_cast<int>(Status::kOk)},
       {"WORK_BOUND", static_cast<int>(Status::kWorkBound)},
       {"STARTED_INSIDE", static_cast<int>(Status::kStartedInside)},
       {"JUMP", static_cast<int>(Status::kJump)},
       {"BAD_INPUT", static_cast<int>(Status::kBadInput)},
       {"NON_FINITE", static_cast<int>(Status::kNonFinite)},
       {"FAR_AWAY", static_cast<int>(Status::kFarAway)}},
      "Outcome of a tick, by severity; `run` gives its number.\n\n"
      "WORK_BOUND: a search ended early, and the next tick continues it. STARTED_INSIDE: tool and bone overlapped at "
      "a\n"
      "start or a restore. JUMP: tool or bone moved farther than a hand moves it, and nothing was cut. BAD_INPUT: the\n"
      "pose is not finite or no rotation; zero wrench. NON_FINITE: a law overflowed; zero wrench. FAR_AWAY: the tool\n"
      "stays far from the bone: are poses in metres?");
  py::class_<ContactSummary>(m, "ContactSummary", "The contact of a tick.")
      .def(pickled_in_tick<ContactSummary>([](auto& r) -> auto& { return r.contact; }))
      .def_readonly("count", &ContactSummary::count, "places that touch")
      .def_readonly("tip", &ContactSummary::tip, "the ball or head touches")
      .def_readonly("shaft", &ContactSummary::shaft, "the shaft touches")
      .def_readonly("depth", &ContactSummary::depth, "deepest penetration [m]");
  py::class_<StructureSummary>(m, "StructureSummary", "Structures in a tick.")
      .def(pickled_in_tick<StructureSummary>([](auto& r) -> auto& { return r.structures; }))
      .def_readonly("nearest", &StructureSummary::nearest, "number of the structure nearest to the tool; -1: unknown")
      .def_readonly("distance", &StructureSummary::distance, "of the whole tool from it [m], negative inside")
      .def_readonly("warns", &StructureSummary::warns, "it is guarded and nearer than its margin")
      .def_property_readonly(
          "push_force", [](const StructureSummary& s) { return from_vector(s.push.force); }, "(3,) W axes [N]")
      .def_property_readonly(
          "push_torque", [](const StructureSummary& s) { return from_vector(s.push.torque); }, "(3,) W axes [N m]")
      .def_readonly("refused_mm3", &StructureSummary::refused_mm3, "protected bone that cuts would have taken")
      .def_readonly("taken_mm3", &StructureSummary::taken_mm3, "bone of watched structures that cuts took");
  py::class_<CuttingSummary>(m, "CuttingSummary", "True forces of cutting in a tick, before the device's share.")
      .def(pickled_in_tick<CuttingSummary>([](auto& r) -> auto& { return r.cutting; }))
      .def_readonly("thrust", &CuttingSummary::thrust, "[N]")
      .def_readonly("spindle_torque", &CuttingSummary::torque, "of the bone about the spindle's axis [N m]")
      .def_readonly("spindle_speed", &CuttingSummary::spindle, "[rad/s]")
      .def_readonly("feed", &CuttingSummary::feed, "at which the head may advance [m/s]");
  py::class_<TickResult>(m, "TickResult", "What a tick returns.")
      .def(pickled_in_tick<TickResult>([](auto& r) -> auto& { return r; }))
      .def_property_readonly(
          "force", [](const TickResult& r) { return from_vector(r.wrench.force); }, "(3,) on the tool, W axes [N]")
      .def_property_readonly(
          "torque", [](const TickResult& r) { return from_vector(r.wrench.torque); },
          "(3,) on the tool about T's origin, W axes [N m]")
      .def_property_readonly(
          "status", [](const TickResult& r) { return r.status; }, "outcome of the tick")
      .def_readonly("removed_mm3", &TickResult::removed_mm3, "bone removed in this tick [mm^3]")
      .def_readonly("contact", &TickResult::contact, "contact of tool and bone")
      .def_readonly("structures", &TickResult::structures, "distances, push and volumes of structures")
      .def_readonly("cutting", &TickResult::cutting, "true forces of a law")
      .def("__repr__", [](const TickResult& r) {
        return "<trephine.TickResult force=" + std::string(py::str(from_vector(r.wrench.force))) +
               " torque=" + std::string(py::str(from_vector(r.wrench.torque))) + " status=" + to_string(r.status) + ">";
      });
}

}  // namespace

PythonScene::PythonScene(BonePointer of, double at, const SceneTool& with, const RendererOptions& by,
                         const StageOptions& stages)
    : bone(std::move(of)),
      isovalue(at),
      tool(with),
      renderer(by),
      scene(make_scene(bone->bone, isovalue, tool, renderer, stages)) {}

PythonScene::PythonScene(const PythonScene& other)
    : isovalue(other.isovalue),
      tool(other.tool),
      renderer(other.renderer),
      structures(other.structures),
      scene(other.scene.copy()) {
  bone = std::make_shared<PythonBone>(PythonBone{scene.bone(), other.bone->keeps_original});
}

void PythonScene::take(const PythonScene& other) {
  bone->require_idle();
  other.bone->require_idle();
  scene.take(other.scene);
  tool = other.tool;
  structures = other.structures;
}

void PythonScene::set_structures(SceneStructures made) {
  scene.set_structures(*made.distances, made.each, made.options);
  structures = std::move(made);
}

void trephine_python::bind_scene(py::module_& m) {
  bind_results(m);
  const auto idle = [](const PythonScene& s) -> const compiled::Scene& {
    s.bone->require_idle();
    return s.scene;
  };
  py::class_<PythonScene, ScenePointer> c(
      m, "Scene",
      "A tool in a bone.\n\n"
      "Scene(bone, isovalue, tool, renderer=\"coupled\", **parts)\n\n"
      "There is bone where densities are at least `isovalue`. `tool` is a Burr, or `tool(name)` for the coupled tool.\n"
      "`renderer` is \"coupled\", \"line\" or \"surface\", or the options of one of them, or a DevicePreset. `parts` "
      "are\n"
      "the fields of RendererOptions (friction, line_counts, ...) and StageOptions (cut, law, damping, limits, "
      "...).\n\n"
      "The results are those of trephine::compiled::Scene, bit for bit. Raises ValueError where an option is out of\n"
      "range. A scene belongs to one thread at a time, together with all other scenes of its bone.");
  c.def(py::init(&scene_of), py::arg("bone"), py::arg("isovalue"), py::arg("tool"), py::arg("renderer") = "coupled")
      .def("tick", &tick, py::arg("pose"), py::arg("spindle") = true, py::arg("dt") = 1e-3, py::arg("log") = py::none(),
           py::arg("scores") = py::none(),
           "One step of the loop.\n\n"
           "`pose` is X_WT, from the tool's frame T to the world W: (4, 4), or (7,) as x y z qx qy qz qw [m]. T's\n"
           "origin is the burr's centre, and its +z points along the shaft to the handle. `dt` is the time since the\n"
           "last tick [s]. A pose that cannot be used is no error: the status says so, and the wrench is zero. The "
           "tick\n"
           "is added to a SessionLog and to Scores that are given; a log that is full waits for the disk.")
      .def("run", &run, py::arg("poses"), py::arg("spindle") = true, py::arg("dt") = 1e-3, py::arg("log") = py::none(),
           py::arg("scores") = py::none(),
           "Ticks once for each pose, and returns a dict of arrays with a row a tick.\n\n"
           "`poses` is (N, 4, 4) or (N, 7); `spindle` and `dt` are one for all, or one a pose. The dict has\n"
           "force (N, 3) [N] and torque (N, 3) [N m] on the tool about T's origin in W axes, removed_mm3 (N,),\n"
           "depth (N,) [m], status (N,) as numbers of Status, contacts (N,), tip (N,) and shaft (N,). With structures\n"
           "it also has nearest, distance, warns, push_force, push_torque, refused_mm3 and taken_mm3, and with a law\n"
           "thrust, spindle_torque, spindle_speed and feed. The results equal those of `tick`, bit for bit. Each\n"
           "tick is added to `log` and `scores`, as in `tick`. Other threads of Python run meanwhile.")
      .def(
          "reset",
          [](PythonScene& s) {
            s.bone->require_idle();
            s.scene.reset();
          },
          "Forgets contact, velocity and the state of stages; bone and options stay.")
      .def(
          "forget_wrench",
          [](PythonScene& s) {
            s.bone->require_idle();
            s.scene.forget_wrench();
          },
          "Takes it that no wrench acts on the hand, as before a first tick.")
      .def_property(
          "stages", [](const PythonScene& s) { return s.scene.stages(); },
          [](PythonScene& s, const StageOptions& stages) {
            s.bone->require_idle();
            s.scene.set_stages(stages);
          },
          "a copy of the StageOptions; setting them keeps the state of stages that stay")
      .def_property(
          "tool", [](const PythonScene& s) { return s.tool; }, &set_tool,
          "Burr or NamedTool; setting it is for the coupled tool, and of the same kind")
      .def_property_readonly(
          "bone", [](const PythonScene& s) { return s.bone; }, "the bone")
      .def_property_readonly(
          "isovalue", [](const PythonScene& s) { return s.isovalue; }, "density of bone's surface")
      .def_property_readonly(
          "renderer", [](const PythonScene& s) { return s.renderer; }, "a copy of its options")
      .def_property_readonly(
          "stiffness", [idle](const PythonScene& s) { return idle(s).stiffness(); }, "of the contact, as felt [N/m]")
      .def(
          "tangent_stiffness", [idle](const PythonScene& s, double force) { return idle(s).tangent_stiffness(force); },
          py::arg("force"), "The same as a tangent where the contact presses with `force` [N].")
      .def_property_readonly(
          "bounds_wrench", [idle](const PythonScene& s) { return idle(s).bounds_wrench(); },
          "True if the wrench never steps")
      .def_property_readonly(
          "proxy_pose", [idle](const PythonScene& s) { return from_pose(idle(s).proxy_pose_W()); },
          "(4, 4) of the proxy in W, as the last good tick left it")
      .def_property_readonly(
          "visual_pose", [idle](const PythonScene& s) { return from_pose(idle(s).visual_pose_W()); },
          "(4, 4) where to draw the tool, likewise")
      .def_property_readonly(
          "cutting_pose", [idle](const PythonScene& s) { return from_pose(idle(s).cutting_pose_W()); },
          "(4, 4) of the tool that cuts, likewise")
      .def("contacts", &contacts,
           "Contacts of the last good tick: a dict of position [m], normal and force [N], (C, 3) in W axes.")
      .def(
          "warnings", [idle](const PythonScene& s) { return idle(s).warnings(); },
          "A sentence for each reason why results may be off.")
      .def(
          "copy",
          [](const PythonScene& s) {
            const Work work(s.bone);
            const py::gil_scoped_release release;
            return std::make_shared<PythonScene>(s);
          },
          "A scene on a copy of the bone, with the same contact, stages, structures and counts: both go on with the\n"
          "same bits.")
      .def("take", &PythonScene::take, py::arg("other"),
           "Puts bone and state to those of a copy of this scene, or of what this is a copy of: an undo, or the start "
           "of\n"
           "a trial, in about a millisecond. Raises ValueError for any other scene, and for a bone without its\n"
           "original.");
  bind_protection(c);
  bind_records(c);
  bind_state(c);
}
