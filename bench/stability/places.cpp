// SPDX-License-Identifier: MIT
#include "stability/places.hpp"

#include <cmath>
#include <stdexcept>

namespace trephine::bench {

using namespace trephine::test;

namespace {

constexpr double kBall = 1.5e-3, kShaft = 0.8e-3;
constexpr double kInside = 0.1e-3;  // places lie off the voxels' planes

Burr ball() { return {.tip_radius = kBall, .shaft_radius = kShaft, .shaft_length = 0}; }
Burr drill(double length) { return {.tip_radius = kBall, .shaft_radius = kShaft, .shaft_length = length}; }

}  // namespace

Posed tool_pose(const Vec3d& p, const Vec3d& shaft) {
  const Vec3d z = shaft.normalized(), x = z.unitOrthogonal();
  Mat3d R;
  R << x, z.cross(x), z;
  return make_pose<double>(R, p);
}

std::shared_ptr<Bone> make_bone(const std::function<double(const Vec3d&)>& shape, int n) {
  RasterOptions o{.size = {n, n, n}, .spacing = Vec3d::Constant(kPlaceVoxel)};
  o.grid.stored_gradients = true;
  o.grid.keep_original = false;
  const Vec3d middle = o.middle();
  o.X_WG.translation() = -middle;
  return std::make_shared<Bone>(rasterise<std::int16_t>([&](const Vec3d& p) { return shape(p - middle); }, o));
}

std::unique_ptr<Bone> round(const Place& place, double half) {
  const Bone& bone = *place.bone;
  const Vec3d middle = (bone.X_WG().inverse() * place.touching.translation()).cwiseQuotient(bone.spacing());
  VoxelBox box;
  for (int a = 0; a < 3; ++a) {
    const int reach = static_cast<int>(std::ceil(half / bone.spacing()[a]));
    const int at = static_cast<int>(std::lround(middle[a]));
    box.lo[static_cast<std::size_t>(a)] = at - reach;
    box.hi[static_cast<std::size_t>(a)] = at + reach;
  }
  return std::make_unique<Bone>(bone.cropped(box));
}

std::shared_ptr<Bone> with_gradients(const Bone& bone) {
  const auto& n = bone.size();
  std::vector<std::int16_t> voxels(static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) *
                                   static_cast<std::size_t>(n[2]));
  bone.copy_voxels(voxels);
  return std::make_shared<Bone>(
      GridGeometry{
          .size = n, .spacing = bone.spacing(), .X_WG = bone.X_WG(), .outside = static_cast<double>(bone.outside())},
      std::span<const std::int16_t>(voxels), GridOptions{.stored_gradients = true});
}

std::vector<std::string> place_names() {
  return {"flat wall",  "tilted wall",     "edge 90",
          "edge 30",    "corner",          "concave corner",
          "slot",       "shaft in a hole", "one bar under the shaft",
          "shaft flush"};
}

std::vector<std::string> pressed_place_names() {
  return {"flat wall", "tilted wall",           "thin wall",       "edge 90",    "edge 30", "corner", "concave corner",
          "groove",    "slot's floor and side", "shaft in a hole", "shaft flush"};
}

