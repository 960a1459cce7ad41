// SPDX-License-Identifier: MIT
#include "../examples/drill/phantom.hpp"
#include "speed/kernels.hpp"
#include "speed/levels.hpp"
#include "speed/others.hpp"
#include "speed/run.hpp"
#include "studies/arguments.hpp"
#include "studies/table.hpp"
#include "support/fields.hpp"
#include "sweep/row.hpp"

#include <trephine/trephine.hpp>

#include <array>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <thread>

/// What the library costs, each figure beside its reference in one interleaved run.
///   bench_speed --out DIR [--march NAME] [--append] [--quick]
/// writes DIR/speed.csv, speed_spread.csv (worst cases), speed_servo.csv and speed_memory.csv.
namespace {

using namespace trephine;
using Clock = std::chrono::steady_clock;
using Grid = VoxelGrid<std::uint8_t>;
using Field = DensityField<std::uint8_t, float>;
using Surface = SurfaceApproxRenderer<float>;
using Line = LineApproxRenderer<float>;
using Coupled = CoupledToolRenderer<float>;
using bench::SpeedRun;

constexpr double kIsovalue = drill::PhantomDensities::kIsovalue;
#if defined(__clang__)
constexpr const char* kCompiler = "clang++";
#else
constexpr const char* kCompiler = "g++";
#endif

struct Options {
  std::string folder = "build/report";
  std::string march = "native";
  bool append = false;
  bool quick = false;
};

/// The thesis' tooth in voxels of another size [m].
[[nodiscard]] Grid tooth_of(double voxel) {
  const double shrink = 1e-4 / voxel;
  const int across = static_cast<int>(256 * shrink);
  return drill::tooth_phantom<std::uint8_t>(
      {.size = {across, across, static_cast<int>(176 * shrink)}, .spacing = voxel});
}

/// A tooth and poses of a tool that leans on its crown.
struct Scene {
  Grid tooth = drill::tooth_phantom<std::uint8_t>();
  Vec3d top;

  Scene() {
    const Field field(tooth, kIsovalue);
    top = 0.5e-4 * Vec3d(255, 255, 175);
    top.z() = 0.0175;
    while (top.z() > 0 && field.value(top.cast<float>()) < 0) top.z() -= 5e-5;
  }
  /// The ball's centre `height` above the crown.
  [[nodiscard]] Pose<float> pose(double height, double lean = 0.3) const {
    return make_pose<double>(rotation_from_vector(Vec3d(lean, 0.1, 0)), top + Vec3d(0, 0, height)).cast<float>();
  }
};

[[nodiscard]] Surface surface(int slices = 20, int per_slice = 8, int sphere = 26, double length = 0.04) {
  const Burr burr{.tip_radius = 1.5_mm, .shaft_radius = 0.8_mm, .shaft_length = length};
  return Surface(ToolDiscretization{burr, SurfaceCounts{.sphere = sphere, .slices = slices, .per_slice = per_slice}});
}

[[nodiscard]] Line line() {
  const Burr burr{.tip_radius = 1.5_mm, .shaft_radius = 0.8_mm, .shaft_length = 40_mm};
  return Line(ToolDiscretization{burr, LineCounts{}});
}

[[nodiscard]] Coupled coupled(DepthMap& depths) {
  const Burr burr{.tip_radius = 1.5_mm, .shaft_radius = 0.8_mm, .shaft_length = 40_mm};
  return Coupled(ToolDiscretization{burr, SurfaceCounts{}}, FromDepthMap(depths));
}

/// The thesis' own formulas, and ours that sum over patches.
using Thesis = SurfaceApproxRenderer<float, CollisionRatio, HoldForce, TorqueOnly>;
using Patches = SurfaceApproxRenderer<float, PatchWeights>;

/// The thesis' ticks with a gradient for each hit: the least that any law adds to them that asks how bone lies.
struct WithGradients {
  Thesis thesis;
  Field field;
  Pose<float> X;
  int hits;
  std::array<std::vector<float>, 3> out{};

  void operator()() {
    benchmark::DoNotOptimize(thesis.render(field, X));
    const auto& p = thesis.tool().points();
    for (auto& v : out) v.resize(static_cast<std::size_t>(padded_to_lane(hits)));
    field.gradients(X, p.x.data(), p.y.data(), p.z.data(), out[0].data(), out[1].data(), out[2].data(),
                    padded_to_lane(hits));
    benchmark::ClobberMemory();
  }
};

/// A pose at which about `hits` of the tool's vertices are in bone.
[[nodiscard]] Pose<float> pose_of_hits(const Scene& scene, const Surface& like, int hits) {
  const Field field(scene.tooth, kIsovalue);
  const auto& tool = like.tool();
  std::vector<float> values(static_cast<std::size_t>(tool.padded()));
  for (double height = 0.002; height > -0.015; height -= 2e-5) {
    const Pose<float> X = scene.pose(height);
    field.values(X, tool.points().x.data(), tool.points().y.data(), tool.points().z.data(), values.data(),
                 tool.padded());
    if (std::count_if(values.begin(), values.begin() + tool.periphery(), [](float v) { return v >= 0; }) >= hits)
      return X;
  }
  return scene.pose(-0.015);
}

/// Flat bone with two voxels of blur, and a drill laid on it: its vertices touch and no group's centre is in bone.
struct Flat {
  static constexpr int kLevel = 88;  // voxels
  Grid bone = make();

