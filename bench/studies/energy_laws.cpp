// SPDX-License-Identifier: MIT
// Contact that comes from an energy: which law, on which field. Each is compared with its own energy's derivatives, on
// every shape and on scanned bone; then with what it must answer on plane and ball, and on time and memory.
#include "studies/study.hpp"
#include "studies/table.hpp"
#include "support/energy_derivative.hpp"
#include "support/path_work.hpp"
#include "sweep/measure.hpp"

#include <trephine/render/energy_surface_renderer.hpp>

#include "bone.hpp"
#include "spot.hpp"

#include <chrono>
#include <functional>
#include <limits>
#include <optional>

namespace trephine::bench {
namespace {

using namespace trephine::test;

constexpr double kVoxel = 3e-4, kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr Burr kDrill{.tip_radius = 1.5e-3, .shaft_radius = 0.8e-3, .shaft_length = 12e-3};
const RasterOptions kRoom{.size = {72, 72, 72}};

struct Scene {
  std::string name;
  Vec3d p = kRoom.middle();                        ///< on the surface, in G
  std::function<Vec3d(const Vec3d&)> normal{};     ///< outward, where the surface is smooth
  std::function<double(const Vec3d&)> distance{};  ///< signed, negative in bone
};

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// Pressed by .2 to .6 radii where the surface is smooth: direction, and the time of a tick at the thesis' counts.
template <class Renderer, class Field>
void press(Renderer& renderer, const Field& field, const Scene& s, int cases, double& degrees, double& nanoseconds) {
  using Scalar = typename Renderer::Scalar;
  Random random(5);
  std::vector<double> angles, times;
  for (int i = 0; i < cases; ++i) {
    // Onto the surface from nearby.
    Vec3d q = s.p + 0.002 * random.unit();
    for (int k = 0; k < 20; ++k) q -= s.distance(q) * s.normal(q);
    const Vec3d n = s.normal(q);
    const Vec3d axis = (n + 0.5 * random.unit()).normalized();
    const double depth = random.uniform(0.2, 0.6) * kDrill.tip_radius;
    const Posed X = tool_at(q + (kDrill.tip_radius - depth) * n, axis, random.uniform(0, 6.28));
    const Pose<Scalar> pose(X.template cast<Scalar>());
    renderer.reset();
    const auto out = renderer.render(field, pose);
    const Vec3d f = out.wrench.force.template cast<double>();
    if (!out.contact.shaft && f.norm() > 0.05) angles.push_back(angle_deg(f, n));
    constexpr int kTicks = 20;
    const auto begin = std::chrono::steady_clock::now();
    for (int k = 0; k < kTicks; ++k) static_cast<void>(renderer.render(field, pose));
    times.push_back(1e9 * seconds_since(begin) / kTicks);
  }
  degrees = percentile(angles, 0.99);
  nanoseconds = percentile(times, 0.5);
}

/// Net work of closed paths that start and end out of contact, of the path's: mean and worst.
template <class Renderer, class Field>
void go_round(Renderer& renderer, const Field& field, const Scene& s, int paths, double& mean, double& worst) {
  Random random(7);
  mean = worst = 0;
  const Vec3d n = s.normal(s.p);
  int counted = 0;
  for (int i = 0; i < paths; ++i) {
    const Vec3d out = (n + 0.3 * random.unit()).normalized();
    const Posed rest = tool_at(s.p + (kDrill.tip_radius + 4e-4) * out, (out + 0.4 * random.unit()).normalized());
    const double deep = 4e-4 + random.uniform(0.2, 0.6) * kDrill.tip_radius;
    const Vec3d aside = 0.001 * random.unit(), turn = 0.2 * random.unit();
    const auto pose = [&](double phase) {
      const double t = std::sin(phase), c = 0.5 * (1 - std::cos(phase));
      return make_pose<double>(rotation_from_vector(Vec3d(t * turn)) * rest.linear(),
                               rest.translation() - c * deep * out + t * c * aside);
    };
    renderer.reset();
    PathWork work(pose(0), renderer.render(field, pose(0)).wrench);
    constexpr int kSteps = 16000;
    for (int k = 1; k <= kSteps; ++k) {
      const Posed X = pose(6.283185307179586 * k / kSteps);
      work.go(X, renderer.render(field, X).wrench);
    }
    if (!(work.length > 1e-7)) continue;
    ++counted;
    mean += std::abs(work.net) / work.length;
    worst = std::max(worst, std::abs(work.net) / work.length);
  }
  mean /= std::max(1, counted);
}

struct Work {
  int poses, cases, paths;
};

template <class Law, class Depth, class Bone>
void compare(Table& table, const char* law, const char* on, const Scene& s, const Bone& bone, double isovalue,
             const Burr& burr, const Depth& depths, double make_s, double bytes, const Work& work) {
  const ToolDiscretization<SurfaceCounts, double> tool(burr, {.sphere = 60, .slices = 12, .per_slice = 8});
  EnergySurfaceRenderer<double, Depth, Law> exact(tool, depths, {.jump = 1});
  const auto field = exact.field(bone, isovalue);
  const EnergyDifference d = compare_with_energy(exact, field, bone, s.p, 5 * burr.tip_radius / 3, work.poses);
  double degrees = kNaN, nanoseconds = kNaN, mean = kNaN, worst = kNaN;
  if (s.normal) {
    using Fast = std::conditional_t<std::same_as<Law, DepthLaw>, DepthLaw, RayLaw<float>>;
    EnergySurfaceRenderer<float, Depth, Fast> fast(
        ToolDiscretization<SurfaceCounts, float>(kDrill, SurfaceCounts::thesis()), depths, {.jump = 1});
    press(fast, fast.field(bone, isovalue), s, work.cases, degrees, nanoseconds);
    go_round(exact, field, s, work.paths, mean, worst);
  }
  table.row(law, on, s.name, d.poses, static_cast<double>(d.left_out) / d.poses, d.force, d.torque, mean, worst,
            degrees, nanoseconds, bytes, make_s);
}

template <class Bone>
void compare_all(Table& table, const Scene& s, const Bone& bone, double isovalue, const Burr& burr, const Work& work) {
  const auto begin = std::chrono::steady_clock::now();
  DepthMap map(bone, isovalue, {.reach = 10, .keep_original = false});
  const double make_s = seconds_since(begin);
  const auto& n = bone.size();
  const double bytes = static_cast<double>(map.bytes()) / n[0] / n[1] / n[2];
  compare<DepthLaw>(table, "depth", "depths", s, bone, isovalue, burr, FromDepthMap(map), make_s, bytes, work);
  compare<DepthLaw>(table, "depth", "densities", s, bone, isovalue, burr, FromDensities{}, 0, 0, work);
  compare<RayLaw<double>>(table, "rays", "depths", s, bone, isovalue, burr, FromDepthMap(map), make_s, bytes, work);
  compare<RayLaw<double>>(table, "rays", "densities", s, bone, isovalue, burr, FromDensities{}, 0, 0, work);
}

}  // namespace

void study_energy_laws(const StudyOptions& options) {
  Table table(options.folder + "/energy_laws.csv",
              "law,field,bone,poses,left_out_share,force_off_derivative_max,torque_off_derivative_max,"
              "net_work_rel_mean,net_work_rel_worst,direction_error_deg_p99,tick_ns_median,bytes_per_voxel,make_s");
  const Work work =
      options.quick ? Work{.poses = 500, .cases = 40, .paths = 4} : Work{.poses = 10000, .cases = 400, .paths = 40};
  const Vec3d p = kRoom.middle(), n = Vec3d(0.3, 0.5, 0.8).normalized();
  constexpr double h = kVoxel;
  const auto shown = [&](const std::string& name, const auto& shape, bool smooth) {
    Scene s{.name = name, .distance = shape};
    if (smooth) s.normal = [shape](const Vec3d& q) { return outward_normal(shape, q); };
    compare_all(table, s, rasterise<std::uint8_t>(shape, kRoom), kRoom.isovalue(), kDrill, work);
  };
  shown("plane", HalfSpace{p, n}, true);
  shown("ball", Ball{p - 20 * h * n, 20 * h}, true);
  shown("socket", Hollow{Ball{p + 12 * h * n, 12 * h}}, true);
  shown("rod", Rod{p - 6 * h * n.unitOrthogonal(), n, 6 * h}, false);
  shown("edge", Both{HalfSpace{p, n}, HalfSpace{p, n.unitOrthogonal()}}, false);
  shown("corner", Block{p - 12 * h * Vec3d::Ones(), 12 * h * Vec3d::Ones()}, false);
  shown("plate", Plate{p, n, 3 * h}, false);
  drill::Options scanned;
  scanned.skull = options.skull;
  const drill::Bone bone = drill::load_bone(scanned);
  const drill::Spot spot = drill::find_spot(bone);
  const Scene s{.name = bone.name, .p = bone.grid.X_WG().inverse() * spot.p_W};
  compare_all(table, s, bone.grid, bone.isovalue, bone.burr, work);
}

}  // namespace trephine::bench
