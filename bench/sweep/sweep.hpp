// SPDX-License-Identifier: MIT
#pragma once

#include <iosfwd>
#include <memory>
#include <string>
#include <vector>

namespace trephine::bench {

/// How fine a renderer is, and what of. Counts that a renderer does not have are 0.
struct Setting {
  std::string renderer;                         ///< "line", "surface" or "coupled"
  std::string variant;                          ///< the law by name: the thesis' or ours
  int vertices = 50;                            ///< Line: along the shaft
  int sphere = 26, slices = 20, per_slice = 8;  ///< Surface
  double step = 0.5;                            ///< of a search [voxels]
};

/// The bone's image in 8 bit.
struct Image {
  std::string kind = "ct_blur";  ///< binary, partial_volume, ct_blur, clamped_distance
  double contrast = 255;
  double voxel_mm = 0.3;

  [[nodiscard]] std::string name() const;
};

/// A row of error_vs_time.csv: one scenario, image and setting. Percentiles are over the scenario's cases; NaN where a
/// figure is not defined, written as an empty field.
struct Row {
  std::string scenario;
  Image image;
  Setting setting;
  double samples_per_tick = 0;
  double tick_ns_median = 0, tick_ns_p999 = 0;
  double force_error_rel_p50 = 0, force_error_rel_p95 = 0, force_error_N_p95 = 0;
  double direction_error_deg_p99 = 0;
  double torque_error_rel_p95 = 0, torque_error_Nm_p95 = 0;
  double point_error_voxel_p95 = 0;
  int misses = 0;
  double excluded_share = 0;
  std::string error_kind;  ///< "discretisation" or "model"
};

/// Column names, in the order of `write`.
void write_header(std::ostream& out);
void write(std::ostream& out, const Row& row);

/// One setting in one image of one scenario.
struct Job {
  std::string scenario;
  Image image;
  Setting setting;
  [[nodiscard]] std::string name() const;
};

/// Every factor one at a time round the default, and every image at the defaults. Jobs in the same image follow each
/// other. `quick`: the factors' ends and middle.
[[nodiscard]] std::vector<Job> make_plan(bool quick);

struct Scenario;

/// A scenario's bones in one image. Opaque here, so that a file of variants compiles alone.
class Bones {
 public:
  Bones(const Scenario& scenario, const Image& image);
  ~Bones();
  struct Data;
  [[nodiscard]] const Data& data() const { return *data_; }

 private:
  std::unique_ptr<Data> data_;
};

/// Variants of a renderer that `run` has: the thesis' own and this library's.
[[nodiscard]] std::vector<std::string> variants(const std::string& renderer);
inline constexpr const char* kSurfaceThesis = "thesis_surface";
inline constexpr const char* kSurfaceDefault = "surface";
inline constexpr const char* kCoupledDefault = "coupled";
inline constexpr const char* kLineThesis = "thesis_line";
inline constexpr const char* kLineDefault = "translate_rotate";
inline constexpr const char* kLineRayCast = "ray_cast";

/// Both rows (discretisation, model) of a setting, none where the scenario does not concern the renderer. Throws
/// std::invalid_argument for an unknown variant.
[[nodiscard]] std::vector<Row> run(const Setting& setting, const Bones& bones);

}  // namespace trephine::bench
