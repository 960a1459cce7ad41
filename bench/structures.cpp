// SPDX-License-Identifier: MIT
#include "common/command_line.hpp"
#include "common/paired_ticks.hpp"
#include "common/percentile.hpp"
#include "common/table.hpp"
#include "structure/label_shapes.hpp"
#include "support/random.hpp"

#include <trephine/core/units.hpp>
#include <trephine/everything.hpp>
#include <trephine/stage/veto.hpp>
#include <trephine/structure/build_structure_field.hpp>
#include <trephine/structure/structure_guard.hpp>
#include <trephine/structure/structure_veto.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <limits>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

/// What structures cost: the build of their distances, its memory, and a tick with guard and veto beside a tick
/// without.
///   bench_structures --out DIR [--quick]
/// writes DIR/structures.csv.
namespace trephine::bench {
namespace {

constexpr int kSide = 256;
constexpr double kVoxel = 0.4_mm;
constexpr int kStructures = 15;
constexpr double kReach = 5_mm;  // margin, the burr's radius and 2.6 smoothings
constexpr double kGuardMargin = 1_mm, kVetoMargin = 0.3_mm;
constexpr Burr kBurr{.tip_radius = 1.5_mm, .shaft_radius = 0.8_mm, .shaft_length = 40_mm};

/// A made-up head: tubes as nerves and vessels are, plates as dura, balls and rings, and hollow balls as the walls of
/// sinuses. Later structures take voxels of earlier ones.
[[nodiscard]] test::Labels head() {
  test::Labels labels({kSide, kSide, kSide}, Vec3d::Constant(kVoxel));
  test::Random random(1515);
  const double edge = kVoxel * kSide;
  const auto beyond = [](double x, double half) { return std::max(std::abs(x) - half, 0.0); };
  for (int s = 0; s < kStructures; ++s) {
    const Vec3d c = edge * Vec3d(random.uniform(0.2, 0.8), random.uniform(0.2, 0.8), random.uniform(0.25, 0.75));
    const Mat3d R = random.rotation();
    const double size = random.uniform(0, 1);
    const auto shape = [=](const Vec3d& p) {
      const Vec3d q = R.transpose() * (p - c);
      switch (s % 5) {
        case 0:  // tube, bent by a slow wave: 1.2 to 2.4 mm across
          return Vec3d(q.x() - 3_mm * std::sin(q.z() / 8_mm), q.y(), beyond(q.z(), 25_mm)).norm() - 0.6_mm -
                 size * 0.6_mm;
        case 1:  // plate, 1.2 to 2.4 mm thick
          return Vec3d(beyond(q.x(), 20_mm), beyond(q.y(), 20_mm), q.z() - 2_mm * std::sin(q.x() / 10_mm)).norm() -
                 0.6_mm - size * 0.6_mm;
        case 2:  // ball
          return q.norm() - 3_mm - size * 6_mm;
        case 3:  // hollow ball, its wall 1.2 mm thick
          return std::abs(q.norm() - 8_mm - size * 4_mm) - 0.6_mm;
        default:  // tube of a sinus: 4 to 8 mm across
          return Vec3d(q.x(), q.y() - 4_mm * std::sin(q.z() / 12_mm), beyond(q.z(), 20_mm)).norm() - 2_mm - size * 2_mm;
      }
    };
    labels.fill(shape, s + 1);
  }
  return labels;
}

/// A number of /proc/self/status [MB]; NaN where there is none.
[[nodiscard]] double memory_now(const std::string& name) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.rfind(name + ":", 0) == 0) return 1.024e-3 * std::atof(line.c_str() + name.size() + 1);
  return std::numeric_limits<double>::quiet_NaN();
}

class Report {
 public:
  explicit Report(const std::string& folder) : table_(folder + "/structures.csv", "measure,figure,unit,goal,met") {}

