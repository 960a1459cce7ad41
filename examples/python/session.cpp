// SPDX-License-Identifier: MIT
#include "session.hpp"

#include "scene.hpp"
#include "table.hpp"

#include <trephine/stage/motion.hpp>
#include <trephine/voxel/density_type.hpp>

#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <type_traits>

using namespace trephine_python;

namespace {

/// An array with what `get` returns of each tick.
template <class Get>
auto of_ticks(const Session& session, const Get& get) {
  py::array_t<std::invoke_result_t<Get, const RecordedTick&>> made(static_cast<py::ssize_t>(session.ticks.size()));
  auto* to = made.mutable_data();
  for (const RecordedTick& tick : session.ticks) *to++ = get(tick);
  return made;
}

py::array_t<double> poses_of(const Session& session) {
  py::array_t<double> poses({static_cast<py::ssize_t>(session.ticks.size()), py::ssize_t{4}, py::ssize_t{4}});
  double* to = poses.mutable_data();
  for (const RecordedTick& tick : session.ticks)
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) *to++ = i < 3 ? tick.input.X_WT(i, j) : static_cast<double>(j == 3);
  return poses;
}

py::dict results_of(const Session& session) {
  Columns columns({static_cast<py::ssize_t>(session.ticks.size())}, true, true);
  for (std::size_t t = 0; t < session.ticks.size(); ++t) columns.put(t, session.ticks[t].result);
  return columns.dict();
}

py::dict numbered(const std::vector<Session::Numbered>& records) {
  return table(records, Column{"position", &Session::Numbered::position}, Column{"number", &Session::Numbered::number});
}

/// A row for each voxel that changed.
py::dict changes_of(const Session& session) {
  py::ssize_t count = 0;
  for (const Session::Change& change : session.changes) count += static_cast<py::ssize_t>(change.brick.voxels.size());
  py::array_t<std::int64_t> position(count);
  py::array_t<int> index({count, py::ssize_t{3}});
  py::array_t<float> density(count);
  auto* to_position = position.mutable_data();
  auto* to_index = index.mutable_data();
  auto* to_density = density.mutable_data();
  for (const Session::Change& change : session.changes)
    for (const BrickChange::Voxel& voxel : change.brick.voxels) {
      *to_position++ = static_cast<std::int64_t>(change.position);
      for (const int i : session.bone->index(change.brick.brick, voxel.number)) *to_index++ = i;
      *to_density++ = voxel.density;
    }
  py::dict made;
  made["position"] = position;
  made["index"] = index;
  made["density"] = density;
  return made;
}

/// The bone's voxels (z, y, x) as the session left them, from those with which it began.
py::array changed(const Session& session, const py::array& voxels) {
  if (!session.bone) refuse("Session.changed", "the log must have followed a bone", "one without");
  const FollowedBone& bone = *session.bone;
  return with_density_type(bone.density, [&]<class Density>(std::type_identity<Density>) -> py::array {
    const auto& n = bone.geometry.size;
    const bool fits = py::isinstance<py::array_t<Density>>(voxels) && voxels.ndim() == 3 && voxels.shape(0) == n[2] &&
                      voxels.shape(1) == n[1] && voxels.shape(2) == n[0];
    py::array_t<Density> made(fits ? py::array::ShapeContainer{n[2], n[1], n[0]} : py::array::ShapeContainer{0});
    if (fits) {
      const auto given = py::array_t<Density, py::array::c_style | py::array::forcecast>(voxels);
      std::copy_n(given.data(), bone.voxels(), made.mutable_data());
    }
    const std::span<Density> densities(made.mutable_data(), static_cast<std::size_t>(made.size()));
    if (!bone.began_with(std::span<const Density>(densities)))
      refuse("Session.changed", "voxels must be those with which the session began", "others");
    for (const Session::Change& change : session.changes) apply_change(bone, change.brick, densities);
    return made;
  });
}

