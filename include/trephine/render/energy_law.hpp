// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/vertex_contacts.hpp>
#include <trephine/contact/ways_out.hpp>

#include <concepts>
#include <numbers>
#include <span>

/// What energy a vertex in bone has, and what follows from it: U_i = ½ k w_i u(pose), w_i the area [m²] that the vertex
/// stands for, k a foundation's stiffness [N/m³].
namespace trephine {

/// U / (k w) [m²] of one vertex, and −∂/∂pose of it: a force at `lever` from T's origin, and a couple beside it, in G.
struct EnergyTerm {
  double energy = 0;
  Vec3d force = Vec3d::Zero();
  Vec3d lever = Vec3d::Zero();
  Vec3d couple = Vec3d::Zero();
  Vec3d out = Vec3d::Zero();  ///< out of the bone there
  bool known = true;          ///< false: beyond what the law can tell; no force
};

/// u = φ², φ the vertex' depth: one sample, and a direction as deep as depths reach. No rays, no grazing case.
class DepthLaw {
 public:
  template <class Tool>
  explicit DepthLaw(const Tool&) {}

  /// F / (k δ) of the ball of radius R [m] on a plane in the continuum, δ = R/2: F = k π R δ².
  [[nodiscard]] static double per_stiffness(double R) noexcept { return std::numbers::pi * R * R / 2; }

  template <class Field, class Tool, RealScalar Scalar>
  void look(const Field&, const Tool&, const Pose<Scalar>&, std::span<const VertexContact>) noexcept {}

  [[nodiscard]] EnergyTerm term(std::size_t, const VertexContact& c) const noexcept {
    return {0.5 * c.depth * c.depth, c.depth * c.out, c.lever, Vec3d::Zero(), c.out, c.out.squaredNorm() > 0};
  }
};

/// u = g(n·d) a², a the vertex' way out along its unit direction d toward its group's centre, n the outward normal
/// where it comes out, at c: Eq. 15's springs, but the force acts at c, along n. With cosθ = n·d
///
///     ∂a/∂x = −n / cosθ,    f = k w a (g n / cosθ − ½ g' a b)  at c,    couple = −½ k w g' a² (d × n),
///     b = m − n (m·d) / cosθ,    m = ∂cosθ/∂c = −∇∇φ (d − n cosθ) / |∇φ|.
///
/// The weight g falls from 1 at cosθ = .3 to 0 at .1, where a ray grazes the surface, and is differentiated too. On a
/// plane F = 2πR³k(−ln(1−ε) − ε), ε = δ/R, below ε = .7; it would diverge at 1. A ray that meets no surface on its way
/// to the centre has no energy: U jumps there. So this law is for shallow contact, and for comparison (energy of
/// springs along rays: our own derivation).
template <RealScalar Scalar>
class RayLaw {
 public:
  using Tool = ToolDiscretization<SurfaceCounts, Scalar>;
  explicit RayLaw(const Tool& tool) : ways_(tool.periphery()), terms_(static_cast<std::size_t>(tool.periphery())) {}

  [[nodiscard]] static double per_stiffness(double R) noexcept {
    return 4 * std::numbers::pi * R * R * (std::numbers::ln2 - 0.5);
  }

  /// Follows the rays of all vertices in bone.
  template <class Field>
  void look(const Field& field, const Tool& tool, const Pose<Scalar>& X,
            std::span<const VertexContact> found) noexcept {
    constexpr Scalar kStep = Scalar(0.5);  // [voxels]
    const auto radius = [&](int vertex) {
      return static_cast<Scalar>(vertex < tool.groups()[0].count ? tool.burr().tip_radius : tool.burr().shaft_radius);
    };
    ways_.clear();
    for (const VertexContact& c : found)
      ways_.add(tool.points()[c.vertex], tool.inward()[c.vertex], radius(c.vertex),
                static_cast<Scalar>(c.depth) / field.metres());
    ways_.search(field, X, kStep * field.voxel());
    for (std::size_t i = 0; i < found.size(); ++i) {
      const int vertex = found[i].vertex;
      terms_[i] =
          follow(field, X, tool.points()[vertex], tool.inward()[vertex], ways_[static_cast<int>(i)], radius(vertex));
    }
  }

  [[nodiscard]] EnergyTerm term(std::size_t i, const VertexContact&) const noexcept { return terms_[i]; }

 private:
  static constexpr double kGrazing = 0.1, kFull = 0.3;  // cosθ where g is 0, and 1

  template <class Field>
  [[nodiscard]] static EnergyTerm follow(const Field& field, const Pose<Scalar>& X, const Vec3<Scalar>& vertex,
                                         const Vec3<Scalar>& inward, Scalar way, Scalar radius) noexcept {
    const Vec3<Scalar> start = X * vertex, along = X.linear() * inward;
    EnergyTerm t;
    t.lever = (start - X.translation()).template cast<double>();
    t.known = false;
    if (!(way < radius)) return t;
    // The search ends within a tolerance; what is differentiated must be the crossing itself.
    constexpr int kPolish = 4;
    Vec3<Scalar> c = start + way * along, q = field.gradient(c);
    for (int i = 0; i < kPolish; ++i) {
      const Scalar slope = q.dot(along);
      if (!(slope < Scalar(0))) return t;  // grazes, or is flat
      way -= field.value(c) / slope;
      c = start + way * along;
      q = field.gradient(c);
    }
    const double steepness = static_cast<double>(q.norm());
    if (!(steepness > 0) || !(way > Scalar(0))) return t;
    const Vec3d n = -q.template cast<double>() / steepness, d = along.template cast<double>();
    const double a = static_cast<double>(way), cosine = n.dot(d);
    if (!(cosine > kGrazing)) return t;
    t.known = true;
    // Smoothstep between the two.
    const double s = std::min(1.0, (cosine - kGrazing) / (kFull - kGrazing));
    const double g = s * s * (3 - 2 * s), rise = 6 * s * (1 - s) / (kFull - kGrazing);
    t.energy = 0.5 * g * a * a;
    t.force = (g * a / cosine) * n;
    t.lever = (c - X.translation()).template cast<double>();
    t.out = n;
    if (rise > 0) {
      const Vec3d m = -(field.hessian(c).template cast<double>() * (d - cosine * n)) / steepness;
      const Vec3d b = m - (m.dot(d) / cosine) * n;
      t.force -= (0.5 * rise * a * a) * b;
      t.couple = (-0.5 * rise * a * a) * d.cross(n);
    }
    return t;
  }

  WaysOut<Scalar> ways_;
  std::vector<EnergyTerm> terms_;
};

template <class L, class Scalar>
concept EnergyLaw = std::same_as<L, DepthLaw> || std::same_as<L, RayLaw<Scalar>>;

}  // namespace trephine
