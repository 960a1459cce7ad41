// SPDX-License-Identifier: MIT
#pragma once

#include "stability/tool.hpp"
#include "support/raster.hpp"

#include <functional>
#include <memory>
#include <string>
#include <vector>

/// Bones of known shape, and how a tool comes to touch them.
namespace trephine::bench {

inline constexpr double kPlaceVoxel = 3e-4;

struct Place {
  std::string name;
  Burr burr{};
  std::shared_ptr<Bone> bone;  ///< only read
  double isovalue = 0;
  Posed touching = Posed::Identity();       ///< the ball (or the shaft) just touches, for Surface
  Posed touching_line = Posed::Identity();  ///< the same for Line's point tip and centreline
  Vec3d outward = Vec3d::UnitZ();           ///< the way out
  Vec3d across = Vec3d::UnitX();            ///< a way to slide
  double room = 1e-3;                       ///< that far off on the way out it is free [m]
  bool by_shaft = false;                    ///< the shaft holds the tool, so that it turns about where it does
  bool rolls = false;                       ///< without friction the ball rolls over what holds it, an edge or a corner
  double mill_rate = 0;                     ///< a rate-limited cut's that suits the bone [densities/s]; 0: none known
  [[nodiscard]] const Posed& start(const Setup& setup) const {
    return setup.renderer == "line" ? touching_line : touching;
  }
};

[[nodiscard]] Place make_place(const std::string& name);
[[nodiscard]] std::vector<std::string> place_names();
/// Those where a tool is pressed the way in until it is held, for the greatest stable stiffness.
[[nodiscard]] std::vector<std::string> pressed_place_names();
/// On the skull's CT (without its folder: the phantom) where a surgeon would begin, or at the bottom of a pit milled
/// there. The bone is the place's own.
[[nodiscard]] Place scanned_place(const std::string& skull, bool milled);

/// Scanned bone round the place, `half` [m] to each side.
[[nodiscard]] std::unique_ptr<Bone> round(const Place& place, double half);
/// A copy with stored gradients: what a run may carve, and no other.
[[nodiscard]] std::shared_ptr<Bone> with_gradients(const Bone& bone);

/// Any shape as a grid of `n` voxels a side whose middle is the world's origin.
[[nodiscard]] std::shared_ptr<Bone> make_bone(const std::function<double(const Vec3d&)>& shape, int n = 64);
inline constexpr double kPlaceIsovalue = 127.5;

/// T at p, shaft (handle) along `shaft`.
[[nodiscard]] Posed tool_pose(const Vec3d& p, const Vec3d& shaft);

}  // namespace trephine::bench
