// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/voxel_grid.hpp>

#include <bit>
#include <cstring>

/// Trilinear sampling of a VoxelGrid, for single points and for batches. Positions are **voxel coordinates of the
/// padded array**, `u = p_G / spacing + 1`: the border voxel is at 0, voxel (0, 0, 0) at 1. They are clamped to the
/// array, so points beyond the border have the density `outside`.
namespace trephine::inline TREPHINE_ALIGNED {

/// Points per vectorised block. Counts are padded to a multiple of it, so that plain loops vectorise: 16
/// single-precision numbers fill one AVX-512 register. Searches that sample a block per span also take their resolution
/// from it.
inline constexpr int kLane = 16;
/// Returns n rounded up to a multiple of kLane.
[[nodiscard]] constexpr int padded_to_lane(int n) noexcept { return (n + kLane - 1) / kLane * kLane; }

/// The grid's array as the kernels read it: pointer, pitches and clamping limits.
template <VoxelDensity Density, RealScalar Scalar>
struct SampleView {
  const Density* voxels;
  int row;
  int plane;
  Vec3<Scalar> last;             ///< size + 1 per axis: coordinate of the far border
  std::array<int, 3> last_cell;  ///< size per axis: index of the cell that ends at the far border

  explicit SampleView(const VoxelGrid<Density>& g) noexcept
      : voxels(g.data()),
        row(g.row_pitch()),
        plane(g.plane_pitch()),
        last(Scalar(g.size()[0] + 1), Scalar(g.size()[1] + 1), Scalar(g.size()[2] + 1)),
        last_cell(g.size()) {}
};

/// A cell, by the index of its lowest corner, and a position within it, each coordinate in [0, 1].
template <RealScalar Scalar>
struct Cell {
  int base;
  Scalar fx, fy, fz;
};

/// Returns u clamped to [0, last]; NaN becomes 0, because its comparison fails.
template <RealScalar Scalar>
[[nodiscard]] inline Scalar clamp_coordinate(Scalar u, Scalar last) noexcept {
  u = u > Scalar(0) ? u : Scalar(0);
  return u < last ? u : last;
}

/// Returns the cell of voxel coordinates u. Always inlined, as `sample`: each step of a search waits for a sample, and
/// passing points and cells through memory takes an eighth of that time.
template <VoxelDensity Density, RealScalar Scalar>
[[nodiscard, gnu::always_inline]] inline Cell<Scalar> cell_at(const SampleView<Density, Scalar>& v,
                                                              const Vec3<Scalar>& u) noexcept {
  const Scalar x = clamp_coordinate(u.x(), v.last.x());
  const Scalar y = clamp_coordinate(u.y(), v.last.y());
  const Scalar z = clamp_coordinate(u.z(), v.last.z());
  // A point on the far border belongs to the cell before it, at fraction 1: all eight corners lie in the array.
  const int i = std::min(static_cast<int>(x), v.last_cell[0]);
  const int j = std::min(static_cast<int>(y), v.last_cell[1]);
  const int k = std::min(static_cast<int>(z), v.last_cell[2]);
  return {k * v.plane + j * v.row + i, x - Scalar(i), y - Scalar(j), z - Scalar(k)};
}

/// Returns the eight corner densities of a cell: c[x + 2 y + 4 z].
template <VoxelDensity Density, RealScalar Scalar>
[[nodiscard]] std::array<Scalar, 8> corners(const SampleView<Density, Scalar>& v, int base) noexcept {
  const Density* p = v.voxels + base;
  return {Scalar(p[0]),       Scalar(p[1]),           Scalar(p[v.row]),           Scalar(p[v.row + 1]),
          Scalar(p[v.plane]), Scalar(p[v.plane + 1]), Scalar(p[v.plane + v.row]), Scalar(p[v.plane + v.row + 1])};
}

template <RealScalar Scalar>
[[nodiscard]] constexpr Scalar lerp(Scalar a, Scalar b, Scalar f) noexcept {
  return a + f * (b - a);
}

/// Returns the density of the trilinear interpolant at voxel coordinates u.
template <VoxelDensity Density, RealScalar Scalar>
[[nodiscard, gnu::always_inline]] inline Scalar sample(const SampleView<Density, Scalar>& v,
                                                       const Vec3<Scalar>& u) noexcept {
  const Cell<Scalar> c = cell_at(v, u);
  const auto r = corners(v, c.base);
  const Scalar y0 = lerp(lerp(r[0], r[1], c.fx), lerp(r[2], r[3], c.fx), c.fy);
  const Scalar y1 = lerp(lerp(r[4], r[5], c.fx), lerp(r[6], r[7], c.fx), c.fy);
  return lerp(y0, y1, c.fz);
}

/// A word of two neighbouring voxels: one load fetches both, and shifts separate them in vector registers. The word is
/// as wide as the numbers it is converted to, so vectors of words need no widening.
template <VoxelDensity Density>
using PairWord = std::conditional_t<std::is_floating_point_v<Density>, std::array<float, 2>,
                                    std::conditional_t<std::is_signed_v<Density>, std::int32_t, std::uint32_t>>;

/// Loads a voxel and its successor along x.
template <VoxelDensity Density>
[[nodiscard]] inline PairWord<Density> load_pair(const Density* voxel) noexcept {
  using Bytes = std::conditional_t<std::is_signed_v<Density>, std::int16_t, std::uint16_t>;
  std::conditional_t<sizeof(Density) == 1, Bytes, PairWord<Density>> pair;
  std::memcpy(&pair, voxel, sizeof(pair));
  return pair;
}

/// Returns the linear interpolation of the two voxels in a word.
template <VoxelDensity Density, RealScalar Scalar>
[[nodiscard]] inline Scalar lerp_pair(const PairWord<Density>& word, Scalar f) noexcept {
  if constexpr (std::is_floating_point_v<Density>) {
    return lerp(Scalar(word[0]), Scalar(word[1]), f);
  } else {
    // Shifts of whole integers: a cast to Density makes g++ pack vectors to bytes and unpack them again.
    constexpr int kBits = 8 * sizeof(Density);
    const auto low = static_cast<int>(word << (32 - kBits) >> (32 - kBits));
    const auto high = static_cast<int>(word >> kBits);
    constexpr bool kLittle = std::endian::native == std::endian::little;
    return lerp(Scalar(kLittle ? low : high), Scalar(kLittle ? high : low), f);
  }
}

/// The cells of a batch of points: positions within the cells, and corner densities as four pairs of neighbours.
template <VoxelDensity Density, RealScalar Scalar, int kSize>
struct CellBatch {
  std::array<Scalar, kSize> fx, fy, fz;
  std::array<PairWord<Density>, kSize> p00, p10, p01, p11;