Place make_place(const std::string& name) {
  Place p;
  p.name = name;
  p.isovalue = kPlaceIsovalue;
  p.burr = ball();
  const Vec3d up = Vec3d::UnitZ();
  // Bone below z = kInside unless said otherwise; the tool stands on top, its handle up.
  const HalfSpace floor{Vec3d(0, 0, kInside), up};
  const auto stand = [&](double top, const Vec3d& n) {
    p.outward = n;
    p.touching = tool_pose((top + kBall) * n, up);
    p.touching_line = tool_pose(top * n, up);
  };
  if (name == "flat wall") {
    p.bone = make_bone(floor);
    stand(kInside, up);
  } else if (name == "tilted wall") {
    const Vec3d n = Vec3d(0.3, 0.5, 0.8).normalized();
    p.bone = make_bone(HalfSpace{kInside * n, n});
    stand(kInside, n);
    p.across = n.unitOrthogonal();
  } else if (name == "edge 90" || name == "edge 30") {
    const double half = (name == "edge 90" ? 45 : 15) * 0.017453292519943295;
    const Vec3d a(std::cos(half), 0, std::sin(half)), b(-std::cos(half), 0, std::sin(half));
    p.bone = make_bone(Both<HalfSpace, HalfSpace>{{Vec3d(kInside, 0, kInside), a}, {Vec3d(kInside, 0, kInside), b}});
    stand(kInside, up);
    p.touching.translation().x() = p.touching_line.translation().x() = kInside;
    p.rolls = true;
  } else if (name == "corner") {
    p.rolls = true;
    p.bone = make_bone([](const Vec3d& q) {  // a cube's corner, its diagonal up
      const Vec3d d = Quatd::FromTwoVectors(Vec3d::UnitZ(), Vec3d::Ones()) * (q - Vec3d(0, 0, kInside));
      return d.maxCoeff();
    });
    stand(kInside, up);
  } else if (name == "concave corner") {
    p.bone = make_bone([](const Vec3d& q) { return std::min({q.x(), q.y(), q.z()}) - kInside; });
    const Vec3d n = Vec3d::Ones().normalized();
    p.outward = n;
    p.touching = tool_pose(Vec3d::Constant(kInside + kBall), up);
    p.touching_line = tool_pose(Vec3d::Constant(kInside), up);
    p.across = -Vec3d::UnitX();  // along the groove of two walls against the third
  } else if (name == "slot") {   // a voxel of room on either side of the ball, and a floor
    p.bone = make_bone([](const Vec3d& q) {
      return std::min(kBall + kPlaceVoxel - std::abs(q.x() - kInside), q.z() + 3e-3 - kInside);
    });
    p.touching = tool_pose(Vec3d(kInside, 0, kInside - 3e-3 + kBall), up);
    p.touching_line = tool_pose(Vec3d(kInside, 0, kInside - 3e-3), up);
    p.across = Vec3d::UnitY();
  } else if (name == "slot's floor and side") {
    p = make_place("slot");
    p.name = name;
    p.outward = Vec3d(-1, 0, 1).normalized();
    p.touching.translation().x() += kPlaceVoxel;
    p.touching_line.translation().x() += kBall + kPlaceVoxel;
    p.room = 4e-4;
  } else if (name == "groove") {  // of 90 degrees
    p.bone = make_bone([](const Vec3d& q) { return std::sqrt(0.5) * (q.z() - std::abs(q.x() - kInside)) - kInside; });
    p.touching = tool_pose(Vec3d(kInside, 0, std::sqrt(2.0) * (kInside + kBall)), up);
    p.touching_line = tool_pose(Vec3d(kInside, 0, std::sqrt(2.0) * kInside), up);
    p.across = Vec3d::UnitY();
  } else if (name == "thin wall") {  // of one voxel
    p.bone = make_bone([](const Vec3d& q) { return std::abs(q.z() - kInside) - 0.5 * kPlaceVoxel; });
    stand(kInside + 0.5 * kPlaceVoxel, up);
  } else if (name == "shaft in a hole") {  // a plate with a hole half a voxel wider than the shaft, the tip below it
    p.burr = drill(10e-3);
    p.burr.tip_radius = kShaft;
    p.bone = make_bone([](const Vec3d& q) {
      const double hole = kShaft + 0.5 * kPlaceVoxel - std::hypot(q.x() - kInside, q.y());
      return std::max(std::abs(q.z()) - 1.2e-3, hole);
    });
    p.touching = p.touching_line = tool_pose(Vec3d(kInside, 0, -4e-3), up);
    p.outward = Vec3d::UnitX();
    p.across = up;
    p.room = 0;
    p.by_shaft = true;
  } else if (name == "one bar under the shaft" || name == "shaft flush") {
    // The tool lies along x from its tip at -8 mm on.
    p.burr = drill(20e-3);
    const bool flush = name == "shaft flush";
    if (flush)
      p.bone = make_bone([](const Vec3d& q) { return std::max(q.z() - kInside, -6e-3 - q.x()); });
    else
      p.bone = make_bone(Rod{Vec3d(4e-3, 0, kInside - 1e-3), Vec3d::UnitY(), 1e-3});
    p.by_shaft = true;
    p.touching = tool_pose(Vec3d(-8e-3, 0, kInside + kShaft), Vec3d::UnitX());
    p.touching_line = tool_pose(Vec3d(-8e-3, 0, kInside), Vec3d::UnitX());
    p.across = Vec3d::UnitX();
  } else {
    throw std::invalid_argument("make_place: no place '" + name + "'");
  }
  return p;
}

}  // namespace trephine::bench