void bind_followed_bone(py::module_& m) {
  py::class_<FollowedBone>(m, "FollowedBone", "The bone of a session as it was when its log began to follow it.")
      .def_property_readonly(
          "size", [](const FollowedBone& b) { return b.geometry.size; }, "voxels along x, y, z")
      .def_property_readonly(
          "spacing", [](const FollowedBone& b) { return py::array_t<double>(3, b.geometry.spacing.data()); },
          "along x, y, z [m]")
      .def_property_readonly(
          "X_WG", [](const FollowedBone& b) { return from_pose(b.geometry.X_WG); }, "(4, 4) pose of its grid")
      .def_property_readonly(
          "outside", [](const FollowedBone& b) { return b.geometry.outside.value_or(0); }, "density beyond the grid")
      .def_property_readonly(
          "dtype",
          [](const FollowedBone& b) {
            return with_density_type(b.density, []<class Density>(std::type_identity<Density>) {
              return std::string(py::str(py::dtype::of<Density>()));
            });
          },
          "of its voxels, by NumPy's name")
      .def_readonly("isovalue", &FollowedBone::isovalue, "None: the program named none")
      .def_readonly("hash", &FollowedBone::hash, "FNV-1a of the densities with which the session began");
}

/// Adds a record, which is not dropped.
template <class Add>
void add_to(const LogPointer& log, const Add& add) {
  const Work work(log);
  const py::gil_scoped_release release;
  log->wait_for_room();
  add(*log->log);
}

void close(const LogPointer& log) {
  if (log->closed) return;
  {
    const Work work(log);
    log->closed = true;
    with_file([&] { log->log->close(); });
  }
}

void bind_log(py::module_& m) {
  py::class_<PythonLog, LogPointer>(
      m, "SessionLog",
      "Writes a session to a file while it runs, which `load_session` and `score` read.\n\n"
      "    with trephine.SessionLog(\"session.log\") as log:\n"
      "        scene.run(poses, log=log)\n\n"
      "It replaces a file that exists. A thread of its own writes at least every `flush` seconds, 0.01 to 0.5, so the\n"
      "file can be read up to there if the process is killed. `records` may wait for the disk; where more come, the\n"
      "call that adds them waits, so none is dropped. Raises OSError where the file cannot be written. One thread at "
      "a\n"
      "time; a log belongs to the calls that it is given to.")
      .def(py::init([](const std::filesystem::path& path, std::size_t records, double flush) {
             auto made = std::make_shared<PythonLog>();
             made->log = with_file([&] {
               return std::make_unique<SessionLog>(path, SessionLogOptions{records, flush});
             });
             return made;
           }),
           py::arg("path"), py::arg("records") = SessionLogOptions{}.records,
           py::arg("flush") = SessionLogOptions{}.flush)
      .def(
          "tool_changed",
          [](const LogPointer& log, int number) {
            add_to(log, [number](SessionLog& to) { (void)to.tool_changed(number); });
          },
          py::arg("number"), "From the next tick on the tool with this number is in the hand.")
      .def(
          "event",
          [](const LogPointer& log, std::int64_t number) {
            add_to(log, [number](SessionLog& to) { (void)to.event(number); });
          },
          py::arg("number"), "Something happened that the program has a number for.")
      .def(
          "follow",
          [](const LogPointer& log, const BonePointer& bone, std::optional<double> isovalue) {
            const Work of_log(log);
            const Work of_bone(bone);
            const py::gil_scoped_release release;
            log->log->follow(bone->bone, isovalue);
          },
          py::arg("bone"), py::arg("isovalue") = std::nullopt,
          "Also writes the voxels of the bone that change, at least every `flush` seconds, from now on. Once, before\n"
          "the first tick. The isovalue is for readers. Raises ValueError for a second bone.")
      .def("close", &close,
           "Writes all that is left, and the end. Raises OSError where the disk refused bytes. Once is enough.")
      .def("__enter__", [](LogPointer log) { return log; })
      .def(
          "__exit__",
          [](const LogPointer& log, const py::object&, const py::object&, const py::object&) { close(log); },
          py::arg("kind"), py::arg("error"), py::arg("traceback"))
      .def_readonly("ticks", &PythonLog::ticks, "ticks that were added")
      .def_property_readonly(
          "dropped", [](const PythonLog& log) { return log.log->dropped(); },
          "records that are not in the file, because the disk refused them")
      .def_property_readonly(
          "failed", [](const PythonLog& log) { return log.log->failed(); },
          "True once the disk has refused bytes: the file ends there")
      .def_readonly("closed", &PythonLog::closed, "True after `close`");
}

}  // namespace

void PythonLog::require_idle() const {
  if (closed) refuse("SessionLog", "a log that is closed takes no records", "one more");
  if (at_work) throw std::runtime_error("trephine: another thread's call is at work on this log");
}

void PythonLog::wait_for_room() const {
  while (!log->has_room()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const py::gil_scoped_acquire acquire;
    raise_signals();
  }
}