  static Grid make() {
    std::vector<std::uint8_t> voxels;
    for (int k = 0; k < 176; ++k)
      voxels.insert(voxels.end(), 256 * 256, static_cast<std::uint8_t>(std::clamp(127 + 64 * (kLevel - k), 0, 255)));
    return Grid({.size = {256, 256, 176}, .spacing = Vec3d::Constant(1e-4)}, voxels);
  }
  [[nodiscard]] static Surface drill(int slices = 20) { return surface(slices, 8, 26, 0.02); }
  /// A pose at which at least `hits` of its vertices are in bone.
  [[nodiscard]] Pose<float> pose_of_hits(int hits, int slices = 20) const {
    const Field field(bone, 127);
    for (double tilt = 0.1; tilt >= 0; tilt -= 0.002)
      for (double height = 7.5e-4; height > 2e-5; height -= 1e-5) {
        const Mat3d R = rotation_from_vector(Vec3d(-1.5708 + tilt, 0, 0)) * rotation_from_vector(Vec3d(0, 0, 0.3));
        const Vec3d p = 1e-4 * Vec3d(128, 30, kLevel) + Vec3d(0, 0, height);
        const Pose<float> X = make_pose<double>(R, p).cast<float>();
        Surface s = drill(slices);
        if (s.render(field, X).contact.count < hits) continue;
        if (std::ranges::none_of(s.groups(), [](const auto& g) { return g.deep; })) return X;
      }
    throw std::runtime_error("no pose of so many hits");
  }
};

/// As many samples as a tick takes, of the tool's own points.
class Samples {
 public:
  /// `ones` of them one after the other, each where the one before tells, as a search takes them.
  Samples(const Field& field, const Surface& like, const Pose<float>& X, std::int64_t count, std::int64_t ones = 0)
      : field_(&field),
        tool_(&like.tool()),
        X_(X),
        count_(count - ones),
        ones_(ones),
        out_(static_cast<std::size_t>(tool_->padded())) {}
  void operator()() {
    Vec3<float> at = X_.translation();
    for (std::int64_t i = 0; i < ones_; ++i) at.z() += 1e-9F * field_->value(at);
    benchmark::DoNotOptimize(at);
    const auto& p = tool_->points();
    for (std::int64_t left = count_; left > 0; left -= tool_->padded()) {
      const int n = static_cast<int>(std::min<std::int64_t>(padded_to_lane(static_cast<int>(left)), tool_->padded()));
      field_->values(X_, p.x.data(), p.y.data(), p.z.data(), out_.data(), n);
      benchmark::DoNotOptimize(out_.data());
      benchmark::ClobberMemory();
    }
  }

 private:
  const Field* field_;
  const ToolDiscretization<SurfaceCounts, float>* tool_;
  Pose<float> X_;
  std::int64_t count_;
  std::int64_t ones_;
  std::vector<float> out_;
};

/// What a tick takes.
struct Taken {
  std::int64_t samples = 0;
  std::int64_t ones = 0;  ///< of them one at a time
};

template <class Renderer>
[[nodiscard]] Taken taken_by(const Field& field, Renderer renderer, const Pose<float>& X) {
  const test::CountingField<Field> counting(field);
  for (int i = 0; i < 3; ++i) {
    counting.samples = counting.ones = counting.normals = 0;
    benchmark::DoNotOptimize(renderer.render(counting, X));
  }
  // A normal reads the voxels of a sample.
  return {counting.samples + counting.normals, counting.ones + counting.normals};
}

/// A Line that goes to and fro by .02 m/s: at rest it searches nothing.
template <class Known>
[[nodiscard]] std::function<void()> moving_line(const Known& field, const Pose<float>& X) {
  return [field, X, l = std::make_shared<Line>(line()), away = false]() mutable {
    Pose<float> at = X;
    if ((away = !away)) at.translation() += Vec3<float>(2e-5F, 0, 0);
    benchmark::DoNotOptimize(l->render(field, at));
  };
}

/// A name as a table may hold it.
[[nodiscard]] std::string without_commas(std::string name) {
  std::replace(name.begin(), name.end(), ',', ':');
  return name;
}

class Report {
 public:
  Report(const SpeedRun& run, const Options& options)
      : run_(run),
        march_(options.march),
        table_(options.folder + "/speed.csv", "measure,compiler,march,ns,reference_ns,ratio,target,met",
               options.append) {}

  /// ns / reference at most `target`; no target where it is 0.
  void at_most(const std::string& measure, const std::string& name, const std::string& reference, double target) {
    row(measure, run_.ns(name), run_.ns(reference), target, [](double r, double t) { return r <= t; });
  }
  void at_least(const std::string& measure, const std::string& name, const std::string& reference, double target) {
    row(measure, run_.ns(name), run_.ns(reference), target, [](double r, double t) { return r >= t; });
  }
  void figure(const std::string& measure, const std::string& name) {
    table_.row(without_commas(measure), kCompiler, march_, run_.ns(name), "", "", "", "");
  }

