// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/cholesky.hpp>
#include <trephine/core/math.hpp>
#include <trephine/structure/label_surface.hpp>
#include <trephine/structure/parallel_tasks.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace trephine::detail {

/// Smooths surfels: moves each along its voxel edge onto a surface that is fitted to the surfels around it.
///
/// The fit is a quadric by weighted least squares, so a curved surface does not shrink as it does under a Gaussian.
/// Only surfels of the same structure that face the same way count, so both sides of a thin plate stay apart. A surfel
/// stays on its edge, between the two voxel centres: no fit moves a voxel to the other side. After several rounds the
/// surface is as smooth as the labels allow.
class SurfaceFit {
 public:
  SurfaceFit(std::vector<Surfel> surfels, const Vec3d& spacing) : old_(std::move(surfels)), spacing_(spacing) {
    longest_ = spacing.maxCoeff();
    sort_into_cells();
    new_ = old_;
  }

  /// Fits all surfels. Returns false if the build was cancelled.
  [[nodiscard]] bool run(int threads, const ProgressShare& share) {
    const std::size_t tasks = (cells_.size() + kCellsPerTask - 1) / kCellsPerTask;
    std::vector<Window> windows(static_cast<std::size_t>(threads));
    for (int round = 0; round < kRounds; ++round) {
      const float step = (share.to - share.from) / kRounds;
      const ProgressShare part{share.progress, share.from + step * static_cast<float>(round),
                               share.from + step * static_cast<float>(round + 1)};
      if (!run_tasks(tasks, threads, part, [&](std::size_t task, int thread) {
            const std::size_t end = std::min((task + 1) * kCellsPerTask, cells_.size() - 1);
            for (std::size_t c = task * kCellsPerTask; c < end; ++c) fit(c, windows[static_cast<std::size_t>(thread)]);
          }))
        return false;
      old_.swap(new_);
    }
    return true;
  }

  /// The surfels, by structure.
  [[nodiscard]] std::vector<Surfel> take() noexcept { return std::move(old_); }

 private:
  // Numbers that decide.
  static constexpr int kRounds = 6;         // rounds of the fit: the error falls from .20 voxel to .08, and no further
  static constexpr double kWindow = 2.5;    // radius of the fit [longest spacings]
  static constexpr double kCell = 3.0;      // edge of a cell [longest spacings]: the window and the moves of surfels
  static constexpr float kFacing = 0.3F;    // least cosine between normals of surfels that count
  static constexpr double kSlack = 0.01;    // added to the sums of squares: weight of no slope ...
  static constexpr double kFlat = 0.01;     // ... and of no curvature, where few surfels are near
  static constexpr double kGrazing = 0.2;   // least cosine between normal and edge, for the move along the edge
  static constexpr double kClosest = 0.05;  // share of its edge that a surfel keeps from voxel centres
  static constexpr std::size_t kCellsPerTask = 256;
  static constexpr int kTerms = 6;  // height, two slopes, three curvatures

  struct Cell {
    std::uint64_t key;  // structure, z, y, x: neighbours along x follow each other
    std::size_t first;  // of its surfels
  };
  using Window = std::vector<Surfel>;

  [[nodiscard]] static std::uint64_t key(std::uint64_t structure, std::uint64_t x, std::uint64_t y,
                                         std::uint64_t z) noexcept {
    return structure << 48 | z << 32 | y << 16 | x;
  }

  void sort_into_cells() {
    std::vector<std::pair<std::uint64_t, std::size_t>> order(old_.size());
    const auto per_metre = static_cast<float>(1 / (kCell * longest_));
    for (std::size_t i = 0; i < old_.size(); ++i) {
      const auto& p = old_[i].position;
      // Surfels lie beyond half a voxel before the first; keys start at 1, so that a neighbour's is never negative.
      const auto cell = [&](std::size_t a) { return static_cast<std::uint64_t>(p[a] * per_metre + 2.0F); };
      order[i] = {key(old_[i].structure, cell(0), cell(1), cell(2)), i};
    }
    std::sort(order.begin(), order.end());
    new_.resize(old_.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
      new_[i] = old_[order[i].second];
      if (i == 0 || order[i].first != order[i - 1].first) cells_.push_back({order[i].first, i});
    }
    cells_.push_back({~std::uint64_t{0}, order.size()});
    old_.swap(new_);
  }

