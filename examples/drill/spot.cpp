// SPDX-License-Identifier: MIT
#include "spot.hpp"

#include <trephine/contact/surface_search.hpp>
#include <trephine/voxel/density_field.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

namespace drill {
namespace {

using trephine::Vec3d;
using Field = trephine::DensityField<std::int16_t, double>;

/// All in G.
struct Patch {
  Vec3d p;
  Vec3d n;
  double unevenness = 0;
};

/// What a place must offer; lengths in burr radii.
struct Demands {
  double unevenness;  ///< at most, over two radii round it
  double depth;       ///< bone below, at least
  double lean;        ///< angle by which the shaft must be free to lean to all sides [rad]
};

/// A skull or a jaw meets the first; small bones only the later ones.
constexpr std::array<Demands, 3> kDemands{{{0.5, 1.5, 0.85}, {1.2, 1.2, 0.6}, {2.0, 0.8, 0.0}}};

class Finder {
 public:
  explicit Finder(const Bone& bone) : bone_(bone), field_(bone.grid, bone.isovalue), R_(bone.burr.tip_radius) {}

  /// The best place that meets the demands, or none.
  [[nodiscard]] std::optional<Spot> best(const Demands& demands) const {
    const auto& n = bone_.grid.size();
    const int stride = std::max(1, static_cast<int>(std::lround(0.8 * R_ / field_.voxel())));
    std::optional<Spot> best;
    double best_score = 0;
    for (int k = 0; k < n[2]; k += stride)
      for (int j = 0; j < n[1]; j += stride)
        for (int i = 0; i < n[0]; i += stride) {
          const Vec3d p = bone_.grid.spacing().cwiseProduct(Vec3d(i, j, k));
          if (!near_surface(p)) continue;
          const auto patch = settle(p);
          if (!patch || patch->unevenness > demands.unevenness * R_) continue;
          const double depth = depth_below(*patch);
          if (depth < demands.depth * R_) continue;
          const double score = std::min(depth, kWanted * R_) / R_ - 4 * patch->unevenness / R_;
          if (best && score <= best_score) continue;
          if (!has_room(*patch, demands.lean)) continue;
          best = in_world(*patch, depth);
          best_score = score;
        }
    return best;
  }

  [[nodiscard]] Spot nearest(const Vec3d& p_W) const {
    const Vec3d p = bone_.grid.X_WG().inverse() * p_W;
    const double reach = 10 * R_;
    const double step = 0.7 * field_.voxel();
    std::vector<std::pair<double, Vec3d>> found;  // by distance
    // Within the volume: around a wide burr's reach there is much air.
    std::array<int, 3> lo{}, hi{};
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      const double end = field_.voxel() + bone_.grid.spacing()[axis] * bone_.grid.size()[a];
      lo[a] = static_cast<int>(std::max(-reach, -field_.voxel() - p[axis]) / step);
      hi[a] = static_cast<int>(std::min(reach, end - p[axis]) / step);
    }
    for (int k = lo[2]; k <= hi[2]; ++k)
      for (int j = lo[1]; j <= hi[1]; ++j)
        for (int i = lo[0]; i <= hi[0]; ++i) {
          const Vec3d q = p + step * Vec3d(i, j, k);
          const double d = (q - p).norm();
          if (d < reach && near_surface(q)) found.emplace_back(d, q);
        }
    // Jagged bone has places, often the nearest, where a burr finds no plane to stand on.
    const auto nearer = [](const auto& a, const auto& b) { return a.first < b.first; };
    std::sort(found.begin(), found.end(), nearer);
    std::optional<Patch> patch;
    for (std::size_t c = 0; c < found.size() && !patch; ++c) patch = settle(found[c].second);
    if (!patch) {
      std::array<char, 160> text{};
      std::snprintf(text.data(), text.size(),
                    "no open bone surface within %g mm of %g %g %g (choose another place, --at)", 1e3 * reach,
                    1e3 * p_W.x(), 1e3 * p_W.y(), 1e3 * p_W.z());
      throw std::runtime_error(text.data());
    }
    return in_world(*patch, depth_below(*patch));
  }

 private:
  static constexpr double kWanted = 3.5;  // radii of bone below: a hole of three, and a floor

  [[nodiscard]] bool near_surface(const Vec3d& p) const {
    Vec3d n;
    if (!field_.normal(p, n)) return false;
    const double h = field_.voxel();
    return field_.value(p - h * n) >= 0 && field_.value(p + h * n) < 0;
  }

