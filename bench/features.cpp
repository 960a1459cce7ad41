// SPDX-License-Identifier: MIT
#include "../examples/drill/phantom.hpp"
#include "speed/features/scene.hpp"
#include "studies/arguments.hpp"
#include "studies/table.hpp"
#include "sweep/row.hpp"

#include <trephine/core/units.hpp>
#include <trephine/voxel/clearance_map.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <random>
#include <sstream>

/// What a scene pays for a feature that it lists and that does nothing, beside the same scene without it.
///   bench_features --out DIR [--text FILE] [--quick]
/// writes DIR/features.csv and features_spread.csv (the same scene twice: what a difference must exceed to be one).
/// Times are the thread's own, medians over repetitions in turn; the ratio is the median over pairs of these.
/// FILE: lines of `renderer_scene bytes`, the code of each scene's object file.
namespace {

std::size_t live_bytes = 0;

}  // namespace

// What scenes take is counted where they ask for it. Of more than usual alignment nothing here asks for any.
void* operator new(std::size_t size) {
  constexpr std::size_t kHeader = 16;
  auto* memory = static_cast<std::byte*>(std::malloc(size + kHeader));
  if (memory == nullptr) throw std::bad_alloc();
  std::memcpy(memory, &size, sizeof size);
  live_bytes += size;
  return memory + kHeader;
}
// Where it is inlined, GCC 12 takes what it frees for what operator new returned, and warns.
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  if (memory == nullptr) return;
  auto* begin = static_cast<std::byte*>(memory) - 16;
  std::size_t size = 0;
  std::memcpy(&size, begin, sizeof size);
  live_bytes -= size;
  std::free(begin);
}
void operator delete(void* memory, std::size_t) noexcept { operator delete(memory); }

namespace trephine::bench {

std::vector<const Registered*>& Registered::all() {
  static std::vector<const Registered*> every;
  return every;
}

namespace {

using Path = std::vector<TickInput>;
constexpr double kDt = 1e-3;
constexpr double kTipRadius = 1.5e-3;
constexpr double kIsovalue = drill::PhantomDensities::kIsovalue;

/// What is left to compare where a feature is an output itself.
enum class Compare { kAll, kForce };

struct Feature {
  std::string name;
  std::string without, with;  // scenes
  Settings settings_without, settings_with;
  const Path* path;
  Compare compare = Compare::kAll;
};

struct Options {
  std::string folder = "build/report";
  std::string text;
  bool quick = false;
};

/// In and out of contact with the tooth's crown: a wander across, up and down, and round. `lean` and `depth` [rad, m]
/// bound it; the spindle turns or not.
[[nodiscard]] Path wander(const Vec3d& top, std::size_t ticks, double lean, double depth, bool spindle_on) {
  std::mt19937 random(20080001);
  // Sums of three sines: at most 0.06 m/s and 3 rad/s.
  const auto wave = [&] {
    std::array<double, 6> w{};
    for (std::size_t i = 0; i < w.size(); i += 2) {
      w[i] = 2 + 8 * static_cast<double>(random()) / static_cast<double>(std::mt19937::max());
      w[i + 1] = 6.283 * static_cast<double>(random()) / static_cast<double>(std::mt19937::max());
    }
    return [w](double t) {
      return (std::sin(w[0] * t + w[1]) + std::sin(w[2] * t + w[3]) + std::sin(w[4] * t + w[5])) / 3;
    };
  };
  const auto x = wave(), y = wave(), z = wave(), turn_x = wave(), turn_y = wave();
  Path path(ticks);
  for (std::size_t i = 0; i < ticks; ++i) {
    const double t = kDt * static_cast<double>(i);
    const Vec3d turn(lean * turn_x(t), lean * turn_y(t), 0.3 * t);
    const Vec3d p = top + Vec3d(0.002 * x(t), 0.002 * y(t), 0.0012 - depth + (0.0012 + depth) * z(t));
    path[i] = {.X_WT = make_pose<double>(rotation_from_vector(turn), p), .spindle_on = spindle_on};
  }
  return path;
}

/// Zeros of either sign are the same force.
[[nodiscard]] bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a + 0.0) == std::bit_cast<std::uint64_t>(b + 0.0);
}
[[nodiscard]] bool same_bits(const Vec3d& a, const Vec3d& b) {
  return same_bits(a.x(), b.x()) && same_bits(a.y(), b.y()) && same_bits(a.z(), b.z());
}
[[nodiscard]] bool same(const Outcome& a, const Outcome& b, Compare compare) {
  if (!same_bits(a.wrench.force, b.wrench.force) || a.status != b.status) return false;
  if (compare == Compare::kAll && !same_bits(a.wrench.torque, b.wrench.torque)) return false;
  for (int i = 0; i < 4; ++i)
    if (!same_bits(Vec3d(a.X_WP.matrix().block<3, 1>(0, i)), Vec3d(b.X_WP.matrix().block<3, 1>(0, i)))) return false;
  return true;
}

