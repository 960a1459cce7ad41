// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/structure/label_surface.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

/// Distances from lattice points to a set of surfels, by descent through a tree of cells.
namespace trephine::inline TREPHINE_ALIGNED::detail {

/// Distance of a point from a set of surfels: an average over the surfels that are about as near as the nearest.
///
/// A surfel's own distance is that of a disc about it. Weights fall from 1 at the nearest to 0 where the squared
/// distance to the surfel's centre exceeds the smallest by `kBlend`² longest spacings. On a plane this is a fixed
/// lateral window.
struct SurfelDistance {
  static constexpr float kBlend = 1.0F;  ///< [longest spacings]
  static constexpr float kDisc = 0.5F;   ///< radius of a surfel's disc [longest spacings] ...
  static constexpr float kNear = 2.0F;   ///< ... up to this distance [longest spacings]; then inverse to the distance
};

/// Surfels that may be nearest to a point of a cell; arrays are padded with points far away.
struct Candidates {
  static constexpr std::size_t kLanes = 8;
  std::vector<float> x, y, z;
  std::vector<std::uint32_t> index;
  std::size_t count = 0;

  void clear() {
    count = 0;
    x.clear(), y.clear(), z.clear(), index.clear();
  }
  void add(float px, float py, float pz, std::uint32_t i) {
    x.push_back(px), y.push_back(py), z.push_back(pz), index.push_back(i);
    ++count;
  }
  void pad() {
    constexpr float kFarAway = 1e6F;  // [m]
    while (x.size() % kLanes != 0) x.push_back(kFarAway), y.push_back(0.0F), z.push_back(0.0F), index.push_back(0);
  }
};

/// The nearest surface to a lattice point.
struct NearestSurfel {
  float distance;  ///< [m], >= 0
  std::uint8_t structure;
};

/// Searches one set of surfels. One per thread: it owns the lists of candidates.
class SurfelSearch {
 public:
  static constexpr int kRoot = 64;  ///< edge of the largest cell [samples]
  static constexpr int kBrick = 8;  ///< edge of the cells that `wanted` and `leaf` are told of
  using Brick = std::array<NearestSurfel, kBrick * kBrick * kBrick>;

  SurfelSearch(std::span<const Surfel> surfels, const Vec3d& spacing) : surfels_(surfels) {
    for (std::size_t a = 0; a < 3; ++a) spacing_[a] = static_cast<float>(spacing[static_cast<Eigen::Index>(a)]);
    const float h = std::max({spacing_[0], spacing_[1], spacing_[2]});
    blend_ = SurfelDistance::kBlend * SurfelDistance::kBlend * h * h;
    disc_ = SurfelDistance::kDisc * h;
    near_ = SurfelDistance::kNear * h;
  }

  /// Computes the distances at the samples of a cell, of `kRoot` samples an edge from `first`, and in `within`.
  ///
  /// `wanted(box, edge, distance)` is asked of each cell, with a lower bound of its samples' distances [m]; where it is
  /// false nothing is computed. `needed(i, j, k)` is asked of each sample of wanted bricks. `leaf(box, brick)` takes a
  /// brick's distances, x fastest, at its offsets from the brick's first sample, which `box.lo` is unless clipped.
  template <class Wanted, class Needed, class Leaf>
  void run(const std::array<int, 3>& first, const LatticeBox& within, const Wanted& wanted, const Needed& needed,
           const Leaf& leaf) {
    if (lists_[0].count == 0) {
      lists_[0].clear();
      for (std::size_t i = 0; i < surfels_.size(); ++i) {
        const auto& p = surfels_[i].position;
        lists_[0].add(p[0], p[1], p[2], static_cast<std::uint32_t>(i));
      }
      lists_[0].pad();
    }
    if (lists_[0].count == 0) return;
    descend(0, kRoot, first, within, wanted, needed, leaf);
  }

 private:
  static constexpr std::size_t kLanes = Candidates::kLanes;
  using Lanes = std::array<float, kLanes>;
  using Float3 = std::array<float, 3>;
  static constexpr std::size_t kCorners = 8;  // of a cell

