// SPDX-License-Identifier: MIT
#include "pictured_bone.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace drill {
namespace {

std::size_t flat(const std::array<int, 3>& n, int i, int j, int k) {
  return static_cast<std::size_t>((static_cast<std::ptrdiff_t>(k) * n[1] + j) * n[0] + i);
}

std::size_t product(const std::array<int, 3>& n) {
  return static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(n[2]);
}

/// Mean over 2 r + 1 neighbours along an axis, air beyond the edges; by a running sum.
void box_blur(std::vector<float>& values, const std::array<int, 3>& n, std::size_t axis, int r) {
  if (r < 1) return;
  const std::array<std::size_t, 3> stride{1, static_cast<std::size_t>(n[0]),
                                          static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1])};
  const std::size_t other1 = axis == 0 ? 1 : 0;
  const std::size_t other2 = axis == 2 ? 1 : 2;
  const int length = n[axis];
  std::vector<float> line(static_cast<std::size_t>(length));
  for (int b = 0; b < n[other2]; ++b)
    for (int a = 0; a < n[other1]; ++a) {
      float* at =
          values.data() + static_cast<std::size_t>(a) * stride[other1] + static_cast<std::size_t>(b) * stride[other2];
      for (int i = 0; i < length; ++i)
        line[static_cast<std::size_t>(i)] = at[static_cast<std::size_t>(i) * stride[axis]];
      const auto value = [&](int i) { return i < 0 || i >= length ? 0.0F : line[static_cast<std::size_t>(i)]; };
      float sum = 0;
      for (int i = -r; i <= r; ++i) sum += value(i);
      for (int i = 0; i < length; ++i) {
        at[static_cast<std::size_t>(i) * stride[axis]] = sum / static_cast<float>(2 * r + 1);
        sum += value(i + r + 1) - value(i - r);
      }
    }
}

}  // namespace

PicturedBone::PicturedBone(const trephine::VoxelGrid<std::int16_t>& bone, double isovalue)
    : field_(bone, isovalue),
      spacing_(bone.spacing().cast<float>()),
      hi_(Vec3f(static_cast<float>(bone.size()[0]), static_cast<float>(bone.size()[1]),
                static_cast<float>(bone.size()[2]))
              .cwiseProduct(spacing_)),
      most_above_(static_cast<float>(bone.original_range().max - isovalue)) {
  find_occupied(isovalue);
  blur(isovalue);
}

void PicturedBone::find_occupied(double isovalue) {
  const auto& bone = grid();
  const auto& n = bone.size();
  // Cells have voxels at their corners, the border's too: cell (0, 0, 0) lies between voxels -1 and 0.
  for (std::size_t a = 0; a < 3; ++a) {
    cells_[a] = n[a] + 1;
    blocks_[a] = (cells_[a] + kBlock - 1) / kBlock;
  }
  cell_holds_bone_.assign(product(cells_), 0);
  block_holds_bone_.assign(product(blocks_), 0);
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        if (!(static_cast<double>(bone.at(i, j, k)) >= isovalue)) continue;
        for (int z = k; z <= k + 1; ++z)
          for (int y = j; y <= j + 1; ++y)
            for (int x = i; x <= i + 1; ++x) {
              cell_holds_bone_[flat(cells_, x, y, z)] = 1;
              block_holds_bone_[flat(blocks_, x / kBlock, y / kBlock, z / kBlock)] = 1;
            }
      }
}

void PicturedBone::blur(double isovalue) {
  const auto& bone = grid();
  const auto& n = bone.size();
  for (std::size_t a = 0; a < 3; ++a) half_[a] = (n[a] + 1) / 2;
  std::vector<float> share(product(half_), 0.0F);
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i)
        if (static_cast<double>(bone.at(i, j, k)) >= isovalue) share[flat(half_, i / 2, j / 2, k / 2)] += 0.125F;
  for (const float voxels : {1.5F, 4.0F, 12.0F}) {
    Blurred b{voxels * voxel(), share};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      // Three boxes of 2 r + 1 have variance (2 r + 1)^2 / 4 - 1/4, near enough to a Gaussian.
      const float sigma = b.distance / (2 * spacing_[static_cast<int>(axis)]);
      const int r = std::max(0, static_cast<int>(std::lround((std::sqrt(4 * sigma * sigma + 1) - 1) / 2)));
      for (int pass = 0; pass < 3; ++pass) box_blur(b.share, half_, axis, r);
    }
    blurred_.push_back(std::move(b));
  }
}

float PicturedBone::share_at(const Blurred& blurred, const Vec3f& p) const noexcept {
  std::array<int, 3> base{};
  std::array<float, 3> f{};
  float fade = 1;  // to air beyond the grid
  for (std::size_t a = 0; a < 3; ++a) {
    // A pair of voxels 2 i, 2 i + 1 has its centre at 2 i + 1/2.
    const float u = (p[static_cast<int>(a)] / spacing_[static_cast<int>(a)] - 0.5F) / 2;
    const float c = std::clamp(u, 0.0F, static_cast<float>(half_[a] - 1));
    fade *= std::clamp(1 - std::abs(u - c) / 6, 0.0F, 1.0F);
    base[a] = std::min(static_cast<int>(c), std::max(half_[a] - 2, 0));
    f[a] = c - static_cast<float>(base[a]);
  }
  if (!(fade > 0)) return 0;
  float sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int x = corner & 1;
    const int y = (corner >> 1) & 1;
    const int z = corner >> 2;
    const float w = (x != 0 ? f[0] : 1 - f[0]) * (y != 0 ? f[1] : 1 - f[1]) * (z != 0 ? f[2] : 1 - f[2]);
    if (!(w > 0)) continue;
    sum += w * blurred.share[flat(half_, base[0] + x, base[1] + y, base[2] + z)];
  }
  return fade * sum;
}

