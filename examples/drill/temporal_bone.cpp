// SPDX-License-Identifier: MIT
#include "temporal_bone.hpp"

#include "phantom.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/core/spatial.hpp>
#include <trephine/core/units.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace drill::temporal_bone {
namespace {

using trephine::Mat3d;
using trephine::Posed;
using trephine::Vec3d;
using namespace trephine::literals;

constexpr double kAirHU = -1000, kSoftHU = 40, kBoneHU = 1300;
constexpr double kIsovalue = 300;
const Vec3d kLow(-17_mm, -14_mm, -24_mm), kHigh(17_mm, 15_mm, 4_mm);  // of the bone's voxels

double along_line(const Vec3d& p, const Vec3d& a, const Vec3d& b) {
  const Vec3d ab = b - a;
  return (p - a - std::clamp((p - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0) * ab).norm();
}

/// A tube about a line through points [mm].
struct Tube {
  std::vector<Vec3d> points;
  double radius;
  [[nodiscard]] double distance(const Vec3d& p) const {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t n = 1; n < points.size(); ++n)
      least = std::min(least, along_line(p, 1_mm * points[n - 1], 1_mm * points[n]));
    return least - radius;
  }
};

const Tube kFacialNerveTube{{{0, -10, -12}, {0, -1, -11}, {0.5, 2, -11}, {7, 4, -12}}, 0.6_mm};
const Tube kChordaTube{{{1.8, -5, -11}, {6, 0, -8.5}}, 0.3_mm};
const Tube kSinusTube{{{-14, -13, -8.5}, {-12.5, 0, -7.5}, {-12, 7, -8.5}}, 3_mm};
const Tube kCarotidTube{{{13, -12, -16}, {13.5, 2, -15}}, 2_mm};
const Tube kCochleaTube = [] {
  Tube tube{{}, 0.8_mm};
  const Mat3d R = trephine::rotation_between<double>(Vec3d::UnitZ(), Vec3d(0.5, 0.3, 0.8).normalized());
  constexpr int kSteps = 60;
  for (int n = 0; n <= kSteps; ++n) {
    const double share = static_cast<double>(n) / kSteps, turn = 2.5 * 2 * std::numbers::pi * share;
    const double r = 3.0 - 2.3 * share;
    tube.points.push_back(Vec3d(6, -1, -15.5) + R * Vec3d(r * std::cos(turn), r * std::sin(turn), 3 * share));
  }
  return tube;
}();

/// Three rings about one point, each in a plane of its own, and the vestibule in their middle.
double canals(const Vec3d& p) {
  static const Mat3d R = trephine::rotation_from_vector<double>(Vec3d(0.35, -0.3, 0.4));
  const Vec3d q = R.transpose() * (p - Vec3d(-5.5_mm, 3_mm, -14_mm));
  double least = q.norm() - 1.2_mm;
  for (int a = 0; a < 3; ++a) {
    const double across = q[(a + 1) % 3], over = q[(a + 2) % 3];
    least = std::min(least, std::hypot(std::hypot(across, over) - 3.2_mm, q[a]) - 0.5_mm);
  }
  return least;
}

/// A plate that rises forward from under the bone.
double dura(const Vec3d& p) { return std::abs(Vec3d(0, 0.8, -0.6).dot(p) - 16_mm) - 0.8_mm; }

struct Cell {
  Vec3d centre;
  double radius;
};

/// Air cells in the outer bone: in layers, with walls of 0.3 mm and more between them, and none near structures.
std::vector<Cell> cells() {
  std::vector<Cell> found;
  for (int k = 0; k < 3; ++k)
    for (int j = -3; j <= 3; ++j)
      for (int i = -3; i <= 3; ++i) {
        const double size = 1.1 + 0.2 * std::sin(7.0 * i + 5.0 * j + 3.0 * k);
        const Vec3d p(3.0 * i + 1.5 * (k % 2), 3.0 * j + 1.5 * (k % 2), -3.2 - 2.2 * k);
        double room = std::numeric_limits<double>::infinity();
        for (int s = 0; s < kCount; ++s) room = std::min(room, distance(s, 1_mm * p));
        if (room > (size + 0.6) * 1_mm) found.push_back({1_mm * p, size * 1_mm});
      }
  return found;
}

}  // namespace

double distance(int structure, const Vec3d& p_W) {
  switch (structure) {
    case kFacialNerve:
      return kFacialNerveTube.distance(p_W);
    case kChorda:
      return kChordaTube.distance(p_W);
    case kCanals:
      return canals(p_W);
    case kCochlea:
      return kCochleaTube.distance(p_W);
    case kSinus:
      return kSinusTube.distance(p_W);
    case kCarotid:
      return kCarotidTube.distance(p_W);
    default:
      return dura(p_W);
  }
}

namespace {

/// Distances of places that follow each other closely, each computed anew only where it may have come under a limit.
class NearDistances {
 public:
  /// The distance of p from a structure if that is less than `limit`, else something that is not.
  [[nodiscard]] double operator()(int structure, const Vec3d& p, double limit) {
    Known& known = known_[static_cast<std::size_t>(structure)];
    const double least = known.distance - (p - known.p).norm() - 1e-9;  // a distance changes by no more than the place
    if (least >= limit) return least;
    known = {p, distance(structure, p)};
    return known.distance;
  }

 private:
  struct Known {
    Vec3d p = Vec3d::Zero();
    double distance = -std::numeric_limits<double>::infinity();
  };
  std::array<Known, kCount> known_{};
};

}  // namespace

