// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/density_field.hpp>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace drill {

using Vec3f = trephine::Vec3<float>;

struct Ray {
  Vec3f origin;
  Vec3f direction;  ///< unit
};

/// The bone as a picture sees it: the surface of the trilinear density, which is also what the tool feels, with smooth
/// normals and a measure of how open each place is. A view of a grid that nobody carves meanwhile; any thread. G,
/// metres.
class PicturedBone {
 public:
  PicturedBone(const trephine::VoxelGrid<std::int16_t>& bone, double isovalue);

  /// Density above the isovalue; >= 0 is bone.
  [[nodiscard]] float above(const Vec3f& p) const noexcept { return field_.value(p); }
  /// First place on the ray in [from, to] that is bone; `from` itself where that is bone already. Bone thinner than
  /// `step` voxels along the ray may be missed.
  [[nodiscard]] std::optional<float> hit(const Ray& ray, float from, float to, float step = 0.5F) const noexcept;
  /// Outward unit normal of the cubic B-spline over the voxels: smoother than the surface is. Averaged over a distance
  /// `spread` [m] to each side where that is > 0, so that single slices do not show from afar.
  [[nodiscard]] Vec3f normal(const Vec3f& p, float spread = 0) const noexcept;
  /// How much of the sky above the surface at p with normal n is free of bone, 0..1, from blurred occupancies at three
  /// distances: soft, and the same from every side.
  [[nodiscard]] float openness(const Vec3f& p, const Vec3f& n) const noexcept;

  [[nodiscard]] float voxel() const noexcept { return field_.voxel(); }
  /// Largest density above the isovalue.
  [[nodiscard]] float most_above() const noexcept { return most_above_; }
  [[nodiscard]] Vec3f lo() const noexcept { return -spacing_; }
  [[nodiscard]] Vec3f hi() const noexcept { return hi_; }
  [[nodiscard]] const trephine::VoxelGrid<std::int16_t>& grid() const noexcept { return field_.grid(); }

 private:
  /// Share of bone around each pair of voxels, blurred.
  struct Blurred {
    float distance;  ///< standard deviation of the blur [m]
    std::vector<float> share;
  };
  void find_occupied(double isovalue);
  void blur(double isovalue);
  [[nodiscard]] float first_bone(const Ray& ray, float outside, float inside) const noexcept;
  [[nodiscard]] Vec3f gradient(const Vec3f& p) const noexcept;
  [[nodiscard]] float share_at(const Blurred& blurred, const Vec3f& p) const noexcept;

  static constexpr int kBlock = 4;  // cells a side
  trephine::DensityField<std::int16_t, float> field_;
  Vec3f spacing_;
  Vec3f hi_;
  float most_above_;
  // What holds no bone at its corners holds none at all, and rays skip it.
  std::array<int, 3> cells_{};
  std::array<int, 3> blocks_{};
  std::vector<std::uint8_t> cell_holds_bone_;
  std::vector<std::uint8_t> block_holds_bone_;
  std::array<int, 3> half_{};  // size of the blurred arrays
  std::vector<Blurred> blurred_;
};

}  // namespace drill