  /// `goal`: the figure is to be at most so much; 0: there is none.
  void row(const std::string& measure, double figure, const std::string& unit, double goal = 0) {
    std::ostringstream asked;
    if (goal > 0) asked << goal << ',' << (figure <= goal ? "yes" : "no");
    table_.row(measure, figure, unit, goal > 0 ? asked.str() : ",");
    std::fprintf(stderr, "structures: %-56s %9.3g %s\n", measure.c_str(), figure, unit.c_str());
  }

 private:
  Table table_;
};

/// Median time and greatest memory of builds.
[[nodiscard]] std::shared_ptr<const StructureField> measure_build(const test::Labels& labels, bool quick,
                                                                  Report& report) {
  std::shared_ptr<const StructureField> field;
  for (const int threads : {1, 2}) {
    std::vector<double> seconds, processor;
    double peak = 0;
    for (int i = 0; i < (quick ? 1 : 3); ++i) {
      field.reset();
      std::ofstream("/proc/self/clear_refs") << 5;  // sets the peak to what is in use
      const double before = memory_now("VmRSS");
      const std::clock_t used = std::clock();
      const auto begin = std::chrono::steady_clock::now();
      field = build_structure_field(labels.view(), {.reach = kReach, .threads = threads});
      seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
      processor.push_back(static_cast<double>(std::clock() - used) / CLOCKS_PER_SEC);
      peak = std::max(peak, memory_now("VmHWM") - before);
    }
    const std::string of = threads == 1 ? "1 thread" : "2 threads";
    report.row("build: " + of, percentile(seconds, 0.5), "s", threads == 2 ? 5 : 0);
    report.row("build: processor time / " + of, percentile(processor, 0.5) / threads, "s");
    report.row("build: greatest memory with " + of, peak, "MB");
  }
  report.row("field", 1e-6 * static_cast<double>(field->bytes()), "MB", 64);
  report.row("field: a voxel", static_cast<double>(field->bytes()) / (1.0 * kSide * kSide * kSide), "byte");
  return field;
}

/// Bone below a tilted plane through the structures, for a tool from above.
struct Block {
  const Vec3d n = Vec3d(0.1, -0.05, 1).normalized();
  const Vec3d middle = Vec3d::Constant(0.5 * kVoxel * (kSide - 1));

  [[nodiscard]] VoxelGrid<std::int16_t> bone() const {
    std::vector<std::int16_t> densities;
    densities.reserve(std::size_t{kSide} * kSide * kSide);
    for (int k = 0; k < kSide; ++k)
      for (int j = 0; j < kSide; ++j)
        for (int i = 0; i < kSide; ++i) {
          const double below = n.dot(middle - kVoxel * Vec3d(i, j, k)) / kVoxel;
          densities.push_back(static_cast<std::int16_t>(std::clamp(300 + 400 * below, -1000.0, 1500.0)));
        }
    return {{.size = {kSide, kSide, kSide}, .spacing = Vec3d::Constant(kVoxel)}, densities};
  }
  /// The tip pressed 0.4 mm into the surface, at x and y from the middle [m].
  [[nodiscard]] Posed pressed(double x, double y) const {
    const Vec3d u = Vec3d(1, 0, -n.x() / n.z()), v = Vec3d(0, 1, -n.y() / n.z());
    return make_pose<double>(rotation_between<double>(Vec3d::UnitZ(), (n + 0.3 * v).normalized()),
                             middle + x * u + y * v + (kBurr.tip_radius - 0.4_mm) * n);
  }
};

