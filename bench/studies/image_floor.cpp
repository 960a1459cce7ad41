// SPDX-License-Identifier: MIT
// What no search on an image's interpolant can do better than: where its surface lies off the true one along the true
// normal, at the very contacts of the sweep. A tip that is held there by a spring along that normal has this error.
#include "studies/study.hpp"
#include "studies/table.hpp"
#include "sweep/measure.hpp"

#include <algorithm>
#include <cmath>

namespace trephine::bench {
namespace {

/// Along n from p to the interpolant's surface [m]; outward is positive. NaN where there is none within a voxel.
template <class Field>
double way_to_surface(const Field& field, const Vec3d& p, const Vec3d& n) {
  double low = -static_cast<double>(field.voxel()), high = -low;
  if (!(field.value(p + low * n) >= 0) || field.value(p + high * n) >= 0) return std::nan("");
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (low + high);
    (field.value(p + middle * n) >= 0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

void study_image_floor(const StudyOptions& options) {
  Table table(options.folder + "/image_floor.csv",
              "scenario,field,cases,surface_error_voxel_rms,surface_error_voxel_p95,force_error_rel_p95,"
              "direction_error_deg_p99_cells,direction_error_deg_p99_smoothed");
  for (const std::string name : {"plane", "sphere", "socket", "cylinder", "ridge", "plate"}) {
    const Scenario scenario = make_scenario(name, 8, options.quick ? 8 : 64);
    for (const std::string kind : {"ct_blur", "partial_volume", "binary", "clamped_distance"}) {
      const Image image{.kind = kind};
      const auto imaged = make_image<std::uint8_t>(scenario, image);
      std::vector<double> off, force, cells, smoothed;
      double squares = 0;
      for (const Case& c : scenario.cases) {
        if (c.line_path.empty()) continue;
        const DensityField<std::uint8_t, double> field(imaged.grids[c.bone], imaged.isovalue);
        const DensityField<std::uint8_t, double, SplineGradient> smooth(imaged.grids[c.bone], imaged.isovalue);
        const double way = way_to_surface(field, c.line.point, c.line.normal);
        if (!std::isfinite(way)) continue;
        const Vec3d p = c.line.point + way * c.line.normal;
        off.push_back(std::abs(way) / field.voxel());
        squares += off.back() * off.back();
        force.push_back(kStiffness * std::abs(way) / std::max(kForceFloor, kStiffness * c.depth));
        cells.push_back(test::angle_deg(-field.gradient(p), c.line.normal));
        smoothed.push_back(test::angle_deg(-smooth.gradient(p), c.line.normal));
      }
      table.row(name, image.name(), off.size(),
                std::sqrt(squares / std::max<double>(1, static_cast<double>(off.size()))), percentile(off, 0.95),
                percentile(force, 0.95), percentile(cells, 0.99), percentile(smoothed, 0.99));
    }
  }
}

}  // namespace trephine::bench