  /// Height of the surface over the plane at p along n, looked for from `reach` above to as far below.
  [[nodiscard]] std::optional<double> height(const Vec3d& p, const Vec3d& n, double reach) const {
    const Vec3d above = p + reach * n;
    const Vec3d below = p - reach * n;
    const auto c = trephine::first_crossing(field_, above, below, 0.5 * field_.voxel(), 1000);
    if (!c.found || field_.value(above) >= 0) return std::nullopt;
    return reach - 2 * reach * c.after;
  }

  /// The plane through the surface around p, over two burr radii: starts from the density's normal and follows the
  /// slope of what it finds.
  [[nodiscard]] std::optional<Patch> settle(Vec3d p) const {
    Patch patch{.p = p, .n = Vec3d::UnitZ()};
    if (!field_.normal(p, patch.n)) return std::nullopt;
    for (int round = 0; round < 3; ++round) {
      const auto middle = height(patch.p, patch.n, 2 * R_);
      if (!middle) return std::nullopt;
      patch.p += *middle * patch.n;
      const Vec3d u = patch.n.unitOrthogonal();
      const Vec3d v = patch.n.cross(u);
      Vec3d slope = Vec3d::Zero();
      patch.unevenness = 0;
      for (int i = 0; i < kRing; ++i) {
        const double a = 2 * std::numbers::pi * i / kRing;
        const double r = i % 2 == 0 ? R_ : 2 * R_;
        const Vec3d way = std::cos(a) * u + std::sin(a) * v;
        const auto h = height(patch.p + r * way, patch.n, 1.5 * R_);
        if (!h) return std::nullopt;
        slope += 2.0 / kRing * *h / r * way;
        patch.unevenness = std::max(patch.unevenness, std::abs(*h));
      }
      if (round < 2) patch.n = (patch.n - slope).normalized();
    }
    return patch;
  }

  /// Bone straight below, under the middle and under the burr's rim; as far as kWanted radii and one more.
  [[nodiscard]] double depth_below(const Patch& patch) const {
    const Vec3d u = patch.n.unitOrthogonal();
    const Vec3d v = patch.n.cross(u);
    double least = (kWanted + 1) * R_;
    for (int i = 0; i < 9; ++i) {
      const double a = 2 * std::numbers::pi * i / 8;
      const Vec3d way = i == 8 ? Vec3d(Vec3d::Zero()) : Vec3d(0.7 * R_ * (std::cos(a) * u + std::sin(a) * v));
      // The surface is uneven: start a little below it.
      const double skip = patch.unevenness + 0.5 * field_.voxel();
      for (double d = skip; d < least; d += 0.5 * field_.voxel())
        if (field_.value(patch.p + way - d * patch.n) < 0) least = d;
    }
    return least;
  }

  /// Free way for the shaft, straight and leaning to all sides, and from there out of the volume.
  [[nodiscard]] bool has_room(const Patch& patch, double most_lean) const {
    const Vec3d u = patch.n.unitOrthogonal();
    const Vec3d v = patch.n.cross(u);
    for (const double lean : {0.0, 0.5 * most_lean, most_lean})
      for (int i = 0; i < (lean > 0 ? 8 : 1); ++i) {
        const double a = 2 * std::numbers::pi * i / 8;
        const Vec3d way = std::cos(lean) * patch.n + std::sin(lean) * (std::cos(a) * u + std::sin(a) * v);
        const double length = lean > 0 ? bone_.burr.shaft_length : 10 * bone_.burr.shaft_length;
        for (double d = 1.5 * R_; d < length; d += 0.5 * R_)
          if (field_.value(patch.p + d * way) >= 0) return false;
      }
    return true;
  }

  [[nodiscard]] Spot in_world(const Patch& patch, double depth) const {
    const auto& X_WG = bone_.grid.X_WG();
    return {.p_W = X_WG * patch.p, .normal_W = X_WG.linear() * patch.n, .depth = depth, .unevenness = patch.unevenness};
  }

  static constexpr int kRing = 16;
  const Bone& bone_;
  Field field_;
  double R_;
};

}  // namespace

Spot find_spot(const Bone& bone) {
  const Finder finder(bone);
  for (const Demands& demands : kDemands)
    if (const auto spot = finder.best(demands)) return *spot;
  throw std::runtime_error(
      "no place on the bone is flat, thick and free enough for this drill; take a smaller one (--burr-diameter, "
      "--tool), another --isovalue, or say where with --at");
}

Spot spot_near(const Bone& bone, const Vec3d& p_W) { return Finder(bone).nearest(p_W); }

}  // namespace drill
