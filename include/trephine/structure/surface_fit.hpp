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

namespace trephine::inline TREPHINE_ALIGNED::detail {

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
  static constexpr std::size_t kTerms = 6;  // height, two slopes, three curvatures

  struct Cell {
    std::uint64_t key;  // structure, z, y, x: neighbours along x follow each other
    std::size_t first;  // of its surfels
  };
  static constexpr std::size_t kLanes = 8;
  using Lanes = std::array<float, kLanes>;
  /// The surfels around a cell, and those around one of its surfels: place along two tangents, height and weight.
  struct Window {
    std::vector<Surfel> surfels;
    std::vector<float> p, q, height, weight;

    void add(float along, float across, float above, float w) {
      p.push_back(along), q.push_back(across), height.push_back(above), weight.push_back(w);
    }
    void clear() { p.clear(), q.clear(), height.clear(), weight.clear(); }
  };

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
    window.surfels.clear();
    const std::uint64_t at = cells_[cell].key;
    for (std::uint64_t z = 0; z < 3; ++z)
      for (std::uint64_t y = 0; y < 3; ++y) {
        const std::uint64_t from = at + (z << 32) + (y << 16) - key(0, 1, 1, 1);
        auto c = std::lower_bound(cells_.begin(), cells_.end(), from,
                                  [](const Cell& a, std::uint64_t k) { return a.key < k; });
        const std::size_t first = c->first;
        while (c->key <= from + 2) ++c;
        window.surfels.insert(window.surfels.end(), old_.begin() + static_cast<std::ptrdiff_t>(first),
                              old_.begin() + static_cast<std::ptrdiff_t>(c->first));
      }
    for (std::size_t i = cells_[cell].first; i < cells_[cell + 1].first; ++i) new_[i] = fitted(old_[i], window);
  }

  [[nodiscard]] Surfel fitted(const Surfel& s, Window& window) const {
    const Vec3d n(s.normal[0], s.normal[1], s.normal[2]);
    const Vec3d u = n.unitOrthogonal(), v = n.cross(u);
    const Eigen::Vector3f nf = n.cast<float>(), uf = u.cast<float>(), vf = v.cast<float>();
    const auto per_metre = static_cast<float>(1 / longest_);
    constexpr auto kSquare = static_cast<float>(kWindow * kWindow);
    window.clear();
    for (const Surfel& o : window.surfels) {
      const Eigen::Vector3f d((o.position[0] - s.position[0]) * per_metre, (o.position[1] - s.position[1]) * per_metre,
                              (o.position[2] - s.position[2]) * per_metre);
      const float square = d.squaredNorm();
      const float facing = o.normal[0] * nf[0] + o.normal[1] * nf[1] + o.normal[2] * nf[2];
      if (!(square < kSquare && facing > kFacing)) continue;
      const float closeness = 1 - square / kSquare;
      // Facing to the third power: a quadric leaves the round side of a thin tube as the normals turn away. Surfels
      // that count in full there make tubes of 1.4 to 4 voxels err by a tenth more.
      const float weight = closeness * closeness * facing * facing * facing * std::abs(o.normal[o.side / 2U]);
      window.add(d.dot(uf), d.dot(vf), d.dot(nf), weight);
    }
    while (window.p.size() % kLanes != 0) window.add(0, 0, 0, 0);
    Eigen::Matrix<double, kTerms, 1> fit;
    if (!solve(window, fit)) return s;
    return moved(s, n, u, v, fit);
  }

  /// Weighted least squares for the height 1, p, q, p², pq, q². The sums are those of weight p^a q^b up to the fourth
  /// degree.
  [[nodiscard]] static bool solve(const Window& window, Eigen::Matrix<double, kTerms, 1>& fit) noexcept {
    constexpr std::size_t kMoments = 15;
    std::array<Lanes, kMoments> moments{};
    std::array<Lanes, kTerms> heights{};
    for (std::size_t n = 0; n < window.p.size(); n += kLanes) {
      // Products by degree: w, wp, wq, wpp, wpq, wqq, ... of the degree before, times p, and the last times q.
      std::array<Lanes, kMoments> product;
      Lanes p, q, height;
      for (std::size_t l = 0; l < kLanes; ++l) {
        p[l] = window.p[n + l];
        q[l] = window.q[n + l];
        height[l] = window.height[n + l];
        product[0][l] = window.weight[n + l];
      }
      for (std::size_t degree = 1, to = 1, from = 0; degree < 5; ++degree) {
        for (std::size_t m = 0; m < degree; ++m, ++to, ++from)
          for (std::size_t l = 0; l < kLanes; ++l) product[to][l] = product[from][l] * p[l];
        for (std::size_t l = 0; l < kLanes; ++l) product[to][l] = product[from - 1][l] * q[l];
        ++to;
      }
      for (std::size_t m = 0; m < kMoments; ++m)
        for (std::size_t l = 0; l < kLanes; ++l) moments[m][l] += product[m][l];
      for (std::size_t t = 0; t < kTerms; ++t)
        for (std::size_t l = 0; l < kLanes; ++l) heights[t][l] += product[t][l] * height[l];
    }
    const auto sum = [](const Lanes& lanes) {
      double all = 0;
      for (const float x : lanes) all += static_cast<double>(x);
      return all;
    };
    constexpr std::array<std::size_t, kTerms> kDegree{0, 1, 1, 2, 2, 2}, kOfQ{0, 0, 1, 0, 1, 2};
    Eigen::Matrix<double, kTerms, kTerms> H;
    Eigen::Matrix<double, kTerms, 1> b;
    std::array<double, kMoments> total{};
    for (std::size_t m = 0; m < kMoments; ++m) total[m] = sum(moments[m]);
    for (std::size_t r = 0; r < kTerms; ++r) {
      const auto row = static_cast<Eigen::Index>(r);
      for (std::size_t c = 0; c <= r; ++c) {
        const std::size_t degree = kDegree[r] + kDegree[c];
        H(row, static_cast<Eigen::Index>(c)) = total[degree * (degree + 1) / 2 + kOfQ[r] + kOfQ[c]];
      }
      b[row] = sum(heights[r]);
      if (r > 0) H(row, row) += r < 3 ? kSlack : kFlat;
    }
    return solve_positive_definite<kTerms>(H, b, fit);
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