/// Ticks of both scenes in turn, at the same poses: the tool slides to and fro over a few places of one kind.
template <class With, class Without>
void measure_ticks(const std::string& name, With& with, Without& without, const std::vector<Posed>& places,
                   bool spindle, int ticks, Report& report) {
  PairedTicks times;
  for (const Posed& place : places) {
    for (int i = 0; i < ticks; ++i) {
      Posed X = place;
      X.translation() += Vec3d(1e-3 * std::sin(0.02 * i), 5e-4 * (1 - std::cos(0.013 * i)), 0);
      if (i < 50) X.translation().z() += 4e-5 * (50 - i);  // from above
      const TickInput input{.X_WT = X, .spindle_on = spindle && i >= 50};
      times.tick(with, without, input, i >= 60);
    }
  }
  report.row(name + ": without; median", percentile(times.without, 0.5), "µs");
  report.row(name + ": without; p99", percentile(times.without, 0.99), "µs");
  report.row(name + ": guard and veto; median", percentile(times.with, 0.5), "µs");
  report.row(name + ": guard and veto; p99", percentile(times.with, 0.99), "µs");
  report.row(name + ": more; median of differences", percentile(times.more, 0.5), "µs", 3);
  report.row(name + ": more; p99 less p99", percentile(times.with, 0.99) - percentile(times.without, 0.99), "µs");
}

void measure_scenes(const std::shared_ptr<const StructureField>& field, bool quick, Report& report) {
  const Block block;
  auto bare = block.bone(), guarded = block.bone();
  const std::vector<GuardedStructure> guards(kStructures, {.margin = kGuardMargin, .stiffness = 500});
  const std::vector<StructureVeto> vetoes(kStructures, {.margin = kVetoMargin});
  const auto begin = std::chrono::steady_clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(); };
  auto potential = std::make_shared<const GuardPotential>(field, Posed::Identity(), kBurr, guards);
  const double for_guard = seconds();
  const auto floor = make_cut_floor(*field, Posed::Identity(), guarded, 300, vetoes);
  report.row("guard: made in", for_guard, "s");
  report.row("guard: memory", 1e-6 * static_cast<double>(potential->bytes()), "MB");
  report.row("veto: made in", seconds() - for_guard, "s");

  // Places on the bone, by how near the whole tool is to a structure.
  std::array<std::vector<Posed>, 3> places;  // far, near, touching
  test::Random random(77);
  const std::size_t count = quick ? 2 : 8;
  for (int i = 0; i < 100000 && std::ranges::any_of(places, [&](const auto& p) { return p.size() < count; }); ++i) {
    const Posed X = block.pressed(random.uniform(-30_mm, 30_mm), random.uniform(-30_mm, 30_mm));
    const double d = tool_distance(*field, kBurr, X).distance;
    const int kind = d > 6_mm ? 0 : d > 0.2_mm && d < 0.8_mm ? 1 : d < -0.2_mm && d > -1_mm ? 2 : -1;
    if (kind >= 0 && places[static_cast<std::size_t>(kind)].size() < count)
      places[static_cast<std::size_t>(kind)].push_back(X);
  }
  const CoupledToolRenderer renderer{kBurr, CoupledOptions{.stiffness = 500}};
  const DeviceLimits limits{.force = 3.3, .torque = 0.1};
  HapticScene without{bare, 300, renderer, Cutting{}, limits};
  HapticScene with{guarded, 300, renderer, Cutting{}, Veto{floor}, StructureGuard{potential}, limits};
  const int ticks = quick ? 500 : 3000;
  for (const bool spindle : {false, true})
    for (std::size_t kind = 0; kind < places.size(); ++kind) {
      if (places[kind].size() < count) throw std::runtime_error("too few places on the bone");
      const std::string name =
          std::string(spindle ? "tick; drilling " : "tick; sliding ") + (kind == 0   ? "6 mm off and more"
                                                                         : kind == 1 ? "in a margin"
                                                                                     : "touching a structure");
      measure_ticks(name, with, without, places[kind], spindle, ticks, report);
    }
}

}  // namespace
}  // namespace trephine::bench

int main(int argc, char** argv) {
  using namespace trephine::bench;
  const CommandLine line(argc, argv);
  Report report(line.folder);
  std::shared_ptr<const trephine::StructureField> field;
  {
    const auto labels = head();
    field = measure_build(labels, line.quick, report);
  }
  measure_scenes(field, line.quick, report);
  return 0;
}
