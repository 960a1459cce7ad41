// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {
namespace detail {

/// Samples on a lattice, x fastest, in the making of a resampled grid.
struct Lattice {
  std::array<int, 3> size{};
  std::vector<float> values{};

  /// Samples that lie between neighbours along an axis.
  [[nodiscard]] std::size_t pitch(std::size_t axis) const noexcept {
    std::size_t p = 1;
    for (std::size_t a = 0; a < axis; ++a) p *= static_cast<std::size_t>(size[a]);
    return p;
  }
};

/// Positions along an axis: sample i of the result lies at `first + i * step` samples of the source.
struct AxisSamples {
  double first;
  double step;
  int count;

  /// Width [samples] over which a sample of the result is a mean. Voxels are means over their own width, so a box of
  /// this width turns a voxel of 1 into one of `step`: variances s²/12 add. 0 for finer samples.
  [[nodiscard]] double width() const noexcept { return step > 1 ? std::sqrt(step * step - 1) : 0; }
};

/// Replaces the samples of one line of planes, `pitch` numbers each, by their cubic B-spline's coefficients. The signal
/// is mirrored at its ends. Recursive filter of Unser, Aldroubi and Eden (1993).
inline void to_spline_coefficients(float* planes, int count, std::size_t pitch) noexcept {
  if (count < 2) return;
  const double pole = std::sqrt(3.0) - 2;
  const auto z = static_cast<float>(pole);
  const auto plane = [&](int i) { return planes + static_cast<std::size_t>(i) * pitch; };
  // 20 terms leave 4e-12 of the sum over the mirrored signal's past.
  const int terms = std::min(count, 20);
  for (std::size_t l = 0; l < pitch; ++l) {
    double sum = 0, power = 1;
    for (int i = 0; i < terms; ++i, power *= pole) sum += power * static_cast<double>(plane(i)[l]);
    plane(0)[l] = static_cast<float>(6 * sum);
  }
  for (int i = 1; i < count; ++i)
    for (std::size_t l = 0; l < pitch; ++l) plane(i)[l] = 6 * plane(i)[l] + z * plane(i - 1)[l];
  const auto end = static_cast<float>(pole / (pole * pole - 1));
  for (std::size_t l = 0; l < pitch; ++l) plane(count - 1)[l] = end * (plane(count - 1)[l] + z * plane(count - 2)[l]);
  for (int i = count - 2; i >= 0; --i)
    for (std::size_t l = 0; l < pitch; ++l) plane(i)[l] = z * (plane(i + 1)[l] - plane(i)[l]);
}

/// Resamples along one axis.
inline Lattice resampled_along(Lattice in, std::size_t axis, const AxisSamples& samples) {
  const std::size_t pitch = in.pitch(axis), n = static_cast<std::size_t>(in.size[axis]);
  const std::size_t lines = in.values.size() / (pitch * n);
  Lattice out{.size = in.size};
  out.size[axis] = samples.count;
  out.values.resize(lines * pitch * static_cast<std::size_t>(samples.count));
  // A mean is over places a quarter of a sample apart, or nearer.
  const int parts = std::max(1, static_cast<int>(std::ceil(4 * samples.width())));
  const float share = 1.0F / static_cast<float>(parts);
  const int last = in.size[axis] - 1;
  const auto mirrored = [last](int i) {
    if (last == 0) return std::size_t{0};
    i = i < 0 ? -i : i;
    return static_cast<std::size_t>(i > last ? 2 * last - i : i);
  };
  for (std::size_t line = 0; line < lines; ++line) {
    float* const from = in.values.data() + line * pitch * n;
    float* const to = out.values.data() + line * pitch * static_cast<std::size_t>(samples.count);
    to_spline_coefficients(from, in.size[axis], pitch);
    for (int part = 0; part < samples.count * parts; ++part) {
      const int i = part / parts;
      const double off = samples.width() * ((part % parts + 0.5) / parts - 0.5);
      const double u = std::clamp(samples.first + i * samples.step + off, 0.0, static_cast<double>(last));
      const int base = std::min(static_cast<int>(u), std::max(last - 1, 0));
      const double t = u - base, s = 1 - t;
      const auto w0 = static_cast<float>(s * s * s / 6), w3 = static_cast<float>(t * t * t / 6);
      const auto w1 = static_cast<float>((4 - 6 * t * t + 3 * t * t * t) / 6),
                 w2 = static_cast<float>((4 - 6 * s * s + 3 * s * s * s) / 6);
      const float* const c0 = from + mirrored(base - 1) * pitch;
      const float* const c1 = from + mirrored(base) * pitch;
      const float* const c2 = from + mirrored(base + 1) * pitch;
      const float* const c3 = from + mirrored(base + 2) * pitch;
      float* const row = to + static_cast<std::size_t>(i) * pitch;
      for (std::size_t l = 0; l < pitch; ++l) row[l] += share * (w0 * c0[l] + w1 * c1[l] + w2 * c2[l] + w3 * c3[l]);
    }
  }
  return out;
}

}  // namespace detail

