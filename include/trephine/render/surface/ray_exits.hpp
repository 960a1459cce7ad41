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
class RayExits {
 public:
  explicit RayExits(int max_rays) {
    const auto n = static_cast<std::size_t>(max_rays + kRays - 1) / kRays * kRays;  // batches are copied whole
    for (auto* v : {&x_, &y_, &z_, &dx_, &dy_, &dz_, &length_, &value_, &way_}) v->resize(n);
  }

  void clear() noexcept { count_ = 0; }
  [[nodiscard]] int count() const noexcept { return count_; }
  /// Distance of ray i in the order they were added [m], after `search`.
  [[nodiscard]] Scalar operator[](int i) const noexcept { return way_[static_cast<std::size_t>(i)]; }

  /// A ray from `start` along the unit `direction`; `value` is the field's there, >= 0. At most `max_rays` of them.
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
      Batch b(*this, static_cast<std::size_t>(first));
      march(field, X, step, b);
      close(field, X, b);
      std::copy_n(b.way.begin(), kRays, way_.begin() + first);
    }
  }

 private:
  static constexpr int kRays = 32;        // a batch
  static constexpr int kSteps = 8;        // marched at once
  static constexpr int kMostLanes = 64;   // of 16 steps
  static constexpr int kMostClosing = 8;  // of false position
  using Rays = std::array<Scalar, kRays>;

  // Rays of one batch, copied. Loops over it go on to a multiple of kLane, and its arrays are no one else's: g++ -O2
  // vectorises no others. Rays beyond `count` are left from earlier searches; they have no length and are out from the
  // start.
  struct Batch {
    int count;
    Rays x, y, z, dx, dy, dz, length;
    // [lo, hi] with the field's values there, hi outside once the ray is `out`.
    Rays lo{}, hi{}, at_lo, at_hi{}, way;
    std::array<int, kRays> out;

    Batch(const RayExits& all, std::size_t first) noexcept
        : count(std::min(all.count_ - static_cast<int>(first), kRays)) {
      const auto copy = [first](const std::vector<Scalar>& from, Rays& to) {
        std::copy_n(from.data() + first, kRays, to.begin());
      };
      copy(all.x_, x);
      copy(all.y_, y);
      copy(all.z_, z);
      copy(all.dx_, dx);
      copy(all.dy_, dy);
      copy(all.dz_, dz);
      copy(all.length_, length);
      copy(all.value_, at_lo);
      for (std::size_t r = 0; r < kRays; ++r) {
        const bool is_ray = static_cast<int>(r) < count;
        length[r] = is_ray ? length[r] : Scalar(0);
        out[r] = is_ray ? 0 : 1;
      }
    }
    [[nodiscard]] std::size_t padded() const noexcept { return static_cast<std::size_t>(padded_to_lane(count)); }
  };

  // field.value at n points of a stack buffer, n padded to a lane by copies of the last.
  struct Points {
    std::array<Scalar, kRays * kSteps> x, y, z, value;
    // Of the first alone, so that g++ does not take the arrays for ones that nobody writes.
    Points() noexcept { x[0] = y[0] = z[0] = value[0] = Scalar(0); }
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

  // Of 16 steps, how many make a step at most `step`.
  [[nodiscard]] static Scalar lanes_for(Scalar length, Scalar step) noexcept {
    const Scalar wanted = std::ceil(length / (step * Scalar(kLane)));
    return wanted < Scalar(kMostLanes) ? std::max(Scalar(1), wanted) : Scalar(kMostLanes);
  }

  static void place(const Batch& b, std::size_t ray, Scalar s, Points& p, std::size_t at) noexcept {
    p.x[at] = b.x[ray] + s * b.dx[ray];
    p.y[at] = b.y[ray] + s * b.dy[ray];
    p.z[at] = b.z[ray] + s * b.dz[ray];
  }

  template <ContactField Field>
  static void march(const Field& field, const Pose<Scalar>& X, Scalar step, Batch& b) noexcept {
    const auto n = static_cast<std::size_t>(b.count);
    const std::size_t m = b.padded();
    Rays spacing;
    Scalar most = 1;
    for (std::size_t r = 0; r < n; ++r) most = std::max(most, lanes_for(b.length[r], step));
    for (std::size_t r = 0; r < m; ++r) spacing[r] = b.length[r] / (lanes_for(b.length[r], step) * Scalar(kLane));
    const int last = static_cast<int>(most) * kLane;
    Points p;
    for (int done = 0; done < last; done += kSteps) {
      // What is placed beyond the rays of a step, those of the next replace.
      for (std::size_t j = 0; j < kSteps; ++j) {
        const Scalar steps = static_cast<Scalar>(done + static_cast<int>(j) + 1);
        for (std::size_t r = 0; r < m; ++r) place(b, r, std::min(steps * spacing[r], b.length[r]), p, j * n + r);
      }
      p.sample(field, X, kSteps * b.count);
      // How many of these steps each ray takes in bone, which vectors count, and then for each ray what is at their
      // end.
      std::array<int, kRays> open, inside{};
      for (std::size_t r = 0; r < m; ++r) open[r] = 1 - b.out[r];
      for (std::size_t j = 0; j < kSteps; ++j)
        for (std::size_t r = 0; r < m; ++r) {
          open[r] = p.value[j * n + r] < Scalar(0) ? 0 : open[r];
          inside[r] += open[r];
        }
      const auto way = [&](std::size_t r, std::size_t j) {
        return std::min(static_cast<Scalar>(done + static_cast<int>(j) + 1) * spacing[r], b.length[r]);
      };
      for (std::size_t r = 0; r < n; ++r) {
        if (b.out[r] != 0) continue;
        const auto first_out = static_cast<std::size_t>(inside[r]);
        if (first_out > 0) {
          b.lo[r] = way(r, first_out - 1);
          b.at_lo[r] = p.value[(first_out - 1) * n + r];
        }
        if (first_out == kSteps) continue;
        b.hi[r] = way(r, first_out);
        b.at_hi[r] = p.value[first_out * n + r];
        b.out[r] = 1;
      }
      int in_bone = 0;
      for (std::size_t r = 0; r < m; ++r) in_bone += 1 - b.out[r];
      if (in_bone == 0) return;
    }
  }

  // Where the chord of a bracket crosses 0.
  [[nodiscard]] static Scalar root(const Batch& b, std::size_t r) noexcept {
    const Scalar f = b.at_lo[r] / (b.at_lo[r] - b.at_hi[r]);
    return b.lo[r] + f * (b.hi[r] - b.lo[r]);
  }

  // Illinois: an end that is kept twice counts for half, so that both close in. Ends with the last chord's root.
  template <ContactField Field>
  static void close(const Field& field, const Pose<Scalar>& X, Batch& b) noexcept {
    const std::size_t m = b.padded();
    const Scalar enough = static_cast<Scalar>(kSurfaceTolerance) * field.voxel();
    std::array<int, kRays> kept{};
    Points p;
    for (std::size_t r = 0; r < m; ++r) {
      const Scalar chord = root(b, r);
      b.way[r] = b.out[r] != 0 ? chord : b.length[r];
    }
    for (int i = 0; i < kMostClosing; ++i) {
      for (std::size_t r = 0; r < m; ++r) place(b, r, b.way[r], p, r);
      p.sample(field, X, b.count);
      int moving = 0;
      for (std::size_t r = 0; r < m; ++r) {
        const Scalar v = p.value[r];
        const Scalar s = b.way[r];
        const bool leaves = v < Scalar(0);
        const Scalar lo_again = kept[r] == 1 ? b.at_lo[r] / Scalar(2) : b.at_lo[r];
        const Scalar hi_again = kept[r] == 2 ? b.at_hi[r] / Scalar(2) : b.at_hi[r];
        b.hi[r] = leaves ? s : b.hi[r];
        b.lo[r] = leaves ? b.lo[r] : s;
        b.at_hi[r] = leaves ? v : hi_again;
        b.at_lo[r] = leaves ? lo_again : v;
        kept[r] = leaves ? 1 : 2;
        const Scalar chord = root(b, r);
        const bool closing = b.out[r] != 0 && static_cast<int>(r) < b.count;
        b.way[r] = closing ? chord : s;
        moving += closing && std::abs(chord - s) > enough ? 1 : 0;
      }
      if (moving == 0) return;
    }
  }

  int count_ = 0;
  std::vector<Scalar> x_, y_, z_, dx_, dy_, dz_, length_, value_, way_;
};

}  // namespace trephine