 private:
  template <class Met>
  void row(const std::string& measure, double ns, double reference, double target, Met&& met) {
    const double ratio = ns / reference;
    if (target > 0)
      table_.row(without_commas(measure), kCompiler, march_, ns, reference, ratio, target,
                 met(ratio, target) ? "yes" : "no");
    else
      table_.row(without_commas(measure), kCompiler, march_, ns, reference, ratio, "", "");
    std::fprintf(stderr, "speed: %-60s %9.1f ns, ratio %.3g\n", measure.c_str(), ns, ratio);
  }

  const SpeedRun& run_;
  std::string march_;
  bench::Table table_;
};

/// A burr of 5 voxels radius that goes on by .04 voxel a tick, through a block of bone and back to its start.
class Carving {
 public:
  explicit Carving(double reach) : block_(make()) {
    if (reach > 0) depth_.emplace(block_, 127.0, DepthOptions{.reach = reach});
    restart();
  }
  void operator()() {
    ++tick_;
    const Vec3d q = p_ + 0.04 * kVoxel * Vec3d::Ones().normalized();
    const SphereCutter cutter(p_, q, 5 * kVoxel, tick_ > 0);
    if (depth_)
      depth_->cut(cutter);
    else
      benchmark::DoNotOptimize(carve(block_, 127.0, cutter));
    p_ = q;
  }

  /// Before a tick, and not part of it.
  void prepare() {
    if (tick_ == kTicks) restart();
  }
  [[nodiscard]] const Grid& block() const { return block_; }
  [[nodiscard]] static Grid make() {
    const std::vector<std::uint8_t> bone(64 * 64 * 64, 255);
    return Grid({.size = {64, 64, 64}, .spacing = Vec3d::Constant(kVoxel), .outside = 0}, bone);
  }

 private:
  static constexpr double kVoxel = 3e-4;
  static constexpr int kTicks = 600;
  void restart() {
    block_.restore();
    if (depth_) depth_->restore();
    p_ = Vec3d::Constant(20 * kVoxel);
    tick_ = 0;
  }

  Grid block_;
  std::optional<DepthMap> depth_;
  Vec3d p_;
  int tick_ = 0;
};

/// Sampling by ours and by others, of the same points of the same field: a drill of the thesis' counts that goes
/// through bone and air, all of it within the volume.
class SamplingRows {
 public:
  SamplingRows(SpeedRun& run, const Scene& scene)
      : tool_(surface(20, 8, 26, 0.012).tool()), view_(scene.tooth), checked_(scene.tooth) {
    const Vec3d middle = 0.5e-4 * Vec3d(255, 255, 0) + Vec3d(0, -0.002, 0.01);
    X_ = make_pose<double>(rotation_from_vector(Vec3d(-1.2, 0.1, 0)), middle).cast<float>();
    const Vec3<float> per_metre = scene.tooth.spacing().cwiseInverse().cast<float>();
    at_ = {per_metre.asDiagonal() * X_.linear(),
           X_.translation().cwiseProduct(per_metre),
           tool_.points().x.data(),
           tool_.points().y.data(),
           tool_.points().z.data(),
           tool_.count()};
    add_ours(run);
    add_others(run, scene);
  }
  SamplingRows(const SamplingRows&) = delete;
  SamplingRows& operator=(const SamplingRows&) = delete;

  void report(Report& report, const std::string& march) const {
    const bool v2 = march == "x86-64-v2";
    report.at_most("batched sampling / bare loads", "sampling", "bare loads", v2 ? 4 : 2.5);
    report.at_least("checked Eigen sampling / ours", "checked sampling", "sampling", v2 ? 5 : 8);
    const std::map<std::string, double> targets{{"OpenVDB GridSampler", 18}, {"NanoVDB", 12}, {kItk, 6}};
    for (const auto& other : bench::other_libraries()) {
      const auto target = targets.find(other.name);
      report.at_least(other.name + " / ours", other.name, "sampling",
                      v2 || target == targets.end() ? 0 : target->second);
      // What no sampler of this grid can exceed.
      report.at_least(other.name + " / bare loads", other.name, "bare loads", 0);
    }
  }

 private:
  static constexpr const char* kItk = "ITK's linear interpolator";
  using Values = std::vector<float>;

  void sample(Values& out) const {
    sample_points(view_, at_.A, Vec3<float>(at_.t + Vec3<float>::Ones()), at_.x, at_.y, at_.z, out.data(),
                  tool_.padded());
  }

  void add_ours(SpeedRun& run) {
    const auto& p = tool_.points();
    auto bare = std::make_shared<bench::BareLoads>(view_, at_.A, Vec3<float>(at_.t + Vec3<float>::Ones()), p.x.data(),
                                                   p.y.data(), p.z.data(), tool_.padded());
    run.add("bare loads", [bare] {
      benchmark::DoNotOptimize((*bare)());
      benchmark::ClobberMemory();
    });
    auto out = std::make_shared<Values>(static_cast<std::size_t>(tool_.padded()));
    run.add("sampling", [this, out] {
      sample(*out);
      benchmark::DoNotOptimize(out->data());
      benchmark::ClobberMemory();
    });
    Values checked;
    for (int i = 0; i < tool_.count(); ++i) checked.push_back(static_cast<float>(checked_((X_ * p[i]).cast<double>())));
    must_agree("checked sampling", checked);
    run.add("checked sampling", [this] {
      double sum = 0;
      for (int i = 0; i < tool_.count(); ++i) sum += checked_((X_ * tool_.points()[i]).cast<double>());
      benchmark::DoNotOptimize(sum);
    });
  }

