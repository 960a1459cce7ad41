// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/surface_search.hpp>
#include <trephine/tool/surface_discretization.hpp>
#include <trephine/voxel/density_field.hpp>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// Samples the field at a Surface tool's vertices, unless the tool is beyond the volume. A vertex outside bone may have
/// a patch that reaches into it. No allocation after construction.
template <RealScalar Scalar>
class VertexSamples {
  // Factor on the bounding radius: covers the rounding of positions in single precision.
  static constexpr auto kRounding = Scalar(1.0001);

 public:
  using Tool = ToolDiscretization<SurfaceCounts, Scalar>;

  explicit VertexSamples(const Tool& tool) : values_(static_cast<std::size_t>(tool.padded())) {
    const auto& last = tool.groups().back();
    bounds_height_ = (last.height - static_cast<Scalar>(tool.burr().tip_radius)) / Scalar(2);
    for (int i = 0; i < tool.count(); ++i)
      bounds_radius_ = std::max(bounds_radius_, (tool.points()[i] - on_axis(bounds_height_)).norm());
    bounds_radius_ *= kRounding;
  }

  /// Samples the field. Returns false if certainly no vertex and no patch is in bone.
  template <ContactField Field>
  [[nodiscard]] bool update(const Field& field, const Tool& tool, const Pose<Scalar>& X_GT) noexcept {
    if (is_known_beyond(field, Vec3<Scalar>(X_GT * on_axis(bounds_height_)), bounds_radius_)) return false;
    sample(field, tool.points(), X_GT, 0, tool.padded());
    return may_touch();
  }

  /// Samples the field anew at the peripheries of groups that are moved out of bone; their centres count as outside.
  /// `vertices` are all vertices' positions in T, `is_moved` is 1 for each such group.
  template <ContactField Field>
  void resample(const Field& field, const Tool& tool, const PointArrays<Scalar>& vertices, const Pose<Scalar>& X_GT,
                std::span<const std::uint8_t> is_moved) noexcept {
    const auto& groups = tool.groups();
    for (std::size_t first = 0, last = 0; first < groups.size(); first = last + 1) {
      for (last = first; last < groups.size() && is_moved[last] != 0;) ++last;
      if (last == first) continue;
      sample(field, vertices, X_GT, groups[first].first, groups[last - 1].first + groups[last - 1].count);
    }
    // After all samples: a padded lane may reach the centres.
    for (std::size_t g = 0; g < groups.size(); ++g)
      if (is_moved[g] != 0) values_[static_cast<std::size_t>(groups[g].centre)] = std::numeric_limits<Scalar>::lowest();
  }

  /// The field at all vertices, padding included; the lowest number at centres of groups moved out of bone.
  [[nodiscard]] std::span<const Scalar> values() const noexcept { return values_; }
  [[nodiscard]] Scalar operator[](int i) const noexcept { return values_[static_cast<std::size_t>(i)]; }

 private:
  [[nodiscard]] static Vec3<Scalar> on_axis(Scalar height) noexcept { return {Scalar(0), Scalar(0), height}; }

  // Samples vertices [first, last), and further vertices that fill up a lane.
  template <ContactField Field>
  void sample(const Field& field, const PointArrays<Scalar>& p, const Pose<Scalar>& X_GT, int first,
              int last) noexcept {
    const int count = padded_to_lane(last - first);
    const int from = std::min(first, p.size() - count);
    field.values(X_GT, p.x.data() + from, p.y.data() + from, p.z.data() + from, values_.data() + from, count);
  }

  // True if a vertex is in bone or the density varies from vertex to vertex. A plain count: compilers vectorise it.
  [[nodiscard]] bool may_touch() const noexcept {
    const std::size_t whole_lanes = values_.size() / kLane * kLane;
    const Scalar reference = values_[0];
    int count = 0;
    for (std::size_t i = 0; i < whole_lanes; ++i) count += values_[i] != reference ? 1 : 0;
    return count > 0 || reference >= Scalar(0);
  }

  std::vector<Scalar> values_;
  // Bounding ball of all vertices: height of its centre on the shaft's axis, and its radius [m].
  Scalar bounds_height_ = Scalar(0);
  Scalar bounds_radius_ = Scalar(0);
};

}  // namespace trephine
