// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tolerances.hpp>
#include <trephine/tool/discretization.hpp>
#include <trephine/voxel/density_field.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace trephine {

/// Ways out of bone, many at once: for each of a list of rays that start in bone the distance to the first surface.
/// What `first_crossing` does for one segment, in batches of samples, which is several times as fast a ray.
///
/// A ray of length L is looked at every L / (16 lanes), `lanes` the least that makes this at most the step asked for
/// (and at most 64); the bracket found is closed by false position until no ray's answer moves by more than
/// `kSurfaceTolerance` voxels. A ray that never leaves the bone answers L.
///
/// Work a ray: at most 16 · lanes + 8 samples, and less than a lane of padding for each batch of 32 rays and step.
/// Capacity is fixed at construction; nothing allocates after that.
template <RealScalar Scalar>
class WaysOut {
 public:
  explicit WaysOut(int most_rays) {
    const auto n = static_cast<std::size_t>(most_rays);
    for (auto* v : {&x_, &y_, &z_, &dx_, &dy_, &dz_, &length_, &value_, &way_}) v->resize(n);
  }

  void clear() noexcept { count_ = 0; }
  [[nodiscard]] int count() const noexcept { return count_; }
  /// Distance of ray i in the order they were added [m], after `search`.
  [[nodiscard]] Scalar operator[](int i) const noexcept { return way_[static_cast<std::size_t>(i)]; }

  /// A ray from `start` along the unit `direction`; `value` is the field's there, >= 0. At most `most_rays` of them.
  void add(const Vec3<Scalar>& start, const Vec3<Scalar>& direction, Scalar length, Scalar value) noexcept {
    const auto i = static_cast<std::size_t>(count_++);
    x_[i] = start.x();
    y_[i] = start.y();
    z_[i] = start.z();
    dx_[i] = direction.x();
    dy_[i] = direction.y();
    dz_[i] = direction.z();
    length_[i] = length;
    value_[i] = value;
  }

  /// Rays are given in a frame that X maps to the field's; `step` [m].
  template <ContactField Field>
  void search(const Field& field, const Pose<Scalar>& X, Scalar step) noexcept {
    for (int first = 0; first < count_; first += kRays) {
      Brackets b;
      b.count = std::min(count_ - first, kRays);
      march(field, X, step, static_cast<std::size_t>(first), b);
      close(field, X, static_cast<std::size_t>(first), b);
    }
  }

 private:
  static constexpr int kRays = 32;        // a batch
  static constexpr int kSteps = 8;        // marched at once
  static constexpr int kMostLanes = 64;   // of 16 steps
  static constexpr int kMostClosing = 8;  // of false position
  using Rays = std::array<Scalar, kRays>;

  // Of each ray: [lo, hi] with the field's values there, hi outside once the ray is `out`.
  struct Brackets {
    int count = 0;
    Rays lo{}, hi{}, at_lo{}, at_hi{};
    std::array<int, kRays> out{};
  };

  // field.value at n points of a stack buffer, n padded to a lane by copies of the last.
  struct Points {
    std::array<Scalar, kRays * kSteps> x, y, z, value;
    template <ContactField Field>
    void sample(const Field& field, const Pose<Scalar>& X, int n) noexcept {
      const int padded = padded_to_lane(n);
      for (auto i = static_cast<std::size_t>(n); i < static_cast<std::size_t>(padded); ++i) {
        x[i] = x[static_cast<std::size_t>(n) - 1];
        y[i] = y[static_cast<std::size_t>(n) - 1];
        z[i] = z[static_cast<std::size_t>(n) - 1];
      }
      field.values(X, x.data(), y.data(), z.data(), value.data(), padded);
    }
  };

  [[nodiscard]] static int lanes_for(Scalar length, Scalar step) noexcept {
    const Scalar wanted = std::ceil(length / (step * Scalar(kLane)));
    return wanted < Scalar(kMostLanes) ? std::max(1, static_cast<int>(wanted)) : kMostLanes;
  }

