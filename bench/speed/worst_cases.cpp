// SPDX-License-Identifier: MIT
#include "speed/speed_scene.hpp"
#include "support/fields.hpp"
#include "support/raster.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/cutting_force.hpp>
#include <trephine/tool/named_tools.hpp>
#include <trephine/voxel/bone_volume.hpp>
#include <trephine/voxel/crossed_edges.hpp>
#include <trephine/voxel/dual_element.hpp>
#include <trephine/voxel/pressure_cut.hpp>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace trephine::bench::speed {
namespace {

/// Times one by one, where the worst counts: p50, p99, p99.9 and the longest [ns].
class Spread {
 public:
  explicit Spread(const Options& options)
      : march_(options.march),
        table_(options.folder + "/speed_spread.csv", "case,compiler,march,ticks,p50_ns,p99_ns,p999_ns,max_ns",
               options.append) {}

  template <class Work>
  void measure(const std::string& name, int ticks, Work&& work) {
    measure(
        name, ticks, [](int i) { return i; }, work);
  }
  /// Times work(prepare(i)) without what prepare takes.
  template <class Prepare, class Work>
  void measure(const std::string& name, int ticks, Prepare&& prepare, Work&& work) {
    std::vector<double> times;
    for (int i = 0; i < ticks; ++i) {
      const auto input = prepare(i);
      const auto begin = Clock::now();
      work(input);
      times.push_back(std::chrono::duration<double, std::nano>(Clock::now() - begin).count());
    }
    table_.row(without_commas(name), kCompiler, march_, ticks, percentile(times, 0.5), percentile(times, 0.99),
               percentile(times, 0.999), percentile(times, 1));
    std::fprintf(stderr, "speed: %-44s p50 %.0f ns, p99.9 %.0f ns\n", name.c_str(), percentile(times, 0.5),
                 percentile(times, 0.999));
  }

