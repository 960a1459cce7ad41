// SPDX-License-Identifier: MIT
#pragma once

#include "common/percentile.hpp"
#include "support/fields.hpp"
#include "sweep/sweep.hpp"
#include "truth/scenario.hpp"

#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/voxel/bone_surface.hpp>

#include <chrono>
#include <limits>
#include <map>
#include <memory>
#include <utility>

/// Leads a renderer along a scenario's paths and compares what it gives at their ends with the truth.
namespace trephine::bench {

inline constexpr double kStiffness = 800;  ///< [N/m] of every renderer here
/// Figures below these are not divided by, and have no direction: half of what a hand can tell apart.
inline constexpr double kForceFloor = 0.05, kTorqueFloor = 1e-3;

/// A scenario's bones as voxels.
struct Imaged {
  const Scenario* scenario;
  Image image;
  double isovalue;
  std::vector<VoxelGrid<std::uint8_t>> grids;
  mutable std::vector<std::shared_ptr<BoneSurface<std::uint8_t>>>
      surfaces{};  ///< of the grids, those that were asked for
};

[[nodiscard]] inline test::RasterOptions raster_options(const Image& image) {
  test::RasterOptions o;
  const double h = 1e-3 * image.voxel_mm;
  o.spacing = Vec3d::Constant(h);
  o.size.fill(static_cast<int>(std::lround(kSide / h)) + 1);
  o.contrast = image.contrast;
  o.image = image.kind == "binary"           ? test::Image::kBinary
            : image.kind == "partial_volume" ? test::Image::kPartialVolume
            : image.kind == "ct_blur"        ? test::Image::kCtBlur
                                             : test::Image::kClampedDistance;
  o.grid = {.keep_original = false};
  return o;
}

[[nodiscard]] inline Imaged make_image(const Scenario& scenario, const Image& image) {
  const test::RasterOptions o = raster_options(image);
  Imaged made{&scenario, image, o.isovalue(), {}};
  for (const Shape& bone : scenario.bones) made.grids.push_back(test::rasterise<std::uint8_t>(bone, o));
  made.surfaces.resize(made.grids.size());
  return made;
}

/// What is true of one case under a law.
struct Truth {
  Wrenchd wrench;
  Vec3d point = Vec3d::Zero();  ///< mean contact point, weighted by force, or the proxy
  bool exists = true;
};

/// What was found.
struct Found {
  Wrenchd wrench;
  Vec3d point = Vec3d::Zero();
  bool touching = false;
};

/// Errors against the continuum of the renderer's own law, and against rigid contact.
class Errors {
 public:
  /// `linear`: a law whose force is stiffness times depth, so that rigid contact tells its magnitude.
  void add(const Found& found, const Truth& truth, const Case& c, const RigidContact& rigid, bool linear,
           const Vec3d& origin, double voxel) {
    ++cases_;
    const double force = truth.wrench.force.norm(), torque = truth.wrench.torque.norm();
    const bool felt = force >= kForceFloor;
    if (truth.exists && felt && !found.touching) ++misses_;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    if (truth.exists) {
      own_.force(found.wrench.force, truth.wrench.force, force);
      own_.torque(found.wrench.torque, truth.wrench.torque, torque);
      own_.direction.push_back(felt && found.touching ? test::angle_deg(found.wrench.force, truth.wrench.force) : nan);
      own_.point.push_back(found.touching && felt ? (found.point - truth.point).norm() / voxel : nan);
      if (!felt) ++excluded_;
    }
    const double given = found.wrench.force.norm();
    const bool judged = given >= kForceFloor;
    if (!judged) ++model_excluded_;
    if (linear) rigid_.force(found.wrench.force, kStiffness * c.depth * rigid.normal, kStiffness * c.depth);
    rigid_.direction.push_back(judged ? test::angle_deg(found.wrench.force, rigid.normal) : nan);
    const Vec3d moment = (rigid.point - origin).cross(found.wrench.force);
    if (judged) rigid_.torque(found.wrench.torque, moment, moment.norm());
    rigid_.point.push_back(judged ? (found.point - rigid.point).norm() / voxel : nan);
  }

  void fill(Row& row, bool model) const {
    const One& e = model ? rigid_ : own_;
    row.force_error_rel_p50 = percentile(e.force_rel, 0.5);
    row.force_error_rel_p95 = percentile(e.force_rel, 0.95);
    row.force_error_N_p95 = percentile(e.force_N, 0.95);
    row.direction_error_deg_p99 = percentile(e.direction, 0.99);
    row.torque_error_rel_p95 = percentile(e.torque_rel, 0.95);
    row.torque_error_Nm_p95 = percentile(e.torque_Nm, 0.95);
    row.point_error_voxel_p95 = percentile(e.point, 0.95);
    row.misses = misses_;
    row.excluded_share = cases_ > 0 ? static_cast<double>(model ? model_excluded_ : excluded_) / cases_ : 0;
    row.error_kind = model ? "model" : "discretisation";
  }