  void add_others(SpeedRun& run, const Scene& scene) {
    for (const auto& other : bench::other_libraries()) {
      const auto sampling = other.make(scene.tooth);
      auto out = std::make_shared<Values>(static_cast<std::size_t>(tool_.count()));
      sampling(at_, out->data());
      must_agree(other.name, *out);
      run.add(other.name, [this, sampling, out] {
        sampling(at_, out->data());
        benchmark::DoNotOptimize(out->data());
        benchmark::ClobberMemory();
      });
    }
  }

  /// Times of what does not answer the same say nothing.
  void must_agree(const std::string& name, const Values& values) const {
    constexpr float kRounding = 0.02F;  // densities: coordinates of 256 voxels in floats, 255 densities a voxel
    Values ours(static_cast<std::size_t>(tool_.padded()));
    sample(ours);
    int in_bone = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(tool_.count()); ++i) {
      const Vec3<float> u = at_[static_cast<int>(i)];
      if (!((u.array() >= 0).all() && (u - view_.last).maxCoeff() < -2))
        throw std::runtime_error("a point lies beyond the volume");
      if (!(std::abs(values[i] - ours[i]) <= kRounding))
        throw std::runtime_error(name + " answers " + std::to_string(values[i]) + " where ours answers " +
                                 std::to_string(ours[i]));
      in_bone += ours[i] >= kIsovalue ? 1 : 0;
    }
    if (in_bone < tool_.count() / 5 || in_bone > tool_.count() * 4 / 5)
      throw std::runtime_error(std::to_string(in_bone) + " points in bone: neither bone nor air is to be left out");
  }

  ToolDiscretization<SurfaceCounts, float> tool_;
  SampleView<std::uint8_t, float> view_;
  bench::CheckedSampling checked_;
  Pose<float> X_;
  bench::PosedPoints at_;
};

