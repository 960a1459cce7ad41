// SPDX-License-Identifier: MIT
#include "sweep/row.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <ostream>

namespace trephine::bench {

std::string Image::name() const {
  std::string text = kind + "_" + std::to_string(bits) + "bit";
  if (contrast != 255) text += "_c" + std::to_string(static_cast<int>(contrast));
  if (noise > 0) text += "_n" + std::to_string(static_cast<int>(noise));
  if (anisotropic) text += "_113";
  return text;
}

void write_header(std::ostream& out) {
  out << "scenario,field,voxel_mm,renderer,variant,scalar,vertices,slices,per_slice,steps,samples_per_tick,tick_ns_"
         "median,"
         "tick_ns_p999,force_error_rel_p50,force_error_rel_p95,force_error_N_p95,direction_error_deg_p99,"
         "torque_error_rel_p95,torque_error_Nm_p95,point_error_voxel_p95,misses,excluded_share,error_kind\n";
}

void write(std::ostream& out, const Row& r) {
  const auto number = [&out](double v) {
    if (std::isfinite(v)) out << v;
    out << ',';
  };
  const Setting& s = r.setting;
  const bool surface = s.renderer != "line";
  out << r.scenario << ',' << r.image.name() << ',' << r.image.voxel_mm << ',' << s.renderer << ',' << s.variant << ','
      << s.scalar << ',' << (surface ? s.sphere : s.vertices) << ',' << (surface ? s.slices : 0) << ','
      << (surface ? s.per_slice : 0) << ',';
  // A fixed count as it is, a step length as 1/steps of a voxel.
  if (s.steps > 0)
    out << s.steps << ',';
  else
    out << "1/" << 1 / s.step << "vx,";
  number(r.samples_per_tick);
  number(r.tick_ns_median);
  number(r.tick_ns_p999);
  number(r.force_error_rel_p50);
  number(r.force_error_rel_p95);
  number(r.force_error_N_p95);
  number(r.direction_error_deg_p99);
  number(r.torque_error_rel_p95);
  number(r.torque_error_Nm_p95);
  number(r.point_error_voxel_p95);
  out << r.misses << ',';
  number(r.excluded_share);
  out << r.error_kind << '\n';
}

double percentile(std::vector<double> values, double q) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const auto rank = static_cast<std::size_t>(std::ceil(q * static_cast<double>(values.size())));
  return values[std::min(values.size() - 1, rank == 0 ? 0 : rank - 1)];
}

}  // namespace trephine::bench
