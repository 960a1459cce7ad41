// SPDX-License-Identifier: MIT
#include "session.hpp"

#include "scene.hpp"
#include "table.hpp"

#include <trephine/stage/motion.hpp>

#include <pybind11/stl/filesystem.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <thread>
#include <tuple>

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

/// Adds a record, which is not dropped.
template <class Add>
void add_to(const LogPointer& log, const Add& add) {
  const Work work(log);
  const py::gil_scoped_release release;
  log->wait_for_room();
  add(*log->log);
}

void follow(const LogPointer& log, const BonePointer& bone, std::optional<double> isovalue) {
  if (isovalue && !is_finite(*isovalue)) refuse("SessionLog.follow", "the isovalue must be finite", *isovalue);
  const Work work(log);
  const Work at_rest(bone);
  const py::gil_scoped_release release;
  log->log->follow(bone->bone, isovalue);
  log->bone = bone;
}

/// Changed voxels of all bricks, a row each.
py::dict changes_of(const Session& session) {
  std::size_t count = 0;
  for (const Session::Change& c : session.changes) count += c.brick.voxels.size();
  const auto n = static_cast<py::ssize_t>(count);
  py::array_t<std::int64_t> position(n), index({n, py::ssize_t{3}});
  py::array_t<float> density(n);
  std::int64_t *to_position = position.mutable_data(), *to_index = index.mutable_data();
  float* to_density = density.mutable_data();
  for (const Session::Change& c : session.changes)
    for (const BrickChange::Voxel& v : c.brick.voxels) {
      const auto [i, j, k] = session.bone->index(c.brick.brick, v.number);
      for (const int u : {k, j, i}) *to_index++ = u;
      *to_position++ = static_cast<std::int64_t>(c.position);
      *to_density++ = v.density;
    }
  py::dict made;
  made["position"] = position;
  made["index"] = index;
  made["density"] = density;
  return made;
}

BonePointer bone_after(const Session& session, const BonePointer& before, std::optional<std::size_t> ticks) {
  const char* const who = "Session.bone_after";
  before->require_idle();
  if (!session.bone) refuse(who, "the session must be of a log that followed its bone (SessionLog.follow)", "another");
  return with_density(before->bone.density_type(), [&]<class Density>(Density) {
    py::array voxels = voxels_of(before->bone);
    const std::span<Density> densities(static_cast<Density*>(voxels.mutable_data()),
                                       static_cast<std::size_t>(voxels.size()));
    if (!session.bone->began_with(std::span<const Density>(densities)))
      refuse(who, "the bone must have the densities with which the session began", "others");
    for (const Session::Change& c : session.changes)
      if (c.position <= ticks.value_or(session.ticks.size())) apply_change(*session.bone, c.brick, densities);
    const GridGeometry geometry{before->bone.size(), before->bone.spacing(), before->bone.X_WG(),
                                before->bone.outside()};
    return std::make_shared<PythonBone>(PythonBone{
        {geometry, std::span<const Density>(densities), GridOptions{before->keeps_original}}, before->keeps_original});
  });
}

void close(const LogPointer& log) {
  if (log->closed) return;
  {
    const Work work(log);
    log->closed = true;
    with_file([&] { log->log->close(); });
    log->bone.reset();
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
      .def("follow", &follow, py::arg("bone"), py::arg("isovalue") = py::none(),
           "Also writes the voxels of a Bone that change from now on, so that `Session.bone_after` has the bone that\n"
           "the session left. Once, before the first tick; later its pose and densities may change by ticks alone.")
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
  py::class_<FollowedBone>(m, "FollowedBone", "The bone of a session as it was when its log began to follow it.")
      .def_property_readonly(
          "shape",
          [](const FollowedBone& b) { return std::tuple(b.geometry.size[2], b.geometry.size[1], b.geometry.size[0]); },
          "(z, y, x)")
      .def_property_readonly(
          "spacing", [](const FollowedBone& b) { return from_vector(b.geometry.spacing); }, "(3,) along x, y, z [m]")
      .def_property_readonly(
          "X_WG", [](const FollowedBone& b) { return from_pose(b.geometry.X_WG); }, "(4, 4) pose in the world")
      .def_property_readonly(
          "outside", [](const FollowedBone& b) { return b.geometry.outside.value_or(0); }, "density beyond the grid")
      .def_property_readonly(
          "dtype",
          [](const FollowedBone& b) {
            return with_density(b.density,
                                []<class Density>(Density) { return std::string(py::str(py::dtype::of<Density>())); });
          },
          "of the densities, by NumPy's name")
      .def_readonly("hash", &FollowedBone::hash, "FNV-1a of the densities with which the session began")
      .def_readonly("isovalue", &FollowedBone::isovalue, "density of the bone's surface; None: the log was not told");
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
      .def_readonly("bone", &Session::bone, "the FollowedBone; None: the log followed none")
      .def_property_readonly(
          "changes", &changes_of,
          "changed voxels of that bone: a dict of position (V,), index (V, 3) as z, y, x, and the new density (V,)")
      .def("bone_after", &bone_after, py::arg("before"), py::arg("ticks") = py::none(),
           "The Bone that the session left, or that the log knew of after so many ticks, by its changes.\n\n"
           "`before` has the densities with which the session began. Raises ValueError for another bone, or where the\n"
           "log followed none.")
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