void measure_speed(const Options& options, const Scene& scene) {
  SpeedRun run;
  const Field field(scene.tooth, kIsovalue);
  const Surface thesis = surface();
  const Pose<float> light = pose_of_hits(scene, thesis, 20);
  const Pose<float> deep = pose_of_hits(scene, thesis, 84);
  const Pose<float> near_air = scene.pose(0.003);
  const Pose<float> far_air = make_pose<double>(Mat3d::Identity(), 1e-4 * Vec3d(20, 20, 160)).cast<float>();
  const Pose<float> outside = scene.pose(0.05);

  const SamplingRows sampling(run, scene);

  // Ticks of both renderers, beside as many samples.
  const auto tick = [&]<class Renderer>(const std::string& name, Renderer renderer, const Pose<float>& X,
                                        double per = 1) {
    const Taken taken = taken_by(field, renderer, X);
    auto r = std::make_shared<Renderer>(std::move(renderer));
    run.add(
        name, [&field, r, X] { benchmark::DoNotOptimize(r->render(field, X)); }, per);
    run.add(name + ", bare", Samples(field, thesis, light, taken.samples));
    if (taken.ones > 0) run.add(name + ", as taken", Samples(field, thesis, light, taken.samples, taken.ones));
  };
  tick("surface, near air", surface(), near_air);
  tick("surface, far air", surface(), far_air);
  tick("surface, outside", surface(), outside);
  tick("surface, 1 centre in bone", surface(), light);
  tick("surface, 6 centres in bone", surface(), deep);
  const Flat flat;
  const Field on_flat(flat.bone, 127);
  const Surface flat_drill = Flat::drill();
  for (const int hits : {20, 84}) {
    const Pose<float> X = flat.pose_of_hits(hits);
    const std::string name = "surface, " + std::to_string(hits) + " hits";
    auto r = std::make_shared<Surface>(Flat::drill());
    run.add(name, [&on_flat, r, X] { benchmark::DoNotOptimize(r->render(on_flat, X)); });
    run.add(name + ", bare", Samples(on_flat, flat_drill, X, taken_by(on_flat, Flat::drill(), X).samples));
    auto thesis_way = std::make_shared<Thesis>(flat_drill.tool());
    auto patches = std::make_shared<Patches>(flat_drill.tool());
    const std::string count = ", " + std::to_string(hits) + " hits";
    run.add("thesis" + count, [&on_flat, thesis_way, X] { benchmark::DoNotOptimize(thesis_way->render(on_flat, X)); });
    run.add("patches" + count, [&on_flat, patches, X] { benchmark::DoNotOptimize(patches->render(on_flat, X)); });
    run.add("thesis with gradients" + count, WithGradients{Thesis(flat_drill.tool()), on_flat, X, hits});
  }
  // The same with a map of air; bare samples are those of a tick that looks at all.
  auto air = std::make_shared<AirMap<std::uint8_t>>(scene.tooth, kIsovalue);
  const FieldWithAir<Field, std::uint8_t> known(field, *air);
  for (const auto& [name, X] :
       {std::pair("near air", near_air), std::pair("far air", far_air), std::pair("light", light)}) {
    auto r = std::make_shared<Surface>(surface());
    run.add("surface, culled, " + std::string(name),
            [known, air, r, X = X] { benchmark::DoNotOptimize(r->render(known, X)); });
  }
  // Without and with what the field knows of air; the plain one knows nothing, not even where the grid ends.
  const test::CountingField<Field> plain(field);
  for (const auto& [name, X] :
       {std::pair("near air", near_air), std::pair("far air", far_air), std::pair("beyond the grid", outside)}) {
    run.add("line, " + std::string(name) + ", all sampled", moving_line(plain, X));
    run.add("line, " + std::string(name), moving_line(field, X));
    run.add("line, " + std::string(name) + ", map of air", moving_line(known, X));
  }
  // The whole tick of a scene, what is not the renderer's included.
  auto grid = std::make_shared<Grid>(drill::tooth_phantom<std::uint8_t>());
  auto whole = std::make_shared<HapticScene<std::uint8_t, Surface>>(*grid, kIsovalue, surface());
  run.add("scene, near air",
          [grid, whole, X = near_air.cast<double>()] { benchmark::DoNotOptimize(whole->tick({.X_WT = X}, 1e-3)); });

  // N scaling: all of a tool in air and in contact.
  for (const auto& [name, slices] : {std::pair("207", 20), std::pair("1008", 109)}) {
    const Surface many = surface(slices);
    const double count = many.tool().count();
    tick("N " + std::string(name) + ", air", surface(slices), near_air, count);
    const Pose<float> X = flat.pose_of_hits(many.tool().periphery() * 2 / 5, slices);
    auto r = std::make_shared<Surface>(Flat::drill(slices));
    run.add(
        "N " + std::string(name) + ", contact", [&on_flat, r, X] { benchmark::DoNotOptimize(r->render(on_flat, X)); },
        count);
  }

  // The same tool in metres on finer voxels.
  std::vector<std::shared_ptr<Grid>> grids;
  for (const double voxel : {4e-4, 2e-4, 1e-4}) {
    grids.push_back(std::make_shared<Grid>(tooth_of(voxel)));
    const std::string name = std::to_string(static_cast<int>(voxel * 1e4 + 0.5));
    for (const auto& [what, X] : {std::pair("air", near_air), std::pair("light", light)}) {
      auto r = std::make_shared<Surface>(surface());
      run.add("voxel 0." + name + " mm, " + what,
              [g = grids.back(), r, X = X] { benchmark::DoNotOptimize(r->render(Field(*g, kIsovalue), X)); });
    }
  }

  for (const auto& [name, work] : speed_levels::work_at_o2()) run.add("-O2, " + name, work);
  for (const auto& [name, work] : speed_levels::work_at_o3()) run.add("-O3, " + name, work);

  run.add("carving", [c = std::make_shared<Carving>(0)] { c->prepare(), (*c)(); });
  run.add("carving depths", [c = std::make_shared<Carving>(4)] { c->prepare(), (*c)(); });

  run.run(options.quick ? 9 : 41, 0.002);

  Report report(run, options);
  sampling.report(report, options.march);
  report.at_most("no-contact tick / bare samples, Surface", "surface, near air", "surface, near air, bare", 1.15);
  report.at_most("culled far air / bare samples, Surface", "surface, culled, far air", "surface, far air, bare", 0.25);
  report.at_most("culled near air / bare samples, Surface", "surface, culled, near air", "surface, near air, bare",
                 0.65);
  report.at_most("outside the grid's box / bare samples, Surface", "surface, outside", "surface, near air, bare", 0.1);
  const double contact = std::string(kCompiler) == "g++" ? 1.5 : 1.8;
  report.at_most("contact tick of 20 hits / bare samples", "surface, 20 hits", "surface, 20 hits, bare", contact);
  report.at_most("contact tick of 84 hits / bare samples", "surface, 84 hits", "surface, 84 hits, bare", contact);
  for (const std::string hits : {", 20 hits", ", 84 hits"}) {
    report.at_most("patches / the thesis' way" + hits, "patches" + hits, "thesis" + hits, 1);
    report.at_most("the thesis' way and a gradient a hit / without" + hits, "thesis with gradients" + hits,
                   "thesis" + hits, 0);
  }
  for (const char* name : {"surface, 1 centre in bone", "surface, 6 centres in bone"}) {
    const std::string what = std::string("contact tick, ") + (name + 9) + " / ";
    report.at_most(what + "bare samples", name, std::string(name) + ", bare", contact);
    report.at_most(what + "its samples, single ones as such", name, std::string(name) + ", as taken", 0);
    // What no tick that takes these samples can be below.
    report.at_most(std::string("samples as taken, ") + (name + 9) + " / bare samples", std::string(name) + ", as taken",
                   std::string(name) + ", bare", 0);
  }
  for (const char* what : {"air", "contact"}) {
    const std::string few = std::string("N 207, ") + what, many = std::string("N 1008, ") + what;
    report.at_most("ns a vertex at N = 1008 / N = 207, " + std::string(what), many, few, 1.1);
  }
  for (const char* what : {"air", "light"})
    report.at_most("voxel 0.1 mm / 0.4 mm, " + std::string(what), "voxel 0.1 mm, " + std::string(what),
                   "voxel 0.4 mm, " + std::string(what), 1.3);
  report.at_most("a map of air in light contact / none", "surface, culled, light", "surface, 1 centre in bone", 0);
  for (const char* what : {"air", "light"})
    for (const char* voxel : {"0.4", "0.2", "0.1"}) {
      const std::string name = std::string("voxel ") + voxel + " mm, " + what;
      report.figure(name, name);
    }
  for (const std::string where : {"near air", "far air"})
    report.at_most("Line moving in " + where + ": a map of air / all sampled", "line, " + where + ", map of air",
                   "line, " + where + ", all sampled", 0);
  report.at_most("Line moving beyond the grid / all sampled", "line, beyond the grid",
                 "line, beyond the grid, all sampled", 0);
  for (const std::string name : {"sampling", "no-contact tick", "contact tick"})
    report.at_most("-O2 / -O3, " + name, "-O2, " + name, "-O3, " + name, 1.2);
  for (const char* name : {"line, near air", "line, far air", "scene, near air", "carving", "carving depths"})
    report.figure(name, name);
}

