// SPDX-License-Identifier: MIT
#include "session.hpp"
#include "table.hpp"

#include <pybind11/stl/filesystem.h>

#include <array>
#include <filesystem>
#include <span>
#include <utility>

using namespace trephine_python;

namespace trephine_python {

/// Numbers by their names, as a type of its own in signatures.
struct NumbersByName : py::dict {};

}  // namespace trephine_python

template <>
struct pybind11::detail::handle_type_name<trephine_python::NumbersByName> {
  static constexpr auto name = const_name("Dict[str, float]");
};

namespace {

NumbersByName totals_of(const PythonScores& s) {
  s.require_idle();
  const SessionTotals t = s.scores.totals();
  NumbersByName made;
  const auto set = [&made](const char* name, auto value) { made[name] = value; };
  set("time", t.time);
  set("ticks", t.ticks);
  set("unusable", t.unusable);
  set("missing_time", t.missing_time);
  set("spindle_time", t.spindle_time);
  set("removed_mm3", t.removed_mm3);
  set("refused_mm3", t.refused_mm3);
  set("peak_force", t.peak_force);
  set("over_limit", t.over_limit.count);
  set("over_limit_time", t.over_limit.time);
  set("strokes", t.strokes);
  set("stroke_time", t.stroke_time);
  set("stroke_length", t.stroke_length);
  set("stroke_mm3", t.stroke_mm3);
  set("mean_force", t.mean_force());
  set("mean_speed", t.mean_speed());
  set("removal_rate", t.removal_rate());
  set("idle_share", t.idle_share());
  return made;
}

py::dict strokes_of(const PythonScores& s) {
  s.require_idle();
  return table(s.scores.strokes(), Column{"start", &Stroke::start}, Column{"duration", &Stroke::duration},
               Column{"length", &Stroke::length}, Column{"mean_force", &Stroke::mean_force},
               Column{"peak_force", &Stroke::peak_force}, Column{"mean_speed", &Stroke::mean_speed},
               Column{"peak_speed", &Stroke::peak_speed}, Column{"mean_curvature", &Stroke::mean_curvature},
               Column{"removed_mm3", &Stroke::removed_mm3}, Column{"distance", &Stroke::distance},
               Column{"nearest", &Stroke::nearest}, Column{"tool", &Stroke::tool},
               Column{"end", [](const Stroke& stroke) { return static_cast<std::uint8_t>(stroke.end); }});
}

py::dict around(std::span<const StructureScores> structures) {
  py::dict made = table(structures, Column{"distance", &StructureScores::distance},
                        Column{"breaches", [](const StructureScores& s) { return s.breaches.count; }},
                        Column{"breach_time", [](const StructureScores& s) { return s.breaches.time; }},
                        Column{"breach_depth", &StructureScores::breach_depth},
                        Column{"breached_mm3", &StructureScores::breached_mm3},
                        Column{"over_limit", [](const StructureScores& s) { return s.over_limit.count; }},
                        Column{"over_limit_time", [](const StructureScores& s) { return s.over_limit.time; }});
  constexpr py::ssize_t kShells = 1 + StructureScores::kShellEdges.size();
  const auto n = static_cast<py::ssize_t>(structures.size());
  py::array_t<double> time({n, kShells}), removed({n, kShells});
  double *to_time = time.mutable_data(), *to_removed = removed.mutable_data();
  const auto put = [&](const Shell& shell) {
    *to_time++ = shell.time;
    *to_removed++ = shell.removed_mm3;
  };
  for (const StructureScores& s : structures) {
    put(s.inside);
    for (const Shell& shell : s.shells) put(shell);
  }
  py::array_t<std::int64_t> misses({n, kShells - 1});
  std::int64_t* to_misses = misses.mutable_data();
  for (const StructureScores& s : structures)
    for (const std::uint64_t count : s.near_misses) *to_misses++ = static_cast<std::int64_t>(count);
  made["near_misses"] = misses;
  made["shell_time"] = time;
  made["shell_mm3"] = removed;
  return made;
}

py::dict uses(std::span<const ToolUse> tools) {
  return table(tools, Column{"time", &ToolUse::time}, Column{"spindle_time", &ToolUse::spindle_time},
               Column{"removed_mm3", &ToolUse::removed_mm3});
}

/// Visits a session in memory in the order of its file.
template <class Visitor>
void visit(const Session& session, Visitor& visitor) {
  auto tool = session.tools.begin();
  auto gap = session.gaps.begin();
  for (std::size_t t = 0; t <= session.ticks.size(); ++t) {
    for (; gap != session.gaps.end() && gap->position == t; ++gap) visitor.dropped(gap->dropped);
    for (; tool != session.tools.end() && tool->position == t; ++tool)
      visitor.tool_changed(static_cast<int>(tool->number));
    if (t < session.ticks.size()) visitor(session.ticks[t]);
  }
}

SessionReport add_session(const ScoresPointer& scores, const Session& session) {
  const Work work(scores);
  const py::gil_scoped_release release;
  visit(session, scores->scores);
  scores->scores.finish();
  return session.report;
}
SessionReport add_file(const ScoresPointer& scores, const std::filesystem::path& path) {
  const Work work(scores);
  return with_file([&] {
    const SessionReport report = visit_session(path, scores->scores);
    scores->scores.finish();
    return report;
  });
}

ScoresPointer make_scores(const py::kwargs& options) {
  ScoreOptions made;
  set_options(made, options);
  return std::make_shared<PythonScores>(PythonScores{Scores(made)});
}

}  // namespace