void PythonScores::require_idle() const {
  if (at_work) throw std::runtime_error("trephine: another thread's call is at work on these scores");
}

Observers::Observers(const std::optional<LogPointer>& log, const std::optional<ScoresPointer>& scores)
    : log_(log.value_or(nullptr)), scores_(scores.value_or(nullptr)) {
  if (log_) log_work_.emplace(log_);
  if (scores_) scores_work_.emplace(scores_);
}

void Observers::operator()(const TickInput& input, double dt, const TickResult& result) const {
  if (scores_) scores_->scores.add(input, dt, result);
  if (!log_) return;
  log_->wait_for_room();
  (void)log_->log->record(input, dt, result);
  ++log_->ticks;
}

void trephine_python::bind_session(py::module_& m) {
  py::class_<SessionReport>(m, "SessionReport", "What the file of a session held, and what it lacks.")
      .def_readonly("ticks", &SessionReport::ticks, "in the file")
      .def_property_readonly(
          "dropped", [](const SessionReport& r) { return r.dropped.count; },
          "records that are missing, because the disk did not follow")
      .def_property_readonly(
          "missing_time", [](const SessionReport& r) { return r.dropped.time; }, "of the ticks among them [s]")
      .def_readonly("lost_bytes", &SessionReport::lost_bytes,
                    "at the file's end, from the first part that is incomplete or damaged")
      .def_readonly("complete", &SessionReport::complete, "True if the session was closed")
      .def_property_readonly("text", &SessionReport::text, "all this in one sentence");
  bind_followed_bone(m);
  py::class_<Session>(m, "Session",
                      "A session in memory, which `load_session` reads. N is the number of its ticks, and a position\n"
                      "counts the ticks before a record. Each property is a new array.")
      .def("__len__", [](const Session& s) { return s.ticks.size(); })
      .def_property_readonly("poses", &poses_of, "(N, 4, 4) X_WT")
      .def_property_readonly(
          "spindle", [](const Session& s) { return of_ticks(s, [](const auto& t) { return t.input.spindle_on; }); },
          "(N,) bool")
      .def_property_readonly(
          "dt", [](const Session& s) { return of_ticks(s, [](const auto& t) { return t.dt; }); },
          "(N,) since the tick before [s]")
      .def_property_readonly(
          "time",
          [](const Session& s) {
            double now = 0;
            return of_ticks(s, [&now](const auto& t) { return now += clamped_dt(t.dt); });
          },
          "(N,) of the session at the end of each tick, as Scores count it: without what is missing [s]")
      .def("results", &results_of, "A dict of arrays as `Scene.run` returns it, with all columns.")
      .def_property_readonly(
          "tools", [](const Session& s) { return numbered(s.tools); },
          "changes of tool: a dict of position and number, (T,) each")
      .def_property_readonly(
          "events", [](const Session& s) { return numbered(s.events); },
          "events: a dict of position and number, (E,) each")
      .def_property_readonly(
          "gaps",
          [](const Session& s) {
            return table(s.gaps, Column{"position", &Session::Gap::position},
                         Column{"count", [](const Session::Gap& g) { return g.dropped.count; }},
                         Column{"time", [](const Session::Gap& g) { return g.dropped.time; }});
          },
          "where records are missing: a dict of position, their count, and the time of the ticks among them [s]")
      .def_property_readonly(
          "bone", [](const Session& s) { return s.bone; }, "the FollowedBone; None unless the log followed one")
      .def_property_readonly(
          "changes", &changes_of,
          "voxels that changed, each time that the log read them: a dict of position (V,), index i, j, k (V, 3) and\n"
          "the new density (V,) float32. The log read them up to its `flush` after the ticks that cut them.")
      .def("changed", &changed, py::arg("voxels"),
           "The bone's voxels (z, y, x) as the session left them, bit for bit, from those with which it began. Raises\n"
           "ValueError where `voxels` are others, or no bone was followed.")
      .def_property_readonly(
          "report", [](const Session& s) { return s.report; }, "the SessionReport of its file");
  m.def(
      "load_session", [](const std::filesystem::path& path) { return with_file([&] { return load_session(path); }); },
      py::arg("path"),
      "Reads the file of a SessionLog, or of a recording, into a Session of about 400 bytes a tick.\n\n"
      "A log that was not closed, or is damaged, is read up to there, and its `report` says what is missing. Raises\n"
      "OSError, with path and reason, where there is no session to read.");
  bind_log(m);
}
