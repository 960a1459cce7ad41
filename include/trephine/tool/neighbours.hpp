// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/discretization.hpp>

#include <span>

namespace trephine {

/// Which vertices of a Surface tool have patches that may touch each other: on the ball those within 2.2 patch radii,
/// on the shaft the two beside a vertex in its slice and the two above and below it. Immutable after construction.
class PatchNeighbours {
 public:
  PatchNeighbours() = default;
  template <RealScalar Scalar>
  explicit PatchNeighbours(const ToolDiscretization<SurfaceCounts, Scalar>& tool) {
    first_.push_back(0);
    for (std::size_t g = 0; g < tool.groups().size(); ++g) {
      const auto& group = tool.groups()[g];
      for (int i = group.first; i < group.first + group.count; ++i) {
        g == 0 ? add_on_ball(tool, i) : add_on_slice(tool, g, i);
        first_.push_back(static_cast<int>(all_.size()));
      }
    }
  }

  /// Of vertex i of the periphery.
  [[nodiscard]] std::span<const int> of(int i) const noexcept {
    const auto n = static_cast<std::size_t>(i);
    return std::span<const int>(all_).subspan(static_cast<std::size_t>(first_[n]),
                                              static_cast<std::size_t>(first_[n + 1] - first_[n]));
  }

 private:
  template <class Tool>
  void add_on_ball(const Tool& tool, int i) {
    const auto reach = static_cast<typename Tool::Scalar>(2.2) * tool.patch(i).disc;
    // Layouts go up along z, so that the search can stop.
    const auto near = [&](int j) {
      if (std::abs(tool.points()[j].z() - tool.points()[i].z()) > reach) return false;
      if ((tool.points()[j] - tool.points()[i]).norm() <= reach) all_.push_back(j);
      return true;
    };
    for (int j = i - 1; j >= 0 && near(j); --j) {
    }
    for (int j = i + 1; j < tool.groups()[0].count && near(j); ++j) {
    }
  }

  template <class Tool>
  void add_on_slice(const Tool& tool, std::size_t g, int i) {
    const auto& group = tool.groups()[g];
    const int at = i - group.first;
    all_.push_back(group.first + (at + 1) % group.count);
    all_.push_back(group.first + (at + group.count - 1) % group.count);
    if (g > 1) all_.push_back(i - group.count);
    if (g + 1 < tool.groups().size()) all_.push_back(i + group.count);
  }

  std::vector<int> first_, all_;
};

}  // namespace trephine