/// Times one by one, where the worst counts: p50, p99, p99.9 and the longest [ns].
class Spread {
 public:
  explicit Spread(const Options& options)
      : march_(options.march),
        table_(options.folder + "/speed_spread.csv",
               "case,compiler,march,ticks,p50_ns,p99_ns,p999_ns,max_ns,samples_bound", options.append) {}

  /// `prepare` is not timed.
  template <class Prepare, class Work>
  void measure(const std::string& name, int ticks, std::int64_t bound, Prepare&& prepare, Work&& work) {
    std::vector<double> times;
    for (int i = 0; i < ticks; ++i) {
      prepare(i);
      const auto begin = Clock::now();
      work(i);
      times.push_back(std::chrono::duration<double, std::nano>(Clock::now() - begin).count());
    }
    table_.row(without_commas(name), kCompiler, march_, ticks, bench::percentile(times, 0.5),
               bench::percentile(times, 0.99), bench::percentile(times, 0.999), bench::percentile(times, 1), bound);
    std::fprintf(stderr, "speed: %-44s p50 %.0f ns, p99.9 %.0f ns\n", name.c_str(), bench::percentile(times, 0.5),
                 bench::percentile(times, 0.999));
  }

 private:
  std::string march_;
  bench::Table table_;
};

/// The coupled tool at the thesis' counts, pressed three voxels deep and led over a plane or round a ball.
void measure_coupled(Spread& spread, int ticks) {
  constexpr double kVoxel = 3e-4, kRadius = 20 * kVoxel, kDeep = 3 * kVoxel;
  const test::RasterOptions o{.size = {80, 80, 80}};
  const Vec3d n = Vec3d(0.3, 0.5, 0.8).normalized(), u = n.unitOrthogonal(), v = n.cross(u);
  for (const bool ball : {false, true}) {
    const Vec3d top = o.middle();
    const auto bone = ball ? test::rasterise<std::uint8_t>(test::Ball{top - kRadius * n, kRadius}, o)
                           : test::rasterise<std::uint8_t>(test::HalfSpace{top, n}, o);
    DepthMap depths(bone, o.isovalue());
    for (const bool fast : {false, true}) {
      Coupled tool = coupled(depths);
      const auto field = tool.field(bone, o.isovalue());
      const double speed = fast ? 0.1 : 0.03, turn = fast ? 13 : 0;  // [m/s], [rad/s] about the normal
      const double above = tool.shape().tip_radius - kDeep;
      // To and fro over 6 mm.
      const auto pose = [&](int i) {
        const double s = 0.003 * std::sin(speed / 0.003 * 1e-3 * i), t = 0.001 * std::cos(speed / 0.003 * 7e-4 * i);
        const Vec3d m = ball ? Vec3d((n + (s * u + t * v) / kRadius).normalized()) : n;
        const Vec3d p =
            ball ? Vec3d(top - kRadius * n + (kRadius + above) * m) : Vec3d(top + s * u + t * v + above * n);
        const Mat3d R = rotation_between<double>(Vec3d::UnitZ(), (m + 0.3 * u).normalized());
        return make_pose<float>(rotation_from_vector(Vec3d(1e-3 * turn * i * m)).cast<float>() * R.cast<float>(),
                                p.cast<float>());
      };
      spread.measure(
          std::string("Coupled, slid over a ") + (ball ? "ball" : "plane") + (fast ? ", .1 m/s, turning" : ", .03 m/s"),
          ticks, 0, [](int) {}, [&](int i) { benchmark::DoNotOptimize(tool.render(field, pose(i))); });
    }
  }
}

