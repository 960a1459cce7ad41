// SPDX-License-Identifier: MIT
#include "run_log.hpp"

#include "csv.hpp"

#include <trephine/device/statistics.hpp>

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>

namespace drill {

void write_run_csv(const RunLog& log, const std::string& path) {
  Csv csv(path,
          "time_s,tick_ns,x_m,y_m,z_m,qw,qx,qy,qz,probe_x_m,probe_y_m,probe_z_m,proxy_x_m,proxy_y_m,proxy_z_m,"
          "fx_N,fy_N,fz_N,tx_Nm,ty_Nm,tz_Nm,contacts,removed_mm3,status");
  for (const LogRow& r : log.rows) {
    const trephine::Quatd q(r.hand.linear());
    csv.row(r.time, r.tick_ns, trephine::Vec3d(r.hand.translation()), q.w(), q.x(), q.y(), q.z(),
            trephine::Vec3d(r.probe.translation()), trephine::Vec3d(r.proxy.translation()), r.wrench.force,
            r.wrench.torque, r.contact.count, r.removed_mm3, trephine::to_string(r.status));
  }
  csv.close();
}

RunFigures figures_of(const RunLog& log) {
  RunFigures f;
  trephine::TimeHistogram times;
  std::size_t within = 0;
  std::size_t touching = 0;
  std::map<std::string, int> statuses;
  for (const LogRow& r : log.rows) {
    times.add(1e-9 * static_cast<double>(r.tick_ns));
    within += r.tick_ns <= 1'000'000 ? 1 : 0;
    const double force = r.wrench.force.norm();
    const double torque = r.wrench.torque.norm();
    f.peak_force = std::max(f.peak_force, force);
    f.peak_torque = std::max(f.peak_torque, torque);
    if (r.contact.count > 0) {
      ++touching;
      f.mean_force += force;
      f.mean_torque += torque;
    }
    if (r.status != trephine::Status::kOk) ++statuses[trephine::to_string(r.status)];
  }
  const auto ticks = static_cast<double>(std::max<std::size_t>(log.rows.size(), 1));
  const auto late = static_cast<double>(log.report.missed_deadlines);
  f.rate_kept = log.real_time ? ticks / (ticks + late) : static_cast<double>(within) / ticks;
  f.p50_us = 1e6 * times.quantile(0.5);
  f.p99_9_us = 1e6 * times.quantile(0.999);
  f.mean_force /= static_cast<double>(std::max<std::size_t>(touching, 1));
  f.mean_torque /= static_cast<double>(std::max<std::size_t>(touching, 1));
  if (!log.rows.empty()) f.removed_mm3 = log.rows.back().removed_mm3;
  for (const auto& [name, count] : statuses)
    f.statuses += (f.statuses.empty() ? "" : ", ") + name + " x " + std::to_string(count);
  if (f.statuses.empty()) f.statuses = "all ok";
  return f;
}

void print_table(const std::vector<const RunLog*>& logs) {
  std::printf("\n%-10s %6s %10s %9s %9s %9s %10s %8s %8s %8s %8s %9s\n", "algorithm", "ticks", "rate kept", "tick p50",
              "p99.9", "CPU p99", "CPU p99.99", "peak F", "mean F", "peak T", "mean T", "removed");
  std::printf("%-10s %6s %10s %9s %9s %9s %10s %8s %8s %8s %8s %9s\n", "", "", "of 1 kHz", "us", "us", "us", "us", "N",
              "N", "mN m", "mN m", "mm3");
  for (const RunLog* const log : logs) {
    const RunFigures f = figures_of(*log);
    const trephine::TimeSummary& cpu = log->report.cpu_time;
    std::printf("%-10s %6zu %8.2f %% %9.1f %9.1f %9.1f %10.1f %8.2f %8.2f %8.2f %8.2f %9.4g\n", log->algorithm.c_str(),
                log->rows.size(), 100 * f.rate_kept, f.p50_us, f.p99_9_us, 1e6 * cpu.p99, 1e6 * cpu.p99_99,
                f.peak_force, f.mean_force, 1e3 * f.peak_torque, 1e3 * f.mean_torque, f.removed_mm3);
  }
  std::printf(
      "rate kept: share of ticks within a millisecond by the clock; where other programs take the processor, p99.9 is\n"
      "their doing and CPU (with reading and writing the device) is the loop's. Means are over ticks in "
      "contact,\n"
      "torque is about the burr's centre.\n");
  for (const RunLog* const log : logs) {
    std::printf("  %-8s status: %s\n", log->algorithm.c_str(), figures_of(*log).statuses.c_str());
    for (const auto& w : log->warnings) std::printf("  %-8s %s\n", log->algorithm.c_str(), w.c_str());
  }
}

}  // namespace drill