 private:
  std::string march_;
  Table table_;
};

/// Leads the coupled tool along poses that begin in contact, from `out` [m] away.
template <class Tool, class Path>
void measure_slide(Spread& spread, const std::string& name, BoneSurface<std::uint8_t>& surface, Tool tool, int ticks,
                   const Vec3d& out, Path&& pose) {
  tool.prepare(surface.view());
  for (int i = 0; i <= 50; ++i) {  // from outside: a tool that appears as deep is without force
    Posed X = pose(0);
    X.translation() += (1 - i / 50.0) * out;
    static_cast<void>(tool.render(surface.view(), X));
  }
  spread.measure("Coupled, " + name, ticks, pose,
                 [&](const Posed& X) { benchmark::DoNotOptimize(tool.render(surface.view(), X)); });
}

/// A tool that leans by .3 u from a normal m and turns about m at 13 rad/s, at tick i of a millisecond each.
[[nodiscard]] Mat3d turned(const Vec3d& m, const Vec3d& u, int i) {
  return rotation_from_vector(Vec3d(13e-3 * i * m)) *
         rotation_between<double>(Vec3d::UnitZ(), (m + 0.3 * u).normalized());
}

/// The coupled tool pressed 0.9 mm deep and led over a plane or round a ball, and wedged between two walls. It turns at
/// 13 rad/s.
void measure_coupled(Spread& spread, int ticks) {
  constexpr double kRadius = 6e-3, kDeep = 9e-4;
  const double R = burr_of().tip_radius;
  const Vec3d n = Vec3d(0.3, 0.5, 0.8).normalized(), u = n.unitOrthogonal(), v = n.cross(u);
  // To and fro over 6 mm along u and 2 mm along v, at `speed` [m/s].
  const auto along = [](double speed, int i) { return 0.003 * std::sin(speed / 0.003 * 1e-3 * i); };
  const auto across = [](double speed, int i) { return 0.001 * std::cos(speed / 0.003 * 7e-4 * i); };
  for (const double voxel : {3e-4, 4e-4, 1e-4}) {
    const int side = static_cast<int>(0.0168 / voxel);
    const test::RasterOptions o{.size = {side, side, side}, .spacing = Vec3d::Constant(voxel)};
    const Vec3d top = o.middle();
    const std::string in = voxel == 3e-4 ? "" : voxel < 3e-4 ? ", voxels of 0.1 mm" : ", voxels of 0.4 mm";
    const auto plane = test::rasterise<std::uint8_t>(test::HalfSpace{top, n}, o);
    const auto on_plane = shared_bone_surface(plane, o.isovalue());
    const auto over_plane = [&](const std::string& name, auto tool, double speed) {
      measure_slide(spread, "slid over a plane, " + name + in, *on_plane, std::move(tool), ticks, 2 * kDeep * n,
                    [&](int i) {
                      return make_pose<double>(turned(n, u, i),
                                               top + along(speed, i) * u + across(speed, i) * v + (R - kDeep) * n);
                    });
    };
    over_plane(".03 m/s", coupled(), 0.03);
    over_plane(".1 m/s", coupled(), 0.1);
    if (voxel != 3e-4) continue;
    over_plane(".03 m/s, friction .3", coupled(Coulomb(0.3, 0.3)), 0.03);
    over_plane(".1 m/s, friction .3", coupled(Coulomb(0.3, 0.3)), 0.1);

    const auto ball = test::rasterise<std::uint8_t>(test::Ball{top - kRadius * n, kRadius}, o);
    const auto on_ball = shared_bone_surface(ball, o.isovalue());
    const auto over_ball = [&](const std::string& name, auto tool, double speed) {
      measure_slide(spread, "slid over a ball, " + name, *on_ball, std::move(tool), ticks, 2 * kDeep * n, [&](int i) {
        const Vec3d m = (n + (along(speed, i) * u + across(speed, i) * v) / kRadius).normalized();
        return make_pose<double>(turned(m, u, i), top - kRadius * n + (kRadius + R - kDeep) * m);
      });
    };
    over_ball(".03 m/s", coupled(), 0.03);
    over_ball(".1 m/s", coupled(), 0.1);
    over_ball(".03 m/s, friction .3", coupled(Coulomb(0.3, 0.3)), 0.03);
    over_ball(".1 m/s, friction .3", coupled(Coulomb(0.3, 0.3)), 0.1);

    // Two walls that press the burr with some of the largest force each, upright: they leave a shaft no room to lean.
    const double gap = R - voxel / 3;
    const auto walls = test::rasterise<std::uint8_t>(
        test::Either{test::HalfSpace{top - gap * v, v}, test::HalfSpace{top + gap * v, Vec3d(-v)}}, o);
    const auto between = shared_bone_surface(walls, o.isovalue());
    for (const double speed : {0.03, 0.1})
      measure_slide(spread, std::string("wedged in a slot, ") + (speed < 0.1 ? ".03 m/s" : ".1 m/s"), *between,
                    coupled(), ticks, Vec3d::Zero(),
                    [&](int i) { return make_pose<double>(turned(n, Vec3d::Zero(), i), top + along(speed, i) * u); });
  }
}

/// The coupled tool drills into a tilted block: burrs of 3 mm and of others at once, and a match-head by the cutting
/// law.
void measure_drilling(Spread& spread) {
  const auto drill = [&](const std::string& what, double diameter, double voxel, double speed, auto renderer,
                         auto cut) {
    const int side = static_cast<int>(4.8 * diameter / voxel);
    const test::RasterOptions o{.size = {side, side, side}, .spacing = Vec3d::Constant(voxel)};
    const Vec3d n = Vec3d(0.3, 0.5, 0.8).normalized(), top = o.middle() + 4 * diameter / 3 * n;
    const Mat3d R = rotation_between<double>(Vec3d::UnitZ(), n);
    auto bone = test::rasterise<std::uint8_t>(test::HalfSpace{top, n}, o);
    HapticScene scene{bone, o.isovalue(), std::move(renderer), std::move(cut)};
    const double above = scene.renderer().tool().burr().tip_radius;
    std::string size = std::to_string(voxel * 1e3);
    size.erase(size.find_last_not_of('0') + 1);
    spread.measure(what + ", voxels of " + size + " mm", 1000, [&](int i) {
      const Posed X = make_pose<double>(R, top + (above - speed * 1e-3 * i) * n);
      benchmark::DoNotOptimize(scene.tick({.X_WT = X, .spindle_on = true}, 1e-3));
    });
  };
  const NamedTool tool = tool_by_name("match-head-3");
  CuttingForce::Options law{.edges = tool.edges, .force_scale = 0.1};
  const test::RasterOptions image;
  law.strength = {.soft = image.air, .cortical = image.air + image.contrast};
  for (const double voxel : {3e-4, 1e-4}) {
    drill("Coupled, drills at 5 mm/s", 3e-3, voxel, 5e-3, coupled(), Cutting{});
    drill("Coupled, match-head-3 by the law at 2 mm/s", 3e-3, voxel, 2e-3,
          CoupledToolRenderer{tool.tool, CoupledOptions{.stiffness = 800}}, Cutting{PressureCut{}, CuttingForce(law)});
  }
  const auto burr = [&](const std::string& what, double diameter, double voxel) {
    const Burr of{.tip_radius = diameter / 2, .shaft_radius = diameter / 4, .shaft_length = 40_mm};
    drill(what, diameter, voxel, 5e-3, CoupledToolRenderer{of}, Cutting{});
  };
  for (const double voxel : {4e-4, 1e-4}) burr("Coupled, a 6 mm burr drills at 5 mm/s", 6e-3, voxel);
  burr("Coupled, a 2 mm burr drills at 5 mm/s", 2e-3, 5e-5);
}

/// Least time of the volume that a cut tells: that of the cells which the surface crosses before the burr, twice, for
/// before and after. `forward` points along the burr's motion.
void measure_told_volume(Spread& spread, const std::string& name, const Grid& block, const Vec3d& centre,
                         const Vec3d& forward) {
  struct Row {
    std::uint64_t cells;
    std::array<const std::uint8_t*, 4> voxels;
  };
  const detail::LeastBone<std::uint8_t> least(127.0);
  std::vector<Row> rows;
  std::size_t cells = 0;
  const auto [nx, ny, nz] = block.size();
  for (int k = 0; k + 1 < nz; ++k)
    for (int j = 0; j + 1 < ny; ++j)
      for (int first = 0; first + 1 < nx; first += 64) {
        const auto row = [&](int dj, int dk) { return block.data() + block.index(first, j + dj, k + dk); };
        Row r{0, {row(0, 0), row(1, 0), row(0, 1), row(1, 1)}};
        for (int i = 0; i < 64 && first + i + 1 < nx; ++i) {
          int bone = 0;
          for (const std::uint8_t* v : r.voxels) bone += (v[i] >= least.density) + (v[i + 1] >= least.density);
          const Vec3d middle = block.spacing().x() * (Vec3d(first + i, j, k) + Vec3d::Constant(0.5));
          if (bone > 0 && bone < 8 && (middle - centre).dot(forward) > 0) r.cells |= std::uint64_t{1} << i;
        }
        cells += static_cast<std::size_t>(std::popcount(r.cells));
        if (r.cells != 0) rows.push_back(r);
      }
  spread.measure(name + "; volume of its " + std::to_string(cells) + " crossed cells, twice", 600, [&](int) {
    for (int twice = 0; twice < 2; ++twice) {
      detail::CrossedCells<std::uint8_t> volume(127.0);
      for (const Row& r : rows) volume.add(r.cells, r.voxels[0], r.voxels[1], r.voxels[2], r.voxels[3]);
      benchmark::DoNotOptimize(volume.sum());
    }
  });
}

/// Least time of the elements that a cut changes: the rows of voxels of each brick that it changed are compared with
/// the isovalue, and the changed elements gathered and computed, as if it were known where they are.
class ChangedElements {
 public:
  using Surface = BoneSurface<std::uint8_t>;
  /// Keeps the elements before the cut.
  ChangedElements(const Grid& block, double isovalue) : block_(block), compute_{to_float(block.spacing())} {
    Surface surface(block, isovalue);
    for (std::size_t b = 0; b < block.brick_count(); ++b) {
      surface.begin_tick();
      if (surface.crosses(b) && surface.provide(b))
        for_each_element(surface, b, [&](const Key& key, const Element& e) { before_[key] = e; });
    }
  }

