// SPDX-License-Identifier: MIT
#pragma once

#include "brick_summary.hpp"
#include "gl.hpp"
#include "strokes.hpp"

#include <cstddef>
#include <vector>

namespace live {

/// A brick's voxels with their halo, as `GridReader::copy_brick` leaves them.
using Haloed = std::array<std::int16_t, std::size_t{10} * 10 * 10>;

/// The bone on the graphics card: densities, empty space and shares of bone as 3-D textures, of which changed bricks
/// are written anew. It reads the grid through a `GridReader`, beside the haptic thread. A brick costs 1.2 kB of
/// transfer. It holds nothing that the grid does not: a lost context is made good by another one.
class BoneTexture {
 public:
  /// Uploads everything as it is now. Throws std::runtime_error where the card takes no texture of that size.
  BoneTexture(const drill::Grid& bone, double isovalue);

  /// Uploads a brick that changed.
  void update(std::size_t brick, const Haloed& haloed);

  /// Binds the textures to the units 0 (densities), 1 (empty space) and 2 (shares of bone; shares cut).
  void bind() const;

  [[nodiscard]] double isovalue() const { return isovalue_; }
  /// Returns the greatest density above the isovalue.
  [[nodiscard]] double densest() const { return densest_; }
  [[nodiscard]] const std::array<int, 3>& size() const { return reader_.size(); }
  [[nodiscard]] Vec3d spacing() const { return reader_.spacing(); }
  [[nodiscard]] const std::array<int, 3>& bricks() const { return bricks_; }
  /// Texture memory [bytes].
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  Reader reader_;
  double isovalue_;
  double densest_;
  double soft_;  // densities over which a voxel turns to bone, for shares
  std::array<int, 3> bricks_;
  std::vector<BrickShares> whole_;  // shares of the bone as loaded
  EmptySpace empty_;
  std::size_t bytes_ = 0;
  gl::Texture densities_, distances_, shares_;
};

}  // namespace live
