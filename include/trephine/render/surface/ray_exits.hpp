// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tolerances.hpp>
#include <trephine/tool/surface_discretization.hpp>
#include <trephine/voxel/density_field.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// Exit distances of many rays that start in bone: for each ray the distance to the first surface. It samples rays in
/// batches, which is several times faster per ray than `first_crossing`, its equivalent for one segment.
///
/// A ray of length L is sampled every L / (16 lanes). `lanes` is the smallest number that makes this at most the given
/// step, limited to 64. False position then shrinks the bracket until no ray's distance changes by more than
/// `kSurfaceTolerance` voxels. A ray that never leaves bone gets L.
///
/// Work per ray: at most 16 · lanes + 12 samples, and less than a lane of padding for each batch of 32 rays and step.
/// Capacity is fixed at construction; nothing allocates after that.
template <RealScalar Scalar>
class RayExits {
 public:
  /// Room for `max_rays` rays.
  explicit RayExits(int max_rays) {
    const auto n = static_cast<std::size_t>(max_rays + kRays - 1) / kRays * kRays;  // batches are copied whole
    for (auto* v : {&x_, &y_, &z_, &dx_, &dy_, &dz_, &length_, &value_, &distance_, &cover_}) v->resize(n);
  }

  void clear() noexcept { count_ = 0; }
  [[nodiscard]] int count() const noexcept { return count_; }
  /// Exit distance of the i-th ray added [m], valid after `search`.
  [[nodiscard]] Scalar operator[](int i) const noexcept { return distance_[static_cast<std::size_t>(i)]; }

  /// Distance [m] from each ray's start back to the surface behind it, by linear extrapolation of the field along the
  /// ray's first step; the largest number if the field does not rise there. Valid after `search`.
  [[nodiscard]] std::span<const Scalar> covers() const noexcept {
    return {cover_.data(), static_cast<std::size_t>(count_)};
  }

  /// Adds a ray from `start` [m] along the unit `direction`, at most `length` [m] long. `value` >= 0 is the field at
  /// `start`. At most `max_rays` rays fit.
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

  /// Computes all exit distances. X maps the rays' frame to the field's; `step` is the largest sampling step [m].
  template <ContactField Field>
  void search(const Field& field, const Pose<Scalar>& X, Scalar step) noexcept {
    for (int first = 0; first < count_; first += kRays) {
      Batch b(*this, static_cast<std::size_t>(first));
      march(field, X, step, b);
      shrink_brackets(field, X, b);
      std::copy_n(b.distance.begin(), kRays, distance_.begin() + first);
      std::copy_n(b.cover.begin(), kRays, cover_.begin() + first);
    }
  }

 private:
  static constexpr int kRays = 32;           // rays per batch, the size of its local arrays
  static constexpr int kSteps = 8;           // steps sampled at once; more would sample farther past the surface
  static constexpr int kMaxLanes = 64;       // lanes of 16 steps per ray; bounds the work, longer rays get longer steps
  static constexpr int kMaxIterations = 12;  // of false position; bounds the work
  // Bone is flat if a chord's root, deeper in the bracket, has at least this share of the value before it.
  static constexpr auto kFlat = Scalar(0.9);
  using Rays = std::array<Scalar, kRays>;

