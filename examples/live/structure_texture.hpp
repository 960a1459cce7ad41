// SPDX-License-Identifier: MIT
#pragma once

#include "gl.hpp"
#include "guarded_bone.hpp"
#include "left_structures.hpp"

#include <cstddef>

namespace live {

/// Structures on the graphics card: distances to what the burr left of them and to the whole, the nearest structure,
/// and colours. Five bytes a sample.
class StructureTexture {
 public:
  /// Uploads everything. Throws std::runtime_error where the card takes no texture of that size. `left` must outlive
  /// it.
  StructureTexture(const GuardedBone& guarded, const LeftStructures& left);

  /// Uploads the samples in a box, which may be empty (lo > hi).
  void update(const trephine::VoxelBox& box);

  /// Binds the textures to the units 4 (distances), 5 (the nearest structure's number) and 6 (colours, by number).
  void bind() const;

  [[nodiscard]] const LeftStructures& left() const { return left_; }
  [[nodiscard]] const trephine::Posed& X_GS() const { return X_GS_; }
  [[nodiscard]] double margin() const { return margin_; }  ///< [m]
  /// Texture memory [bytes].
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  const LeftStructures& left_;
  trephine::Posed X_GS_;
  double margin_;
  std::size_t bytes_ = 0;
  gl::Texture distances_, numbers_, colours_;
};

}  // namespace live
