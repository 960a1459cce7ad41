// SPDX-License-Identifier: MIT
#pragma once

#include "burr_path.hpp"

#include <trephine/structure/structure_field.hpp>
#include <trephine/voxel/grid_geometry.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

namespace live {

using trephine::Vec3d;

/// Signed distances to structures and to what a burr left of them, on a grid for pictures: a field's nearest distances,
/// and the same with the burr's way taken out. The latter are lower bounds outside. No OpenGL. Window thread.
class LeftStructures {
 public:
  /// A sample [quanta].
  struct Sample {
    std::int16_t left, whole;
  };
  static constexpr double kMaxSamples = 32e6;  ///< 160 MB here and on the card
  static constexpr std::size_t kMaxStrokes = 32;

  /// Samples the field at the labels' voxels in `box` and `around` [m] it, or at every second, third ... where those
  /// are too many.
  LeftStructures(const trephine::StructureField& field, const trephine::VoxelBox& box, double around)
      : quantum_(field.quantum()) {
    for (int stride = 1;; ++stride) {
      double samples = 1;
      spacing_ = stride * field.spacing();
      for (std::size_t a = 0; a < 3; ++a) {
        const auto axis = static_cast<Eigen::Index>(a);
        const double h = field.spacing()[axis];
        const double first = box.lo[a] - std::ceil(around / h) - 1, last = box.hi[a] + std::ceil(around / h) + 1;
        first_S_[axis] = h * first;
        size_[a] = static_cast<int>(std::ceil((last - first) / stride)) + 1;
        samples *= size_[a];
      }
      if (samples <= kMaxSamples) break;
    }
    const auto count =
        static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1]) * static_cast<std::size_t>(size_[2]);
    samples_.reserve(count);
    numbers_.reserve(count);
    for (int k = 0; k < size_[2]; ++k)
      for (int j = 0; j < size_[1]; ++j)
        for (int i = 0; i < size_[0]; ++i) {
          const auto [distance, structure] = field.nearest(sample_S(i, j, k));
          samples_.push_back({quanta(distance), quanta(distance)});
          numbers_.push_back(static_cast<std::uint8_t>(std::max(structure, 0)));
        }
  }

  [[nodiscard]] const std::array<int, 3>& size() const { return size_; }
  [[nodiscard]] const Vec3d& spacing() const { return spacing_; }
  [[nodiscard]] const Vec3d& first_S() const { return first_S_; }  ///< place of the first sample
  [[nodiscard]] double quantum() const { return quantum_; }        ///< [m]
  /// All samples, x fastest.
  [[nodiscard]] const std::vector<Sample>& samples() const { return samples_; }
  /// The structure nearest to each sample.
  [[nodiscard]] const std::vector<std::uint8_t>& numbers() const { return numbers_; }

  /// A stroke begins: what is left now can be had back.
  void begin_stroke() {
    if (strokes_.size() == kMaxStrokes) strokes_.erase(strokes_.begin());
    strokes_.emplace_back();
  }
  /// Takes out a piece of the burr's way, in S. Returns the box of changed samples; it is empty (lo > hi) for none.
  trephine::VoxelBox take(const BurrPiece& piece_S) {
    trephine::VoxelBox box, changed = nothing();
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      // Samples around the ball count too, for the slope on its surface.
      const double reach = piece_S.radius + 2 * spacing_.maxCoeff();
      const double lo = (std::min(piece_S.from[axis], piece_S.to[axis]) - reach - first_S_[axis]) / spacing_[axis];
      const double hi = (std::max(piece_S.from[axis], piece_S.to[axis]) + reach - first_S_[axis]) / spacing_[axis];
      box.lo[a] = static_cast<int>(std::ceil(std::clamp(lo, 0.0, static_cast<double>(size_[a]))));
      box.hi[a] = static_cast<int>(std::floor(std::clamp(hi, -1.0, size_[a] - 1.0)));
    }
    const Vec3d way = piece_S.to - piece_S.from;
    const double square = std::max(way.squaredNorm(), 1e-18);
    for (int k = box.lo[2]; k <= box.hi[2]; ++k)
      for (int j = box.lo[1]; j <= box.hi[1]; ++j)
        for (int i = box.lo[0]; i <= box.hi[0]; ++i) {
          const Vec3d p = sample_S(i, j, k) - piece_S.from;
          const double apart = (p - std::clamp(p.dot(way) / square, 0.0, 1.0) * way).norm();
          const std::int16_t cleared = quanta(piece_S.radius - apart);
          const std::size_t at = index(i, j, k);
          if (cleared <= samples_[at].left) continue;
          if (!strokes_.empty()) strokes_.back().try_emplace(at, samples_[at].left);
          samples_[at].left = cleared;
          include(changed, i, j, k);
        }
    return changed;
  }
  /// Takes out all of the burr's way since the last call; `X_SW` maps it. Returns the box of changed samples.
  trephine::VoxelBox take(BurrPath& path, const trephine::Posed& X_SW) {
    trephine::VoxelBox changed = nothing();
    path.take([&](const BurrPiece& piece) {
      const trephine::VoxelBox box = take({X_SW * piece.from, X_SW * piece.to, piece.radius});
      if (box.hi[0] < box.lo[0]) return;
      include(changed, box.lo[0], box.lo[1], box.lo[2]);
      include(changed, box.hi[0], box.hi[1], box.hi[2]);
    });
    return changed;
  }
  /// Puts back what the last stroke took. Returns the box of changed samples.
  trephine::VoxelBox undo() {
    trephine::VoxelBox changed = nothing();
    if (strokes_.empty()) return changed;
    for (const auto& [at, distance] : strokes_.back()) {
      samples_[at].left = distance;
      const auto n = static_cast<int>(at);
      include(changed, n % size_[0], n / size_[0] % size_[1], n / (size_[0] * size_[1]));
    }
    strokes_.pop_back();
    return changed;
  }
  /// All is whole again, and nothing can be undone.
  trephine::VoxelBox restore() {
    strokes_.clear();
    for (Sample& s : samples_) s.left = s.whole;
    return {{0, 0, 0}, {size_[0] - 1, size_[1] - 1, size_[2] - 1}};
  }

  [[nodiscard]] static trephine::VoxelBox nothing() { return {{1 << 30, 1 << 30, 1 << 30}, {-1, -1, -1}}; }
  static void include(trephine::VoxelBox& box, int i, int j, int k) {
    const std::array<int, 3> at{i, j, k};
    for (std::size_t a = 0; a < 3; ++a) {
      box.lo[a] = std::min(box.lo[a], at[a]);
      box.hi[a] = std::max(box.hi[a], at[a]);
    }
  }

 private:
  [[nodiscard]] Vec3d sample_S(int i, int j, int k) const { return first_S_ + spacing_.cwiseProduct(Vec3d(i, j, k)); }
  [[nodiscard]] std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(size_[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(size_[0]) +
           static_cast<std::size_t>(i);
  }
  [[nodiscard]] std::int16_t quanta(double distance) const {
    return static_cast<std::int16_t>(std::lround(std::clamp(distance / quantum_, -32767.0, 32767.0)));
  }

  double quantum_;
  std::array<int, 3> size_{};
  Vec3d spacing_ = Vec3d::Zero(), first_S_ = Vec3d::Zero();
  std::vector<Sample> samples_;
  std::vector<std::uint8_t> numbers_;
  std::vector<std::unordered_map<std::size_t, std::int16_t>> strokes_;  // samples as they were before
};

}  // namespace live
