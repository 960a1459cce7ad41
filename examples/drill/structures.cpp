// SPDX-License-Identifier: MIT
#include "structures.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/core/spatial.hpp>
#include <trephine/voxel/density_field.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

namespace drill {
namespace {

using trephine::Mat3d;
using trephine::Posed;
using trephine::Vec3d;

// Lengths in burr radii.
constexpr double kApart = 3.6;                            // between the ways to two structures
constexpr double kNerveRadius = 0.55, kNerveDepth = 2.0;  // depths of the near side
constexpr double kNerveReach = 5.0;                       // half its length
constexpr double kSinusRadius = 1.33, kSinusDepth = 2.3;
constexpr double kDuraThickness = 1.0, kDuraReach = 7.0;
constexpr double kVoxelsARadius = 6;
constexpr int kSize = 90;  // voxels a side of the labels

class Maker {
 public:
  Maker(const Bone& bone, const Surgeon& surgeon)
      : field_(bone.grid, bone.isovalue),
        X_GW_(bone.grid.X_WG().inverse()),
        R_(bone.burr.tip_radius),
        F_(surgeon.frame_W()),
        spot_W_(surgeon.spot().p_W) {}

  [[nodiscard]] MadeStructures make() const {
    const double nerve = surface(-kApart), sinus = surface(kApart), middle = surface(0);
    const double far_side = below(middle);
    // Askew to the bone's voxels, as another scan's segmentation would lie.
    const double h = R_ / kVoxelsARadius;
    const Mat3d R_WS = F_ * trephine::rotation_from_vector<double>(Vec3d(0.3, -0.2, 0.5));
    const Vec3d centre = place({0, 0, 0.5 * (middle + far_side)});
    const Posed X_WS = trephine::make_pose<double>(R_WS, centre - R_WS * Vec3d::Constant(0.5 * h * (kSize - 1)));

    std::vector<std::uint8_t> labels(static_cast<std::size_t>(kSize) * kSize * kSize);
    const std::vector<bool> open = flooded(X_WS, h, place({0, 0, far_side - 0.2}));
    for (std::size_t v = 0; v < labels.size(); ++v) {
      const Vec3d p_W = X_WS * (h * voxel(v));
      const Vec3d q = F_.transpose() * (p_W - spot_W_) / R_;
      const double to_nerve = std::hypot(q.x() + kApart, q.z() - (nerve - kNerveDepth - kNerveRadius));
      const double to_sinus = (q - Vec3d(kApart, 0, sinus - kSinusDepth - kSinusRadius)).norm();
      if (to_nerve < kNerveRadius && std::abs(q.y()) < kNerveReach)
        labels[v] = kNerve + 1;
      else if (to_sinus < kSinusRadius)
        labels[v] = kSinus + 1;
      else if (open[v] && q.head<2>().norm() < kDuraReach && is_under_bone(p_W))
        labels[v] = kDura + 1;
    }
    const auto way = [&](double x, double z, double depth) { return Approach{place({x, 0, z}), R_ * depth}; };
    return {
        .labels = StructureLabels({.size = {kSize, kSize, kSize}, .spacing = Vec3d::Constant(h), .X_WG = X_WS}, labels,
                                  {{kNerve + 1, "nerve", {0.98F, 0.80F, 0.16F}},
                                   {kSinus + 1, "sinus", {0.22F, 0.45F, 0.90F}},
                                   {kDura + 1, "dura", {0.83F, 0.28F, 0.52F}}}),
        .approaches = {way(-kApart, nerve, kNerveDepth), way(kApart, sinus, kSinusDepth),
                       way(0, middle, middle - far_side)},
        .frame_W = F_,
        .shown = kDura};
  }

 private:
  static constexpr double kStep = 0.05;  // along a ray [radii]

  /// A place in W from coordinates in radii: lean, across, outward from the spot.
  [[nodiscard]] Vec3d place(const Vec3d& q) const { return spot_W_ + R_ * (F_ * q); }
  [[nodiscard]] bool is_bone(const Vec3d& p_W) const { return field_.value(X_GW_ * p_W) >= 0; }
  [[nodiscard]] static Vec3d voxel(std::size_t v) {
    const int n = static_cast<int>(v);
    return {static_cast<double>(n % kSize), static_cast<double>(n / kSize % kSize),
            static_cast<double>(n / (kSize * kSize))};
  }

  /// Height of the bone's surface over the spot, x radii beside it.
  [[nodiscard]] double surface(double x) const {
    for (double z = 3; z > -3; z -= kStep)
      if (is_bone(place({x, 0, z}))) return z;
    throw std::runtime_error("--structures: the bone ends beside the spot (choose another place, --at)");
  }

  /// Height of the bone's far side under the spot: no bone follows it for a radius.
  [[nodiscard]] double below(double top) const {
    double end = top;
    for (double z = top; z > top - 14; z -= kStep) {
      if (is_bone(place({0, 0, z}))) end = z - kStep;
      if (end - z >= 1) return end;
    }
    throw std::runtime_error("--structures: no far side of the bone within 14 burr radii (choose another place, --at)");
  }

  /// Bone lies outward within the dura's thickness.
  [[nodiscard]] bool is_under_bone(const Vec3d& p_W) const {
    for (double s = kStep; s <= kDuraThickness; s += kStep)
      if (is_bone(p_W + s * R_ * F_.col(2))) return true;
    return false;
  }

  /// Voxels without bone that are connected with the one at p_W.
  [[nodiscard]] std::vector<bool> flooded(const Posed& X_WS, double h, const Vec3d& p_W) const {
    std::vector<bool> seen(static_cast<std::size_t>(kSize) * kSize * kSize);
    const Vec3d u = (X_WS.inverse() * p_W / h).array().round();
    std::vector<std::size_t> waiting{static_cast<std::size_t>((u.z() * kSize + u.y()) * kSize + u.x())};
    seen[waiting[0]] = true;
    while (!waiting.empty()) {
      const std::size_t at = waiting.back();
      waiting.pop_back();
      std::size_t pitch = 1;
      for (int a = 0; a < 3; ++a, pitch *= kSize) {
        const auto place_on_axis = at / pitch % kSize;
        const auto visit = [&](bool possible, std::size_t to) {
          if (!possible || seen[to] || is_bone(X_WS * (h * voxel(to)))) return;
          seen[to] = true;
          waiting.push_back(to);
        };
        visit(place_on_axis > 0, at - pitch);
        visit(place_on_axis + 1 < kSize, at + pitch);
      }
    }
    return seen;
  }

  trephine::DensityField<std::int16_t, double> field_;
  Posed X_GW_;
  double R_;
  Mat3d F_;
  Vec3d spot_W_;
};

}  // namespace

MadeStructures make_structures(const Bone& bone, const Surgeon& surgeon) { return Maker(bone, surgeon).make(); }

}  // namespace drill
