// SPDX-License-Identifier: MIT
#include "common/command_line.hpp"
#include "speed/interleaved.hpp"
#include "speed/kernels.hpp"
#include "speed/levels.hpp"
#include "speed/others.hpp"
#include "speed/speed_scene.hpp"
#include "support/fields.hpp"

#include <array>
#include <cmath>
#include <memory>
#include <sstream>

/// What the library costs, each figure beside its reference in one interleaved run.
///   bench_speed --out DIR [--march NAME] [--append] [--quick]
/// writes DIR/speed.csv, speed_spread.csv (worst cases), speed_servo.csv and speed_memory.csv.
namespace trephine::bench::speed {
namespace {

using Thesis = ThesisSurface<float>;

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

/// Flat bone with two voxels of blur, and a drill laid on it: its vertices touch and no group's centre is in bone.
struct Flat {
  static constexpr int kLevel = 88;  // voxels
  Grid bone{{.size = {256, 256, 176}, .spacing = Vec3d::Constant(1e-4)}, speed_levels::flat_voxels(kLevel)};

  [[nodiscard]] static Surface drill() { return surface(0.02); }
  /// A pose at which at least `hits` of its vertices are in bone.
  [[nodiscard]] Pose<float> pose_of_hits(int hits) const {
    const Field field(bone, 127);
    for (double tilt = 0.1; tilt >= 0; tilt -= 0.002)
      for (double height = 7.5e-4; height > 2e-5; height -= 1e-5) {
        const Mat3d R = rotation_from_vector(Vec3d(-1.5708 + tilt, 0, 0)) * rotation_from_vector(Vec3d(0, 0, 0.3));
        const Vec3d p = 1e-4 * Vec3d(128, 30, kLevel) + Vec3d(0, 0, height);
        const Pose<float> X = make_pose<double>(R, p).cast<float>();
        Surface s = drill();
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

template <class Known, class Renderer>
[[nodiscard]] std::function<void()> rendering(const Known& field, Renderer renderer, const Pose<float>& X) {
  return [field, X, r = std::move(renderer)]() mutable { benchmark::DoNotOptimize(r.render(field, X)); };
}
/// A renderer that goes to and fro by .02 m/s: at rest Line searches nothing.
template <class Known, class S, class Renderer>
[[nodiscard]] std::function<void()> moving(const Known& field, const Pose<S>& X, Renderer renderer) {
  return [field, X, r = std::move(renderer), away = false]() mutable {
    Pose<S> at = X;
    if ((away = !away)) at.translation() += Vec3<S>(S(2e-5), 0, 0);
    benchmark::DoNotOptimize(r.render(field, at));
  };
}

/// Rows of speed.csv: a time beside its reference's.
class Report {
 public:
  Report(const SpeedRun& run, const Options& options)
      : run_(run),
        march_(options.march),
        table_(options.folder + "/speed.csv", "measure,compiler,march,ns,reference_ns,ratio,target,met",
               options.append) {}

  /// The ratio is to be at most `target`, or at least its negative; no target where it is 0.
  void row(const std::string& measure, const std::string& name, const std::string& reference, double target = 0) {
    const double ns = run_.ns(name), beside = run_.ns(reference), ratio = ns / beside;
    std::ostringstream goal;
    if (target != 0) goal << std::abs(target) << ',' << ((target > 0) == (ratio <= std::abs(target)) ? "yes" : "no");
    table_.row(without_commas(measure), kCompiler, march_, ns, beside, ratio, target != 0 ? goal.str() : ",");
    std::fprintf(stderr, "speed: %-60s %9.1f ns, ratio %.3g\n", measure.c_str(), ns, ratio);
  }

 private:
  const SpeedRun& run_;
  std::string march_;
  bench::Table table_;
};

/// Sampling by ours and by others, of the same points of the same field: a drill of the thesis' counts that goes
/// through bone and air, all of it within the volume.
class SamplingRows {
 public:
  SamplingRows(SpeedRun& run, const Scene& scene)
      : tool_(surface(0.012).tool()), view_(scene.tooth), checked_(scene.tooth) {
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

  void report(Report& report) const {
    report.row("batched sampling / bare loads", "sampling", "bare loads", 2.5);
    report.row("checked Eigen sampling / ours", "checked sampling", "sampling", -8);
    const std::map<std::string, double> targets{{"OpenVDB GridSampler", -18}, {"NanoVDB", -12}, {kItk, -6}};
    for (const auto& other : bench::other_libraries()) {
      const auto target = targets.find(other.name);
      report.row(other.name + " / ours", other.name, "sampling", target == targets.end() ? 0 : target->second);
      report.row(other.name + " / bare loads", other.name, "bare loads");  // no sampler of this grid exceeds it
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

  // Ticks beside as many samples.
  for (const auto& [name, X] :
       {std::pair("near air", near_air), std::pair("far air", far_air), std::pair("outside", outside),
        std::pair("1 centre in bone", light), std::pair("6 centres in bone", deep)}) {
    const Taken taken = taken_by(field, thesis, X);
    const std::string tick = std::string("surface, ") + name;
    run.add(tick, rendering(field, thesis, X));
    run.add(tick + ", bare", Samples(field, thesis, light, taken.samples));
    run.add(tick + ", as taken", Samples(field, thesis, light, taken.samples, taken.ones));
  }
  const Flat flat;
  const Field on_flat(flat.bone, 127);
  const Surface lying = Flat::drill();
  for (const int hits : {20, 84}) {
    const Pose<float> X = flat.pose_of_hits(hits);
    const std::string count = ", " + std::to_string(hits) + " hits";
    run.add("surface" + count, rendering(on_flat, lying, X));
    run.add("surface" + count + ", bare", Samples(on_flat, lying, X, taken_by(on_flat, lying, X).samples));
    run.add("thesis" + count, rendering(on_flat, Thesis(lying.tool()), X));
    run.add("thesis with gradients" + count, WithGradients{Thesis(lying.tool()), on_flat, X, hits});
  }
  // Without and with the field's knowledge of its end; the plain one knows nothing.
  const test::CountingField<Field> plain(field);
  for (const auto& [name, X] : {std::pair("near air", near_air), std::pair("beyond the grid", outside)}) {
    run.add("line, " + std::string(name) + ", all sampled", moving(plain, X, line()));
    run.add("line, " + std::string(name), moving(field, X, line()));
  }
  // The rates of the thesis' Fig. 26 and 29: its algorithms and ours, by their counts.
  for (const int n : {50, 100, 250, 500, 1000}) {
    const ToolDiscretization<LineCounts, float> tool(burr_of(), {.shaft = n});
    run.add("line of " + std::to_string(n), moving(field, light, Line(tool)));
    run.add("thesis' line of " + std::to_string(n), moving(field, light, ThesisLine<float>(tool)));
  }
  for (const int n : {10, 20, 30, 50, 100}) {
    const ToolDiscretization<SurfaceCounts, float> tool(burr_of(), {.sphere = 26, .slices = n});
    run.add("surface of " + std::to_string(n), rendering(field, Surface(tool), light));
    run.add("thesis' surface of " + std::to_string(n), rendering(field, Thesis(tool), light));
  }
  for (const auto& [name, work] : speed_levels::work_at_o2()) run.add("-O2, " + name, work);
  for (const auto& [name, work] : speed_levels::work_at_o3()) run.add("-O3, " + name, work);

  run.run(options.quick ? 9 : 41, 0.002);

  Report report(run, options);
  sampling.report(report);
  const std::string near = "surface, near air, bare", sampled = ", all sampled";
  const double contact = std::string(kCompiler) == "g++" ? 1.5 : 1.8;
  report.row("no-contact tick / bare samples, Surface", "surface, near air", near, 1.15);
  report.row("outside the grid's box / bare samples, Surface", "surface, outside", near, 0.1);
  for (const std::string hits : {"20 hits", "84 hits"}) {
    report.row("contact tick of " + hits + " / bare samples", "surface, " + hits, "surface, " + hits + ", bare",
               contact);
    report.row("ours / the thesis' way, " + hits, "surface, " + hits, "thesis, " + hits, 1);
    report.row("the thesis' way and a gradient a hit / without, " + hits, "thesis with gradients, " + hits,
               "thesis, " + hits);
  }
  for (const std::string what : {"1 centre in bone", "6 centres in bone"}) {
    const std::string tick = "surface, " + what, bare = tick + ", bare", taken = tick + ", as taken";
    report.row("contact tick, " + what + " / bare samples", tick, bare, contact);
    report.row("contact tick, " + what + " / its samples, single ones as such", tick, taken);
    report.row("samples as taken, " + what + " / bare samples", taken, bare);  // no tick can be below
  }
  for (const int n : {50, 100, 250, 500, 1000}) {
    const std::string tool = "line of " + std::to_string(n);
    report.row(tool + " vertices / the thesis' one", tool, "thesis' " + tool);
  }
  for (const int n : {10, 20, 30, 50, 100}) {
    const std::string tool = "surface of " + std::to_string(n);
    report.row(tool + " slices / the thesis' one", tool, "thesis' " + tool);
  }
  report.row("line beyond the grid, moving / all sampled", "line, beyond the grid", "line, beyond the grid" + sampled);
  for (const std::string name : {"sampling", "no-contact tick", "contact tick"})
    report.row("-O2 / -O3, " + name, "-O2, " + name, "-O3, " + name, 1.2);
}

}  // namespace
}  // namespace trephine::bench::speed

int main(int argc, char** argv) {
  using namespace trephine;
  using namespace trephine::bench::speed;
  Options options;
  std::string only;  // "kernels", "spread", "servo" or "memory"
  const bench::CommandLine line(argc, argv, {{"--march", &options.march}, {"--only", &only}},
                                {{"--append", &options.append}});
  options.folder = line.folder;
  options.quick = line.quick;
  const Scene scene;
  const auto wanted = [&](const char* name) { return only.empty() || only == name; };
  if (wanted("kernels")) measure_speed(options, scene);
  if (wanted("spread")) measure_spread(options, scene);
  if (wanted("servo")) measure_servo(options, scene);
  if (wanted("memory") && !options.append) measure_memory(options);
}
