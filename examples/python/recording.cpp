// SPDX-License-Identifier: MIT
#include "scene.hpp"
#include "ticks.hpp"

#include <trephine/device/replay.hpp>
#include <trephine/session/recording_file.hpp>

#include <pybind11/stl/filesystem.h>

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

using namespace trephine_python;

namespace {

struct Recording {
  std::vector<RecordedTick> ticks;
};

/// Runs `body`; what the file system or a file's content refuses is an OSError.
template <class Body>
auto with_file(Body&& body) {
  try {
    const py::gil_scoped_release release;
    return body();
  } catch (const std::runtime_error& e) {
    PyErr_SetString(PyExc_OSError, e.what());
    throw py::error_already_set();
  }
}

Recording record(PythonScene& self, const Numbers& poses, const py::object& spindle, const py::object& dt) {
  const Work work(self.bone);
  const Inputs inputs("Scene.record", -1, poses, spindle, dt);
  Recording made;
  const py::gil_scoped_release release;
  made.ticks.reserve(inputs.ticks());
  self.scene.forget_wrench();
  for (std::size_t i = 0; i < inputs.ticks(); ++i) {
    const TickInput input = inputs.input(i);
    made.ticks.push_back({input, inputs.dt(i), self.scene.tick(input, inputs.dt(i))});
  }
  return made;
}

ReplayReport replay_in(PythonScene& self, const Recording& recording) {
  const Work work(self.bone);
  const py::gil_scoped_release release;
  return replay(std::span<const RecordedTick>(recording.ticks), self.scene);
}

py::ssize_t count(const Recording& r) { return static_cast<py::ssize_t>(r.ticks.size()); }

py::array_t<double> poses_of(const Recording& r) {
  py::array_t<double> poses({count(r), py::ssize_t{4}, py::ssize_t{4}});
  for (py::ssize_t t = 0; t < count(r); ++t)
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j)
        poses.mutable_at(t, i, j) =
            i < 3 ? r.ticks[static_cast<std::size_t>(t)].input.X_WT(i, j) : static_cast<double>(j == 3);
  return poses;
}

py::dict results_of(const Recording& r) {
  Columns columns({count(r)}, true, true);
  for (std::size_t t = 0; t < r.ticks.size(); ++t) columns.put(t, r.ticks[t].result);
  return columns.dict();
}

}  // namespace

void trephine_python::bind_recording(py::module_& m) {
  py::class_<ReplayReport>(m, "ReplayReport", "How a replay compares with its recording.")
      .def(pickled_members(&ReplayReport::ticks, &ReplayReport::different, &ReplayReport::first_different))
      .def_readonly("ticks", &ReplayReport::ticks, "ticks that were run")
      .def_readonly("different", &ReplayReport::different, "ticks with an output that differs in a bit")
      .def_readonly("first_different", &ReplayReport::first_different, "the first of them; None: there is none");
  py::class_<Recording>(m, "Recording", "Inputs and results of ticks, which `Scene.record` makes.")
      .def_static(
          "load",
          [](const std::filesystem::path& path) { return with_file([&] { return Recording{load_recording(path)}; }); },
          py::arg("path"), "Reads a file of `save`, or of the headers' save_recording. Raises OSError.")
      .def(
          "save",
          [](const Recording& r, const std::filesystem::path& path) {
            with_file([&] { save_recording(path, r.ticks); });
          },
          py::arg("path"), "Writes a file. Raises OSError.")
      .def(py::pickle([](const Recording& r) { return py::bytes(bytes_of(r.ticks)); },
                      [](const py::bytes& bytes) { return Recording{ticks_of(bytes)}; }))
      .def("__len__", [](const Recording& r) { return r.ticks.size(); })
      .def_property_readonly("poses", &poses_of, "(N, 4, 4) X_WT")
      .def_property_readonly(
          "spindle",
          [](const Recording& r) {
            py::array_t<bool> made(count(r));
            for (std::size_t t = 0; t < r.ticks.size(); ++t) made.mutable_data()[t] = r.ticks[t].input.spindle_on;
            return made;
          },
          "(N,) bool")
      .def_property_readonly(
          "dt",
          [](const Recording& r) {
            py::array_t<double> made(count(r));
            for (std::size_t t = 0; t < r.ticks.size(); ++t) made.mutable_data()[t] = r.ticks[t].dt;
            return made;
          },
          "(N,) [s]")
      .def("results", &results_of, "A dict of arrays as `Scene.run` returns it, with all columns.");
}

void trephine_python::bind_records(py::class_<PythonScene, ScenePointer>& scene) {
  scene
      .def("record", &record, py::arg("poses"), py::arg("spindle") = true, py::arg("dt") = 1e-3,
           "As `run`, and returns a Recording. It takes it that no wrench acts at the start, as a replay does.")
      .def("replay", &replay_in, py::arg("recording"),
           "Ticks with a recording's inputs, and compares each result bit by bit. The scene and its bone must be as\n"
           "they were when the recording began.");
}