  /// Takes a brick that the cut changed, whose elements `after` has.
  void add(const Surface& after, std::size_t brick) {
    std::size_t changed = 0;
    for_each_element(after, brick, [&](const Key& key, const Element& e) {
      const auto it = before_.find(key);
      changed += it == before_.end() || it->second != e ? 1 : 0;
      ++total_;
    });
    changed_ += changed;
    const auto [x, y, z] = block_.brick_coordinates(brick);
    bricks_.push_back({std::make_unique<CrossedEdges<std::uint8_t>>(block_, brick, after.isovalue()), changed,
                       block_.data() + block_.index(Grid::kBrick * x - 1, Grid::kBrick * y - 1, Grid::kBrick * z - 1)});
  }

  void measure(Spread& spread, const std::string& name) const {
    spread.measure(name + "; the " + std::to_string(changed_) + " of " + std::to_string(total_) +
                       " elements that it changed, at least",
                   600, [&](int) {
                     CrossingLanes around;
                     DualElementLanes element;
                     for (const auto& [edges, changed, first] : bricks_) {
                       read_rows(first);
                       for (std::size_t i = 0; i < changed; i += CrossingLanes::kLanes) {
                         edges->surround(i, around);
                         compute_.compute(around, edges->isovalue(), element);
                         benchmark::DoNotOptimize(element);
                       }
                     }
                   });
  }

