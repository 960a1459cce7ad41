// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

/// Parts of guides: bounded springs, wells that end at a distance, and gains that change without a step.
namespace trephine::inline TREPHINE_ALIGNED::detail {

/// A spring of a distance q >= 0 that pulls with k q up to a greatest force, and with that force beyond. Its energy is
/// a parabola that continues as a line, with a continuous slope. With a stiffness of 0 there is no spring.
struct BoundedSpring {
  double stiffness = 0;  // k [N/m], or [N·m/rad] for an angle
  double force = 0;      // greatest [N], or [N·m]

  [[nodiscard]] double energy(double q) const noexcept {  // [J]
    if (stiffness * q <= force) return 0.5 * stiffness * q * q;
    return force * (q - 0.5 * force / stiffness);
  }
  [[nodiscard]] double pull(double q) const noexcept { return std::min(stiffness * q, force); }
  /// Returns pull/q, which is finite at 0.
  [[nodiscard]] double secant(double q) const noexcept { return stiffness * q <= force ? stiffness : force / q; }
};

/// Shape of a potential that ends: follows the energy e of its springs up to a quarter of the depth, then levels off,
/// and is constant from e = depth on. Its slope falls from 1 to 0 in proportion to e, so that forces are continuous.
struct CaptureWell {
  double depth = std::numeric_limits<double>::infinity();  // [J]

  /// Share of the depth up to which springs act in full: half the capture radius of a spring that is not saturated.
  static constexpr double kFullShare = 0.25;

  struct Value {
    double energy;  // [J]
    double slope;   // d energy / d e: the share of the springs' forces, in [0, 1]
  };
  [[nodiscard]] Value at(double e) const noexcept {
    const double full = kFullShare * depth;
    if (e <= full) return {e, 1};
    const double width = depth - full;
    const double slope = std::max((depth - e) / width, 0.0);
    return {full + 0.5 * width * (1 - slope * slope), slope};
  }
};

/// Smooth minimum of two numbers, exact where they differ by `blend` or more. `share` is its derivative by x, in [0,
/// 1]; that by y is 1 − share. Both are continuous.
struct SmoothMinimum {
  double value;
  double share;

  [[nodiscard]] static SmoothMinimum of(double x, double y, double blend) noexcept {
    const double h = std::max(blend - std::abs(x - y), 0.0);
    return {std::min(x, y) - h * h / (4 * blend), std::clamp(0.5 + (y - x) / (2 * blend), 0.0, 1.0)};
  }
};

/// Shortens v to `limit`. A force that was dissipated from by damping stays so.
[[nodiscard]] inline Vec3d shortened(const Vec3d& v, double limit) noexcept {
  const double length = v.norm();
  return length > limit ? Vec3d(v * (limit / length)) : v;
}

/// The gain of a guide whose options may change at any tick. It rises from 0 to 1 in `Options::ramp` seconds while the
/// guide is enabled, and falls likewise. Options that change the law wait until the gain has fallen to 0.
template <class Options>
class GuideGain {
 public:
  explicit GuideGain(const Options& options) noexcept : wanted_(options), active_(options) {}

  [[nodiscard]] const Options& wanted() const noexcept { return wanted_; }
  [[nodiscard]] const Options& active() const noexcept { return active_; }
  void adopt(const Options& options) noexcept { wanted_ = options; }

  /// Sets the gain to 0.
  void restart() noexcept {
    level_ = 0;
    active_ = wanted_;
  }
  /// Advances by dt [s] and returns the gain.
  double advance(double dt) noexcept {
    const bool waits = !active_.has_law_of(wanted_);
    const double step = dt / wanted_.ramp;
    level_ = std::clamp(level_ + (wanted_.enabled && !waits ? step : -step), 0.0, 1.0);
    if (waits && level_ == 0) active_ = wanted_;
    return gain();
  }
  /// Returns the gain in [0, 1]; its rate is continuous, at most 1.5/ramp a second, and 0 at both ends.
  [[nodiscard]] double gain() const noexcept { return level_ * level_ * (3 - 2 * level_); }

 private:
  Options wanted_;
  Options active_;  // of the law in force
  double level_ = 0;
};

}  // namespace trephine::detail
