// SPDX-License-Identifier: MIT
#include "sweep/sweep.hpp"

#include <cmath>
#include <ostream>

namespace trephine::bench {

std::string Image::name() const {
  std::string text = kind;
  if (contrast != 255) text += "_c" + std::to_string(static_cast<int>(contrast));
  return text;
}

void write_header(std::ostream& out) {
  out << "scenario,field,voxel_mm,renderer,variant,vertices,slices,per_slice,steps,samples_per_tick,tick_ns_median,"
         "tick_ns_p999,force_error_rel_p50,force_error_rel_p95,force_error_N_p95,direction_error_deg_p99,"
         "torque_error_rel_p95,torque_error_Nm_p95,point_error_voxel_p95,misses,excluded_share,error_kind\n";
}

void write(std::ostream& out, const Row& r) {
  const Setting& s = r.setting;
  const bool line = s.renderer == "line";
  out << r.scenario << ',' << r.image.name() << ',' << r.image.voxel_mm << ',' << s.renderer << ',' << s.variant << ','
      << (line ? s.vertices : s.sphere) << ',' << (line ? 0 : s.slices) << ',' << (line ? 0 : s.per_slice) << ',';
  out << "1/" << 1 / s.step << "vx,";
  const auto number = [&out](double v) { (std::isfinite(v) ? out << v : out) << ','; };
  for (const double v : {r.samples_per_tick, r.tick_ns_median, r.tick_ns_p999, r.force_error_rel_p50,
                         r.force_error_rel_p95, r.force_error_N_p95, r.direction_error_deg_p99, r.torque_error_rel_p95,
                         r.torque_error_Nm_p95, r.point_error_voxel_p95})
    number(v);
  out << r.misses << ',';
  number(r.excluded_share);
  out << r.error_kind << '\n';
}

}  // namespace trephine::bench