/// Of this thread alone: what else the machine does is not the scene's.
[[nodiscard]] double processor_ns() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e9 * static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_nsec);
}

class Study {
 public:
  Study(const Options& options, const Place& place, const Vec3d& top)
      : options_(options),
        place_(place),
        top_(top),
        table_(options.folder + "/features.csv",
               "renderer,feature,tick_ns_without,tick_ns_with,ratio,bytes_without,bytes_with,text_bytes_without,"
               "text_bytes_with,outputs_identical"),
        spread_(options.folder + "/features_spread.csv", "renderer,pairs,tick_ns,least_ratio,greatest_ratio") {
    for (const Registered* r : Registered::all()) makers_[r->renderer + '_' + r->name] = r->make;
    std::ifstream text(options.text);
    std::string name;
    for (std::string bytes; text >> name >> bytes;) text_[name] = bytes;
  }

  void run(const std::string& renderer) {
    // Where it begins to touch: Line's tip is a point.
    const Vec3d touching = top_ + Vec3d(0, 0, renderer == "line" ? 0.0 : kTipRadius);
    constexpr std::size_t kTicks = 3000;
    all_ = wander(touching, kTicks, 0.7, 0.0006, false);
    turning_ = wander(touching, kTicks, 0.7, 0.0006, true);
    tip_ = wander(touching, kTicks, 0.1, 0.0002, false);  // upright and shallow: what may touch is the tip
    const Settings tool{.burr = {.tip_radius = kTipRadius, .shaft_radius = 0.8_mm, .shaft_length = 40_mm}};
    spread(renderer, tool);
    for (const Feature& f : features(renderer, tool)) {
      const auto without = scene(renderer, f.without), with = scene(renderer, f.with);
      if (without != nullptr && with != nullptr) compare(renderer, f, without, with);
    }
  }

 private:
  struct Timed {
    double without = 0, with = 0;  // medians [ns]
    double ratio = 1;              // median over pairs that ran one after the other
  };

  [[nodiscard]] std::vector<Feature> features(const std::string& renderer, const Settings& tool) const {
    Settings ball = tool, budget = tool, statistics = tool, held = tool;
    ball.burr.shaft_length = 0;
    budget.budget = StiffnessBudget{1e12, 1e9};
    statistics.statistics = true;
    held.rotational_stiffness = std::numeric_limits<double>::infinity();  // the rotation is the device's
    std::vector<Feature> f{
        {"friction", "bare", "friction", tool, tool, &all_},
        {"torque", "force_only", "bare", tool, tool, &all_, Compare::kForce},
        {"rotation of the proxy", "translation", "bare", tool, held, &all_, Compare::kForce},
        {"torque-only shaft", "shaft_torque_force_only", "shaft_torque", tool, tool, &all_, Compare::kForce},
        {"shaft", "bare", "bare", ball, tool, &tip_},
        {"budget", "bare", "bare", tool, budget, &all_},
        {"air map", "bare", "skip_far", tool, tool, &all_},
    };
    for (const char* stage : {"carving", "vibration", "hunt_crossley", "damping", "filter", "passivity", "rate_limit",
                              "limits", "all_stages"})
      f.push_back({stage, "bare", stage, tool, tool, std::string(stage) == "vibration" ? &turning_ : &all_});
    f.push_back({"recorder", "loop", "recorder", tool, tool, &all_});
    f.push_back({"statistics", "loop", "loop", tool, statistics, &all_});
    f.push_back({"shaft and torque", "force_only", "bare", ball, tool, &tip_, Compare::kForce});
    f.push_back({"shaft and all stages", "bare", "all_stages", ball, tool, &tip_});
    f.push_back({"headers of all else", "bare", "bare_of_all_headers", tool, tool, &all_});
    std::erase_if(f, [&](const Feature& x) { return x.name == "budget" && renderer == "coupled"; });
    return f;
  }

  [[nodiscard]] MakeScene scene(const std::string& renderer, const std::string& name) const {
    const auto found = makers_.find(renderer + '_' + name);
    return found == makers_.end() ? nullptr : found->second;
  }
  [[nodiscard]] std::string text(const std::string& renderer, const std::string& name) const {
    const auto found = text_.find(renderer + '_' + name);
    return found == text_.end() ? "" : found->second;
  }

  /// Each in turn over the whole path; who is first alternates.
  [[nodiscard]] Timed time(FeatureScene& without, FeatureScene& with, const Path& path) const {
    std::vector<double> a, b, ratios;
    const auto once = [&](FeatureScene& s, std::vector<double>& times) {
      const double begin = processor_ns();
      s.run(path, kDt, {});
      times.push_back((processor_ns() - begin) / static_cast<double>(path.size()));
    };
    constexpr double kLongEnough = 4e9;  // [ns]; what takes longer is timed less often
    const double begin = processor_ns();
    for (int i = 0; i < (options_.quick ? 7 : 25) && (i < 7 || processor_ns() - begin < kLongEnough); ++i) {
      if (i % 2 == 0) once(without, a);
      once(with, b);
      if (i % 2 == 1) once(without, a);
      ratios.push_back(b.back() / a.back());
    }
    return {percentile(a, 0.5), percentile(b, 0.5), percentile(ratios, 0.5)};
  }