  /// Fits the surfels of one cell.
  void fit(std::size_t cell, Window& window) {
    window.clear();
    const std::uint64_t at = cells_[cell].key;
    for (std::uint64_t z = 0; z < 3; ++z)
      for (std::uint64_t y = 0; y < 3; ++y) {
        const std::uint64_t from = at + (z << 32) + (y << 16) - key(0, 1, 1, 1);
        auto c = std::lower_bound(cells_.begin(), cells_.end(), from,
                                  [](const Cell& a, std::uint64_t k) { return a.key < k; });
        const std::size_t first = c->first;
        while (c->key <= from + 2) ++c;
        window.insert(window.end(), old_.begin() + static_cast<std::ptrdiff_t>(first),
                      old_.begin() + static_cast<std::ptrdiff_t>(c->first));
      }
    for (std::size_t i = cells_[cell].first; i < cells_[cell + 1].first; ++i) new_[i] = fitted(old_[i], window);
  }

  [[nodiscard]] Surfel fitted(const Surfel& s, const Window& window) const noexcept {
    const Vec3d n(s.normal[0], s.normal[1], s.normal[2]);
    const Vec3d u = n.unitOrthogonal(), v = n.cross(u);
    const auto per_metre = static_cast<float>(1 / longest_);
    constexpr auto kSquare = static_cast<float>(kWindow * kWindow);
    Eigen::Matrix<double, kTerms, kTerms> H = Eigen::Matrix<double, kTerms, kTerms>::Zero();
    Eigen::Matrix<double, kTerms, 1> b = Eigen::Matrix<double, kTerms, 1>::Zero(), fit;
    for (const Surfel& o : window) {
      const float x = (o.position[0] - s.position[0]) * per_metre, y = (o.position[1] - s.position[1]) * per_metre,
                  z = (o.position[2] - s.position[2]) * per_metre;
      const float square = x * x + y * y + z * z;
      const float facing = o.normal[0] * s.normal[0] + o.normal[1] * s.normal[1] + o.normal[2] * s.normal[2];
      if (!(square < kSquare && facing > kFacing)) continue;
      const double near = 1 - static_cast<double>(square / kSquare);
      const double weight = near * near * static_cast<double>(facing * std::abs(o.normal[o.side / 2U]));
      const Vec3d d(x, y, z);
      const double p = d.dot(u), q = d.dot(v), height = d.dot(n);
      const std::array<double, kTerms> t{1, p, q, p * p, p * q, q * q};
      for (std::size_t r = 0; r < kTerms; ++r) {
        const auto row = static_cast<Eigen::Index>(r);
        const double w = weight * t[r];
        for (std::size_t c = 0; c <= r; ++c) H(row, static_cast<Eigen::Index>(c)) += w * t[c];
        b[row] += w * height;
      }
    }
    for (Eigen::Index i = 1; i < kTerms; ++i) H(i, i) += i < 3 ? kSlack : kFlat;
    if (!solve_positive_definite<kTerms>(H, b, fit)) return s;
    return moved(s, n, u, v, fit);
  }

  [[nodiscard]] Surfel moved(const Surfel& s, const Vec3d& n, const Vec3d& u, const Vec3d& v,
                             const Eigen::Matrix<double, kTerms, 1>& fit) const noexcept {
    const auto axis = static_cast<Eigen::Index>(s.side / 2U);
    const double sign = s.side % 2U == 0 ? 1 : -1;
    Vec3d m = (n - fit[1] * u - fit[2] * v).normalized();
    if (!(m[axis] * sign > 0)) m = n;
    // Where the fitted plane meets the edge.
    const double along = sign * fit[0] * longest_ * n.dot(m) / std::max(m[axis] * sign, kGrazing);
    const auto a = static_cast<std::size_t>(axis);
    const double h = spacing_[axis], from = std::floor(static_cast<double>(s.position[a]) / h);
    const double to =
        std::clamp(static_cast<double>(s.position[a]) + along, (from + kClosest) * h, (from + 1 - kClosest) * h);
    Surfel out = s;
    out.position[a] = static_cast<float>(to);
    for (std::size_t i = 0; i < 3; ++i) out.normal[i] = static_cast<float>(m[static_cast<Eigen::Index>(i)]);
    return out;
  }

  std::vector<Surfel> old_, new_;
  Vec3d spacing_;
  double longest_ = 0;
  std::vector<Cell> cells_;  // in ascending order, and one behind the last
};

}  // namespace trephine::detail