Bone bone(const Options& options) {
  constexpr double kVoxel = 0.4_mm, kBlur = kVoxel, kReach = 4 * kBlur;  // beyond it blurred steps are 0 or 1
  const Vec3d n = ((kHigh - kLow) / kVoxel).array().round() + 1;
  const std::array<int, 3> size{static_cast<int>(n.x()), static_cast<int>(n.y()), static_cast<int>(n.z())};
  const std::vector<Cell> air = cells();
  std::vector<std::int16_t> voxels;
  NearDistances near_distance;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i) {
        const Vec3d p = kLow + kVoxel * Vec3d(i, j, k);
        double to_air = -p.z(), to_soft = std::numeric_limits<double>::infinity();
        for (const Cell& c : air)
          if (std::abs(p.z() - c.centre.z()) < c.radius + kReach)
            to_air = std::min(to_air, (p - c.centre).norm() - c.radius);
        for (int s = 0; s < kCount; ++s) to_soft = std::min(to_soft, near_distance(s, p, kReach));
        const double soft = phantom::blurred_step(to_soft, kBlur), open = phantom::blurred_step(to_air, kBlur);
        const double tissue = kBoneHU + (kSoftHU - kBoneHU) * soft;
        voxels.push_back(phantom::stored<std::int16_t>(tissue + (kAirHU - tissue) * open));
      }
  const Posed X_WG = trephine::make_pose<double>(Mat3d::Identity(), kLow);
  return {.name = "temporal bone phantom",
          .unit = "HU",
          .grid = {{.size = size, .spacing = Vec3d::Constant(kVoxel), .X_WG = X_WG, .outside = kAirHU}, voxels},
          .isovalue = options.isovalue.value_or(kIsovalue),
          .burr = {},
          .notes = {"made of formulas, not of a patient"}};
}

StructureLabels labels() {
  constexpr double kVoxel = 0.3_mm;
  const Mat3d R = trephine::rotation_from_vector<double>(Vec3d(0.05, -0.04, 0.06));
  const Vec3d n = ((kHigh - kLow) / kVoxel).array().round() + 13;
  const std::array<int, 3> size{static_cast<int>(n.x()), static_cast<int>(n.y()), static_cast<int>(n.z())};
  const Vec3d middle = 0.5 * (kLow + kHigh);
  const Posed X_WS = trephine::make_pose<double>(R, Vec3d(middle - R * (0.5 * kVoxel * (n - Vec3d::Ones()))));
  std::vector<std::uint8_t> voxels;
  NearDistances near_distance;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i) {
        const Vec3d p_W = X_WS * Vec3d(kVoxel * Vec3d(i, j, k));
        std::uint8_t label = 0;
        for (int s = 0; s < kCount && label == 0; ++s)
          if (near_distance(s, p_W, 0) < 0) label = static_cast<std::uint8_t>(s + 1);
        voxels.push_back(label);
      }
  return {{.size = size, .spacing = Vec3d::Constant(kVoxel), .X_WG = X_WS},
          voxels,
          {{kFacialNerve + 1, "facial nerve", {0.98F, 0.80F, 0.16F}},
           {kChorda + 1, "chorda tympani", {0.95F, 0.60F, 0.15F}},
           {kCanals + 1, "canals", {0.30F, 0.72F, 0.45F}},
           {kCochlea + 1, "cochlea", {0.20F, 0.60F, 0.70F}},
           {kSinus + 1, "sigmoid sinus", {0.22F, 0.45F, 0.90F}},
           {kDura + 1, "dura", {0.83F, 0.28F, 0.52F}},
           {kCarotid + 1, "carotid", {0.80F, 0.20F, 0.18F}}}};
}

namespace {

/// Depth at which a line down from p meets the structure first, with room for the burr beside all others till there.
std::optional<double> depth_below(const Vec3d& p, int structure, double radius) {
  const double room = radius + 1_mm;
  for (double depth = 0; depth < -kLow.z();) {
    const Vec3d at = p - depth * Vec3d::UnitZ();
    double step = std::numeric_limits<double>::infinity();
    for (int s = 0; s < kCount; ++s) {
      const double d = distance(s, at);
      if (s == structure && d < 1e-6) return depth;
      if (s != structure && d < room) return std::nullopt;
      step = std::min(step, s == structure ? d : d - room + 0.05_mm);
    }
    depth += step;
  }
  return std::nullopt;
}

Approach way_to(int structure, const trephine::Burr& burr, const std::string& name) {
  constexpr double kStep = 0.25_mm;
  Approach best{Vec3d::Zero(), std::numeric_limits<double>::infinity()};
  for (int j = -40; j <= 40; ++j)
    for (int i = -52; i <= 52; ++i) {
      const Vec3d p = kStep * Vec3d(i, j, 0);
      const std::optional<double> depth = depth_below(p, structure, burr.tip_radius);
      if (depth && *depth < best.depth) best = {p, *depth};
    }
  if (!std::isfinite(best.depth)) {
    std::ostringstream rule;
    rule << "--phantom temporal: a burr of " << 2e3 * burr.tip_radius << " mm diameter has no straight way to the "
         << name << " (choose a smaller --burr-diameter)";
    throw std::runtime_error(rule.str());
  }
  return best;
}

}  // namespace

MadeStructures structures(const trephine::Burr& burr) {
  MadeStructures made{
      .labels = labels(), .approaches = {}, .frame_W = Mat3d::Identity(), .shown = kFacialNerve, .truth = distance};
  for (int s = 0; s < kCount; ++s)
    made.approaches.push_back(way_to(s, burr, made.labels.structures()[static_cast<std::size_t>(s)].name));
  return made;
}

}  // namespace drill::temporal_bone