  void compare(const std::string& renderer, const Feature& f, MakeScene make_without, MakeScene make_with) {
    const Made without = made(make_without, f.settings_without), with = made(make_with, f.settings_with);
    std::vector<Outcome> a(f.path->size()), b(f.path->size());
    without.scene->run(*f.path, kDt, a);
    with.scene->run(*f.path, kDt, b);
    std::size_t differ = 0;
    double most = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      differ += same(a[i], b[i], f.compare) ? 0 : 1;
      most = std::max(most, (a[i].wrench.force - b[i].wrench.force).norm());
    }
    const Timed t = time(*without.scene, *with.scene, *f.path);
    table_.row(renderer, f.name, t.without, t.with, t.ratio, without.bytes, with.bytes, text(renderer, f.without),
               text(renderer, f.with), differ == 0 ? "yes" : "no");
    std::ostringstream words;
    if (differ > 0) words << ", outcomes differ in " << differ << " ticks, forces by up to " << most << " N";
    if (const auto touches = std::count_if(b.begin(), b.end(), [](const Outcome& o) { return o.contact.shaft; });
        f.path == &tip_ && touches > 0)
      words << ", the shaft touches in " << touches << " ticks";
    std::fprintf(stderr, "features: %-8s %-38s %7.0f ns x %.3f, %+6td bytes%s\n", renderer.c_str(), f.name.c_str(),
                 t.without, t.ratio,
                 static_cast<std::ptrdiff_t>(with.bytes) - static_cast<std::ptrdiff_t>(without.bytes),
                 words.str().c_str());
  }

  struct Made {
    std::unique_ptr<FeatureScene> scene;
    std::size_t bytes;  // sizeof and what it holds on the heap
  };
  [[nodiscard]] Made made(MakeScene make, const Settings& settings) const {
    const std::size_t before = live_bytes;
    auto scene = make(place_, settings);
    const std::size_t bytes = live_bytes - before - scene->wrapped_bytes() + scene->bytes();
    return {std::move(scene), bytes};
  }

  void spread(const std::string& renderer, const Settings& tool) {
    const MakeScene make = scene(renderer, "bare");
    constexpr int kPairs = 7;
    std::vector<double> ratios;
    double ns = 0;
    for (int i = 0; i < kPairs; ++i) {
      const Made a = made(make, tool), b = made(make, tool);
      const Timed t = time(*a.scene, *b.scene, all_);
      ratios.push_back(t.ratio);
      ns = t.without;
      if (i > 0) continue;
      table_.row(renderer, "none (A/A)", t.without, t.with, t.ratio, a.bytes, b.bytes, text(renderer, "bare"),
                 text(renderer, "bare"), "yes");
    }
    spread_.row(renderer, kPairs, ns, percentile(ratios, 0), percentile(ratios, 1));
    std::vector<Outcome> out(all_.size());
    make(place_, tool)->run(all_, kDt, out);
    const auto touching = std::count_if(out.begin(), out.end(), [](const Outcome& o) { return o.contact.count > 0; });
    const auto well = std::count_if(out.begin(), out.end(), [](const Outcome& o) { return o.status == Status::kOk; });
    std::fprintf(stderr,
                 "features: %-8s the same scene twice: %.3f to %.3f; %.0f %% of the path in contact, %.0f %% ok\n",
                 renderer.c_str(), percentile(ratios, 0), percentile(ratios, 1),
                 100 * static_cast<double>(touching) / static_cast<double>(out.size()),
                 100 * static_cast<double>(well) / static_cast<double>(out.size()));
  }

  Options options_;
  Place place_;
  Vec3d top_;
  Path all_, turning_, tip_;
  std::map<std::string, MakeScene> makers_;
  std::map<std::string, std::string> text_;
  Table table_, spread_;
};

}  // namespace
}  // namespace trephine::bench

int main(int argc, char** argv) {
  using namespace trephine;
  bench::Options options;
  if (!bench::read_arguments(argc, argv, "bench_features", {{"--quick", &options.quick}},
                             {{"--out", &options.folder}, {"--text", &options.text}}))
    return 2;
  std::filesystem::create_directories(options.folder);
  auto tooth = drill::tooth_phantom<std::uint8_t>({.size = {128, 128, 88}, .spacing = 0.2_mm});
  ClearanceMap<std::uint8_t> air(tooth, bench::kIsovalue);
  // The crown.
  const DensityField<std::uint8_t, double> field(tooth, bench::kIsovalue);
  Vec3d top = 1e-4 * Vec3d(127, 127, 174);
  while (top.z() > 0 && field.value(top) < 0) top.z() -= 5e-5;
  bench::Study study(options, {tooth, bench::kIsovalue, air}, top);
  for (const char* renderer : {"line", "surface", "coupled"}) study.run(renderer);
}