 private:
  struct One {
    std::vector<double> force_rel, force_N, direction, torque_rel, torque_Nm, point;
    void force(const Vec3d& found, const Vec3d& truth, double size) {
      force_N.push_back((found - truth).norm());
      force_rel.push_back(force_N.back() / std::max(size, kForceFloor));
    }
    void torque(const Vec3d& found, const Vec3d& truth, double size) {
      torque_Nm.push_back((found - truth).norm());
      torque_rel.push_back(torque_Nm.back() / std::max(size, kTorqueFloor));
    }
  };
  One own_, rigid_;
  int cases_ = 0, misses_ = 0, excluded_ = 0, model_excluded_ = 0;
};

/// Where a renderer's contacts are on the mean, weighted by their forces.
template <class Renderer>
[[nodiscard]] Vec3d mean_contact(const Renderer& renderer, bool shaft) {
  if constexpr (requires { renderer.report(); }) {
    // Line: its proxy or IntP.
    if (shaft) return renderer.report().intersection.template cast<double>();
    return renderer.cutting_pose().translation().template cast<double>();
  } else {
    Vec3d sum = Vec3d::Zero();
    double weight = 0;
    for (const auto& contact : renderer.contacts()) {
      const double w = static_cast<double>(contact.force.norm());
      weight += w;
      sum += w * contact.position.template cast<double>();
    }
    return weight > 0 ? Vec3d(sum / weight) : sum;
  }
}

/// Both rows of a setting in an image. `field_of(bone)`: what the renderer reads of a bone; `truth(case, renderer)`:
/// the continuum of its law.
template <class Renderer, class FieldOf, class TruthOf>
std::vector<Row> measure(Renderer& renderer, const Imaged& imaged, const Setting& setting, bool linear,
                         const FieldOf& field_of, const TruthOf& truth) {
  using Scalar = typename Renderer::Scalar;
  constexpr bool kLine = requires { renderer.report(); };
  constexpr bool kCounts =
      !AttachesToBone<Renderer, const VoxelGrid<std::int16_t>>;  // what is asked of a surface are no samples
  const Scenario& scenario = *imaged.scenario;
  const double voxel = 1e-3 * imaged.image.voxel_mm;
  std::vector<double> times;
  std::int64_t samples = 0, ticks = 0;
  Errors errors;
  for (const Case& c : scenario.cases) {
    const auto& path = kLine ? c.line_path : c.surface_path;
    if (path.empty()) continue;
    const auto base = field_of(c.bone);
    const auto field = [&] {
      if constexpr (kCounts)
        return test::CountingField(base);
      else
        return base;
    }();
    renderer.reset();
    Rendered<Scalar> out;
    for (std::size_t i = 0; i < path.size(); ++i) {
      const Pose<Scalar> X(path[i].cast<Scalar>());
      const auto start = std::chrono::steady_clock::now();
      out = renderer.render(field, X);
      const auto end = std::chrono::steady_clock::now();
      if (i < path.size() / 2) continue;  // on the way in; the rest is in contact
      times.push_back(std::chrono::duration<double, std::nano>(end - start).count());
    }
    if constexpr (kCounts) samples += field.samples;
    ticks += static_cast<std::int64_t>(path.size());
    const Found found{out.wrench.template cast<double>(), mean_contact(renderer, scenario.shaft),
                      scenario.shaft ? out.contact.shaft : out.contact.tip};
    errors.add(found, truth(c, renderer), c, kLine ? c.line : c.surface, linear, path.back().translation(), voxel);
  }
  if (ticks == 0) return {};
  Row row;
  row.scenario = scenario.name;
  row.image = imaged.image;
  row.setting = setting;
  row.samples_per_tick =
      kCounts ? static_cast<double>(samples) / static_cast<double>(ticks) : std::numeric_limits<double>::quiet_NaN();
  row.tick_ns_median = percentile(times, 0.5);
  row.tick_ns_p999 = percentile(times, 0.999);
  std::vector<Row> rows(2, row);
  errors.fill(rows[0], false);
  errors.fill(rows[1], true);
  return rows;
}

/// The same of a renderer that reads densities.
template <class Renderer, class TruthOf>
std::vector<Row> measure(Renderer& renderer, const Imaged& imaged, const Setting& setting, bool linear,
                         const TruthOf& truth) {
  using Field = DensityField<std::uint8_t, typename Renderer::Scalar, typename Renderer::Gradient>;
  const auto field_of = [&](std::size_t bone) { return Field(imaged.grids[bone], imaged.isovalue); };
  return measure(renderer, imaged, setting, linear, field_of, truth);
}

struct Bones::Data {
  Imaged imaged;
};

/// Runs by renderer and variant.
using Run = std::vector<Row> (*)(const Imaged&, const Setting&);
using Runs = std::map<std::pair<std::string, std::string>, Run>;

void add_line_runs(Runs& runs);
void add_surface_runs(Runs& runs);

}  // namespace trephine::bench