/// Returns a grid of the densities in `box` at another `spacing` [m], by interpolation with cubic B-splines.
///
/// A CT's coarse voxels make steps in what is seen and notches in what is drilled: a burr needs three voxels of radius
/// or more. Finer voxels around the place of work remove both. They add no detail that the scan has not.
///
/// Voxel (0, 0, 0) of the result is voxel `box.lo` of the source, at the same place in the world. The last ones lie at
/// or before `box.hi`. Samples that coincide with the source's have its densities, but for rounding. Integers are
/// rounded to the nearest and clamped to their range. Beside a step of density the interpolant over- and undershoots
/// by up to a tenth of the step. Along an axis with a coarser spacing each sample is the interpolant's mean over the
/// width that makes it a larger voxel's, so what is finer than a voxel averages out.
///
/// `box` is the whole grid unless given. Memory while it works: 4 bytes for each voxel of the result before its last
/// axis, and again after it. Cost: some 10 ns a voxel of the result; so not within a tick.
///
/// Throws std::invalid_argument where a spacing is not finite and > 0, where no voxel of the grid lies in the box, and
/// where the result would have more than 2³¹ − 1 voxels. Any thread while no other one writes the grid.
template <VoxelDensity Density>
[[nodiscard]] VoxelGrid<Density> resampled(const VoxelGrid<Density>& grid, const Vec3d& spacing,
                                           std::optional<VoxelBox> box = {}, const GridOptions& options = {}) {
  // Voxels beside the box that the spline still feels: the pole to this power is 1e-7.
  constexpr int kSplineReach = 12;
  VoxelBox part = box.value_or(VoxelBox{{0, 0, 0}, {grid.size()[0] - 1, grid.size()[1] - 1, grid.size()[2] - 1}});
  std::array<int, 3> from{};
  detail::Lattice lattice;
  std::array<detail::AxisSamples, 3> samples{};
  double voxels = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    const double wanted = spacing[static_cast<Eigen::Index>(a)], h = grid.spacing()[static_cast<Eigen::Index>(a)];
    if (!(wanted > 0) || !is_finite(wanted)) refuse("resampled", "spacing must be > 0 m", wanted);
    part.lo[a] = std::max(part.lo[a], 0);
    part.hi[a] = std::min(part.hi[a], grid.size()[a] - 1);
    if (part.hi[a] < part.lo[a]) refuse("resampled", "the box must hold voxels of the grid; along an axis it holds", 0);
    const double reach = kSplineReach + std::min(wanted / h, static_cast<double>(grid.size()[a]));
    const int margin = static_cast<int>(std::ceil(reach));
    from[a] = std::max(part.lo[a] - margin, 0);
    lattice.size[a] = std::min(part.hi[a] + margin, grid.size()[a] - 1) - from[a] + 1;
    // A sample that rounding puts a little beyond the last voxel is one more.
    constexpr double kRounding = 1e-9;
    const double count = std::floor((part.hi[a] - part.lo[a]) * h / wanted + kRounding) + 1;
    voxels *= count;
    if (!(voxels <= std::numeric_limits<int>::max()))
      refuse("resampled", "spacing is too small: too many voxels", wanted);
    samples[a] = {static_cast<double>(part.lo[a] - from[a]), wanted / h, static_cast<int>(count)};
  }
  lattice.values.reserve(static_cast<std::size_t>(lattice.size[0]) * static_cast<std::size_t>(lattice.size[1]) *
                         static_cast<std::size_t>(lattice.size[2]));
  for (int k = 0; k < lattice.size[2]; ++k)
    for (int j = 0; j < lattice.size[1]; ++j) {
      const Density* const row = grid.data() + grid.index(from[0], from[1] + j, from[2] + k);
      lattice.values.insert(lattice.values.end(), row, row + lattice.size[0]);
    }
  for (std::size_t a = 0; a < 3; ++a) lattice = detail::resampled_along(std::move(lattice), a, samples[a]);

  std::vector<Density> densities(lattice.values.size());
  std::transform(lattice.values.begin(), lattice.values.end(), densities.begin(), [](float v) {
    if constexpr (std::is_floating_point_v<Density>)
      return v;
    else
      return static_cast<Density>(std::lround(std::clamp(v, static_cast<float>(std::numeric_limits<Density>::lowest()),
                                                         static_cast<float>(std::numeric_limits<Density>::max()))));
  });
  Posed X_WG = grid.X_WG();
  X_WG.translation() += X_WG.linear() * grid.spacing().cwiseProduct(Vec3d(part.lo[0], part.lo[1], part.lo[2]));
  return {{.size = lattice.size, .spacing = spacing, .X_WG = X_WG, .outside = static_cast<double>(grid.outside())},
          std::span<const Density>(densities),
          options};
}

}  // namespace trephine