  void place(std::size_t ray, Scalar s, Points& p, std::size_t at) const noexcept {
    p.x[at] = x_[ray] + s * dx_[ray];
    p.y[at] = y_[ray] + s * dy_[ray];
    p.z[at] = z_[ray] + s * dz_[ray];
  }

  template <ContactField Field>
  void march(const Field& field, const Pose<Scalar>& X, Scalar step, std::size_t first, Brackets& b) const noexcept {
    const auto n = static_cast<std::size_t>(b.count);
    Rays spacing;
    int most = 0;
    for (std::size_t r = 0; r < n; ++r) {
      const int lanes = lanes_for(length_[first + r], step);
      most = std::max(most, lanes);
      spacing[r] = length_[first + r] / static_cast<Scalar>(lanes * kLane);
      b.at_lo[r] = value_[first + r];
    }
    Points p;
    for (int done = 0; done < most * kLane; done += kSteps) {
      for (std::size_t j = 0; j < kSteps; ++j) {
        const Scalar steps = static_cast<Scalar>(done + static_cast<int>(j) + 1);
        for (std::size_t r = 0; r < n; ++r)
          place(first + r, std::min(steps * spacing[r], length_[first + r]), p, j * n + r);
      }
      p.sample(field, X, kSteps * b.count);
      int out = 0;
      for (std::size_t j = 0; j < kSteps; ++j) {
        const Scalar steps = static_cast<Scalar>(done + static_cast<int>(j) + 1);
        for (std::size_t r = 0; r < n; ++r) {
          const Scalar v = p.value[j * n + r];
          const Scalar s = std::min(steps * spacing[r], length_[first + r]);
          const bool open = b.out[r] == 0;
          const bool leaves = v < Scalar(0);
          b.hi[r] = open ? s : b.hi[r];
          b.at_hi[r] = open ? v : b.at_hi[r];
          b.lo[r] = open && !leaves ? s : b.lo[r];
          b.at_lo[r] = open && !leaves ? v : b.at_lo[r];
          b.out[r] = open && leaves ? 1 : b.out[r];
        }
      }
      for (std::size_t r = 0; r < n; ++r) out += b.out[r];
      if (out == b.count) return;
    }
  }

  // Illinois: an end that is kept twice counts for half, so that both close in. Ends with the last chord's root.
  template <ContactField Field>
  void close(const Field& field, const Pose<Scalar>& X, std::size_t first, Brackets& b) noexcept {
    const auto n = static_cast<std::size_t>(b.count);
    const Scalar enough = static_cast<Scalar>(kSurfaceTolerance) * field.voxel();
    std::array<int, kRays> kept{};
    Points p;
    const auto root = [&b](std::size_t r) {
      const Scalar f = b.at_lo[r] / (b.at_lo[r] - b.at_hi[r]);
      return b.lo[r] + f * (b.hi[r] - b.lo[r]);
    };
    for (std::size_t r = 0; r < n; ++r) way_[first + r] = b.out[r] != 0 ? root(r) : length_[first + r];
    for (int i = 0; i < kMostClosing; ++i) {
      for (std::size_t r = 0; r < n; ++r) place(first + r, way_[first + r], p, r);
      p.sample(field, X, b.count);
      Scalar moved = 0;
      for (std::size_t r = 0; r < n; ++r) {
        if (b.out[r] == 0) continue;
        const Scalar v = p.value[r];
        if (v < Scalar(0)) {
          b.hi[r] = way_[first + r];
          b.at_hi[r] = v;
          if (kept[r] == 1) b.at_lo[r] /= Scalar(2);
          kept[r] = 1;
        } else {
          b.lo[r] = way_[first + r];
          b.at_lo[r] = v;
          if (kept[r] == 2) b.at_hi[r] /= Scalar(2);
          kept[r] = 2;
        }
        const Scalar next = root(r);
        moved = std::max(moved, std::abs(next - way_[first + r]));
        way_[first + r] = next;
      }
      if (moved <= enough) return;
    }
  }

  int count_ = 0;
  std::vector<Scalar> x_, y_, z_, dx_, dy_, dz_, length_, value_, way_;
};

}  // namespace trephine
