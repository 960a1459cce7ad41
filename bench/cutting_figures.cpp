// SPDX-License-Identifier: MIT
#include "common/command_line.hpp"
#include "common/ripple.hpp"
#include "common/table.hpp"
#include "stage/cutting_runs.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <map>
#include <string>
#include <utility>

/// The cutting law's figures in steady cuts whose forces have closed forms, each with the bound that tests hold it to:
///   bench_cutting_figures --out DIR [--quick]
namespace {

using namespace trephine;
using namespace trephine::test;
using namespace trephine::test::cutting;

constexpr unsigned kSeed = 7411;      // the tests have others
constexpr double kSlowestBreak = 10;  // [ms]
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// Values of one figure. `bound`: of the greatest, or of the median.
struct Row {
  double bound;
  bool by_median = false;
  Figures values{};
};
/// By figure and blur [voxels]; a blur of 0 is all of them.
using Rows = std::map<std::pair<std::string, double>, Row>;

void add(Rows& rows, const std::string& name, double sigma, double bound, double value, bool by_median = false) {
  rows.try_emplace({name, sigma}, Row{bound, by_median, {}}).first->second.values.add(std::isnan(value) ? 1e9 : value);
}

void plunges(Rows& rows, int places) {
  Random random(kSeed);
  const auto one = [&]<class Density>(const BoneBlock<Density>& block, double dt, const char* name) {
    const Vec3d up = random.unit(), offset = random.arrow(0, block.h);
    const Plunged off = plunge(block, dt, name, up, offset);
    const bool coarse = block.h > 4e-4;
    const std::string in = coarse ? "; voxels of 0.5 mm" : "; voxels to 0.3 mm";
    const bool ok = off.fed.status == Status::kOk;
    const auto worst = [&](const std::string& what, double bound, double value) {
      add(rows, what + in, 0, bound, ok ? value : kNone);
    };
    worst("thrust off the law", coarse ? 0.035 : 0.02, off.thrust);
    worst("torque off the law", coarse ? 0.035 : 0.02, off.torque);
    worst("pull sideways over thrust", coarse ? 0.08 : 0.03, off.pull);
    add(rows, "thrust off the law; median", 0, 0.02, off.thrust, true);
    add(rows, "torque off the law; median", 0, 0.02, off.torque, true);
    add(rows, "work of chips off u by volume", 0, 0.02, off.work);
    // Ripple of a hand's loops is asked to stay under a tenth of a device's force: here of the felt force itself.
    double mean = 0;
    for (const double f : off.fed.forces) mean += f / static_cast<double>(off.fed.forces.size());
    worst("ripple of the felt force over it", 0.1,
          bench::ripple(off.fed.forces, static_cast<std::size_t>(0.05 / dt)) / mean);
  };
  constexpr std::array kBlurs{0.5, 0.7, 1.0};
  for (int n = 0; n < places; ++n) {
    const double sigma = kBlurs[static_cast<std::size_t>(n) % kBlurs.size()];
    for (const char* const name : {"twist-2", "twist-3.2", "round-3", "match-head-3", "cylinder-3"})
      for (const double h : {2e-4, 3e-4, 5e-4}) one(BoneBlock<std::int16_t>{.h = h, .sigma = sigma}, 1e-3, name);
    for (const double dt : {0.25e-3, 4e-3}) one(BoneBlock<std::int16_t>{}, dt, "twist-3.2");
    one(BoneBlock<std::int16_t>{}, 4e-3, "match-head-3");
    one(BoneBlock<std::int16_t>{.sigma = 1}, 0.25e-3, "cylinder-3");
    one(BoneBlock<std::uint8_t>{}, 1e-3, "round-3");
  }
}

void breakthroughs(Rows& rows, int places) {
  Random random(kSeed + 1);
  for (const double sigma : {0.5, 0.7, 1.0})
    for (int n = 0; n < places; ++n) {
      const BoneBlock<std::int16_t> block{.sigma = sigma, .length = 10e-3};
      // Every other plate lies askew to the voxels.
      const Vec3d up = n % 2 == 0 ? Vec3d(Vec3d::UnitZ()) : random.unit(), offset = random.arrow(0, block.h);
      const std::string way = n % 2 == 0 ? "along voxels" : "askew";
      const auto one = [&](const std::string& rate, double dt) {
        const std::string what = "breakthrough " + way + " at " + rate;
        const double ms = 1e3 * breakthrough(block, up, offset, dt);
        add(rows, what + " [ms]", sigma, kSlowestBreak, ms);
        add(rows, what + "; median [ms]", sigma, 2, ms, true);
      };
      one("4 kHz", 0.25e-3);
      one("1 kHz", 1e-3);
    }
}

/// A blurred floor may give way before it breaks, most of all where the axis runs through voxels.
void early_yields(Rows& rows, int plates) {
  Random random(kSeed + 3);
  int late = 0, all = 0;
  for (const double sigma : {0.5, 0.7, 1.0})
    for (int n = 0; n < plates; ++n, ++all) {
      const BoneBlock<std::int16_t> block{.sigma = sigma, .length = 10e-3};
      const Vec3d up = Vec3d::UnitZ();
      late += breakthrough(block, up, random.uniform(0, block.h) * up, 1e-3) > 1e-3 * kSlowestBreak ? 1 : 0;
    }
  add(rows, "share of " + std::to_string(all) + " plates with the axis through voxels that break too slowly", 0, 0,
      static_cast<double>(late) / all);
}

void slots(Rows& rows, int places) {
  Random random(kSeed + 2);
  const double speed = 4e-3, R = 0.0015;
  for (int n = 0; n < places; ++n) {
    const bool clockwise = n % 2 == 0;
    const double deep = random.uniform(1.2e-3, 2.6e-3);
    const Slot s = mill(clockwise, 1, speed, deep);
    const auto row = [&](const std::string& what, double bound, double value) {
      add(rows, "slot: " + what, 0, bound, s.status == Status::kOk ? value : kNone);
    };
    row("volume off the head's path", 0.04, std::abs(s.rate / (2 * R * deep * speed * 1e9) - 1));
    row("power off the chips'", 0.01, std::abs(s.torque * rpm(30'000) / s.power - 1));
    row("power off u by volume", 0.02, std::abs(s.power / (CuttingLaw{}.energy * s.rate * 1e-9) - 1));
    // From .55 to .95; the law has π/4 for the side alone.
    const double side = (clockwise ? 1 : -1) * s.pull.y() * R / s.torque;
    row("pull by radius over torque; off 0.75", 0.2, std::abs(side - 0.75));
  }
}

}  // namespace

int main(int argc, char** argv) {
  const bench::CommandLine options(argc, argv);
  Rows rows;
  plunges(rows, options.quick ? 1 : 6);
  breakthroughs(rows, options.quick ? 2 : 24);
  if (!options.quick) early_yields(rows, 72);
  slots(rows, options.quick ? 2 : 8);
  bench::Table table(options.folder + "/cutting_figures.csv",
                     "figure,blur_voxels,cases,median,worst,judged,bound,pass");
  std::size_t met = 0;
  for (const auto& [key, row] : rows) {
    const double value = row.by_median ? row.values.median() : row.values.worst();
    const bool pass = value <= row.bound;
    met += pass ? 1 : 0;
    table.row(key.first, key.second > 0 ? std::to_string(key.second) : "", row.values.count(), row.values.median(),
              row.values.worst(), value, row.bound, pass ? "pass" : "fail");
  }
  std::printf("cutting figures: %zu limits, %zu met\n", rows.size(), met);
}
