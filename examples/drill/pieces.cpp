// SPDX-License-Identifier: MIT
#include "pieces.hpp"

#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace drill {
namespace {

/// Labels of a volume, x fastest; 0 is air.
class Labels {
 public:
  explicit Labels(const trephine::VoxelGrid<std::int16_t>& grid, double isovalue) : n_(grid.size()) {
    std::vector<std::int16_t> voxels(static_cast<std::size_t>(n_[0]) * static_cast<std::size_t>(n_[1]) *
                                     static_cast<std::size_t>(n_[2]));
    grid.copy_voxels(voxels);
    labels_.resize(voxels.size());
    for (std::size_t i = 0; i < voxels.size(); ++i) labels_[i] = voxels[i] >= isovalue ? kUnknown : 0;
    for (std::size_t i = 0; i < labels_.size(); ++i)
      if (labels_[i] == kUnknown) sizes_.push_back(fill(i, static_cast<int>(sizes_.size()) + 1));
  }

  [[nodiscard]] const std::vector<std::size_t>& sizes() const noexcept { return sizes_; }
  [[nodiscard]] int operator[](std::size_t i) const noexcept { return labels_[i]; }

 private:
  static constexpr int kUnknown = -1;

  std::size_t fill(std::size_t seed, int label) {
    const std::array<std::size_t, 3> stride{1, static_cast<std::size_t>(n_[0]),
                                            static_cast<std::size_t>(n_[0]) * static_cast<std::size_t>(n_[1])};
    std::size_t count = 0;
    std::vector<std::size_t> open{seed};
    labels_[seed] = label;
    while (!open.empty()) {
      const std::size_t at = open.back();
      open.pop_back();
      ++count;
      for (std::size_t a = 0; a < 3; ++a) {
        const auto place = static_cast<int>(at / stride[a] % static_cast<std::size_t>(n_[a]));
        const auto visit = [&](bool possible, std::size_t to) {
          if (!possible || labels_[to] != kUnknown) return;
          labels_[to] = label;
          open.push_back(to);
        };
        visit(place > 0, at - stride[a]);
        visit(place + 1 < n_[a], at + stride[a]);
      }
    }
    return count;
  }

  std::array<int, 3> n_;
  std::vector<int> labels_;
  std::vector<std::size_t> sizes_;
};

}  // namespace

Pieces keep_largest_piece(trephine::VoxelGrid<std::int16_t>& grid, double isovalue) {
  const Labels labels(grid, isovalue);
  const auto& sizes = labels.sizes();
  if (sizes.size() < 2) return {};
  std::size_t largest = 0;
  Pieces pieces{.removed = sizes.size() - 1, .removed_voxels = 0};
  for (std::size_t l = 0; l < sizes.size(); ++l) {
    if (sizes[l] > sizes[largest]) largest = l;
    pieces.removed_voxels += sizes[l];
  }
  pieces.removed_voxels -= sizes[largest];

  const auto& n = grid.size();
  std::vector<std::int16_t> voxels(static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) *
                                   static_cast<std::size_t>(n[2]));
  grid.copy_voxels(voxels);
  const auto below = static_cast<std::int16_t>(std::ceil(isovalue) - 1);
  for (std::size_t i = 0; i < voxels.size(); ++i)
    if (labels[i] != 0 && labels[i] != static_cast<int>(largest) + 1) voxels[i] = below;
  grid = {{.size = n, .spacing = grid.spacing(), .X_WG = grid.X_WG(), .outside = static_cast<double>(grid.outside())},
          std::span<const std::int16_t>(voxels)};
  return pieces;
}

}  // namespace drill
