// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/friction.hpp>
#include <trephine/contact/vertex_contacts.hpp>

#include <algorithm>
#include <limits>
#include <vector>

namespace trephine {

/// Friction of a tool's vertices: each in contact has a spring, as stiff as its contact, along the surface from where
/// it stuck; Coulomb's law lets that point slip after it (Eriksson 2006; thesis 2.1.3, at every vertex instead of the
/// tip). As both springs are equally stiff, the law's cone of forces is a cone of distances. A tool at rest does not
/// creep: its points stay where they are. Places of one vertex share its spring; where together they weigh more than
/// they did, it is stretched the less, so that its force stays and no energy comes with the weight. A law that holds
/// nothing (`Coulomb{0, 0}`) is asked once, and is as none.
template <Friction Law>
class FrictionContacts {
 public:
  FrictionContacts(const Law& law, std::size_t vertices)
      : law_(law), holds_(!(law.slip(std::numeric_limits<double>::min(), 1.0, true) > 0)), springs_(vertices) {}

  /// Whether there is any friction.
  [[nodiscard]] bool holds() const noexcept { return holds_; }

  void reset() noexcept { std::fill(springs_.begin(), springs_.end(), Spring{}); }

  /// A tick begins with the tool at X.
  void begin(const Posed& X) noexcept { X_begin_ = X; }

  /// Vertices that touch are unstretched where they are, unless they touched already.
  void enter(std::span<const VertexContact> found, const Posed& X) noexcept {
    if (!holds_) return;
    for (const VertexContact& c : found) spring(c).weight_now = 0;
    for (const VertexContact& c : found) {
      Spring& s = spring(c);
      s.weight_now += c.weight;
      if (s.held) continue;
      s = {.stretch = -way(c, X), .weight_now = s.weight_now, .held = true};
    }
  }

  /// Adds the contact's friction at pose X to a Newton system: `k` [N/m], H its stiffness, `residual` its wrench.
  template <class MatN, class VecN>
  void add(const VertexContact& c, const Posed& X, double k, MatN& H, VecN& residual) const noexcept {
    if (!holds_) return;
    const Stretch s = stretch(c, X);
    Mat3d K = k * (Mat3d::Identity() - s.normal * s.normal.transpose());
    Vec3d f = -k * s.along;
    if (s.slides) {
      // The force keeps its magnitude and turns with the direction of the stretch.
      const double share = s.length > 0 ? (s.length - s.slip) / s.length : 0.0;
      const Vec3d t = s.length > 0 ? Vec3d(s.along / s.length) : Vec3d(Vec3d::Zero());
      K = share * (K - k * t * t.transpose());
      f *= share;
    }
    constexpr int kDof = VecN::RowsAtCompileTime;
    Eigen::Matrix<double, 3, kDof> J;
    J.template leftCols<3>().setIdentity();
    if constexpr (kDof == 6)
      J.template rightCols<3>() << 0, c.lever.z(), -c.lever.y(), -c.lever.z(), 0, c.lever.x(), c.lever.y(),
          -c.lever.x(), 0;
    H += J.transpose() * K * J;
    residual += J.transpose() * f;
  }

  /// Energy / (k/2) [m²] that the contact's spring has at pose X, once it slipped.
  [[nodiscard]] double energy(const VertexContact& c, const Posed& X) const noexcept {
    if (!holds_) return 0;
    const Stretch s = stretch(c, X);
    return (s.length - s.slip) * (s.length - s.slip);
  }

  /// Lets the contact slip as far as its law says; returns its friction force / k [m].
  Vec3d settle(const VertexContact& c, const Posed& X) noexcept {
    if (!holds_) return Vec3d::Zero();
    Spring& spring = this->spring(c);
    const Stretch s = stretch(c, X);
    Vec3d along = s.along;
    if (s.slip > 0) along *= (s.length - s.slip) / s.length;
    spring.held = true;
    spring.settled += c.weight * along;
    spring.settled_weight += c.weight;
    spring.slipped = spring.slipped || s.slip > 0;
    return -along;
  }

  /// After every contact of a tick has settled: forgets the vertices that touch no more.
  void end() noexcept {
    if (!holds_) return;
    for (Spring& s : springs_) {
      if (!s.held) continue;
      if (s.settled_weight > 0)
        s = {.stretch = s.settled / s.settled_weight,
             .weight = s.settled_weight,
             .weight_now = s.settled_weight,
             .held = true,
             .sticks = !s.slipped};
      else
        s = {};
    }
  }

 private:
  struct Spring {
    Vec3d stretch = Vec3d::Zero();                            // when the tick began, in G [m]
    double weight = std::numeric_limits<double>::infinity();  // likewise, of its places; of a new one, any
    double weight_now = 0;
    bool held = false;
    bool sticks = false;
    bool slipped = false;           // in this tick
    Vec3d settled = Vec3d::Zero();  // stretches at the tick's end, by weight
    double settled_weight = 0;
  };

  struct Stretch {
    Vec3d normal;  // unit
    Vec3d along;   // from where it stuck, along the surface [m]
    double length;
    double depth;  // of the normal spring [m]
    double slip;
    bool slides;
  };

  [[nodiscard]] Spring& spring(const VertexContact& c) noexcept { return springs_[static_cast<std::size_t>(c.vertex)]; }
  [[nodiscard]] const Spring& spring(const VertexContact& c) const noexcept {
    return springs_[static_cast<std::size_t>(c.vertex)];
  }

  /// How far the tool's material at a contact has gone since the tick began: where on the tool it touches may glide,
  /// which is no slip.
  [[nodiscard]] Vec3d way(const VertexContact& c, const Posed& X) const noexcept {
    const Vec3d before = X_begin_.linear() * (X.linear().transpose() * c.lever) + X_begin_.translation();
    return X.translation() + c.lever - before;
  }

  [[nodiscard]] Stretch stretch(const VertexContact& c, const Posed& X) const noexcept {
    const Spring& of = spring(c);
    Stretch s;
    const double steepness = c.out.norm();
    s.normal = steepness > 0 ? Vec3d(c.out / steepness) : Vec3d(Vec3d::Zero());
    const Vec3d d = std::min(1.0, of.weight / of.weight_now) * of.stretch + way(c, X);
    s.along = d - d.dot(s.normal) * s.normal;
    s.length = s.along.norm();
    s.depth = c.depth * steepness;
    s.slip = law_.slip(s.length, s.depth, of.sticks);
    // A point that slipped at the last tick is on the edge of its cone: it goes on unless it is pulled back.
    s.slides = s.slip > 0 || (!of.sticks && s.length > 0 && law_.slip(s.length * (1 + 1e-6), s.depth, false) > 0);
    return s;
  }

  Law law_;
  bool holds_;
  Posed X_begin_ = Posed::Identity();
  std::vector<Spring> springs_;  // of each vertex
};

template <>
class FrictionContacts<Frictionless> {
 public:
  FrictionContacts(const Frictionless&, std::size_t) {}
  [[nodiscard]] static constexpr bool holds() noexcept { return false; }
  void reset() noexcept {}
  void begin(const Posed&) noexcept {}
  void enter(std::span<const VertexContact>, const Posed&) noexcept {}
  template <class MatN, class VecN>
  void add(const VertexContact&, const Posed&, double, MatN&, VecN&) const noexcept {}
  [[nodiscard]] static constexpr double energy(const VertexContact&, const Posed&) noexcept { return 0; }
  Vec3d settle(const VertexContact&, const Posed&) noexcept { return Vec3d::Zero(); }
  void end() noexcept {}
};

}  // namespace trephine
