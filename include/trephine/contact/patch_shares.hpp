// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/discretization.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace trephine {

/// What share of a contact each patch of a ball has. Patches overlap, and where several have the same deepest place it
/// counts once. Of a place beyond its patch the share is none, as it is a neighbour's; from nothing at the patch's edge
/// it grows toward its middle, so that nothing steps. That the deepest is not lost where neighbours miss it, the shares
/// round it are made up to one. Allocates at construction alone.
template <RealScalar Scalar>
class PatchShares {
 public:
  /// Of a ball of `radius` [m] with `count` patches that reach so far [rad] round their vertices.
  PatchShares(Scalar radius, Scalar reach, int count)
      : radius2_(radius * radius),
        cosine_(std::cos(reach)),
        reach2_(reach * reach * radius * radius),
        inside_(static_cast<std::size_t>(count)),
        shares_(static_cast<std::size_t>(count)) {}

  /// Of the j-th place divided up.
  [[nodiscard]] Scalar of(int j) const noexcept { return shares_[static_cast<std::size_t>(j)]; }

  /// Of the first `count` places, in T, where patches are so deep (`values`); `vertex(j)` is that of the j-th. Those
  /// less deep than `outside` have none.
  template <class Vertex>
  void divide(const PointArrays<Scalar>& places, const std::vector<Scalar>& values, int count, Scalar outside,
              Vertex&& vertex) noexcept {
    int deepest = -1;
    for (int j = 0; j < count; ++j) {
      const auto at = static_cast<std::size_t>(j);
      inside_[at] = Scalar(0);
      if (!(values[at] >= outside)) continue;
      if (deepest < 0 || values[at] > values[static_cast<std::size_t>(deepest)]) deepest = j;
      const Scalar within = places[j].dot(vertex(j)) / radius2_ - cosine_;
      if (!(within > Scalar(0))) continue;
      const Scalar t = std::min(within / (kRim * (Scalar(1) - cosine_)), Scalar(1));
      inside_[at] = t * t * (3 - 2 * t);
    }
    for (int j = 0; j < count; ++j) {
      const auto at = static_cast<std::size_t>(j);
      shares_[at] =
          inside_[at] > Scalar(0) ? inside_[at] / std::max(Scalar(1), round(places, inside_, count, j)) : Scalar(0);
    }
    if (deepest >= 0)
      shares_[static_cast<std::size_t>(deepest)] += std::max(Scalar(0), 1 - round(places, shares_, count, deepest));
  }

 private:
  static constexpr Scalar kRim = Scalar(0.3);  // of a patch' cap, where its share grows

  /// What there is of `parts` round a place, less from farther off, up to a patch' reach.
  [[nodiscard]] Scalar round(const PointArrays<Scalar>& places, const std::vector<Scalar>& parts, int count,
                             int place) const noexcept {
    const Vec3<Scalar> middle = places[place];
    Scalar sum = Scalar(0);
    for (int i = 0; i < count; ++i)
      if (const Scalar part = parts[static_cast<std::size_t>(i)]; part > Scalar(0))
        sum += part * std::max(Scalar(0), Scalar(1) - (places[i] - middle).squaredNorm() / reach2_);
    return sum;
  }

  Scalar radius2_, cosine_, reach2_;
  std::vector<Scalar> inside_, shares_;
};

}  // namespace trephine