void measure_spread(const Options& options, const Scene& scene) {
  Spread spread(options);
  const int ticks = options.quick ? 2000 : 20000;
  const Field field(scene.tooth, kIsovalue);
  const auto nothing = [](int) {};
  // What the machine adds by itself.
  spread.measure("a thousand divisions in a chain: the machine's own", ticks, 0, nothing, [](int i) {
    float x = static_cast<float>(i);
    for (int k = 0; k < 1000; ++k) x = 1.0F / (1.0F + x);
    benchmark::DoNotOptimize(x);
  });
  const auto wiggled = [](Pose<float> X, int i) {
    X.translation() +=
        5e-5F * Vec3<float>(static_cast<float>(std::sin(0.1 * i)), static_cast<float>(std::cos(0.07 * i)), 0);
    return X;
  };
  const auto renders = [&](const std::string& name, auto renderer, const Pose<float>& X, std::int64_t bound) {
    spread.measure(name, ticks, bound, nothing,
                   [&](int i) { benchmark::DoNotOptimize(renderer.render(field, wiggled(X, i))); });
  };
  const Surface thesis = surface();
  const auto& tool = thesis.tool();
  // Samples at most: all vertices, and of each in bone a march of a lane for every 8 voxels of its way and 8 closing
  // steps, padded.
  const auto lanes = static_cast<std::int64_t>(std::ceil(1.5e-3 / (0.5 * 1e-4 * kLane)));
  const std::int64_t bound = tool.padded() + tool.periphery() * (lanes * kLane + 8) * 3 / 2;
  const Pose<float> buried = scene.pose(-0.006, 0.0);
  renders("Surface, 1 centre in bone", surface(), pose_of_hits(scene, thesis, 20), bound);
  renders("Surface, 6 centres in bone", surface(), pose_of_hits(scene, thesis, 84), bound);
  renders("Surface, as deep as it goes", surface(), buried, bound);
  renders("Line, as deep as it goes", line(), buried, 0);
  measure_coupled(spread, ticks);
  {
    // From air to contact within a tick, as far as no jump is: both renderers' longest way.
    Surface s = surface();
    const Pose<float> X = pose_of_hits(scene, thesis, 20);
    Pose<float> above = X;
    above.translation().z() += 0.0045F;
    spread.measure(
        "Surface, first contact after a way of 4.5 mm", ticks, bound,
        [&](int) { benchmark::DoNotOptimize(s.render(field, above)); },
        [&](int) { benchmark::DoNotOptimize(s.render(field, X)); });
    Line l = line();
    spread.measure(
        "Line, first contact after a way of 4.5 mm", ticks, 0,
        [&](int) {
          l.reset();
          benchmark::DoNotOptimize(l.render(field, above));
        },
        [&](int) { benchmark::DoNotOptimize(l.render(field, X)); });
  }
  {
    // What else runs on the machine between ticks leaves nothing in the caches.
    std::vector<char> other(std::size_t{48} << 20);
    Surface s = surface();
    const Pose<float> X = pose_of_hits(scene, thesis, 20);
    spread.measure(
        "Surface, light contact, cold caches", options.quick ? 50 : 300, bound,
        [&](int i) {
          for (std::size_t at = 0; at < other.size(); at += 64) other[at] = static_cast<char>(i);
          benchmark::DoNotOptimize(other.data());
          benchmark::ClobberMemory();
        },
        [&](int) { benchmark::DoNotOptimize(s.render(field, X)); });
  }
  {
    Carving carving(0);
    spread.measure(
        "carving a burr of 5 voxels", ticks, 0, [&](int) { carving.prepare(); }, [&](int) { carving(); });
    Carving depths(4);
    spread.measure(
        "carving its depths", ticks, 0, [&](int) { depths.prepare(); }, [&](int) { depths(); });
  }
  {
    // Bone and depths, in a block's face at a hundredth of a voxel a tick.
    const auto in_time = [&](const char* name, const auto& policy) {
      Grid block = Carving::make();
      DepthMap depths(block, 127);
      BoneWithDepth both(block, depths);
      const double h = block.spacing().x();
      spread.measure(
          name, ticks, 0,
          [&](int i) {
            if (i % 400 == 0) block.restore(), depths.restore();
          },
          [&](int i) {
            const Vec3d p = h * Vec3d(32, 32, 66 - 0.01 * (i % 400));
            const CutAllowance allowance{.dt = 1e-3, .tick = static_cast<std::uint32_t>(i)};
            benchmark::DoNotOptimize(carve(both, 127, SphereCutter(p, p, 5 * h), policy, allowance));
          });
    };
    in_time("carving a burr of 5 voxels and its depths by a rate", RateLimitedCut<>{.rate = 300});
    in_time("carving a burr of 5 voxels and its depths at a speed", AdvancingCut{});
  }
  {
    // A host reads every changed brick, as fast as it can, while the drill goes on.
    Carving carving(0);
    std::atomic<bool> stop{false};
    GridReader<std::uint8_t> reader(carving.block());
    std::thread host([&] {
      std::array<std::uint8_t, 1000> copy;
      while (!stop) {
        reader.poll([&](std::size_t b) { reader.copy_brick(b, copy); });
        std::this_thread::yield();
      }
    });
    spread.measure(
        "carving beside a host that reads changed bricks", ticks, 0, [&](int) { carving.prepare(); },
        [&](int) { carving(); });
    stop = true;
    host.join();
  }
  {
    AirMap<std::uint8_t> map(scene.tooth, kIsovalue);
    spread.measure("map of air made anew, off the haptic thread", 20, 0, nothing, [&](int) { map.refresh(); });
  }
}