 private:
  static constexpr int kHaloed = Grid::kBrick + 2;
  using Key = std::pair<std::size_t, std::uint32_t>;  // brick, edge
  using Element = std::array<float, 4>;
  struct Brick {
    std::unique_ptr<CrossedEdges<std::uint8_t>> edges;
    std::size_t changed;
    const std::uint8_t* first;  // voxel of the halo
  };

  template <class Visit>
  static void for_each_element(const Surface& surface, std::size_t brick, Visit&& visit) {
    surface.for_each_block(brick, [&](const ElementBlock& b, int count) {
      for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
        visit(Key{brick, b.edge[i]}, Element{b.position[0][i], b.position[1][i], b.position[2][i], b.area[i]});
    });
  }

  /// Finds the bone among a brick's voxels and its halo's.
  void read_rows(const std::uint8_t* first) const {
    std::array<std::uint32_t, kHaloed * kHaloed> bone;
    for (int k = 0; k < kHaloed; ++k)
      for (int j = 0; j < kHaloed; ++j) {
        std::array<std::uint8_t, 16> v;
        std::memcpy(v.data(), first + j * block_.row_pitch() + k * block_.plane_pitch(), sizeof(v));
        bone[static_cast<std::size_t>(k * kHaloed + j)] =
            detail::lane_bits<std::uint8_t, 16>([&](std::size_t l) { return v[l] >= 127; });
      }
    benchmark::DoNotOptimize(bone);
  }

