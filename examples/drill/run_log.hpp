// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tick.hpp>
#include <trephine/device/run_report.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace drill {

/// One tick of a run. World frame; wrench on the tool, about the burr's centre.
struct LogRow {
  double time = 0;           ///< [s]
  std::int64_t tick_ns = 0;  ///< the scene's tick alone
  trephine::Posed hand;      ///< where the hand's drill really is
  trephine::Posed probe;     ///< where the encoders say it is, which is what the scene got
  trephine::Posed proxy;     ///< the drill held on the surface (Line, Coupled); the probe (Surface)
  trephine::Posed drawn;     ///< the drill as a host would draw it
  trephine::Wrenchd wrench;  ///< the scene's answer
  trephine::ContactSummary contact;
  double removed_mm3 = 0;  ///< since the start
  trephine::Status status = trephine::Status::kOk;
  trephine::StructureSummary structures;  ///< of this tick
  trephine::CuttingSummary cutting{};     ///< of this tick
  // Of the shaft. Line: its report. Surface: the torque alone, summed over the slices.
  double spring_m = 0, lever_m = 0, reaction_N = 0, shaft_torque_Nm = 0;
  trephine::Vec3d intersection = trephine::Vec3d::Zero();
  trephine::Vec3d reaction = trephine::Vec3d::Zero();  ///< force there on the shaft, in W [N]
};

/// One slice of the Surface approximation in a tick in which it collides.
struct SliceRow {
  std::size_t tick = 0;  ///< index of its LogRow
  int slice = 0;         ///< from the tip up, 1 is the lowest
  double lever_m = 0, reaction_N = 0, torque_Nm = 0;
};

/// All that a run leaves behind.
struct RunLog {
  std::string algorithm;  ///< "line", "surface" or "coupled"
  std::vector<LogRow> rows;
  std::vector<SliceRow> slices;           ///< Surface only
  std::vector<trephine::Vec3d> touching;  ///< contact points at the tick asked for, in W
  std::size_t pictured = 0;               ///< that tick
  trephine::RunReport report;
  std::vector<std::string> warnings;
  bool real_time = false;
};

/// Writes `time_s,tick_ns,...,status`, a row a tick. Throws std::runtime_error where the file cannot be written.
void write_run_csv(const RunLog& log, const std::string& path);

/// What the table says of a run.
struct RunFigures {
  double rate_kept = 0;                     ///< share of ticks that were done within a millisecond
  double p50_us = 0, p99_9_us = 0;          ///< of the scene's tick, by the clock
  double peak_force = 0, mean_force = 0;    ///< [N], mean over ticks in contact
  double peak_torque = 0, mean_torque = 0;  ///< [N·m]
  double removed_mm3 = 0;
  std::string statuses;  ///< those that were not ok, with how often
};
[[nodiscard]] RunFigures figures_of(const RunLog& log);

/// Prints figures of several runs side by side.
void print_table(const std::vector<const RunLog*>& logs);

}  // namespace drill