/// A scene whose ticks are timed by themselves, without device and pacing.
template <class Scene>
struct TimedScene {
  Scene& scene;
  std::vector<double>& times;  // [ns], as long as there is room

  TickResult tick(const TickInput& input, double dt) noexcept {
    const auto begin = Clock::now();
    const TickResult result = scene.tick(input, dt);
    if (times.size() < times.capacity())
      times.push_back(std::chrono::duration<double, std::nano>(Clock::now() - begin).count());
    return result;
  }
};
template <class Scene>
TimedScene(Scene&, std::vector<double>&) -> TimedScene<Scene>;

/// A servo loop that spins from tick to tick on a simulated device, whose hand drills over the crown: which ticks' own
/// work fits the period, and, apart, how late the machine lets them begin.
void measure_servo(const Options& options, const Scene& scene) {
  bench::Table table(options.folder + "/speed_servo.csv",
                     "renderer,rate_Hz,voxel_mm,compiler,march,ticks,share_within_period,p50_ns,p999_ns,"
                     "missed_periods,lateness_p50_ns,lateness_p999_ns",
                     options.append);
  const auto run = [&](const char* name, auto make, double rate, double voxel) {
    Grid tooth = tooth_of(voxel);
    std::optional<DepthMap> depths;
    HapticScene drill{tooth, kIsovalue, make(tooth, depths), Milling{}, DeviceLimits{.force = 3.3, .torque = 0.1}};
    const auto hand = [&scene](double t) {
      const Vec3d at =
          scene.top + Vec3d(0.002 * std::sin(3 * t), 0.002 * std::cos(2 * t), 0.001 * std::sin(12.566 * t));
      return HandTarget(make_pose<double>(rotation_from_vector(Vec3d(0.3, 0.1 * std::sin(5 * t), 0)), at), 1);
    };
    SimulatedDeviceOptions simulated;
    simulated.rate = rate;
    simulated.substeps = 1;  // a tenth of a millisecond and less
    simulated.X_DH = hand(0).X_DH;
    SimulatedDevice device(simulated, hand);
    const double seconds = options.quick ? 0.2 : 1.0;
    std::vector<double> times;
    times.reserve(static_cast<std::size_t>(rate * seconds) + 1);
    TimedScene timed{drill, times};
    ServoOptions servo;
    servo.rate = rate;
    ServoLoop loop(device, timed, Registration{}, servo, SleepSpinPacing{});
    const RunReport report = loop.run_for(std::chrono::duration<double>(seconds));
    const auto within = std::count_if(times.begin(), times.end(), [&](double ns) { return ns <= 1e9 / rate; });
    const double share = static_cast<double>(within) / static_cast<double>(times.size());
    table.row(name, rate, 1e3 * voxel, kCompiler, options.march, times.size(), share, bench::percentile(times, 0.5),
              bench::percentile(times, 0.999), report.missed_deadlines, 1e9 * report.lateness.p50,
              1e9 * report.lateness.p99_9);
    std::fprintf(stderr, "speed: %s at %.0f Hz, %.1f mm: %.5f of ticks within the period\n", name, rate, 1e3 * voxel,
                 share);
  };
  for (const double voxel : {4e-4, 1e-4})
    for (const double rate : {10e3, 40e3}) {
      run(
          "surface", [](auto&, auto&) { return surface(); }, rate, voxel);
      run(
          "line", [](auto&, auto&) { return line(); }, rate, voxel);
      run(
          "coupled",
          [](Grid& tooth, std::optional<DepthMap>& depths) { return coupled(depths.emplace(tooth, kIsovalue)); }, rate,
          voxel);
    }
}

/// Bytes of a grid and what goes with it.
void measure_memory(const Options& options) {
  bench::Table table(options.folder + "/speed_memory.csv",
                     "voxels,density,grid_MB,bytes_per_voxel,without_original_MB,air_map_MB");
  const auto row = [&]<class Density>(int side, Density) {
    const double count = std::pow(side, 3);
    const std::vector<Density> none(static_cast<std::size_t>(count));
    const std::array<int, 3> size{side, side, side};
    const GridGeometry geometry{.size = size, .spacing = Vec3d::Constant(1e-4)};
    double bare = 0;
    double air = 0;
    {
      const VoxelGrid<Density> grid(geometry, none, {.keep_original = false});
      bare = static_cast<double>(grid.bytes());
      air = static_cast<double>(AirMap<Density>(grid, 1).bytes());
    }
    const double all = bare + std::pow(side + 2, 3) * sizeof(Density);
    table.row(side, sizeof(Density) == 1 ? "8 bit" : "16 bit", all / 1e6, all / count, bare / 1e6, air / 1e6);
  };
  for (const int side : {256, 512}) {
    row(side, std::uint8_t{});
    row(side, std::int16_t{});
  }
  if (!options.quick) row(1024, std::uint8_t{});
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  if (!bench::read_arguments(argc, argv, "bench_speed", {{"--quick", &options.quick}, {"--append", &options.append}},
                             {{"--out", &options.folder}, {"--march", &options.march}}))
    return 2;
  std::filesystem::create_directories(options.folder);
  const Scene scene;
  measure_speed(options, scene);
  measure_spread(options, scene);
  measure_servo(options, scene);
  if (!options.append) measure_memory(options);
}
