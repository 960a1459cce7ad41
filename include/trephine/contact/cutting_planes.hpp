// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/vertex_patch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

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

/// The least of a few planes, and where on a patch that is greatest (Kelley's cutting planes). There the planes that
/// bind are equal, and of all places where they are it lies farthest along their gradients; by duality it lies farthest
/// of the patch along a mixture of these, of weights that sum to 1. With three planes those that bind are one of seven
/// sets, and the place of each is known in closed form: that which the planes let be deepest is it.
template <RealScalar Scalar>
class CuttingPlanes {
 public:
  static constexpr int kMost = 3;  // planes: what holds a place on a surface, a corner's

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

  /// Where on the patch the least plane is greatest; the mixture is then of those that bind.
  Vec3<Scalar> deepest(const VertexPatch<Scalar>& patch) noexcept {
    Best best;
    for (std::size_t i = 0; i < size(); ++i) {
      offer(patch.farthest(planes_[i].gradient), {}, best);
      for (std::size_t k = 0; k < i; ++k) meet(patch, k, i, best);
    }
    if (count_ == kMost && patch.ball) meet_all(patch, best);
    if (weights_ = best.weights; weights_ == std::array<Scalar, kMost>{}) weights_[least_at(best.place)] = Scalar(1);
    return best.place;
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
  struct Best {
    Vec3<Scalar> place = Vec3<Scalar>::Zero();
    Scalar depth = std::numeric_limits<Scalar>::lowest();
    std::array<Scalar, kMost> weights{};
  };

  [[nodiscard]] std::size_t size() const noexcept { return static_cast<std::size_t>(count_); }

  [[nodiscard]] std::size_t least_at(const Vec3<Scalar>& p) const noexcept {
    std::size_t least = 0;
    for (std::size_t i = 1; i < size(); ++i)
      if (planes_[i](p) < planes_[least](p)) least = i;
    return least;
  }

  /// `weights`: zero where one plane alone binds.
  void offer(const Vec3<Scalar>& p, const std::array<Scalar, kMost>& weights, Best& best) const noexcept {
    Scalar least = planes_[0](p);
    for (std::size_t i = 1; i < size(); ++i) least = std::min(least, planes_[i](p));
    if (least > best.depth) best = {p, least, weights};
  }

  /// Where planes k and l are equal: on a circle of the ball within the patch, or at two places of its edge.
  void meet(const VertexPatch<Scalar>& patch, std::size_t k, std::size_t l, Best& best) const noexcept {
    const Vec3<Scalar> from = patch.across(planes_[k].gradient);
    const Vec3<Scalar> apart = patch.across(Vec3<Scalar>(planes_[l].gradient - planes_[k].gradient));
    Scalar equal = planes_[k].offset - planes_[l].offset;
    if (!patch.ball) equal -= (planes_[l].gradient.z() - planes_[k].gradient.z()) * patch.height;
    Vec3<Scalar> p;
    Scalar share;
    if (farthest_on(from, apart, equal, patch.radius, p, share) && patch.holds(p)) {
      if (share >= Scalar(0) && share <= Scalar(1)) offer_pair(patch.raised(p), k, l, share, best);
      return;
    }
    if (!patch.ball) return;  // one plane alone binds at an arc's end
    const auto beside = [&](const Vec3<Scalar>& v) { return Vec3<Scalar>(v - v.dot(patch.axis) * patch.axis); };
    const Vec3<Scalar> middle = (patch.radius * patch.cosine) * patch.axis;
    if (farthest_on(beside(from), beside(apart), equal - apart.dot(middle), patch.radius * patch.sine, p, share) &&
        share >= Scalar(0) && share <= Scalar(1))
      offer_pair(Vec3<Scalar>(middle + p), k, l, share, best);
  }

  void offer_pair(const Vec3<Scalar>& p, std::size_t k, std::size_t l, Scalar share, Best& best) const noexcept {
    std::array<Scalar, kMost> weights{};
    weights[k] = Scalar(1) - share;
    weights[l] = share;
    offer(p, weights, best);
  }

  /// Of a ball of this radius and the places p with apart·p = equal the one farthest along `from`, which is parallel to
  /// from + share·apart. Returns whether there is one.
  [[nodiscard]] static bool farthest_on(const Vec3<Scalar>& from, const Vec3<Scalar>& apart, Scalar equal,
                                        Scalar radius, Vec3<Scalar>& p, Scalar& share) noexcept {
    const Scalar apart2 = apart.squaredNorm();
    const Scalar rest2 = radius * radius * apart2 - equal * equal;
    if (!(rest2 > Scalar(0))) return false;
    const Scalar along = from.dot(apart) / apart2;
    const Vec3<Scalar> square = from - along * apart;
    const Scalar square2 = square.squaredNorm();
    if (!(square2 > Scalar(1e-12) * apart2)) return false;
    const Scalar to_square = std::sqrt(rest2 / (apart2 * square2));
    p = (equal / apart2) * apart + to_square * square;
    share = equal / (apart2 * to_square) - along;
    return true;
  }

  /// Where on the ball all three are equal.
  void meet_all(const VertexPatch<Scalar>& patch, Best& best) const noexcept {
    const Vec3<Scalar>& from = planes_[0].gradient;
    const Vec3<Scalar> a = planes_[1].gradient - from, b = planes_[2].gradient - from;
    const Vec3<Scalar> line = a.cross(b);
    const Scalar line2 = line.squaredNorm();
    if (!(line2 > Scalar(1e-12) * a.squaredNorm() * b.squaredNorm())) return;
    // What is 1 along a and 0 along b, and the other way round.
    const Vec3<Scalar> by_a = b.cross(line) / line2, by_b = line.cross(a) / line2;
    const Vec3<Scalar> foot =
        (planes_[0].offset - planes_[1].offset) * by_a + (planes_[0].offset - planes_[2].offset) * by_b;
    const Scalar rest2 = patch.radius * patch.radius - foot.squaredNorm();
    const Scalar rise = from.dot(line);
    if (!(rest2 > Scalar(0)) || rise == Scalar(0)) return;
    const Vec3<Scalar> p = foot + std::copysign(std::sqrt(rest2 / line2), rise) * line;
    if (!patch.holds(p)) return;
    const Vec3<Scalar> mixed = (rise / p.dot(line)) * p - from;
    const Scalar w1 = mixed.dot(by_a), w2 = mixed.dot(by_b);
    if (w1 >= Scalar(0) && w2 >= Scalar(0) && w1 + w2 <= Scalar(1)) offer(p, {Scalar(1) - w1 - w2, w1, w2}, best);
  }

  std::array<DepthPlane<Scalar>, kMost> planes_;
  std::array<Scalar, kMost> weights_{};
  int count_ = 0;
};

}  // namespace trephine
