// SPDX-License-Identifier: MIT
#include "scene.hpp"
#include "ticks.hpp"

#include <trephine/device/replay.hpp>
#include <trephine/session/recording_file.hpp>

#include <pybind11/stl/filesystem.h>

#include <filesystem>
#include <utility>
#include <vector>

using namespace trephine_python;

namespace {

Recording record(PythonScene& self, const Numbers& poses, const py::object& spindle, const py::object& dt) {
  const Work work(self.bone);
  const Inputs inputs("Scene.record", -1, poses, spindle, dt);
  std::vector<RecordedTick> made;
  const py::gil_scoped_release release;
  made.reserve(inputs.ticks());
  self.scene.forget_wrench();
  for (std::size_t i = 0; i < inputs.ticks(); ++i) {
    const TickInput input = inputs.input(i);
    made.push_back({input, inputs.dt(i), self.scene.tick(input, inputs.dt(i))});
  }
  return Recording(std::move(made));
}

ReplayReport replay_in(PythonScene& self, const Session& session) {
  const Work work(self.bone);
  const py::gil_scoped_release release;
  return replay(std::span<const RecordedTick>(session.ticks), self.scene);
}

}  // namespace

void trephine_python::bind_recording(py::module_& m) {
  py::class_<ReplayReport>(m, "ReplayReport", "How a replay compares with its recording.")
      .def(pickled_members(&ReplayReport::ticks, &ReplayReport::different, &ReplayReport::first_different))
      .def_readonly("ticks", &ReplayReport::ticks, "ticks that were run")
      .def_readonly("different", &ReplayReport::different, "ticks with an output that differs in a bit")
      .def_readonly("first_different", &ReplayReport::first_different, "the first of them; None: there is none");
  py::class_<Recording, Session>(m, "Recording",
                                 "A session that `Scene.record` made, with no events, in a file of its own kind.")
      .def_static(
          "load",
          [](const std::filesystem::path& path) { return with_file([&] { return Recording(load_recording(path)); }); },
          py::arg("path"), "Reads a file of `save`, or of the headers' save_recording. Raises OSError.")
      .def(
          "save",
          [](const Recording& r, const std::filesystem::path& path) {
            with_file([&] { save_recording(path, r.ticks); });
          },
          py::arg("path"), "Writes a file. Raises OSError.")
      .def(py::pickle([](const Recording& r) { return py::bytes(bytes_of(r.ticks)); },
                      [](const py::bytes& bytes) { return Recording{ticks_of(bytes)}; }));
}

void trephine_python::bind_records(py::class_<PythonScene, ScenePointer>& scene) {
  scene
      .def("record", &record, py::arg("poses"), py::arg("spindle") = true, py::arg("dt") = 1e-3,
           "As `run`, and returns a Recording. It takes it that no wrench acts at the start, as a replay does.")
      .def("replay", &replay_in, py::arg("session"),
           "Ticks with the inputs of a Session or a Recording, and compares each result bit by bit. The scene and its\n"
           "bone must be as they were when it began.");
}
