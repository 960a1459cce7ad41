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
  /// Uploads everything. Throws std::runtime_error where the card takes no texture of that size.
  explicit StructureTexture(const GuardedBone& guarded);

  /// Takes what the burr left since the last call; `X_SW` maps its way. Returns true if a structure changed.
  bool update(BurrPath& path, const trephine::Posed& X_SW);
  void begin_stroke() { left_.begin_stroke(); }
  void undo() { upload(left_.undo()); }
  void restore() { upload(left_.restore()); }

  /// Binds the textures to the units 4 (distances), 5 (the nearest structure's number) and 6 (colours, by number).
  void bind() const;

  [[nodiscard]] const LeftStructures& left() const { return left_; }
  [[nodiscard]] const trephine::Posed& X_GS() const { return X_GS_; }
  [[nodiscard]] double margin() const { return margin_; }  ///< [m]
  /// Texture memory [bytes].
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  void upload(const trephine::VoxelBox& box);

  LeftStructures left_;
  trephine::Posed X_GS_;
  double margin_;
  std::size_t bytes_ = 0;
  gl::Texture distances_, numbers_, colours_;
};

}  // namespace live
