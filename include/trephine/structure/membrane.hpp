// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/finite.hpp>
#include <trephine/core/refuse.hpp>

#include <cmath>
#include <numbers>

namespace trephine::inline TREPHINE_ALIGNED {

/// Force of a ball that is pressed into a membrane, by its depth v [m]: linear and stiffening up to rupture, where the
/// force stays.
///
///     Ψ' = k₁ v + k₃ v³  for v <= rupture_depth,    Ψ' = rupture_force  beyond
struct MembraneLaw {
  double linear = 0;          ///< k₁ [N/m]
  double cubic = 0;           ///< k₃ [N/m³]
  double rupture_depth = 0;   ///< [m]
  double rupture_force = 0;   ///< [N]
  double rupture_energy = 0;  ///< [J]

  struct Response {
    double force, tangent, energy;  ///< Ψ' [N], Ψ'' [N/m], Ψ [J]
  };
  [[nodiscard]] Response at(double v) const noexcept {
    if (v > rupture_depth) return {rupture_force, 0, rupture_energy + rupture_force * (v - rupture_depth)};
    const double v2 = v * v;
    return {(linear + cubic * v2) * v, linear + 3 * cubic * v2, (linear / 2 + cubic * v2 / 4) * v2};
  }
};

/// A membrane over a soft structure: dura over brain, the wall of a venous sinus, the sheath of a nerve.
///
/// *Spring.* A ball presses the middle of a piece of radius a = `span` that is held at its rim. Under the tension N the
/// force is linear; with depth it grows by the stretch. For E = `modulus`, t = `thickness`, ν = `poisson`
///
///     F = π N v + q³ E t v³ / a²,    q = 1 / (1.05 − 0.15 ν − 0.16 ν²).
///
/// Both terms are the known limits of a membrane under a small indenter, and their sum is an interpolation (Lee 2008,
/// doi:10.1126/science.1157996; its errors: Vella and Davidovitch 2017, doi:10.1039/c6sm02451c).
///
/// *Rupture.* Under a ball of radius R the largest stress is √(F E / (4π R t)) where stretch prevails (the same paper).
/// So the strength σ is reached at F = 4π R t σ² / E: twice as large a burr needs twice the force.
struct Membrane {
  double modulus = 70e6;    ///< E [Pa], > 0
  double strength = 7e6;    ///< σ [Pa], > 0 and at most a third of E
  double thickness = 5e-4;  ///< t [m], > 0
  double span = 10e-3;      ///< a [m], > 0: radius of what bone or tissue leaves free
  double tension = 47;      ///< N [N/m], >= 0, before contact
  double poisson = 0.45;    ///< ν, in [0, 0.5]
  double rest = 0.1;        ///< depth that a torn place counts as, over its depth, in [0, 1]
  double tear_time = 0.05;  ///< in which a place tears, linearly in time [s], > 0

  /// Throws std::invalid_argument if a number is out of range.
  void validate() const {
    const auto positive = [](const char* rule, double v) {
      if (!(v > 0) || !is_finite(v)) refuse("Membrane", rule, v);
    };
    positive("modulus must be > 0 Pa", modulus);
    positive("strength must be > 0 Pa", strength);
    if (!(strength <= modulus / 3)) refuse("Membrane", "strength must be at most a third of the modulus", strength);
    positive("thickness must be > 0 m", thickness);
    positive("span must be > 0 m", span);
    if (!(thickness <= 0.01)) refuse("Membrane", "thickness must be at most 0.01 m", thickness);
    if (!(span <= 0.2)) refuse("Membrane", "span must be at most 0.2 m", span);
    if (!(tension >= 0) || !is_finite(tension)) refuse("Membrane", "tension must be >= 0 N/m", tension);
    if (!(poisson >= 0) || !(poisson <= 0.5)) refuse("Membrane", "poisson must be 0 to 0.5", poisson);
    if (!(rest >= 0) || !(rest <= 1)) refuse("Membrane", "rest must be 0 to 1", rest);
    positive("tear_time must be > 0 s", tear_time);
  }

  /// Returns the true law for a ball of `radius` [m] > 0, of which a device gets the share `scale`. Depths are the true
  /// ones at any share.
  [[nodiscard]] MembraneLaw law(double radius, double scale = 1) const noexcept {
    const double q = 1 / (1.05 - 0.15 * poisson - 0.16 * poisson * poisson);
    MembraneLaw law{.linear = std::numbers::pi * tension, .cubic = q * q * q * modulus * thickness / (span * span)};
    const double force = 4 * std::numbers::pi * radius * thickness * strength * strength / modulus;
    // F is convex: Newton's method from above goes down to the root.
    double v = std::cbrt(force / law.cubic);
    for (int i = 0; i < kRootSteps; ++i)
      v -= (law.linear * v + law.cubic * v * v * v - force) / (law.linear + 3 * law.cubic * v * v);
    law.linear *= scale;
    law.cubic *= scale;
    law.rupture_depth = v;
    law.rupture_force = scale * force;
    law.rupture_energy = (law.linear / 2 + law.cubic * v * v / 4) * v * v;
    return law;
  }

 private:
  static constexpr int kRootSteps = 60;
};

/// Dura mater over the brain. E = 70 MPa and σ = 7 MPa are means of 73 fresh human temporal duras, with standard
/// deviations of 44 and 4 MPa (Zwirner 2019, doi:10.1038/s41598-019-52836-9). σ/E is a strain of 10 %; they measured
/// 11 %. The tension is that of 1.33 kPa (10 mmHg) of pressure within a sphere of 70 mm, p r / 2.
/// Thickness and span are estimates. A burr of 3 mm then dents 2.5 mm before it ruptures; spinal dura dents 2 to 6 mm
/// under a needle (Zarzur 1992, Reg Anesth 17:216).
[[nodiscard]] constexpr Membrane dura() noexcept { return {}; }

/// Wall of a venous sinus. It is made of dura, so E and σ are the dura's. The rest are estimates: a vessel of 5 mm in
/// radius under 1.33 kPa has the tension p r and that span, and its wall is taken as thinner.
[[nodiscard]] constexpr Membrane sinus_wall() noexcept { return {.thickness = 3e-4, .span = 5e-3, .tension = 6.7}; }

/// Sheath of a nerve of 1 to 2 mm. All are estimates, of the order of tests on nerves' connective tissue and roots; no
/// measurement of a burr on a nerve was found.
[[nodiscard]] constexpr Membrane nerve() noexcept {
  return {.modulus = 30e6, .strength = 2e6, .thickness = 1e-4, .span = 3e-3, .tension = 5};
}

/// Options of a SoftStructures.
struct SoftOptions {
  double smoothing = 0.6e-3;  ///< of the distances [m], as a guard's (`GuardPotentialOptions`)
  double force_scale = 1;     ///< share of the true forces that the device gets, in (0, 1]; as a CuttingForce's

  /// Throws std::invalid_argument.
  void validate() const {
    if (!(force_scale > 0) || !(force_scale <= 1)) refuse("SoftOptions", "force_scale must be in (0, 1]", force_scale);
  }
};

}  // namespace trephine
