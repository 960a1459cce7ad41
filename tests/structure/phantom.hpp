// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/units.hpp>
#include <trephine/structure/build_structure_field.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

/// Structures by formula, sampled as labels.
namespace trephine::test {

/// A tube with round ends; a ball where both ends are one.
struct Tube {
  Vec3d from = Vec3d::Zero(), to = Vec3d::Zero();  // [m], in S
  double radius = 0;

  [[nodiscard]] double distance(const Vec3d& p) const {
    const Vec3d along = to - from;
    const double t = std::clamp((p - from).dot(along) / std::max(along.squaredNorm(), 1e-30), 0.0, 1.0);
    return (p - from - t * along).norm() - radius;
  }
};

/// Labels of tubes; several tubes may have one label.
struct LabelledTubes {
  std::vector<Tube> tubes;
  std::vector<int> structure;  // of each tube
  std::array<int, 3> size{64, 64, 64};
  double voxel = 0.3e-3;

  [[nodiscard]] double distance(int s, const Vec3d& p) const {
    double d = 1;
    for (std::size_t t = 0; t < tubes.size(); ++t)
      if (structure[t] == s) d = std::min(d, tubes[t].distance(p));
    return d;
  }
  [[nodiscard]] std::vector<std::uint8_t> labels() const {
    std::vector<std::uint8_t> out;
    for (int k = 0; k < size[2]; ++k)
      for (int j = 0; j < size[1]; ++j)
        for (int i = 0; i < size[0]; ++i) {
          std::uint8_t label = 0;
          for (std::size_t t = 0; t < tubes.size() && label == 0; ++t)
            if (tubes[t].distance(voxel * Vec3d(i, j, k)) < 0) label = static_cast<std::uint8_t>(structure[t] + 1);
          out.push_back(label);
        }
    return out;
  }
  [[nodiscard]] std::shared_ptr<const StructureField> field(double reach) const {
    const std::vector<std::uint8_t> voxels = labels();
    const LabelVolume volume{size, Vec3d::Constant(voxel), voxels};
    return build_structure_field(volume, {.reach = reach});
  }
};

/// Two tubes that cross apart from each other, and a ball: structures 0, 1 and 2 in a cube of 17 mm.
[[nodiscard]] inline LabelledTubes canals() {
  using namespace literals;
  const auto mm = [](double x, double y, double z) { return Vec3d(x * 1_mm, y * 1_mm, z * 1_mm); };
  return {.tubes = {{mm(2, 8, 7), mm(14, 8, 9), 0.8_mm},
                    {mm(8, 2, 12), mm(8, 14, 11), 0.6_mm},
                    {mm(4.5, 11.5, 5), mm(4.5, 11.5, 5), 1.6_mm}},
          .structure = {0, 1, 2},
          .size = {58, 58, 58}};
}

}  // namespace trephine::test
