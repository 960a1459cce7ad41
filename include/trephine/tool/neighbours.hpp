// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/surface_discretization.hpp>

#include <span>

namespace trephine::inline TREPHINE_ALIGNED {

/// Neighbourhood graph of a Surface tool's vertices: two vertices are neighbours if their patches may adjoin. On the
/// ball these are the vertices within 2.2 patch radii. On the shaft they are the two next vertices of the same slice
/// and the vertices of the same angle in the slices above and below. Immutable after construction.
class PatchNeighbours {
  // Distance of neighbours on the ball, in patch radii. Discs of equal size adjoin at 2; the rest allows for layouts
  // that are not hexagonal.
  static constexpr double kBallReach = 2.2;

 public:
  PatchNeighbours() = default;
  template <RealScalar Scalar>
  explicit PatchNeighbours(const ToolDiscretization<SurfaceCounts, Scalar>& tool) {
    first_.push_back(0);
    for (std::size_t g = 0; g < tool.groups().size(); ++g) {
      const auto& group = tool.groups()[g];
      for (int i = group.first; i < group.first + group.count; ++i) {
        g == 0 ? add_on_ball(tool, i) : add_on_slice(tool, g, i);
        first_.push_back(static_cast<int>(neighbours_.size()));
      }
    }
  }

  /// Neighbours of vertex i of the periphery.
  [[nodiscard]] std::span<const int> of(int i) const noexcept {
    const auto n = static_cast<std::size_t>(i);
    return std::span<const int>(neighbours_)
        .subspan(static_cast<std::size_t>(first_[n]), static_cast<std::size_t>(first_[n + 1] - first_[n]));
  }

 private:
  template <class Tool>
  void add_on_ball(const Tool& tool, int i) {
    const auto reach = static_cast<typename Tool::Scalar>(kBallReach) * tool.patch(i).disc;
    // Layouts are sorted by z, so the search stops at the first vertex out of reach along z.
    const auto add_if_near = [&](int j) {
      if (std::abs(tool.points()[j].z() - tool.points()[i].z()) > reach) return false;
      if ((tool.points()[j] - tool.points()[i]).norm() <= reach) neighbours_.push_back(j);
      return true;
    };
    for (int j = i - 1; j >= 0 && add_if_near(j); --j) {
    }
    for (int j = i + 1; j < tool.groups()[0].count && add_if_near(j); ++j) {
    }
  }

  template <class Tool>
  void add_on_slice(const Tool& tool, std::size_t g, int i) {
    const auto& group = tool.groups()[g];
    const int place = i - group.first;
    neighbours_.push_back(group.first + (place + 1) % group.count);
    neighbours_.push_back(group.first + (place + group.count - 1) % group.count);
    if (g > 1) neighbours_.push_back(i - group.count);
    if (g + 1 < tool.groups().size()) neighbours_.push_back(i + group.count);
  }

  std::vector<int> first_;       // start of each vertex's neighbours, and the end of the last vertex's
  std::vector<int> neighbours_;  // of all vertices, one after the other
};

}  // namespace trephine
