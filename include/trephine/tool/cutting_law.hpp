// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/tool/cutting_edges.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

/// Forces of cutting edges by the bone that they remove: a mechanistic law, as its mean over a turn of the spindle.
namespace trephine::inline TREPHINE_ALIGNED {

/// Strength of bone by its density, relative to cortical bone: the square of the density above `soft`, over that of
/// cortical bone. Bone's strength grows with the square of its apparent density (Carter and Hayes 1977).
struct BoneStrength {
  double soft = 0;         ///< density without strength: of water, 0 HU
  double cortical = 1700;  ///< density of strength 1
  double most = 4;         ///< upper bound of the strength

  /// Throws std::invalid_argument.
  void validate() const {
    if (!is_finite(soft)) refuse("BoneStrength", "soft must be a finite density", soft);
    if (!(cortical > soft) || !is_finite(cortical)) refuse("BoneStrength", "cortical must exceed soft", cortical);
    if (!(most > 0) || !is_finite(most)) refuse("BoneStrength", "most must be > 0", most);
  }
  [[nodiscard]] double operator()(double density) const noexcept {
    const double relative = std::max(0.0, (density - soft) / (cortical - soft));
    return std::min(relative * relative, most);
  }
};

/// Which part of a head cuts, and how: sums over its elements that face the feed and have bone ahead. T axes, about T's
/// origin, for teeth that turn about +z. n is the normal, d the direction of feed, ρ the distance from the axis, s the
/// bone's strength, t the direction about the axis.
struct Engagement {
  double area = 0;               ///< Σ (d·n) A: bone removed by metre of feed [m²]
  double hard_area = 0;          ///< Σ s (d·n) A [m²]
  double facing_area = 0;        ///< Σ A [m²]
  double pressed = 0;            ///< Σ s (d·n)² A/ρ [m]
  double edge = 0;               ///< Σ s (d·n) A/ρ [m]: `around` if all of it pointed one way
  double tip = 0;                ///< mean of s (d·n) over the foremost elements
  Vec3d around = Vec3d::Zero();  ///< Σ s (d·n) A/ρ t [m]
  Vec3d moment = Vec3d::Zero();  ///< Σ s (d·n) A/ρ r × t [m²]; its z is `hard_area`
};

/// A mechanistic cutting law. An edge that takes a chip of thickness h gives, by length, the force
///
///     along its way:      u h + K_t (1 − exp(−h / h₀)),
///     against the feed:   κ u h + K_n (1 − exp(−h / h₀)).
///
/// A chip's energy by volume is u. The second term is the edge's own: it rubs and ploughs, and is whole once chips are
/// thicker than the edge's radius h₀. Wear w multiplies it by 1 + w. With z edges, a feed of x metres a radian makes
/// chips of h = 2π x (d·n) / z. All grows with the bone's strength.
///
/// Grains of a diamond meet bone with faces that lean far back, so their force against the feed is γ times the whole of
/// that along their way. The defaults are fitted to measurements; see `bench/cutting.md`.
struct CuttingLaw {
  double energy = 0.9e9;       ///< u [J/m³], of cortical bone; 0.9 J/mm³
  double thrust_ratio = 0.45;  ///< κ
  double edge_force = 16e3;    ///< K_t [N/m]
  double edge_thrust = 16e3;   ///< K_n [N/m]
  double edge_radius = 10e-6;  ///< h₀ [m]
  double grain_thrust = 2.1;   ///< γ
  double chisel = 50e3;        ///< thrust of a twist drill's web, by metre of the drill's radius [N/m]

  /// Throws std::invalid_argument.
  void validate() const {
    const auto refuse_unless = [](bool good, const char* rule, double got) {
      if (!good || !is_finite(got)) refuse("CuttingLaw", rule, got);
    };
    refuse_unless(energy > 0, "energy must be > 0 J/m3", energy);
    refuse_unless(thrust_ratio >= 0, "thrust_ratio must be >= 0", thrust_ratio);
    refuse_unless(edge_force >= 0, "edge_force must be >= 0 N/m", edge_force);
    refuse_unless(edge_thrust >= 0, "edge_thrust must be >= 0 N/m", edge_thrust);
    refuse_unless(thrust_ratio > 0 || edge_thrust > 0, "thrust_ratio or edge_thrust must be > 0", thrust_ratio);
    refuse_unless(edge_radius > 0, "edge_radius must be > 0 m", edge_radius);
    refuse_unless(grain_thrust > 0, "grain_thrust must be > 0", grain_thrust);
    refuse_unless(chisel >= 0, "chisel must be >= 0 N/m", chisel);
  }