  template <class Wanted, class Needed, class Leaf>
  void descend(std::size_t level, int edge, const std::array<int, 3>& first, const LatticeBox& within,
               const Wanted& wanted, const Needed& needed, const Leaf& leaf) {
    LatticeBox box;
    Float3 centre, half;
    for (std::size_t a = 0; a < 3; ++a) {
      box.lo[a] = std::max(first[a], within.lo[a]);
      box.hi[a] = std::min(first[a] + edge - 1, within.hi[a]);
      if (box.lo[a] > box.hi[a]) return;
      centre[a] = 0.5F * static_cast<float>(box.lo[a] + box.hi[a]) * spacing_[a];
      half[a] = 0.5F * static_cast<float>(box.hi[a] - box.lo[a]) * spacing_[a];
    }
    const float nearest = cull(lists_[level], centre, half, lists_[level + 1]);
    const float reach = std::sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2]) + disc_;
    if (edge >= kBrick && !wanted(box, edge, nearest - reach)) return;
    if (edge == kLeaf) return evaluate(lists_[level + 1], box, needed);
    const int step = edge / 2;
    for (int child = 0; child < 8; ++child)
      descend(level + 1, step,
              {first[0] + (child & 1) * step, first[1] + (child >> 1 & 1) * step, first[2] + (child >> 2) * step},
              within, wanted, needed, leaf);
    if (edge == kBrick) leaf(box, first, brick_);
  }

  /// A surfel that rules out others: its place from a cell's centre, and the square of its distance from there.
  using Rival = std::array<float, 4>;

  /// Writes to `out` the candidates that may count at a sample of the cell `centre` ± `half`. Returns the distance of
  /// the centre from the nearest.
  ///
  /// The difference of squared distances from two points is linear in position. So b rules out a in the whole cell if
  /// it does at each corner: |a|² - |b|² - 2 sum of half |a - b| >= blend, for a and b from the cell's centre. The
  /// surfel nearest to the centre comes first, and those nearest to the corners judge what it leaves.
  [[nodiscard]] float cull(const Candidates& in, const Float3& centre, const Float3& half, Candidates& out) {
    const Rival middle = nearest_to_centre(in, centre);
    keep(in, centre, half, std::span<const Rival>(&middle, 1), passed_);
    std::array<Rival, kCorners> rivals{};
    const std::size_t count = nearest_to_corners(passed_, centre, half, rivals);
    keep(passed_, centre, half, std::span<const Rival>(rivals).first(count), out);
    return std::sqrt(middle[3]);
  }

  [[nodiscard]] static Rival rival(const Candidates& in, std::size_t n, const Float3& centre) noexcept {
    const float x = in.x[n] - centre[0], y = in.y[n] - centre[1], z = in.z[n] - centre[2];
    return {x, y, z, x * x + y * y + z * z};
  }

  [[nodiscard]] static Rival nearest_to_centre(const Candidates& in, const Float3& centre) noexcept {
    Lanes best;
    std::array<std::uint32_t, kLanes> at{};
    best.fill(std::numeric_limits<float>::max());
    for (std::size_t n = 0; n < in.x.size(); n += kLanes) {
      Lanes x, y, z, square;
      relative(in, n, centre, x, y, z, square);
      for (std::size_t l = 0; l < kLanes; ++l) {
        const bool nearer = square[l] < best[l];
        best[l] = nearer ? square[l] : best[l];
        at[l] = nearer ? static_cast<std::uint32_t>(n) : at[l];
      }
    }
    const auto l = static_cast<std::size_t>(std::min_element(best.begin(), best.end()) - best.begin());
    return rival(in, at[l] + l, centre);
  }

  /// Finds the candidates nearest to the cell's corners, each once, and returns how many.
  [[nodiscard]] static std::size_t nearest_to_corners(const Candidates& in, const Float3& centre, const Float3& half,
                                                      std::array<Rival, kCorners>& rivals) noexcept {
    std::array<Lanes, kCorners> best;
    std::array<std::array<std::uint32_t, kLanes>, kCorners> at{};
    for (Lanes& b : best) b.fill(std::numeric_limits<float>::max());
    for (std::size_t n = 0; n < in.x.size(); n += kLanes) {
      Lanes x, y, z, square;
      relative(in, n, centre, x, y, z, square);
      for (std::size_t c = 0; c < kCorners; ++c) {
        const float ex = (c & 1) != 0 ? -2 * half[0] : 2 * half[0], ey = (c & 2) != 0 ? -2 * half[1] : 2 * half[1],
                    ez = (c & 4) != 0 ? -2 * half[2] : 2 * half[2];
        for (std::size_t l = 0; l < kLanes; ++l) {
          const float d = square[l] + ex * x[l] + ey * y[l] + ez * z[l];
          const bool nearer = d < best[c][l];
          best[c][l] = nearer ? d : best[c][l];
          at[c][l] = nearer ? static_cast<std::uint32_t>(n) : at[c][l];
        }
      }
    }
    std::size_t count = 0;
    for (std::size_t c = 0; c < kCorners; ++c) {
      const auto l = static_cast<std::size_t>(std::min_element(best[c].begin(), best[c].end()) - best[c].begin());
      const Rival r = rival(in, at[c][l] + l, centre);
      const auto end = rivals.begin() + static_cast<std::ptrdiff_t>(count);
      if (std::find(rivals.begin(), end, r) == end) rivals[count++] = r;
    }
    return count;
  }

  /// Writes to `out` the candidates that no rival rules out.
  void keep(const Candidates& in, const Float3& centre, const Float3& half, std::span<const Rival> rivals,
            Candidates& out) const {
    out.clear();
    for (std::size_t n = 0; n < in.x.size(); n += kLanes) {
      Lanes x, y, z, square, ruled_out;
      relative(in, n, centre, x, y, z, square);
      ruled_out.fill(-1.0F);
      for (const Rival& r : rivals) {
        for (std::size_t l = 0; l < kLanes; ++l) {
          const float across =
              half[0] * std::abs(x[l] - r[0]) + half[1] * std::abs(y[l] - r[1]) + half[2] * std::abs(z[l] - r[2]);
          const float by = square[l] - r[3] - 2 * across;
          ruled_out[l] = ruled_out[l] > by ? ruled_out[l] : by;
        }
      }
      for (std::size_t l = 0; l < kLanes; ++l)
        if (ruled_out[l] < blend_) out.add(in.x[n + l], in.y[n + l], in.z[n + l], in.index[n + l]);
    }
    out.pad();
  }

  static void relative(const Candidates& in, std::size_t n, const Float3& centre, Lanes& x, Lanes& y, Lanes& z,
                       Lanes& square) noexcept {
    for (std::size_t l = 0; l < kLanes; ++l) {
      x[l] = in.x[n + l] - centre[0];
      y[l] = in.y[n + l] - centre[1];
      z[l] = in.z[n + l] - centre[2];
      square[l] = x[l] * x[l] + y[l] * y[l] + z[l] * z[l];
    }
  }

  template <class Needed>
  void evaluate(const Candidates& in, const LatticeBox& box, const Needed& needed) {
    squares_.resize(in.x.size());
    for (int k = box.lo[2]; k <= box.hi[2]; ++k)
      for (int j = box.lo[1]; j <= box.hi[1]; ++j)
        for (int i = box.lo[0]; i <= box.hi[0]; ++i) {
          if (!needed(i, j, k)) continue;
          const Float3 p{static_cast<float>(i) * spacing_[0], static_cast<float>(j) * spacing_[1],
                         static_cast<float>(k) * spacing_[2]};
          brick_[brick_offset(i, j, k)] = distance(in, p);
        }
  }

 public:
  /// Offset of a sample in its brick; bricks start at multiples of `kBrick`.
  [[nodiscard]] static constexpr std::size_t brick_offset(int i, int j, int k) noexcept {
    return static_cast<std::size_t>((i & (kBrick - 1)) + kBrick * ((j & (kBrick - 1)) + kBrick * (k & (kBrick - 1))));
  }

 private:
  [[nodiscard]] NearestSurfel distance(const Candidates& in, const Float3& p) noexcept {
    Lanes least;
    least.fill(std::numeric_limits<float>::max());
    for (std::size_t n = 0; n < in.x.size(); n += kLanes) {
      Lanes x, y, z, square;
      relative(in, n, p, x, y, z, square);
      for (std::size_t l = 0; l < kLanes; ++l) {
        squares_[n + l] = square[l];
        least[l] = square[l] < least[l] ? square[l] : least[l];
      }
    }
    const float smallest = *std::min_element(least.begin(), least.end());
    const float limit = smallest + blend_;
    const float disc = disc_ * near_ / std::max(std::sqrt(smallest), near_);
    const Surfel* nearest = nullptr;
    for (std::size_t n = 0; n < in.count && nearest == nullptr; ++n)
      if (squares_[n] == smallest) nearest = &surfels_[in.index[n]];
    float sum = 0, weights = 0;
    for (std::size_t n = 0; n < in.count; ++n) {
      if (!(squares_[n] < limit)) continue;
      const Surfel& s = surfels_[in.index[n]];
      if (s.structure != nearest->structure) continue;
      const auto& m = s.normal;
      const float height =
          (p[0] - s.position[0]) * m[0] + (p[1] - s.position[1]) * m[1] + (p[2] - s.position[2]) * m[2];
      const float lateral = std::sqrt(std::max(squares_[n] - height * height, 0.0F)) - disc;
      const float own = lateral > 0 ? std::sqrt(height * height + lateral * lateral) : std::abs(height);
      const float part = 1 - (squares_[n] - smallest) / blend_, weight = part * part;
      sum += weight * own;
      weights += weight;
    }
    return {sum / weights, nearest->structure};
  }

  static constexpr int kLeaf = 4;            // edge of the smallest cell [samples]
  static constexpr std::size_t kLevels = 6;  // 64, 32, 16, 8, 4 and the root's own

  std::span<const Surfel> surfels_;
  Float3 spacing_{};
  float blend_ = 0, disc_ = 0, near_ = 0;
  std::array<Candidates, kLevels> lists_;
  Candidates passed_;
  std::vector<float> squares_;
  Brick brick_{};
};

}  // namespace trephine::detail
