// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/bit_cast.hpp>
#include <trephine/core/file_bytes.hpp>
#include <trephine/core/finite.hpp>
#include <trephine/core/tolerances.hpp>
#include <trephine/session/followed_bone.hpp>
#include <trephine/session/rice_code.hpp>
#include <trephine/session/tick_bytes.hpp>
#include <trephine/stage/motion.hpp>
#include <trephine/voxel/brick_layout.hpp>
#include <trephine/voxel/density_type.hpp>
#include <trephine/voxel/grid_checks.hpp>
#include <trephine/voxel/grid_reader.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

/// Records of the bone in the file of a SessionLog. The bone: 3 sizes as int32, 3 spacings as double [m], 12 doubles of
/// X_WG as of X_WT in a tick, the outside density as double, the isovalue as double or NaN, its hash as uint64, its
/// type (`DensityType`) as a byte. A brick: its index as uint32; then in Rice's codes (`rice_code.hpp`) how many voxels
/// changed, and for each how many are skipped since the one before and the difference of its density's bits from those
/// of the one before, sign in the lowest bit. The three kinds of numbers have a code each, and each brick begins anew.
namespace trephine::inline TREPHINE_ALIGNED::session_detail {

inline constexpr std::size_t kBoneBytes = 3 * 4 + (3 + 12 + 2) * 8 + 8 + 1;

inline void put_bone(std::string& bytes, const FollowedBone& bone) {
  for (const int n : bone.geometry.size) append_number(bytes, static_cast<std::int32_t>(n));
  for (int a = 0; a < 3; ++a) append_number(bytes, bone.geometry.spacing[a]);
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 3; ++row) append_number(bytes, bone.geometry.X_WG.matrix()(row, column));
  append_number(bytes, bone.geometry.outside.value_or(0));
  append_number(bytes, bone.isovalue.value_or(std::numeric_limits<double>::quiet_NaN()));
  append_number(bytes, bone.hash);
  append_number(bytes, static_cast<std::uint8_t>(bone.density));
}

/// True for a geometry that a grid can have: what is read of its voxels then stays in range.
[[nodiscard]] inline bool is_grid(const GridGeometry& g) noexcept {
  std::int64_t voxels = 1;
  for (const int n : g.size) {
    if (n < 1 || n > kMaxGridSize) return false;
    voxels *= n;
    if (voxels > std::numeric_limits<std::int32_t>::max()) return false;
  }
  for (int a = 0; a < 3; ++a)
    if (!(g.spacing[a] >= kMinGridSpacing && g.spacing[a] <= kLargestSpacing)) return false;
  return is_usable_pose(g.X_WG) && is_finite(g.outside.value_or(0));
}

/// Takes a bone from the front of `in`. Returns none if it is too short or no grid could be so.
[[nodiscard]] inline std::optional<FollowedBone> take_bone(std::string_view& in) {
  if (in.size() < kBoneBytes) return std::nullopt;
  recording_detail::Cursor cursor(in.data());
  in.remove_prefix(kBoneBytes);
  FollowedBone bone;
  for (int& n : bone.geometry.size) n = cursor.take<std::int32_t>();
  cursor.take(bone.geometry.spacing);
  for (int column = 0; column < 3; ++column) cursor.take(bone.geometry.X_WG.linear().col(column));
  cursor.take(bone.geometry.X_WG.translation());
  bone.geometry.outside = cursor.take<double>();
  const double isovalue = cursor.take<double>();
  if (!is_nan(isovalue)) bone.isovalue = isovalue;
  bone.hash = cursor.take<std::uint64_t>();
  const auto type = cursor.take<std::uint8_t>();
  if (type > static_cast<std::uint8_t>(DensityType::kFloat) || !is_grid(bone.geometry)) return std::nullopt;
  bone.density = static_cast<DensityType>(type);
  return bone;
}

/// The bits of a density as a word, and back.
template <VoxelDensity Density>
using DensityBits = std::conditional_t<sizeof(Density) == 1, std::uint8_t,
                                       std::conditional_t<sizeof(Density) == 2, std::uint16_t, std::uint32_t>>;

/// The codes of a brick's record.
struct BrickCodes {
  RiceCode count, skipped, densities;
};

/// [bytes] of a brick whose numbers all take a code's longest: 14 bits and those of the number.
inline constexpr std::size_t kLargestBrick = 4 + (14 + 10 + BrickLayout::kVoxels * (14 + 9 + 14 + 33)) / 8 + 1;

/// Appends a brick with the voxels that changed: their numbers, rising, and new densities.
template <VoxelDensity Density>
void put_brick(std::string& bytes, std::size_t brick, std::span<const std::pair<int, Density>> changed) {
  append_number(bytes, static_cast<std::uint32_t>(brick));
  BitWriter bits(bytes);
  BrickCodes codes;
  codes.count.put(bits, changed.size());
  int next = 0;
  DensityBits<Density> before = 0;
  for (const auto& [number, density] : changed) {
    codes.skipped.put(bits, static_cast<std::uint64_t>(number - next));
    const auto word = detail::bit_cast<DensityBits<Density>>(density);
    codes.densities.put(bits, folded(std::uint64_t{word} - std::uint64_t{before}));
    next = number + 1;
    before = word;
  }
}