  /// Share of an edge's own force at a chip [m].
  [[nodiscard]] double edge_share(double chip) const noexcept { return -std::expm1(-chip / edge_radius); }
  /// Chip of z edges at a feed of x metres a radian [m].
  [[nodiscard]] static double chip(double x, int edges) noexcept { return 2 * std::numbers::pi * x / edges; }

  /// Force of the edges about the axis: by this factor [N/m] times `Engagement::around` and `moment`.
  [[nodiscard]] double edges_around(double x, const CuttingEdges& edges) const noexcept {
    return of_all(edge_force, edges) * edge_share(chip(x, edges.count()));
  }
  /// Force against the feed [N] at x metres a radian. `radius` is the head's [m].
  [[nodiscard]] double thrust(double x, const Engagement& on, const CuttingEdges& edges, double radius) const noexcept {
    return chip_thrust(edges) * x * on.pressed + own_thrust(on, edges, radius) * edge_share(chip(x, edges.count()));
  }
  /// Largest pull across the axis [N] at x metres a radian: of all edges in one direction.
  [[nodiscard]] double most_pull(double x, const Engagement& on, const CuttingEdges& edges) const noexcept {
    return (energy * x + edges_around(x, edges)) * on.edge;
  }
  /// Torque about the axis [N·m] at x metres a radian.
  [[nodiscard]] double torque(double x, const Engagement& on, const CuttingEdges& edges) const noexcept {
    return (energy * x + edges_around(x, edges)) * on.hard_area;
  }
  /// Feed [m a radian] at which the thrust is `force` [N]: 0 if no part cuts.
  [[nodiscard]] double feed_under(double force, const Engagement& on, const CuttingEdges& edges,
                                  double radius) const noexcept {
    if (!(force > 0) || !(on.pressed > 0)) return 0;
    // The thrust grows with x, and its slope falls: Newton steps from 0 stay below the root.
    const double per_x = chip_thrust(edges) * on.pressed, own = own_thrust(on, edges, radius);
    const double rate = chip(1, edges.count()) / edge_radius;
    double x = 0;
    for (int i = 0; i < kMaxSteps; ++i) {
      const double rest = std::exp(-rate * x), slope = per_x + own * rate * rest;
      const double step = (force - per_x * x - own * (1 - rest)) / slope;
      if (!(step > kSmallStep * x) || !is_finite(step)) break;
      x += step;
    }
    return x;
  }

 private:
  static constexpr int kMaxSteps = 30;
  static constexpr double kSmallStep = 1e-6;

  [[nodiscard]] static bool has_grains(const CuttingEdges& edges) noexcept {
    return edges.kind == CuttingEdges::Kind::kDiamond;
  }
  /// An edge's own force [N/m] of all edges, by radian of the spindle, as wear has made it.
  [[nodiscard]] static double of_all(double force, const CuttingEdges& edges) noexcept {
    return force * edges.count() / (2 * std::numbers::pi) * (1 + edges.wear);
  }
  /// Thrust of chips, by metre of feed a radian and by `Engagement::pressed` [Pa].
  [[nodiscard]] double chip_thrust(const CuttingEdges& edges) const noexcept {
    return (has_grains(edges) ? grain_thrust : thrust_ratio) * energy;
  }
  /// Thrust of edges and chisel under thick chips [N].
  [[nodiscard]] double own_thrust(const Engagement& on, const CuttingEdges& edges, double radius) const noexcept {
    return of_all(has_grains(edges) ? grain_thrust * edge_force : edge_thrust, edges) * on.pressed +
           (edges.chisel ? chisel * radius * on.tip : 0.0);
  }
};

}  // namespace trephine
