// SPDX-License-Identifier: MIT
#pragma once

#include "sweep/row.hpp"

#include <memory>
#include <string>
#include <vector>

namespace trephine::bench {

struct Scenario;

/// A scenario's bones in one image: what a run works on. Opaque here, so that a file of variants compiles alone.
class Bones {
 public:
  Bones(const Scenario& scenario, const Image& image);
  ~Bones();
  struct Data;
  [[nodiscard]] const Data& data() const { return *data_; }

 private:
  std::unique_ptr<Data> data_;
};

/// Names of Surface's and Line's variants that `run` knows; Coupled has one: policies in the
/// order of the template's parameters, then options that differ from the default. Those of 16-bit images and of
/// `double` are fewer.
[[nodiscard]] std::vector<std::string> surface_variants(const std::string& scalar, int bits);
[[nodiscard]] std::vector<std::string> line_variants(const std::string& scalar, int bits);
/// The thesis' own and this library's default.
inline constexpr const char* kSurfaceThesis = "ratio-hold-torque-analytic";
inline constexpr const char* kSurfaceArea = "area-extend-full-analytic";
inline constexpr const char* kSurfaceDefault = "patch-extend-full-analytic";
inline constexpr const char* kCoupledDefault = "coupled";
inline constexpr const char* kLineThesis = "translate_rotate-projected-torque-stored-thesis_trigger";
inline constexpr const char* kLineDefault = "translate_rotate-constrained-full-spline-refined";

/// Both rows (discretisation, model) of a setting, none where the scenario does not concern the renderer. Throws
/// std::invalid_argument for a variant there is none of.
[[nodiscard]] std::vector<Row> run(const Setting& setting, const Bones& bones);

}  // namespace trephine::bench