/// Takes a brick from the front of `in`. Returns false if it is too short or the bone has no such brick or voxels.
[[nodiscard]] inline bool take_brick(std::string_view& in, const FollowedBone& bone, BrickChange& change) {
  if (in.size() < sizeof(std::uint32_t)) return false;
  recording_detail::Cursor cursor(in.data());
  change.brick = cursor.take<std::uint32_t>();
  change.voxels.clear();
  in.remove_prefix(sizeof(std::uint32_t));
  const auto n = bone.bricks();
  if (change.brick / static_cast<std::size_t>(n[0]) / static_cast<std::size_t>(n[1]) >= static_cast<std::size_t>(n[2]))
    return false;
  return with_density_type(bone.density, [&]<class Density>(std::type_identity<Density>) {
    BitReader bits(in);
    BrickCodes codes;
    const std::uint64_t count = codes.count.take(bits);
    if (count > BrickLayout::kVoxels) return false;
    std::uint64_t number = 0, word = 0;
    for (std::uint64_t v = 0; v < count; ++v, ++number) {
      const std::uint64_t skipped = codes.skipped.take(bits);
      if (skipped >= BrickLayout::kVoxels - number) return false;
      number += skipped;
      const auto at = bone.index(change.brick, static_cast<int>(number));
      for (std::size_t a = 0; a < 3; ++a)
        if (at[a] >= bone.geometry.size[a]) return false;
      word += unfolded(codes.densities.take(bits));
      const auto stored = static_cast<DensityBits<Density>>(word);
      if (stored != word || bits.is_short()) return false;
      change.voxels.push_back(
          {static_cast<std::uint16_t>(number), static_cast<float>(detail::bit_cast<Density>(stored))});
    }
    in.remove_prefix(bits.bytes());
    return true;
  });
}

/// Finds what changed in a bone since it was last asked; on a single thread, while the haptic one cuts.
class BoneFollower {
 public:
  explicit BoneFollower(const FollowedBone& bone) : bone_(bone) {}
  virtual ~BoneFollower() = default;
  BoneFollower(const BoneFollower&) = delete;
  BoneFollower& operator=(const BoneFollower&) = delete;

  /// Calls `put(record)` for each brick with voxels that changed.
  virtual void take_changes(const std::function<void(std::string_view record)>& put) = 0;
  [[nodiscard]] const FollowedBone& bone() const noexcept { return bone_; }

 private:
  FollowedBone bone_;
};

/// Follows a VoxelGrid by its GridReader, or a compiled::Bone by its BoneReader. It keeps a copy of all densities.
template <VoxelDensity Density, class Reader>
class BoneFollowerOf final : public BoneFollower {
 public:
  /// While the bone is at rest.
  template <class Bone>
  BoneFollowerOf(const Bone& bone, std::optional<double> isovalue)
      : BoneFollowerOf(bone, Reader(bone), isovalue, voxels_of(bone)) {}

  void take_changes(const std::function<void(std::string_view)>& put) override {
    reader_.poll([&](std::size_t brick) {
      find_changes(brick);
      if (changed_.empty()) return;
      record_.clear();
      put_brick<Density>(record_, brick, changed_);
      put(record_);
    });
  }

 private:
  static constexpr int kSide = BrickLayout::kBrick, kHaloed = kSide + 2;
  using Brick = std::array<Density, std::size_t{kHaloed} * kHaloed * kHaloed>;

  template <class Bone>
  BoneFollowerOf(const Bone& bone, Reader reader, std::optional<double> isovalue, std::vector<Density> voxels)
      : BoneFollower({.geometry = {.size = bone.size(),
                                   .spacing = bone.spacing(),
                                   .X_WG = bone.X_WG(),
                                   .outside = static_cast<double>(bone.outside())},
                      .density = kDensityType<Density>,
                      .isovalue = isovalue,
                      .hash = density_hash(std::span<const Density>(voxels))}),
        reader_(std::move(reader)),
        known_(std::move(voxels)) {
    static_cast<void>(reader_.poll([](std::size_t) {}));  // all is known
  }

  template <class Bone>
  [[nodiscard]] static std::vector<Density> voxels_of(const Bone& bone) {
    const auto& n = bone.size();
    std::vector<Density> voxels(static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) *
                                static_cast<std::size_t>(n[2]));
    bone.copy_voxels(std::span<Density>(voxels));
    return voxels;
  }
  [[nodiscard]] static Brick copy_of(const Reader& reader, std::size_t brick) {
    Brick copy;
    if constexpr (std::is_same_v<Reader, GridReader<Density>>)
      static_cast<void>(reader.copy_brick(brick, copy));
    else
      reader.copy_brick(brick, std::span<Density>(copy));
    return copy;
  }

  void find_changes(std::size_t brick) {
    const Brick now = copy_of(reader_, brick);
    const auto& n = bone().geometry.size;
    const auto at = bone().index(brick, 0);
    changed_.clear();
    for (int k = 0; k < kSide && at[2] + k < n[2]; ++k)
      for (int j = 0; j < kSide && at[1] + j < n[1]; ++j)
        for (int i = 0; i < kSide && at[0] + i < n[0]; ++i) {
          const Density density = now[static_cast<std::size_t>(((k + 1) * kHaloed + j + 1) * kHaloed + i + 1)];
          const std::size_t row = static_cast<std::size_t>(at[2] + k) * static_cast<std::size_t>(n[1]) +
                                  static_cast<std::size_t>(at[1] + j);
          Density& known = known_[row * static_cast<std::size_t>(n[0]) + static_cast<std::size_t>(at[0] + i)];
          if (detail::bit_cast<DensityBits<Density>>(density) == detail::bit_cast<DensityBits<Density>>(known))
            continue;
          known = density;
          changed_.emplace_back((k * kSide + j) * kSide + i, density);
        }
  }

  Reader reader_;
  std::vector<Density> known_;  // as they were last written
  std::vector<std::pair<int, Density>> changed_;
  std::string record_;
};

}  // namespace trephine
