// SPDX-License-Identifier: MIT
#pragma once

#include "bone.hpp"

#include <trephine/session/scores.hpp>
#include <trephine/session/session_file.hpp>
#include <trephine/session/session_log.hpp>

#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>

namespace trephine_python {

/// Runs `body` without Python's lock; what the file system or a file's content refuses is an OSError.
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

/// A session that `Scene.record` made: nothing is missing in it.
struct Recording : Session {
  explicit Recording(std::vector<RecordedTick> made) {
    ticks = std::move(made);
    report.ticks = ticks.size();
    report.complete = true;
  }
};

/// A log of which a call at a time adds records. It drops none: the call waits for the disk where the queue is full.
struct PythonLog {
  BonePointer bone;  // that it follows, which must live longer
  std::unique_ptr<SessionLog> log;
  std::uint64_t ticks = 0;
  bool closed = false;
  bool at_work = false;

  /// Throws std::runtime_error while another thread's call is at work on the log, std::invalid_argument if it is
  /// closed.
  void require_idle() const;
  /// Waits until the log has room, or until a signal's handler raises. Without Python's lock.
  void wait_for_room() const;
};
using LogPointer = std::shared_ptr<PythonLog>;

struct PythonScores {
  Scores scores;
  bool at_work = false;

  void require_idle() const;
};
using ScoresPointer = std::shared_ptr<PythonScores>;

/// Log and scores of a call's ticks, which has them alone. Made and freed under Python's lock.
class Observers {
 public:
  Observers(const std::optional<LogPointer>& log, const std::optional<ScoresPointer>& scores);

  /// Adds a tick; without Python's lock.
  void operator()(const TickInput& input, double dt, const TickResult& result) const;

 private:
  LogPointer log_;
  ScoresPointer scores_;
  std::optional<Work<PythonLog>> log_work_;
  std::optional<Work<PythonScores>> scores_work_;
};

}  // namespace trephine_python