  const Grid& block_;
  DualElements compute_;
  std::map<Key, Element> before_;
  std::vector<Brick> bricks_;
  std::size_t changed_ = 0, total_ = 0;
};

/// A burr goes through a block of bone by .04 voxel a tick: at once, and at a rate that takes a voxel ten ticks.
void measure_carving(Spread& spread) {
  constexpr double kVoxel = 3e-4;
  constexpr double kTick = 1e-3;
  const auto cut = [&](int radius, const std::string& how, const auto& policy) {
    const int side = 2 * radius + 56;
    const auto voxels = static_cast<std::size_t>(side);
    Grid block({.size = {side, side, side}, .spacing = Vec3d::Constant(kVoxel), .outside = 0},
               std::vector<std::uint8_t>(voxels * voxels * voxels, 255));
    BoneSurface<std::uint8_t> surface(block, 127.0);
    std::vector<std::uint32_t> versions(block.brick_count());
    const auto at = [&](int i) {
      return Vec3d(kVoxel * (Vec3d::Constant(radius + 15) + 0.04 * i * Vec3d::Ones().normalized()));
    };
    spread.measure("carving a burr of " + std::to_string(2 * radius) + " voxels diameter" + how, 600, [&](int i) {
      const CutAllowance allowance{.dt = kTick, .tick = static_cast<std::uint32_t>(i)};
      benchmark::DoNotOptimize(
          carve(block, 127.0, SphereCutter(at(i), at(i + 1), radius * kVoxel, i > 0), policy, allowance));
    });
    if (how.empty())
      measure_told_volume(spread, "carving a burr of " + std::to_string(2 * radius) + " voxels diameter", block,
                          at(600), Vec3d::Ones().normalized());
    // Afterwards the coupled tool makes the elements of the changed bricks anew.
    for (std::size_t b = 0; b < versions.size(); ++b) versions[b] = block.brick_version(b);
    if (!how.empty()) return;
    const auto cut_on = [&](int i) {
      static_cast<void>(
          carve(block, 127.0, SphereCutter(at(600 + i), at(601 + i), radius * kVoxel, true), policy, {.dt = kTick}));
      std::vector<std::size_t> changed;
      for (std::size_t b = 0; b < versions.size(); ++b)
        if (std::exchange(versions[b], block.brick_version(b)) != block.brick_version(b) && surface.crosses(b))
          changed.push_back(b);
      return changed;
    };
    const auto provide = [&](const std::vector<std::size_t>& changed) {
      surface.begin_tick();
      for (const std::size_t b : changed) benchmark::DoNotOptimize(surface.provide(b));
    };
    const std::string name = "carving a burr of " + std::to_string(2 * radius) + " voxels diameter";
    spread.measure(name + "; elements of the bricks that it changed", 600, cut_on, provide);
    ChangedElements least(block, 127.0);
    const std::vector<std::size_t> changed = cut_on(600);
    provide(changed);
    for (const std::size_t b : changed) least.add(surface, b);
    least.measure(spread, name);
  };
  for (const int radius : {5, 20}) {
    cut(radius, "", GeometricCut{});
    cut(radius, "; at a rate", RateLimitedCut<>{.rate = 255 / (10 * kTick)});
  }
}

}  // namespace

void measure_spread(const Options& options, const Scene& scene) {
  Spread spread(options);
  const int ticks = options.quick ? 2000 : 20000;
  const Field field(scene.tooth, kIsovalue);
  const auto renders = [&](const std::string& name, auto renderer, const Pose<float>& X) {
    spread.measure(name, ticks, [&](int i) {
      Pose<float> wiggled = X;
      wiggled.translation() += (5e-5 * Vec3d(std::sin(0.1 * i), std::cos(0.07 * i), 0)).cast<float>();
      benchmark::DoNotOptimize(renderer.render(field, wiggled));
    });
  };
  const Pose<float> buried = scene.pose(-0.006, 0.0);
  renders("Surface, as deep as it goes", surface(), buried);
  renders("Line, as deep as it goes", line(), buried);
  measure_coupled(spread, ticks);
  measure_drilling(spread);
  measure_carving(spread);
}

}  // namespace trephine::bench::speed