  /// Loads the cells of the first m points, m a multiple of kLane, at voxel coordinates A p + t. Two plain loops (map,
  /// load) over separate arrays vectorise. Always inlined: otherwise g++ -O2 assumes that the arrays may alias the
  /// points, emits scalar code and takes three times as long.
  [[gnu::always_inline]] void load(const SampleView<Density, Scalar>& v, const Mat3<Scalar>& A, const Vec3<Scalar>& t,
                                   const Scalar* x, const Scalar* y, const Scalar* z, std::size_t m) noexcept {
    const Scalar a00 = A(0, 0), a01 = A(0, 1), a02 = A(0, 2), t0 = t.x();
    const Scalar a10 = A(1, 0), a11 = A(1, 1), a12 = A(1, 2), t1 = t.y();
    const Scalar a20 = A(2, 0), a21 = A(2, 1), a22 = A(2, 2), t2 = t.z();
    const Scalar last_x = v.last.x(), last_y = v.last.y(), last_z = v.last.z();
    // Not derived from `last`: g++ would then treat the far border's cell apart, with two selections an axis.
    const auto [cell_x, cell_y, cell_z] = v.last_cell;
    const int row = v.row;
    const int plane = v.plane;
    std::array<int, kSize> base;
    for (std::size_t i = 0; i < m; ++i) {
      const Scalar px = x[i], py = y[i], pz = z[i];
      const Scalar ux = clamp_coordinate(a00 * px + a01 * py + a02 * pz + t0, last_x);
      const Scalar uy = clamp_coordinate(a10 * px + a11 * py + a12 * pz + t1, last_y);
      const Scalar uz = clamp_coordinate(a20 * px + a21 * py + a22 * pz + t2, last_z);
      const int ix = std::min(static_cast<int>(ux), cell_x);
      const int iy = std::min(static_cast<int>(uy), cell_y);
      const int iz = std::min(static_cast<int>(uz), cell_z);
      base[i] = iz * plane + iy * row + ix;
      fx[i] = ux - static_cast<Scalar>(ix);
      fy[i] = uy - static_cast<Scalar>(iy);
      fz[i] = uz - static_cast<Scalar>(iz);
    }
    // Two consecutive elements of one array are stored together: processors merge stores that share a cache line, and
    // do not merge stores that alternate between four arrays.
    for (std::size_t i = 0; i < m; i += 2) {
      const auto load_two = [&](auto& pairs, const Density* corner) {
        pairs[i] = load_pair(corner + base[i]);
        pairs[i + 1] = load_pair(corner + base[i + 1]);
      };
      load_two(p00, v.voxels);
      load_two(p10, v.voxels + row);
      load_two(p01, v.voxels + plane);
      load_two(p11, v.voxels + plane + row);
    }
  }
};

/// Points of a batch: few enough for the stack and the first-level cache. It changes run time, and no result.
inline constexpr int kBatch = 8 * kLane;

/// Computes the densities of `n` points, n a multiple of `kLane`: out[i] = sample(A p_i + t), p_i = (x[i], y[i], z[i]).
/// The affine map (A, t) takes the points' frame to voxel coordinates.
template <VoxelDensity Density, RealScalar Scalar>
void sample_points(const SampleView<Density, Scalar>& v, const Mat3<Scalar>& A, const Vec3<Scalar>& t, const Scalar* x,
                   const Scalar* y, const Scalar* z, Scalar* out, int n) noexcept {
  CellBatch<Density, Scalar, kBatch> c;
  for (int first = 0; first < n; first += kBatch, x += kBatch, y += kBatch, z += kBatch, out += kBatch) {
    // The explicit multiple of kLane lets compilers vectorise without a remainder loop.
    const auto m = static_cast<std::size_t>(std::min(n - first, kBatch)) / kLane * kLane;
    c.load(v, A, t, x, y, z, m);
    for (std::size_t i = 0; i < m; ++i) {
      const Scalar x00 = lerp_pair<Density>(c.p00[i], c.fx[i]);
      const Scalar x10 = lerp_pair<Density>(c.p10[i], c.fx[i]);
      const Scalar x01 = lerp_pair<Density>(c.p01[i], c.fx[i]);
      const Scalar x11 = lerp_pair<Density>(c.p11[i], c.fx[i]);
      out[i] = lerp(lerp(x00, x10, c.fy[i]), lerp(x01, x11, c.fy[i]), c.fz[i]);
    }
  }
}

/// Computes the densities of the voxels nearest to `n` points, given as for `sample_points`.
template <VoxelDensity Density, RealScalar Scalar>
void nearest_voxels(const SampleView<Density, Scalar>& v, const Mat3<Scalar>& A, const Vec3<Scalar>& t, const Scalar* x,
                    const Scalar* y, const Scalar* z, Scalar* out, int n) noexcept {
  const Scalar a00 = A(0, 0), a01 = A(0, 1), a02 = A(0, 2), t0 = t.x();
  const Scalar a10 = A(1, 0), a11 = A(1, 1), a12 = A(1, 2), t1 = t.y();
  const Scalar a20 = A(2, 0), a21 = A(2, 1), a22 = A(2, 2), t2 = t.z();
  const Scalar last_x = v.last.x(), last_y = v.last.y(), last_z = v.last.z();
  const int row = v.row, plane = v.plane;
  std::array<int, kLane> at;
  for (int first = 0; first < n; first += kLane, x += kLane, y += kLane, z += kLane, out += kLane) {
    for (int i = 0; i < kLane; ++i) {
      const Scalar px = x[i], py = y[i], pz = z[i];
      const auto ix = static_cast<int>(clamp_coordinate(a00 * px + a01 * py + a02 * pz + t0, last_x) + Scalar(0.5));
      const auto iy = static_cast<int>(clamp_coordinate(a10 * px + a11 * py + a12 * pz + t1, last_y) + Scalar(0.5));
      const auto iz = static_cast<int>(clamp_coordinate(a20 * px + a21 * py + a22 * pz + t2, last_z) + Scalar(0.5));
      at[static_cast<std::size_t>(i)] = iz * plane + iy * row + ix;
    }
    for (int i = 0; i < kLane; ++i) out[i] = static_cast<Scalar>(v.voxels[at[static_cast<std::size_t>(i)]]);
  }
}

/// Returns the second voxel of a word minus the first.
template <VoxelDensity Density, RealScalar Scalar>
[[nodiscard]] inline Scalar difference_of_pair(const PairWord<Density>& word) noexcept {
  return lerp_pair<Density>(word, Scalar(1)) - lerp_pair<Density>(word, Scalar(0));
}

/// Computes the interpolant's gradients at `n` points, given as for `sample_points`, in density per voxel along each
/// grid axis.
template <VoxelDensity Density, RealScalar Scalar>
void sample_gradients(const SampleView<Density, Scalar>& v, const Mat3<Scalar>& A, const Vec3<Scalar>& t,
                      const Scalar* x, const Scalar* y, const Scalar* z, Scalar* gx, Scalar* gy, Scalar* gz,
                      int n) noexcept {
  CellBatch<Density, Scalar, kBatch> c;
  for (int first = 0; first < n; first += kBatch) {
    const auto m = static_cast<std::size_t>(std::min(n - first, kBatch)) / kLane * kLane;
    c.load(v, A, t, x + first, y + first, z + first, m);
    Scalar* to_x = gx + first;
    Scalar* to_y = gy + first;
    Scalar* to_z = gz + first;
    for (std::size_t i = 0; i < m; ++i) {
      const Scalar d00 = difference_of_pair<Density, Scalar>(c.p00[i]);
      const Scalar d10 = difference_of_pair<Density, Scalar>(c.p10[i]);
      const Scalar d01 = difference_of_pair<Density, Scalar>(c.p01[i]);
      const Scalar d11 = difference_of_pair<Density, Scalar>(c.p11[i]);
      to_x[i] = lerp(lerp(d00, d10, c.fy[i]), lerp(d01, d11, c.fy[i]), c.fz[i]);
    }
    for (std::size_t i = 0; i < m; ++i) {
      const Scalar x00 = lerp_pair<Density>(c.p00[i], c.fx[i]);
      const Scalar x10 = lerp_pair<Density>(c.p10[i], c.fx[i]);
      const Scalar x01 = lerp_pair<Density>(c.p01[i], c.fx[i]);
      const Scalar x11 = lerp_pair<Density>(c.p11[i], c.fx[i]);
      to_y[i] = lerp(x10 - x00, x11 - x01, c.fz[i]);
      to_z[i] = lerp(x01 - x00, x11 - x10, c.fy[i]);
    }
  }
}

}  // namespace trephine
