// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

namespace trephine {

/// A bound on depth, linear in the place: where bone is convex, what its depth and gradient at one place tell of all.
template <RealScalar Scalar>
struct DepthPlane {
  Vec3<Scalar> gradient = Vec3<Scalar>::Zero();
  Scalar offset = Scalar(0);
  DepthPlane() = default;
  DepthPlane(const Vec3<Scalar>& p, Scalar depth, const Vec3<Scalar>& g) noexcept
      : gradient(g), offset(depth - g.dot(p)) {}
  [[nodiscard]] Scalar operator()(const Vec3<Scalar>& p) const noexcept { return offset + gradient.dot(p); }
};

/// The least of a few planes, and where on a patch that is greatest (Kelley's cutting planes): by duality the place
/// that lies farthest along that mixture of their gradients, of weights that sum to 1, whose bound is least. Pairs of
/// weights are minimised in turn, until no plane is passed by more than `within` or a number of times.
template <RealScalar Scalar>
class CuttingPlanes {
 public:
  static constexpr int kMost = 3;  // planes: what holds a place on a surface, a corner's

  /// `within`: depths that differ by less are the same.
  explicit CuttingPlanes(Scalar within) noexcept : within_(within) {}

  /// In the place of the one that weighs least.
  void add(const DepthPlane<Scalar>& plane) noexcept {
    int at = count_;
    if (count_ < kMost)
      ++count_;
    else
      at = static_cast<int>(std::min_element(weights_.begin(), weights_.end()) - weights_.begin());
    const auto a = static_cast<std::size_t>(at);
    planes_[a] = plane;
    weights_[a] = count_ == 1 ? Scalar(1) : Scalar(0);
    Scalar sum = Scalar(0);
    for (std::size_t i = 0; i < static_cast<std::size_t>(count_); ++i) sum += weights_[i];
    for (std::size_t i = 0; i < static_cast<std::size_t>(count_); ++i) weights_[i] /= sum;
  }

  /// Raises planes that cut off a depth that was found: bone is not convex everywhere.
  void lift(const Vec3<Scalar>& p, Scalar depth) noexcept {
    for (std::size_t i = 0; i < static_cast<std::size_t>(count_); ++i)
      planes_[i].offset += std::max(Scalar(0), depth - planes_[i](p));
  }

  /// `farthest(g)`: the place that lies farthest along g.
  template <class Farthest>
  Vec3<Scalar> deepest(const Farthest& farthest) noexcept {
    bool moved = true;
    for (int sweep = 0; moved && sweep < (count_ > 2 ? kSweeps : 1); ++sweep) {
      moved = false;
      for (int k = 1; k < count_; ++k)
        for (int l = 0; l < k; ++l)
          moved |= balance(static_cast<std::size_t>(k), static_cast<std::size_t>(l), farthest);
    }
    return farthest(mixture().gradient);
  }

  /// The ways in which a place at the edge or corner where planes meet cannot glide: what their gradients differ by,
  /// square to `out` and to each other; on an edge one, on a corner two, zero else.
  [[nodiscard]] std::array<Vec3<Scalar>, 2> crossings(const Vec3<Scalar>& out) const noexcept {
    const Vec3<Scalar> middle = mixture().gradient;
    std::array<Vec3<Scalar>, 2> ways{Vec3<Scalar>::Zero(), Vec3<Scalar>::Zero()};
    for (std::size_t w = 0; w < ways.size(); ++w) {
      Scalar farthest = kSame * kSame * middle.squaredNorm();
      for (std::size_t i = 0; i < static_cast<std::size_t>(count_); ++i) {
        if (!(weights_[i] > kBinds)) continue;
        Vec3<Scalar> d = planes_[i].gradient - middle;
        d -= d.dot(out) * out;
        if (w > 0) d -= d.dot(ways[0]) * ways[0];
        if (!(d.squaredNorm() > farthest)) continue;
        farthest = d.squaredNorm();
        ways[w] = d.normalized();
      }
      if (ways[w].isZero(0)) break;
    }
    return ways;
  }

  [[nodiscard]] DepthPlane<Scalar> mixture() const noexcept {
    DepthPlane<Scalar> m;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count_); ++i) {
      m.gradient += weights_[i] * planes_[i].gradient;
      m.offset += weights_[i] * planes_[i].offset;
    }
    return m;
  }

 private:
  // Fewer leave planes that bind out of the mixture, and a place is then sought where there is none.
  static constexpr int kSweeps = 8;
  static constexpr int kSecants = 8;
  static constexpr Scalar kBinds = Scalar(1e-3);  // less weight says nothing
  static constexpr Scalar kSame = Scalar(0.1);    // of a gradient: those of one face differ by less

  /// Shares the weight of two planes so that both bind, or that alone which binds. Returns whether they did not yet.
  template <class Farthest>
  bool balance(std::size_t k, std::size_t l, const Farthest& farthest) noexcept {
    const Scalar both = weights_[k] + weights_[l];
    if (!(both > Scalar(0))) return false;
    const Vec3<Scalar> apart = planes_[k].gradient - planes_[l].gradient;
    const Scalar above = planes_[k].offset - planes_[l].offset;
    const Vec3<Scalar> rest = mixture().gradient - weights_[k] * apart;
    const auto excess = [&](Scalar w) {
      weights_[k] = w;
      weights_[l] = both - w;
      return above + apart.dot(farthest(Vec3<Scalar>(rest + w * apart)));
    };
    Scalar low = weights_[k], high = low;
    Scalar at_low = excess(low), at_high = at_low;
    if (std::abs(at_low) <= within_) return false;
    if (at_low < Scalar(0)) {
      if (high == both) return false;
      at_high = excess(high = both);
      if (at_high <= Scalar(0)) return true;
    } else {
      if (low == Scalar(0)) return false;
      at_low = excess(low = Scalar(0));
      if (at_low >= Scalar(0)) return true;
    }
    int side = 0;
    for (int i = 0; i < kSecants; ++i) {  // regula falsi, the end that stays halved (Illinois)
      const Scalar w = (low * at_high - high * at_low) / (at_high - at_low);
      const Scalar e = excess(w);
      if (std::abs(e) <= within_) break;
      if (e < Scalar(0)) {
        low = w;
        at_low = e;
        if (std::exchange(side, -1) == -1) at_high /= Scalar(2);
      } else {
        high = w;
        at_high = e;
        if (std::exchange(side, 1) == 1) at_low /= Scalar(2);
      }
    }
    return true;
  }

  Scalar within_;
  std::array<DepthPlane<Scalar>, kMost> planes_;
  std::array<Scalar, kMost> weights_{};
  int count_ = 0;
};

}  // namespace trephine
