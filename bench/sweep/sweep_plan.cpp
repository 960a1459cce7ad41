// SPDX-License-Identifier: MIT
#include "sweep/sweep.hpp"
#include "truth/scenario.hpp"

#include <trephine/tool/counts.hpp>

#include <algorithm>
#include <set>
#include <sstream>

namespace trephine::bench {
namespace {

[[nodiscard]] Setting surface(const std::string& variant = kSurfaceDefault) {
  return {.renderer = "surface", .variant = variant};
}
[[nodiscard]] Setting surface(const SurfaceCounts& counts) {
  Setting s = surface();
  s.sphere = counts.sphere;
  s.slices = counts.slices;
  s.per_slice = counts.per_slice;
  return s;
}
// As near to infinitely many vertices on an image as is tried: what is left is the image's.
constexpr SurfaceCounts kDensest{.sphere = 1000, .slices = 200, .per_slice = 16};
[[nodiscard]] Setting line(const std::string& variant = kLineDefault) {
  return {.renderer = "line", .variant = variant};
}

[[nodiscard]] Setting coupled() {
  return {.renderer = "coupled", .variant = kCoupledDefault, .vertices = 0, .sphere = 0, .slices = 0, .per_slice = 0};
}

template <class T>
[[nodiscard]] std::vector<T> thinned(const std::vector<T>& all, bool quick) {
  if (!quick || all.size() <= 3) return all;
  return {all.front(), all[all.size() / 2], all.back()};
}

// Every factor round the default of one renderer.
[[nodiscard]] std::vector<Setting> factors(const Setting& usual, bool quick) {
  std::vector<Setting> all;
  const auto of = [&](const char* variant) {
    Setting s = usual;
    s.variant = variant;
    return s;
  };
  const auto vary = [&](const char* variant, auto member, const auto& values) {
    for (const auto value : thinned(values, quick)) {
      all.push_back(of(variant));
      all.back().*member = value;
    }
  };
  const std::string& renderer = usual.renderer;
  for (const auto& v : variants(renderer)) all.push_back(of(v.c_str()));
  using Ints = std::vector<int>;
  const std::vector<double> lengths{1, 0.5, 0.25, 0.125, 0.0625, 0.03125, 0.015625};
  if (renderer == "surface") {
    // The counts of ball and shaft for the laws that are compared.
    for (const auto* v : {kSurfaceThesis, kSurfaceDefault}) {
      vary(v, &Setting::sphere, Ints{14, 20, 26, 38, 50, 74, 98, 146, 200, 260, 300, 400, 600, 800, 1000});
      vary(v, &Setting::slices, Ints{5, 10, 20, 30, 50, 100, 200});
      vary(v, &Setting::per_slice, Ints{4, 6, 8, 12, 16, 24, 32});
    }
    vary(kSurfaceDefault, &Setting::step, lengths);
    return all;
  }
  for (const auto* v : {kLineThesis, kLineDefault})
    vary(v, &Setting::vertices, Ints{10, 20, 50, 100, 200, 500, 1000, 2000});
  for (const auto* v : {kLineDefault, kLineRayCast}) vary(v, &Setting::step, lengths);
  return all;
}

[[nodiscard]] std::vector<Image> images() {
  std::vector<Image> all;
  for (const char* kind : {"binary", "partial_volume", "ct_blur", "clamped_distance"}) all.push_back({.kind = kind});
  for (const double contrast : {60.0, 20.0}) all.push_back({.contrast = contrast});
  return all;
}

}  // namespace

std::string Job::name() const {
  std::ostringstream text;
  const Setting& s = setting;
  text << s.renderer << '/' << scenario << '/' << image.name() << '/' << image.voxel_mm << "mm/" << s.variant << '/';
  if (s.renderer == "surface")
    text << s.sphere << '+' << s.slices << 'x' << s.per_slice;
  else
    text << s.vertices;
  text << '/' << s.step << "vx";
  return text.str();
}

std::vector<Job> make_plan(bool quick) {
  std::vector<Job> jobs;
  for (const auto& scenario : scenario_names()) {
    const bool representative = scenario == "plane" || scenario == "sphere" || scenario == "shaft_cylinder";
    if (quick && !representative && scenario != "shaft_ridge") continue;
    for (const Setting& usual : {surface(), line()})
      for (const auto& s : factors(usual, quick)) jobs.push_back({scenario, Image(), s});
    jobs.push_back({scenario, Image(), coupled()});
    jobs.push_back({scenario, Image(), surface(SurfaceCounts{})});
    for (const auto& image : images()) {
      if (quick && !representative) continue;
      for (const auto& s : {surface(), surface(SurfaceCounts{}), surface(kDensest), line(), coupled()})
        jobs.push_back({scenario, image, s});
    }
  }
  // A shaft of five voxels radius.
  for (const char* scenario : {"shaft_cylinder", "shaft_ridge"}) {
    if (quick) break;
    const Image fine{.voxel_mm = 0.15};
    jobs.push_back({scenario, fine, line()});
    jobs.push_back({scenario, fine, surface(SurfaceCounts{})});
    for (const int n : {20, 50, 100, 200}) {
      jobs.push_back({scenario, fine, surface()});
      jobs.back().setting.slices = n;
    }
  }
  // Each once, and those of an image together.
  std::set<std::string> seen;
  std::erase_if(jobs, [&](const Job& j) { return !seen.insert(j.name()).second; });
  std::stable_sort(jobs.begin(), jobs.end(), [](const Job& a, const Job& b) {
    const auto key = [](const Job& j) { return std::tuple(j.scenario, j.image.name(), j.image.voxel_mm); };
    return key(a) < key(b);
  });
  return jobs;
}

}  // namespace trephine::bench
