// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/lane_loop.hpp>
#include <trephine/core/relaxed.hpp>
#include <trephine/voxel/lane_bits.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <utility>

/// Member functions of VoxelGrid that lower densities, restore them, and keep the bricks' marks and versions.
namespace trephine::inline TREPHINE_ALIGNED {

template <class Density>
template <class DensityOf>
int VoxelGrid<Density>::lower_row(int j, int k, int x0, int x1, DensityOf&& density_of) noexcept {
  const BrickRows bricks = brick_rows(j, k);
  int changed = 0;
  int first = x1 + 1;
  int last = x0 - 1;
  for (int x = x0; x <= x1; ++x) {
    Density& voxel = voxels_[index(x, j, k)];
    const Density old = voxel;
    const Density value = density_of(x, old);
    if (!(value < old)) continue;
    store_relaxed(voxel, value);
    for (std::size_t r = 0; r < bricks.count; ++r) {
      const std::size_t at_x = profile_index(bricks.row[r], x);
      new_min_[at_x] = std::min(new_min_[at_x], value);
      old_max_[at_x] = std::max(old_max_[at_x], old);
    }
    ++changed;
    first = std::min(first, x);
    last = x;
  }
  if (changed > 0) mark(j, k, first, last, bricks);
  return changed;
}

template <class Density>
template <class Edit, class Note>
bool VoxelGrid<Density>::lower_lanes(int j, int k, int x0, int x1, Edit&& edit, Note&& note) noexcept {
  // A block may read past x1: a row of border follows, and 64 spare bytes follow the last row.
  static_assert(kLowerLanes <= static_cast<int>(64 / sizeof(Density)));
  constexpr int kHalf = kLowerLanes / 2;
  const BrickRows bricks = brick_rows(j, k);
  int first = x1 + 1;
  int last = -1;
  int x = x0;
  for (; x1 - x >= kHalf; x += kLowerLanes)
    lower_block<kLowerLanes>(j, k, x, std::min(x1 - x + 1, kLowerLanes), bricks, first, last, edit, note);
  if (x <= x1) lower_block<kHalf>(j, k, x, x1 - x + 1, bricks, first, last, edit, note);
  if (last < 0) return false;
  mark(j, k, first, last, bricks);
  return true;
}

template <class Density>
auto VoxelGrid<Density>::brick_rows(int j, int k) const noexcept -> BrickRows {
  const int y0 = std::max(j - 1, 0) / kBrick, y1 = std::min((j + 1) / kBrick, bricks_[1] - 1);
  const int z0 = std::max(k - 1, 0) / kBrick, z1 = std::min((k + 1) / kBrick, bricks_[2] - 1);
  BrickRows rows{1, {brick_row(y0, z0)}};
  if (y1 != y0) rows.row[rows.count++] = brick_row(y1, z0);
  if (z1 == z0) return rows;
  rows.row[rows.count++] = brick_row(y0, z1);
  if (y1 != y0) rows.row[rows.count++] = brick_row(y1, z1);
  return rows;
}

/// Lowers the first `count` lanes of the block at voxel x, and extends [first, last] by the changed lanes.
template <class Density>
template <std::size_t kLanes, class Edit, class Note>
void VoxelGrid<Density>::lower_block(int j, int k, int x, int count, const BrickRows& bricks, int& first, int& last,
                                     Edit& edit, Note& note) noexcept {
  Density* at = voxels_.data() + index(x, j, k);
  std::array<Density, kLanes> old;
  std::memcpy(old.data(), at, sizeof(old));
  std::array<Density, kLanes> value = old;
  edit(x, count, std::as_const(old), value);
  // Separate loops over all lanes, so that they are vectorised.
  detail::for_lanes<kLanes>([&](std::size_t l) { value[l] = value[l] < old[l] ? value[l] : old[l]; });
  const std::uint32_t changed = detail::lane_bits<Density, kLanes>([&](std::size_t l) { return value[l] < old[l]; });
  if (changed == 0) return;
  first = std::min(first, x + std::countr_zero(changed));
  last = x + 31 - std::countl_zero(changed);
  note(x, changed, std::as_const(value));
  // Unchanged lanes too: a fixed count costs less than a variable one.
  [&]<std::size_t... kLane>(std::index_sequence<kLane...>) {
    (store_relaxed(at[kLane], value[kLane]), ...);
  }(std::make_index_sequence<kLanes>());
  std::array<Density, kLanes> low;
  std::array<Density, kLanes> high;
  detail::for_lanes<kLanes>(
      [&](std::size_t l) { low[l] = value[l] < old[l] ? value[l] : std::numeric_limits<Density>::max(); });
  detail::for_lanes<kLanes>(
      [&](std::size_t l) { high[l] = value[l] < old[l] ? old[l] : std::numeric_limits<Density>::lowest(); });
  for (std::size_t r = 0; r < bricks.count; ++r) {
    Density* new_min = new_min_.data() + profile_index(bricks.row[r], x);
    Density* old_max = old_max_.data() + profile_index(bricks.row[r], x);
    std::array<Density, kLanes> least, most;
    std::memcpy(least.data(), new_min, sizeof(least));
    std::memcpy(most.data(), old_max, sizeof(most));
    detail::for_lanes<kLanes>([&](std::size_t l) { least[l] = low[l] < least[l] ? low[l] : least[l]; });
    detail::for_lanes<kLanes>([&](std::size_t l) { most[l] = high[l] > most[l] ? high[l] : most[l]; });
    std::memcpy(new_min, least.data(), sizeof(least));
    std::memcpy(old_max, most.data(), sizeof(most));
  }
}

/// Calls visit(word, bits) for the words of a row of bits that hold bits first … last.
template <class Density>
template <class Visit>
inline void VoxelGrid<Density>::for_each_word(int first, int last, Visit&& visit) noexcept {
  if (last < kWord) return visit(std::size_t{0}, word_bits(first, last));
  for (int w = first / kWord; w <= last / kWord; ++w)
    visit(static_cast<std::size_t>(w),
          word_bits(std::max(first - w * kWord, 0), std::min(last - w * kWord, kWord - 1)));
}

template <class Density>
std::size_t VoxelGrid<Density>::brick_of_bit(std::size_t word, int bit) const noexcept {
  return word / words_ * static_cast<std::size_t>(bricks_[0]) + word % words_ * kWord + static_cast<std::size_t>(bit);
}

/// Bricks bx0 to bx1 of a row of bricks.
template <class Density>
inline void VoxelGrid<Density>::touch_row(std::size_t row, int bx0, int bx1) noexcept {
  for_each_word(bx0, bx1, [&](std::size_t w, std::uint64_t bits) {
    auto& word = touched_[row * words_ + w];
    if (word == 0) touched_words_.push_back(row * words_ + w);
    word |= bits;
  });
}

template <class Density>
inline void VoxelGrid<Density>::mark(int j, int k, int x0, int x1, const BrickRows& bricks) noexcept {
  grow_edit_box({x0, j, k}, {x1, j, k});
  const std::size_t own_row = brick_row(j / kBrick, k / kBrick), last_row = bricks.row[bricks.count - 1];
  const bool same_rows =
      own_row == marked_.own_row && bricks.row[0] == marked_.first_row && last_row == marked_.last_row;
  if (same_rows && x0 >= marked_.from && x1 <= marked_.to) return;
  const int own_from = x0 / kBrick, own_to = x1 / kBrick;
  const int from = std::max(x0 - 1, 0) / kBrick;
  const int to = std::min((x1 + 1) / kBrick, bricks_[0] - 1);
  for (std::size_t r = 0; r < bricks.count; ++r) touch_row(bricks.row[r], from, to);
  if (!edited_.empty())
    for_each_word(own_from, own_to, [&](std::size_t w, std::uint64_t bits) { edited_[own_row * words_ + w] |= bits; });
  // All voxels of these marks, joined with earlier ones if there is no gap.
  int first = std::max(own_from * kBrick, from == 0 ? 0 : from * kBrick + 1);
  int last = std::min(own_to * kBrick + kBrick - 1, to * kBrick + kBrick - 2);
  if (same_rows && first <= marked_.to + 1 && last >= marked_.from - 1) {
    first = std::min(first, marked_.from);
    last = std::max(last, marked_.to);
  }
  marked_ = {own_row, bricks.row[0], last_row, first, last};
}

template <class Density>
void VoxelGrid<Density>::grow_edit_box(const std::array<int, 3>& lo, const std::array<int, 3>& hi) noexcept {
  auto& box = edit_box_;
  // Written out: compilers make slower code of loops over three elements.
  if (lo[0] < box.lo[0]) box.lo[0] = lo[0];
  if (lo[1] < box.lo[1]) box.lo[1] = lo[1];
  if (lo[2] < box.lo[2]) box.lo[2] = lo[2];
  if (hi[0] > box.hi[0]) box.hi[0] = hi[0];
  if (hi[1] > box.hi[1]) box.hi[1] = hi[1];
  if (hi[2] > box.hi[2]) box.hi[2] = hi[2];
}

template <class Density>
template <class Visit>
void VoxelGrid<Density>::for_each_touched(Visit&& visit) noexcept {
  for (const std::size_t at : touched_words_)
    for (std::uint64_t bits = touched_[at]; bits != 0; bits &= bits - 1)
      visit(brick_of_bit(at, std::countr_zero(bits)));
}

template <class Density>
void VoxelGrid<Density>::commit() noexcept {
  publish([&](std::size_t b) { update_range(b); });
}

/// Commits the open edit. `renew_range(b)` brings a brick's range up to date.
template <class Density>
template <class RenewRange>
void VoxelGrid<Density>::publish(RenewRange&& renew_range) noexcept {
  if (touched_words_.empty()) return;
  for_each_touched([&](std::size_t b) {
    renew_range(b);
    store_release(versions_[b], versions_[b] + 1);
  });
  last_edit_ = edit_box_;
  ++edit_count_;
  clear_edit();
}

template <class Density>
void VoxelGrid<Density>::clear_edit() noexcept {
  for_each_touched([&](std::size_t b) {
    const auto [bx, by, bz] = brick_coordinates(b);
    const std::size_t from = profile_index(brick_row(by, bz), bx * kBrick - 1);
    std::fill_n(new_min_.data() + from, kBrick + 2, std::numeric_limits<Density>::max());
    std::fill_n(old_max_.data() + from, kBrick + 2, std::numeric_limits<Density>::lowest());
  });
  for (const std::size_t at : touched_words_) touched_[at] = 0;
  touched_words_.clear();
  marked_ = {};
  risen_ = false;
  edit_box_ = kNothing;
}

/// Stores the brick's densities of an array in this grid's layout, any of which may be higher than the present ones.
template <class Density>
void VoxelGrid<Density>::raise_brick(std::size_t b, const Density* from) noexcept {
  const auto [bx, by, bz] = brick_coordinates(b);
  const std::array lo{bx * kBrick, by * kBrick, bz * kBrick};
  const std::array hi{std::min(lo[0] + kBrick, size_[0]) - 1, std::min(lo[1] + kBrick, size_[1]) - 1,
                      std::min(lo[2] + kBrick, size_[2]) - 1};
  for (int k = lo[2]; k <= hi[2]; ++k)
    for (int j = lo[1]; j <= hi[1]; ++j) {
      const std::size_t at_row = index(lo[0], j, k);
      for (int i = 0; i <= hi[0] - lo[0]; ++i)
        store_relaxed(voxels_[at_row + static_cast<std::size_t>(i)], from[at_row + static_cast<std::size_t>(i)]);
    }
  grow_edit_box(lo, hi);
  for (int z = std::max(bz - 1, 0); z <= std::min(bz + 1, bricks_[2] - 1); ++z)
    for (int y = std::max(by - 1, 0); y <= std::min(by + 1, bricks_[1] - 1); ++y)
      touch_row(brick_row(y, z), std::max(bx - 1, 0), std::min(bx + 1, bricks_[0] - 1));
  risen_ = true;
  increase_stamp_ = detail::unique_number();
}

template <class Density>
std::size_t VoxelGrid<Density>::restore(std::size_t max_bricks) {
  if (original_.empty()) refuse("VoxelGrid", "restore() needs GridOptions::keep_original", "none");
  std::size_t left = 0;
  for (std::size_t at = 0; at < edited_.size(); ++at)
    for (std::uint64_t bits = edited_[at]; bits != 0; bits &= bits - 1) {
      if (max_bricks == 0) {
        ++left;
        continue;
      }
      raise_brick(brick_of_bit(at, std::countr_zero(bits)), original_.data());
      edited_[at] &= ~(bits & (~bits + 1));
      --max_bricks;
    }
  commit();
  return left;
}

template <class Density>
VoxelGrid<Density> VoxelGrid<Density>::copy() const {
  VoxelGrid made(*this);
  made.touched_words_.reserve(touched_.size());
  made.increase_stamp_ = detail::unique_number();
  return made;
}

template <class Density>
void VoxelGrid<Density>::take(const VoxelGrid& other) {
  if (original_.empty()) refuse("VoxelGrid", "take() needs GridOptions::keep_original", "none");
  if (origin_ != other.origin_) refuse("VoxelGrid", "take() needs a copy of this grid", "another grid");
  X_WG_ = other.X_WG_;
  for (std::size_t at = 0; at < edited_.size(); ++at) {
    for (std::uint64_t bits = edited_[at] | other.edited_[at]; bits != 0; bits &= bits - 1)
      raise_brick(brick_of_bit(at, std::countr_zero(bits)), other.voxels_.data());
    edited_[at] = other.edited_[at];
  }
  // All densities are the other's now, and so are the ranges.
  publish([&](std::size_t b) { store_range(b, other.ranges_[b]); });
}

}  // namespace trephine