void trephine_python::bind_scores(py::module_& m) {
  py::enum_<ScoredForce>(m, "ScoredForce", "The force that scores judge.")
      .value("HAND", ScoredForce::kHand, "the scene's force without the push of guards")
      .value("THRUST", ScoredForce::kThrust, "the true thrust of a cutting law");
  OptionsClass<ScoreOptions>(m, "ScoreOptions", "Options of Scores, each with a reason in the headers.")
      .field("chord", &ScoreOptions::chord, "of the dividers that walk along the path [m]")
      .field("lift_off", &ScoreOptions::lift_off, "contact or spindle missing for longer ends a stroke [s]")
      .field("event_gap", &ScoreOptions::event_gap, "breaches or forces over the limit within it are one event [s]")
      .field("force", &ScoreOptions::force, "that is judged")
      .field("force_limit", &ScoreOptions::force_limit, "[N]")
      .field("limit_distance", &ScoreOptions::limit_distance,
             "from a structure, where forces over the limit count besides [m]")
      .field("strokes", &ScoreOptions::strokes, "that are listed; later ones count in the totals alone")
      .field("structures", &ScoreOptions::structures, "with scores of their own, by number from 0")
      .field("tools", &ScoreOptions::tools, "likewise")
      .done();
  int_enum(m, "StrokeEnd",
           {{"LIFT_OFF", static_cast<int>(StrokeEnd::kLiftOff)},
            {"REVERSAL", static_cast<int>(StrokeEnd::kReversal)},
            {"BREAK", static_cast<int>(StrokeEnd::kBreak)},
            {"FINISH", static_cast<int>(StrokeEnd::kFinish)}},
           "Why a stroke ended; `Scores.strokes` gives its number.\n\n"
           "LIFT_OFF: contact or spindle was missing. REVERSAL: the path turned back. BREAK: a jump, a tick that is\n"
           "missing or unusable, or another tool. FINISH: the session ended.");

  py::class_<PythonScores, ScoresPointer>(
      m, "Scores",
      "Scores of a session of drilling, while it runs or from its file, with the same bits.\n\n"
      "    scores = trephine.Scores(force_limit=2)\n"
      "    scene.run(poses, scores=scores)\n"
      "    scores.finish()\n"
      "    print(scores.totals[\"mean_force\"], scores.strokes[\"length\"])\n\n"
      "Keywords are the fields of ScoreOptions. A stroke is drilling in contact, from one lift-off or reversal to the\n"
      "next. Raises ValueError where an option is out of range. One thread at a time.")
      .def(py::init(&make_scores))
      .def(
          "add", &add_session, py::arg("session"),
          "Adds a Session, or the file of one, tool changes and gaps included, ends the stroke that runs, and returns\n"
          "the SessionReport. A file is read in little memory, whatever its length. Raises OSError.")
      .def("add", &add_file, py::arg("path"))
      .def(
          "tool_changed",
          [](const ScoresPointer& s, int number) {
            s->require_idle();
            s->scores.tool_changed(number);
          },
          py::arg("number"), "From the next tick on the tool with this number is in the hand; 0 before.")
      .def(
          "finish",
          [](const ScoresPointer& s) {
            s->require_idle();
            s->scores.finish();
          },
          "Ends the stroke that runs, so that it is listed.")
      .def(
          "reset",
          [](const ScoresPointer& s) {
            s->require_idle();
            s->scores.reset();
          },
          "Starts anew, with the same options.")
      .def_property_readonly("totals", &totals_of,
                             "Sums up to now, with the stroke that runs, as a dict of numbers:\n\n"
                             "time [s]: of all ticks\n"
                             "ticks: number of all ticks\n"
                             "unusable: ticks of no use to scores, such as those with a bad pose\n"
                             "missing_time [s]: besides, of ticks that a log lacks\n"
                             "spindle_time [s]: with the spindle on\n"
                             "removed_mm3 [mm³]: bone removed\n"
                             "refused_mm3 [mm³]: protected bone that cuts would have taken, once for each tick\n"
                             "peak_force [N]: greatest force, in or out of strokes\n"
                             "over_limit: times that the force went over the limit\n"
                             "over_limit_time [s]: with a force over the limit\n"
                             "strokes: number of strokes\n"
                             "stroke_time [s]: in strokes\n"
                             "stroke_length [m]: length of the tool's path in strokes\n"
                             "stroke_mm3 [mm³]: bone removed in strokes\n"
                             "mean_force [N]: over the time in strokes\n"
                             "mean_speed [m/s]: over the time in strokes\n"
                             "removal_rate [mm³/s]: bone removed in strokes, by their time\n"
                             "idle_share: time outside of strokes, by all time")
      .def_property_readonly("strokes", &strokes_of,
                             "The first strokes that have ended, in order, as a dict of arrays (S,):\n\n"
                             "start [s]: time of the session\n"
                             "duration [s]: from its start to its last contact\n"
                             "length [m]: of the tool's path\n"
                             "mean_force [N]: over its time\n"
                             "peak_force [N]: greatest force\n"
                             "mean_speed [m/s]: length by duration\n"
                             "peak_speed [m/s]: highest over a chord\n"
                             "mean_curvature [1/m]: angles that the path turned by, by its length\n"
                             "removed_mm3 [mm³]: bone removed\n"
                             "distance [m]: smallest from a structure; infinite where it is not known\n"
                             "nearest: that structure; its number, or -1\n"
                             "tool: that was in the hand; its number\n"
                             "end: why it ended; a number of StrokeEnd")
      .def_property_readonly(
          "structures",
          [](const PythonScores& s) {
            s.require_idle();
            return around(s.scores.structures());
          },
          "Scores about each structure while it was the nearest, as a dict of arrays with a row a structure:\n\n"
          "distance [m]: smallest of the tool, negative inside; infinite where it was never the nearest\n"
          "breaches: times that its bone was taken, or that the turning tool was in it\n"
          "breach_time [s]: of these in all\n"
          "breach_depth [m]: deepest that the turning tool was in it\n"
          "breached_mm3 [mm³]: its bone that was taken\n"
          "over_limit: times that the force went over the limit near it\n"
          "over_limit_time [s]: of these in all\n"
          "near_misses: approaches without a breach, by their smallest distance; (., 4), up to each of `shell_edges`\n"
          "shell_time [s]: spent in each shell around it; (., 5), inside and then up to each of `shell_edges`\n"
          "shell_mm3 [mm³]: bone removed in each shell; likewise")
      .def_property_readonly(
          "around_structures",
          [](const PythonScores& s) {
            s.require_idle();
            return around({&s.scores.around_structures(), 1});
          },
          "The same dict with a single row, about whichever structure was nearest.")
      .def_property_readonly(
          "shell_edges",
          [](const PythonScores&) {
            const auto& edges = StructureScores::kShellEdges;
            return py::array_t<double>(static_cast<py::ssize_t>(edges.size()), edges.data());
          },
          "(4,) outer distances of the shells; the first begins at the structure's surface [m]")
      .def_property_readonly(
          "tools",
          [](const PythonScores& s) {
            s.require_idle();
            return uses(s.scores.tools());
          },
          "Use of each tool, by number, as a dict of arrays with a row a tool:\n\n"
          "time [s]: in the hand\n"
          "spindle_time [s]: of this with the spindle on\n"
          "removed_mm3 [mm³]: bone removed")
      .def_property_readonly(
          "unlisted_tools",
          [](const PythonScores& s) {
            s.require_idle();
            return uses({&s.scores.unlisted_tools(), 1});
          },
          "The same dict with a single row, for all tools whose numbers are not among those.")
      .def_property_readonly(
          "unlisted_strokes", [](const PythonScores& s) { return s.scores.unlisted_strokes(); },
          "number of strokes that found no room in the list")
      .def_property_readonly(
          "options", [](const PythonScores& s) { return s.scores.options(); }, "a copy of the ScoreOptions");

  m.def(
      "score",
      [](const Session& session, const py::kwargs& options) {
        ScoresPointer made = make_scores(options);
        (void)add_session(made, session);
        return made;
      },
      py::arg("session"),
      "Scores of a Session, or of its file; keywords are the fields of ScoreOptions.\n\n"
      "The file's SessionReport is what `Scores.add` returns. Raises OSError.");
  m.def(
      "score",
      [](const std::filesystem::path& path, const py::kwargs& options) {
        ScoresPointer made = make_scores(options);
        (void)add_file(made, path);
        return made;
      },
      py::arg("path"));
}
