// SPDX-License-Identifier: MIT
#pragma once

#include "chai3d_device.hpp"

#include <trephine/voxel/grid_reader.hpp>

#include <materials/CTexture3d.h>
#include <world/CVoxelObject.h>
#include <world/CWorld.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <utility>

namespace chai3d_host {

/// Grey level of a density in an 8-bit image: the isovalue is in the middle, and densities that are farther from it
/// than `range` are black or white.
struct Grey {
  double isovalue = 300, range = 1300;
  static constexpr float kSurface = 0.5F;  ///< isovalue of the image for CHAI3D's shaders, from 0 to 1
  template <class Density>
  [[nodiscard]] unsigned char operator()(Density density) const {
    const double level = 127.5 * (1 + (static_cast<double>(density) - isovalue) / range);
    return static_cast<unsigned char>(std::lround(std::clamp(level, 0.0, 255.0)));
  }
};

/// A bone in a world of CHAI3D: a volume whose image and texture follow the cuts, brick by brick. Use it in the drawing
/// thread; the haptic thread never waits for it. The bone must outlive it.
template <class Density>
class DrawnBone {
 public:
  using Index = std::array<int, 3>;

  DrawnBone(chai3d::cWorld& world, const trephine::VoxelGrid<Density>& bone, const Grey& grey)
      : reader_(bone), grey_(grey), size_(bone.size()), image_(chai3d::cMultiImage::create()) {
    const auto n = [&](std::size_t axis) { return static_cast<unsigned int>(size_[axis]); };
    if (!image_->allocate(n(0), n(1), n(2), GL_LUMINANCE)) throw std::runtime_error("CHAI3D cannot make the image");
    texture_->setImage(image_);
    object_ = new chai3d::cVoxelObject;  // the world deletes it
    world.addChild(object_);
    // trephine's voxel (0, 0, 0) is a sample at G's origin; a texture's first voxel ends half a voxel before its
    // centre.
    const trephine::Vec3d half = bone.spacing() / 2, voxels(size_[0], size_[1], size_[2]);
    object_->m_minCorner = to_chai3d(trephine::Vec3d(-half));
    object_->m_maxCorner = to_chai3d(trephine::Vec3d(bone.spacing().cwiseProduct(voxels) - half));
    object_->setLocalPos(to_chai3d(trephine::Vec3d(bone.X_WG().translation())));
    object_->setLocalRot(to_chai3d(trephine::Mat3d(bone.X_WG().linear())));
    object_->setTexture(texture_);
    object_->setIsosurfaceValue(Grey::kSurface);
    object_->setRenderingModeIsosurfaceMaterial();
    object_->setHapticEnabled(false);  // else CHAI3D's tools feel it too
    update();
    changed_voxels_ = 0;
  }

  /// Copies the bricks that changed since the last call and marks their region for the graphics card. Returns their
  /// number.
  std::size_t update() {
    // A region replaces the one before it, which may still wait: for a picture, or for the volume to be visible.
    if (!texture_->waits()) first_ = {kNone, kNone, kNone}, last_ = {-1, -1, -1};
    const std::size_t bricks = reader_.poll([&](std::size_t brick) { copy(brick); });
    if (bricks > 0 && last_[0] >= 0) texture_->markForPartialUpdate(corner(first_), corner(last_));
    return bricks;
  }

  /// Voxels that `update` has changed since construction; one that was cut twice counts twice.
  [[nodiscard]] std::size_t changed_voxels() const { return changed_voxels_; }

  /// Voxels of CHAI3D's image that are not the bone's. Exact while nobody cuts.
  [[nodiscard]] std::size_t differences() const {
    std::size_t count = 0;
    chai3d::cColorb found;
    for_each({0, 0, 0}, size_, [&](int x, int y, int z) {
      image_->getVoxelColor(unsigned(x), unsigned(y), unsigned(z), found);
      count += found.getR() != grey_(reader_.voxel(x, y, z));
    });
    return count;
  }

  /// First and last voxel of the region that waits for the graphics card; the last is -1 if none does.
  [[nodiscard]] std::pair<Index, Index> marked() const { return {first_, last_}; }

  [[nodiscard]] chai3d::cVoxelObject& object() { return *object_; }
  [[nodiscard]] const chai3d::cMultiImage& image() const { return *image_; }
  [[nodiscard]] chai3d::cTexture3d& texture() { return *texture_; }

 private:
  static constexpr int kNone = 1 << 30;

  struct Texture : chai3d::cTexture3d {
    /// True until a picture has taken what was marked.
    [[nodiscard]] bool waits() const { return m_updateTextureFlag; }
  };

  static chai3d::cVector3d corner(const Index& i) { return to_chai3d(trephine::Vec3d(i[0], i[1], i[2])); }

  template <class Visit>
  static void for_each(const Index& from, const Index& to, Visit&& visit) {
    for (int z = from[2]; z < to[2]; ++z)
      for (int y = from[1]; y < to[1]; ++y)
        for (int x = from[0]; x < to[0]; ++x) visit(x, y, z);
  }

  void copy(std::size_t brick) {
    constexpr int kBrick = trephine::GridReader<Density>::kBrick;
    Index from = reader_.brick_coordinates(brick), to;
    for (std::size_t a = 0; a < 3; ++a) to[a] = std::min(kBrick * (from[a] + 1), size_[a]), from[a] *= kBrick;
    for_each(from, to, [&](int x, int y, int z) {
      const Index at{x, y, z};
      const unsigned char level = grey_(reader_.voxel(x, y, z));
      unsigned char& drawn = *image_->getVoxelData(unsigned(x), unsigned(y), unsigned(z));
      if (drawn == level) return;
      drawn = level;
      ++changed_voxels_;
      for (std::size_t a = 0; a < 3; ++a) first_[a] = std::min(first_[a], at[a]), last_[a] = std::max(last_[a], at[a]);
    });
  }

  trephine::GridReader<Density> reader_;
  Grey grey_;
  Index size_, first_{kNone, kNone, kNone}, last_{-1, -1, -1};
  chai3d::cMultiImagePtr image_;
  std::shared_ptr<Texture> texture_ = std::make_shared<Texture>();
  chai3d::cVoxelObject* object_ = nullptr;
  std::size_t changed_voxels_ = 0;
};

}  // namespace chai3d_host
