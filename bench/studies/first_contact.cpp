// SPDX-License-Identifier: MIT
#include "studies/study.hpp"
#include "studies/table.hpp"
#include "support/fields.hpp"
#include "sweep/row.hpp"

#include <trephine/render/line/first_contact.hpp>

#include <chrono>
#include <functional>

namespace trephine::bench {
namespace {

using namespace trephine::test;
using Shape = std::function<double(const Vec3d&)>;

constexpr double kVoxel = 3e-4;
const Burr kBurr{};

[[nodiscard]] double deepest(const Shape& shape, const Centreline<double>& line) {
  const auto depth = [&](double h) { return -shape(line.at(h)); };
  const double from = kBurr.tip_radius, to = kBurr.shaft_length, step = 2e-4;
  double best = -1e9, at = from;
  for (double h = from; h <= to; h += step)
    if (const double d = depth(h); d > best) {
      best = d;
      at = h;
    }
  double lo = std::max(from, at - step), hi = std::min(to, at + step);
  for (int i = 0; i < 30; ++i) {
    const double a = lo + 0.381966 * (hi - lo), b = hi - 0.381966 * (hi - lo);
    if (depth(a) > depth(b))
      hi = b;
    else
      lo = a;
  }
  return std::max(best, depth(0.5 * (lo + hi)));
}

// A way to search, by name.
struct Searcher {
  std::string name;
  std::function<FirstContact<float>(const DensityField<std::uint8_t, float>&, const ToolDiscretization<LineCounts>&,
                                    const Centreline<float>&, const Centreline<float>&, float*)>
      search;
  bool rays = false;     // which path the truth takes
  bool trigger = false;  // sees only what is in bone at the end of the tick
};

struct Trial {
  std::size_t bone;
  Centreline<double> from, to;
  double speed;
  const char* kind;
  double truth[2];  // fraction of the path at the first contact: translate-rotate, rays
};

[[nodiscard]] Centreline<float> in_float(const Centreline<double>& l) {
  return {l.tip.cast<float>(), l.direction.cast<float>()};
}

// What the thesis' trigger looks at.
bool is_in_bone(const DensityField<std::uint8_t, float>& field, const ToolDiscretization<LineCounts>& tool,
                const Centreline<double>& line, float* scratch) {
  line_values(field, tool, in_float(line), scratch);
  return scratch[index_of_largest(scratch, tool.count())] >= 0;
}

// The line at share s of the path, for the truth's sake in double and by exact steps.
template <class Step>
double contact_share(const Shape& shape, const Step& stepping, const Centreline<double>& from,
                     const Centreline<double>& to) {
  const auto path = stepping.path(from, to, kBurr.shaft_length, 1.0);
  const int steps = path.steps();
  int hit = 1;
  while (hit <= steps && !(deepest(shape, path.at(hit)) >= 0)) ++hit;
  if (hit > steps) return 2;
  const Centreline<double> a = path.at(hit - 1), b = path.at(hit);
  double lo = 0, hi = 1;
  for (int i = 0; i < 30; ++i) {
    const double mid = 0.5 * (lo + hi);
    const Centreline<double> line{a.tip + mid * (b.tip - a.tip), (a.direction + mid * (b.direction - a.direction))};
    (deepest(shape, line) >= 0 ? hi : lo) = mid;
  }
  return (hit - 1 + 0.5 * (lo + hi)) / steps;
}

// Whether the search, led on as it went, tick after tick, finds the contact that it missed before the line has gone two
// voxels through.
bool finds_later(const Searcher& s, const DensityField<std::uint8_t, float>& field,
                 const ToolDiscretization<LineCounts>& tool, const Trial& t, float* scratch) {
  const Vec3d move = t.to.tip - t.from.tip, turn = t.to.direction - t.from.direction;
  const double a_tick = std::max(1e-6, (move + 0.5 * kBurr.shaft_length * turn).norm());
  const int ticks = static_cast<int>(std::ceil(3 * kVoxel / a_tick)) + 1;
  const auto after = [&](int k) {
    return Centreline<double>{t.to.tip + k * move, (t.to.direction + k * turn).normalized()};
  };
  for (int k = 0; k < ticks; ++k) {
    auto hit = s.search(field, tool, in_float(after(k)), in_float(after(k + 1)), scratch);
    if (hit.found && (!s.trigger || is_in_bone(field, tool, after(k + 1), scratch))) return true;
  }
  return false;
}

}  // namespace

void study_first_contact(const StudyOptions& options) {
  const int trials = options.quick ? 2000 : 100000;
  const ToolDiscretization tool{kBurr, LineCounts{.shaft = 50}};
  std::vector<float> scratch(2 * static_cast<std::size_t>(tool.padded()));
  const auto searcher = [](const char* name, auto stepping, bool refined, bool rays, bool trigger) {
    return Searcher{name,
                    [stepping, refined](const auto& field, const auto& t, const auto& from, const auto& to, float* s) {
                      return find_first_contact(field, t, stepping, from, to, s, refined);
                    },
                    rays, trigger};
  };
  const std::vector<Searcher> searchers{
      searcher("translate_rotate 1/2 voxel refined", TranslateRotate{}, true, false, false),
      searcher("ray_cast 1/2 voxel refined", RayCast{}, true, true, false),
      searcher("translate_rotate 1/2 voxel", TranslateRotate{}, false, false, false),
      searcher("ray_cast 1/2 voxel", RayCast{}, false, true, false),
      searcher("translate_rotate 10+10 steps", TranslateRotate{.translation_steps = 10, .rotation_steps = 10}, false,
               false, false),
      searcher("ray_cast 10 steps", RayCast{.steps = 10}, false, true, false),
      searcher("translate_rotate 1/2 voxel, thesis' trigger", TranslateRotate{}, false, false, true),
  };
  Table table(options.folder + "/first_contact.csv",
              "shape,motion,search,trials,misses,passed,miss_share,place_error_voxel_p50,place_error_voxel_p95,"
              "place_error_voxel_max,tick_ns_median");
  for (const char* name : {"plane", "sphere", "cylinder", "wall_1_voxel", "wall_2_voxels"}) {
    Random random(4711);
    std::vector<Shape> bones;
    std::vector<VoxelGrid<std::uint8_t>> grids;
    const RasterOptions o{.size = {65, 65, 65}};
    const std::string shape_name = name;
    std::vector<Vec3d> tops, outs;
    for (int b = 0; b < (options.quick ? 4 : 16); ++b) {
      const Vec3d n = random.unit();
      const Vec3d top = o.middle() + kVoxel * Vec3d{random.uniform(), random.uniform(), random.uniform()};
      const double wall = shape_name == "wall_1_voxel" ? kVoxel : 2 * kVoxel;
      if (shape_name == "plane") bones.emplace_back(HalfSpace{top, n});
      if (shape_name == "sphere") bones.emplace_back(Ball{top - 0.0048 * n, 0.0048});
      if (shape_name == "cylinder") bones.emplace_back(Rod{top - 0.003 * n, n.unitOrthogonal(), 0.003});
      if (shape_name.rfind("wall", 0) == 0) bones.emplace_back(Plate{top - 0.5 * wall * n, n, wall});
      grids.push_back(rasterise<std::uint8_t>(bones.back(), o));
      tops.push_back(top);
      outs.push_back(n);
    }
    // The same motions for every search.
    std::vector<Trial> all;
    const int count = trials / 5;
    while (static_cast<int>(all.size()) < count) {
      const auto b = static_cast<std::size_t>(random.below(static_cast<int>(bones.size())));
      const Vec3d n = outs[b], u = n.unitOrthogonal(), v = n.cross(u);
      const double speed = 0.01 * std::pow(100.0, random.uniform());
      const double way = 1e-3 * speed;
      const int kind = random.below(3);
      // The shaft lies about square to the normal and touches near its middle.
      const double turn = random.uniform(0, 6.28318);
      const Vec3d along = (std::cos(turn) * u + std::sin(turn) * v + random.uniform(-0.3, 0.3) * n).normalized();
      const double height = random.uniform(0.006, 0.02);
      const double above = random.uniform(0.02, 0.95) * way;
      Centreline<double> from{tops[b] + above * n - height * along, along};
      Centreline<double> to = from;
      const double lean_u = random.uniform(-0.5, 0.5), lean_v = random.uniform(-0.5, 0.5);
      if (kind != 1) to.tip -= way * (kind == 2 ? 0.5 : 1) * (n + lean_u * u + lean_v * v).normalized();
      if (kind != 0) to.direction = (along - (kind == 2 ? 0.5 : 1) * way / height * n).normalized();
      const Shape& shape = bones[b];
      if (!(deepest(shape, from) < -1e-6)) continue;
      // Only what a wall's other side or the far end of the shaft does not decide.
      Trial t{b, from, to, speed, kind == 0 ? "translation" : kind == 1 ? "rotation" : "both", {2, 2}};
      t.truth[0] = contact_share(shape, TranslateRotate{.translation_steps = 40, .rotation_steps = 40}, from, to);
      t.truth[1] = contact_share(shape, RayCast{.steps = 40}, from, to);
      if (t.truth[0] > 1 || t.truth[1] > 1) continue;
      // A graze of less than a quarter of a voxel is below what the image shows.
      double most = -1;
      const auto path = RayCast{.steps = 16}.path(from, to, kBurr.shaft_length, 1.0);
      for (int i = 1; i <= 16; ++i) most = std::max(most, deepest(shape, path.at(i)));
      if (most < 0.25 * kVoxel) continue;
      all.push_back(t);
    }
    for (const Searcher& searcher_now : searchers)
      for (const char* kind : {"translation", "rotation", "both"}) {
        std::vector<double> errors, times;
        int misses = 0, passed = 0, tried = 0;
        for (const Trial& t : all) {
          if (std::string(t.kind) != kind) continue;
          ++tried;
          const DensityField<std::uint8_t, float> field(grids[t.bone], o.isovalue());
          const auto begin = std::chrono::steady_clock::now();
          auto hit = searcher_now.search(field, tool, in_float(t.from), in_float(t.to), scratch.data());
          times.push_back(std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - begin).count());
          if (searcher_now.trigger && hit.found) hit.found = is_in_bone(field, tool, t.to, scratch.data());
          if (!hit.found) {
            ++misses;
            if (!finds_later(searcher_now, field, tool, t, scratch.data())) ++passed;
            continue;
          }
          // How far the surface found is from the bone's, in space: what the hand would feel.
          errors.push_back(std::abs(bones[t.bone](hit.point.template cast<double>())) / kVoxel);
        }
        table.row(name, kind, '"' + searcher_now.name + '"', tried, misses, passed,
                  tried > 0 ? static_cast<double>(misses) / tried : 0.0, percentile(errors, 0.5),
                  percentile(errors, 0.95), percentile(errors, 1), percentile(times, 0.5));
      }
  }
}

}  // namespace trephine::bench
