// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/bone_surface.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

/// Where a rigid ball rests on the image of a plane: what the image alone does to directions.
namespace trephine::bench {

/// Heights of the interpolant's isosurface over a plane through `at` with outward normal n, for a ball of radius R that
/// is slid half a millimetre to either side along `along()`.
template <VoxelDensity D>
class OwnSurface {
 public:
  OwnSurface(const VoxelGrid<D>& bone, double isovalue, const Vec3d& at, const Vec3d& n, double R)
      : surface_(bone, isovalue), at_(at), n_(n), u_(n.unitOrthogonal()), v_(n.cross(u_)), R_(R) {
    for (int i = 0; i < kRows; ++i)
      for (int j = 0; j < kColumns; ++j) points_.push_back(point(u_at(i), v_at(j)));
  }
  [[nodiscard]] const Vec3d& along() const { return u_; }

  /// Where a ball that is pulled toward p and slides without friction comes to rest, from near c: the place nearest to
  /// p from which no point of the surface is nearer than R. Sequential projection: distances are linear about c.
  [[nodiscard]] Vec3d rest(const Vec3d& p, Vec3d c) const {
    constexpr double kTrust = 2e-5, kNear = 4e-5, kStill = 2e-8;  // [m]
    for (int round = 0; round < 80; ++round) {
      const Vec3d step = nearest_free(p, c, nearest(c, kNear)) - c;
      const double size = step.norm(), most = kTrust / (1 + 0.1 * round);
      c += step * std::min(1.0, most / std::max(size, kStill));
      if (size < kStill) break;
    }
    return c;
  }

 private:
  static constexpr double kStep = 1.5e-5, kHalfLength = 1.2e-3, kHalfWidth = 0.8e-3;  // [m]
  static constexpr int kRows = static_cast<int>(2 * kHalfLength / kStep) + 1;
  static constexpr int kColumns = static_cast<int>(2 * kHalfWidth / kStep) + 1;
  static constexpr int kReach = 35;  // steps that a ball's nearest points may lie from below its centre

  [[nodiscard]] static double u_at(int i) { return kStep * i - kHalfLength; }
  [[nodiscard]] static double v_at(int j) { return kStep * j - kHalfWidth; }

  [[nodiscard]] Vec3d point(double u, double v) const {
    const Vec3d from = at_ + u * u_ + v * v_;
    double low = -1.5 * surface_.grid().spacing().minCoeff(), high = -low;
    for (int i = 0; i < 26; ++i) {
      const double middle = (low + high) / 2;
      (surface_.is_bone(from + middle * n_) ? low : high) = middle;
    }
    return from + low * n_;
  }

  /// The x nearest to p that keeps R from all points, distances taken as linear about c: Hildreth's method.
  [[nodiscard]] Vec3d nearest_free(const Vec3d& p, const Vec3d& c, const std::vector<Vec3d>& points) const {
    std::vector<double> pushed(points.size(), 0.0);
    Vec3d x = p;
    double moved = 1;
    for (int round = 0; round < 400 && moved > 1e-10; ++round) {
      moved = 0;
      for (std::size_t i = 0; i < points.size(); ++i) {
        const Vec3d n = (c - points[i]).normalized();
        const double gap = (c - points[i]).norm() - R_ + n.dot(x - c);
        const double push = std::max(-pushed[i], -gap);
        pushed[i] += push;
        x += push * n;
        moved = std::max(moved, std::abs(push));
      }
    }
    return x;
  }

  /// Where the surface comes nearest to c, every such place no more than `more` [m] beyond the nearest.
  [[nodiscard]] std::vector<Vec3d> nearest(const Vec3d& c, double more) const {
    const int i0 = static_cast<int>((u_.dot(c - at_) + kHalfLength) / kStep),
              j0 = static_cast<int>((v_.dot(c - at_) + kHalfWidth) / kStep);
    const auto square = [&](int i, int j) {
      return i < 0 || j < 0 || i >= kRows || j >= kColumns
                 ? 1e9
                 : (points_[static_cast<std::size_t>(i * kColumns + j)] - c).squaredNorm();
    };
    double least = 1e9;
    for (int i = i0 - kReach; i <= i0 + kReach; ++i)
      for (int j = j0 - kReach; j <= j0 + kReach; ++j) least = std::min(least, square(i, j));
    const double most = std::pow(std::sqrt(least) + more, 2);
    std::vector<Vec3d> found;
    for (int i = i0 - kReach; i <= i0 + kReach; ++i)
      for (int j = j0 - kReach; j <= j0 + kReach; ++j) {
        const double here = square(i, j);
        bool is_least = here <= most;
        for (int di = -1; di <= 1 && is_least; ++di)
          for (int dj = -1; dj <= 1; ++dj) is_least = is_least && (!(di || dj) || here <= square(i + di, j + dj));
        if (is_least) found.push_back(refined(c, u_at(i), v_at(j)));
      }
    return found;
  }

  /// The nearest point to c about (u, v), to a tenth of a micrometre.
  [[nodiscard]] Vec3d refined(const Vec3d& c, double u, double v) const {
    Vec3d best = point(u, v);
    for (double step = kStep / 2; step > 1e-7;) {
      const double u0 = u, v0 = v;
      for (int di = -1; di <= 1; ++di)
        for (int dj = -1; dj <= 1; ++dj) {
          const Vec3d q = point(u0 + di * step, v0 + dj * step);
          if (!((q - c).squaredNorm() < (best - c).squaredNorm())) continue;
          best = q;
          u = u0 + di * step;
          v = v0 + dj * step;
        }
      if (u == u0 && v == v0) step /= 2;
    }
    return best;
  }

  BoneSurface<D> surface_;
  Vec3d at_, n_, u_, v_;
  double R_;
  std::vector<Vec3d> points_;
};

}  // namespace trephine::bench
