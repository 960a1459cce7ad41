// SPDX-License-Identifier: MIT
#pragma once

#include "../drill/bone.hpp"

#include <trephine/voxel/grid_reader.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

namespace live {

using trephine::Vec3d;
using Reader = trephine::GridReader<std::int16_t>;
/// A brick's 8³ own voxels, x fastest.
using Brick = std::array<std::int16_t, std::size_t{8} * 8 * 8>;
/// Contents of all bricks that differ from the bone as loaded.
using BoneState = std::map<std::size_t, Brick>;

/// The bone as a stroke found it.
struct PastBone {
  BoneState bricks;
  double removed_mm3 = 0;  ///< by then
};

/// Remembers the bone at the start of each stroke, so that strokes can be undone. It keeps changed bricks only, 1 kB
/// each. Window thread.
class Strokes {
 public:
  static constexpr std::size_t kMax = 32;  ///< strokes remembered; older ones are forgotten

  /// Takes the present content of a changed brick, with its halo.
  void changed(std::size_t brick, std::span<const std::int16_t, std::size_t{10} * 10 * 10> haloed) {
    Brick& own = now_[brick];
    std::size_t to = 0;
    for (std::size_t k = 1; k <= 8; ++k)
      for (std::size_t j = 1; j <= 8; ++j)
        for (std::size_t i = 1; i <= 8; ++i) own[to++] = haloed[(k * 10 + j) * 10 + i];
  }
  /// A stroke begins: the bone as it is now can be had back, with the volume removed so far.
  void begin(double removed_mm3) {
    if (past_.size() == kMax) past_.erase(past_.begin());
    past_.push_back({now_, removed_mm3});
  }
  [[nodiscard]] bool empty() const { return past_.empty(); }
  /// Takes the state before the last stroke off the list.
  [[nodiscard]] PastBone take_last() {
    PastBone last = std::move(past_.back());
    past_.pop_back();
    return last;
  }
  /// The bone is whole again and nothing can be undone.
  void clear() {
    now_.clear();
    past_.clear();
  }

 private:
  BoneState now_;
  std::vector<PastBone> past_;
};

/// Puts the bone back to `state`: the originals first, then what had been removed by then. Haptic thread, between
/// ticks.
inline void set_bone(drill::Grid& bone, const BoneState& state) {
  bone.restore();
  const auto& n = bone.size();
  for (const auto& [b, content] : state) {
    const auto at = bone.brick_coordinates(b);
    for (int k = 0; k < 8; ++k)
      for (int j = 0; j < 8; ++j) {
        const int x = 8 * at[0], y = 8 * at[1] + j, z = 8 * at[2] + k;
        if (x >= n[0] || y >= n[1] || z >= n[2]) continue;
        const std::int16_t* const row = content.data() + (k * 8 + j) * 8;
        bone.lower_row(y, z, x, std::min(x + 7, n[0] - 1),
                       [row, x](int i, std::int16_t) { return row[static_cast<std::size_t>(i - x)]; });
      }
  }
  bone.commit();
}

}  // namespace live