float PicturedBone::openness(const Vec3f& p, const Vec3f& n) const noexcept {
  // One standard deviation above a plane a Gaussian blur sees 15.9 % of it: that much is no occlusion.
  constexpr float kPlane = 0.159F;
  float open = 1;
  for (const Blurred& b : blurred_) {
    const float share = share_at(b, p + b.distance * n);
    open *= 1 - 0.85F * std::clamp((share - kPlane) / (0.75F - kPlane), 0.0F, 1.0F);
  }
  return open;
}

Vec3f PicturedBone::gradient(const Vec3f& p) const noexcept {
  const auto& bone = grid();
  const auto& n = bone.size();
  std::array<int, 3> base{};
  std::array<std::array<float, 4>, 3> weight{};
  std::array<std::array<float, 4>, 3> slope{};
  for (std::size_t a = 0; a < 3; ++a) {
    const float u = p[static_cast<int>(a)] / spacing_[static_cast<int>(a)];
    const float whole = std::floor(u);
    const float f = u - whole;
    const float g = 1 - f;
    base[a] = static_cast<int>(whole);
    weight[a] = {g * g * g / 6, (4 - 6 * f * f + 3 * f * f * f) / 6, (4 - 6 * g * g + 3 * g * g * g) / 6,
                 f * f * f / 6};
    slope[a] = {-g * g / 2, (3 * f * f - 4 * f) / 2, (4 * g - 3 * g * g) / 2, f * f / 2};
  }
  Vec3f sum = Vec3f::Zero();
  for (std::size_t z = 0; z < 4; ++z)
    for (std::size_t y = 0; y < 4; ++y)
      for (std::size_t x = 0; x < 4; ++x) {
        const int i = std::clamp(base[0] + static_cast<int>(x) - 1, -1, n[0]);
        const int j = std::clamp(base[1] + static_cast<int>(y) - 1, -1, n[1]);
        const int k = std::clamp(base[2] + static_cast<int>(z) - 1, -1, n[2]);
        const auto v = static_cast<float>(bone.at(i, j, k));
        sum += v * Vec3f(slope[0][x] * weight[1][y] * weight[2][z], weight[0][x] * slope[1][y] * weight[2][z],
                         weight[0][x] * weight[1][y] * slope[2][z]);
      }
  return sum.cwiseQuotient(spacing_);
}

Vec3f PicturedBone::normal(const Vec3f& p, float spread) const noexcept {
  Vec3f sum = gradient(p);
  if (spread > 0)
    for (int a = 0; a < 3; ++a) {
      Vec3f d = Vec3f::Zero();
      d[a] = spread;
      sum += gradient(p - d) + gradient(p + d);
    }
  const float length = sum.norm();
  return length > 0 ? Vec3f(-sum / length) : Vec3f::UnitZ();
}

std::optional<float> PicturedBone::hit(const Ray& ray, float from, float to, float step) const noexcept {
  const Vec3f inverse = ray.direction.cwiseInverse();
  for (int a = 0; a < 3; ++a) {
    const float t0 = (lo()[a] - ray.origin[a]) * inverse[a];
    const float t1 = (hi_[a] - ray.origin[a]) * inverse[a];
    from = std::max(from, std::min(t0, t1));
    to = std::min(to, std::max(t0, t1));
  }
  // Where the ray leaves the box of `edge` cells that holds cell c.
  const auto leaves = [&](const std::array<int, 3>& c, int edge) {
    float out = std::numeric_limits<float>::max();
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<int>(a);
      const int face = (c[a] / edge + (ray.direction[axis] > 0 ? 1 : 0)) * edge - 1;
      const float t = (static_cast<float>(face) * spacing_[axis] - ray.origin[axis]) * inverse[axis];
      if (std::isfinite(t)) out = std::min(out, t);
    }
    return out;
  };
  for (float t = from; t <= to;) {
    // Into the next cell. Far from the eye that takes more than rounding, or the ray stands still.
    const float nudge = std::max(1e-4F * voxel(), 4 * std::numeric_limits<float>::epsilon() * std::abs(t));
    const Vec3f p = ray.origin + t * ray.direction;
    std::array<int, 3> cell{};
    std::array<int, 3> block{};
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<int>(a);
      cell[a] = std::clamp(static_cast<int>(p[axis] / spacing_[axis] + 1), 0, cells_[a] - 1);
      block[a] = cell[a] / kBlock;
    }
    const bool crowded = block_holds_bone_[flat(blocks_, block[0], block[1], block[2])] != 0;
    const float out = std::max(leaves(cell, crowded ? 1 : kBlock), t) + nudge;
    if (crowded && cell_holds_bone_[flat(cells_, cell[0], cell[1], cell[2])] != 0) {
      const float end = std::min(out, to);
      const int pieces = std::max(1, static_cast<int>(std::ceil((end - t) / (step * voxel()))));
      for (int i = 0; i <= pieces; ++i) {
        const float length = (end - t) / static_cast<float>(pieces);
        const float inside = t + length * static_cast<float>(i);
        if (above(ray.origin + inside * ray.direction) < 0) continue;
        return i == 0 && t <= from ? from : first_bone(ray, inside - length, inside);
      }
    }
    t = out;
  }
  return std::nullopt;
}

/// The surface between a place outside and one in bone, to a 256th of the way.
float PicturedBone::first_bone(const Ray& ray, float outside, float inside) const noexcept {
  for (int i = 0; i < 8; ++i) {
    const float middle = 0.5F * (outside + inside);
    (above(ray.origin + middle * ray.direction) >= 0 ? inside : outside) = middle;
  }
  return inside;
}

}  // namespace drill