  // Copy of one batch of rays. Loops over it run to a multiple of kLane over local arrays, the only loops that g++ -O2
  // vectorises. Rays beyond `count` are left from earlier searches; they have length 0 and count as outside at once.
  struct Batch {
    int count;
    Rays x, y, z, dx, dy, dz, length;
    // Bracket [lo, hi] of the exit distance and the field's values at its ends; hi is valid once `outside` is 1.
    Rays lo{}, hi{}, at_lo, at_hi{}, distance, cover;
    std::array<int, kRays> outside;

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
        outside[r] = is_ray ? 0 : 1;
      }
    }
    [[nodiscard]] std::size_t padded() const noexcept { return static_cast<std::size_t>(padded_to_lane(count)); }
  };

  // Stack buffer of points with the field's values; copies of the last point pad it to a lane.
  struct Points {
    std::array<Scalar, kRays * kSteps> x, y, z, value;
    // Initialises the first point alone: enough to silence g++'s warning about uninitialised arrays.
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

  // Number of lanes, of 16 steps each, that makes a step at most `step` [m] long.
  [[nodiscard]] static Scalar lanes_for(Scalar length, Scalar step) noexcept {
    const Scalar lanes = std::ceil(length / (step * Scalar(kLane)));
    return lanes < Scalar(kMaxLanes) ? std::max(Scalar(1), lanes) : Scalar(kMaxLanes);
  }

  // Stores the point of a ray at distance s as the buffer's point `at`.
  static void place(const Batch& b, std::size_t ray, Scalar s, Points& p, std::size_t at) noexcept {
    p.x[at] = b.x[ray] + s * b.dx[ray];
    p.y[at] = b.y[ray] + s * b.dy[ray];
    p.z[at] = b.z[ray] + s * b.dz[ray];
  }

  // Steps along all rays of a batch until each is outside bone or at its end, and stores the brackets.
  template <ContactField Field>
  static void march(const Field& field, const Pose<Scalar>& X, Scalar step, Batch& b) noexcept {
    const auto n = static_cast<std::size_t>(b.count);
    const std::size_t m = b.padded();
    Rays spacing;
    Scalar max_lanes = 1;
    for (std::size_t r = 0; r < n; ++r) max_lanes = std::max(max_lanes, lanes_for(b.length[r], step));
    for (std::size_t r = 0; r < m; ++r) spacing[r] = b.length[r] / (lanes_for(b.length[r], step) * Scalar(kLane));
    const int last = static_cast<int>(max_lanes) * kLane;
    Points p;
    for (int done = 0; done < last; done += kSteps) {
      // Points beyond a step's rays are overwritten by those of the next step.
      for (std::size_t j = 0; j < kSteps; ++j) {
        const Scalar steps = static_cast<Scalar>(done + static_cast<int>(j) + 1);
        for (std::size_t r = 0; r < m; ++r) place(b, r, std::min(steps * spacing[r], b.length[r]), p, j * n + r);
      }
      p.sample(field, X, kSteps * b.count);
      if (done == 0) measure_cover(spacing, p, b);
      // Counts, vectorised, the steps that each ray takes in bone; then stores each ray's bracket at their end.
      std::array<int, kRays> in_bone, inside{};
      for (std::size_t r = 0; r < m; ++r) in_bone[r] = 1 - b.outside[r];
      for (std::size_t j = 0; j < kSteps; ++j)
        for (std::size_t r = 0; r < m; ++r) {
          in_bone[r] = p.value[j * n + r] < Scalar(0) ? 0 : in_bone[r];
          inside[r] += in_bone[r];
        }
      const auto distance = [&](std::size_t r, std::size_t j) {
        return std::min(static_cast<Scalar>(done + static_cast<int>(j) + 1) * spacing[r], b.length[r]);
      };
      for (std::size_t r = 0; r < n; ++r) {
        if (b.outside[r] != 0) continue;
        const auto first_out = static_cast<std::size_t>(inside[r]);
        if (first_out > 0) {
          b.lo[r] = distance(r, first_out - 1);
          b.at_lo[r] = p.value[(first_out - 1) * n + r];
        }
        if (first_out == kSteps) continue;
        b.hi[r] = distance(r, first_out);
        b.at_hi[r] = p.value[first_out * n + r];
        b.outside[r] = 1;
      }
      int unfinished = 0;
      for (std::size_t r = 0; r < m; ++r) unfinished += 1 - b.outside[r];
      if (unfinished == 0) return;
    }
  }

  // Computes the rays' covers from the values at their starts and first steps.
  static void measure_cover(const Rays& spacing, const Points& p, Batch& b) noexcept {
    for (std::size_t r = 0; r < b.padded(); ++r) {
      const Scalar rise = p.value[r] - b.at_lo[r];
      b.cover[r] = rise > Scalar(0) ? b.at_lo[r] * spacing[r] / rise : std::numeric_limits<Scalar>::max();
    }
  }

  // Root of a bracket's chord.
  [[nodiscard]] static Scalar root(const Batch& b, std::size_t r) noexcept {
    const Scalar f = b.at_lo[r] / (b.at_lo[r] - b.at_hi[r]);
    return b.lo[r] + f * (b.hi[r] - b.lo[r]);
  }

  // Shrinks all brackets by the Illinois method: false position that halves the value of an end kept twice, so that
  // both ends converge. The result is the last chord's root. Bone whose density is flat up to its edge, at the isovalue
  // or close above it, has its chords' roots on the plateau: such a ray's bracket is halved instead, and its result is
  // the outer end, where the density has a slope.
  template <ContactField Field>
  static void shrink_brackets(const Field& field, const Pose<Scalar>& X, Batch& b) noexcept {
    const std::size_t m = b.padded();
    const Scalar tolerance = static_cast<Scalar>(kSurfaceTolerance) * field.voxel();
    std::array<int, kRays> kept{}, flat{};
    Rays value_lo = b.at_lo;  // not halved
    Points p;
    for (std::size_t r = 0; r < m; ++r) {
      const Scalar chord = root(b, r);
      b.distance[r] = b.outside[r] != 0 ? chord : b.length[r];
    }
    for (int i = 0; i < kMaxIterations; ++i) {
      for (std::size_t r = 0; r < m; ++r) place(b, r, b.distance[r], p, r);
      p.sample(field, X, b.count);
      int moving = 0;
      for (std::size_t r = 0; r < m; ++r) {
        const Scalar v = p.value[r];
        const Scalar s = b.distance[r];
        const bool is_outside = v < Scalar(0);
        const Scalar reduced_lo = kept[r] == 1 ? b.at_lo[r] / Scalar(2) : b.at_lo[r];
        const Scalar reduced_hi = kept[r] == 2 ? b.at_hi[r] / Scalar(2) : b.at_hi[r];
        flat[r] = !is_outside && v >= kFlat * value_lo[r] ? 1 : flat[r];
        value_lo[r] = is_outside ? value_lo[r] : v;
        b.hi[r] = is_outside ? s : b.hi[r];
        b.lo[r] = is_outside ? b.lo[r] : s;
        b.at_hi[r] = is_outside ? v : reduced_hi;
        b.at_lo[r] = is_outside ? reduced_lo : v;
        kept[r] = is_outside ? 1 : 2;
        const Scalar chord = flat[r] != 0 ? (b.lo[r] + b.hi[r]) / Scalar(2) : root(b, r);
        const bool has_bracket = b.outside[r] != 0 && static_cast<int>(r) < b.count;
        b.distance[r] = has_bracket ? chord : s;
        moving += has_bracket && std::abs(chord - s) > tolerance ? 1 : 0;
      }
      if (moving == 0) break;
    }
    for (std::size_t r = 0; r < m; ++r) b.distance[r] = flat[r] != 0 && b.outside[r] != 0 ? b.hi[r] : b.distance[r];
  }

  int count_ = 0;
  std::vector<Scalar> x_, y_, z_, dx_, dy_, dz_, length_, value_, distance_, cover_;
};

}  // namespace trephine
