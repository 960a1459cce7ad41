// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/finite.hpp>
#include <trephine/core/math.hpp>
#include <trephine/render/stiffness_budget.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

/// Springs of a tool's contacts that share one stiffness budget.
namespace trephine::inline TREPHINE_ALIGNED {

/// Contact springs of a tool that act at the same height, as an input of the budget.
struct SpringGroup {
  double stiffness = 0;  ///< largest tangent stiffness of the group by itself [N/m]
  double lever = 0;      ///< distance of its force from T [m]
};

/// True if all groups together, each at its largest stiffness, are within the budget without sharing.
[[nodiscard]] inline bool fits(const StiffnessBudget& budget, const std::vector<SpringGroup>& groups) noexcept {
  double linear = 0, angular = 0;
  for (const SpringGroup& g : groups) {
    linear += g.stiffness;
    angular += g.stiffness * g.lever * g.lever;
  }
  return linear <= budget.linear && angular <= budget.angular;
}

/// Shares a stiffness budget between groups of springs without generating energy.
///
/// Springs add up: K = Σ k_i, K_θ = Σ k_i h_i². A factor from the number of contacts would limit the sum, but it jumps
/// with each vertex that enters or leaves, and a jump of the force generates energy. The groups' energies are therefore
/// combined by a norm close to their maximum:
///
///     U = s (Σ (c_g U_g)^q)^(1/q),  q = 4,     F_g' = s c_g (c_g U_g / (Σ (c U)^q)^(1/q))^(q-1) F_g .
///
/// If each F_g is the gradient of an energy, F_g' is too. It is continuous in the pose, and zero for a group that has
/// just made contact. c_g = min(1, K/k_g, K_θ/(k_g h_g²)) keeps each group alone within the budget. s keeps shafts that
/// lie flush or tilted on bone within it. N equal groups are N^(1/q) times as stiff as a single group (2.1 for 20), not
/// N times. The cost is that a single group has only 1/N^(1/q) of the budget.
///
/// Factors do not depend on the order of calls; no allocation after construction.
template <RealScalar Scalar>
class SharedStiffness {
  // Exponent of the norm of displacements, p = 2q. A larger q leaves a single group more of the budget but switches
  // more abruptly between groups. `share` has the powers for q = 4 written out.
  static constexpr int kNorm = 8;
  // Depth of a tilted shaft's shallow end over its deep end, for the largest stiffness.
  static constexpr double kShallowEnd = 0.1;
  static constexpr double kTiny = 1e-300;  // avoids a division by zero without groups

 public:
  /// Throws std::invalid_argument for a budget out of range.
  SharedStiffness(const StiffnessBudget& budget, const std::vector<SpringGroup>& groups)
      : caps_(groups.size()), energies_(groups.size()), factors_(groups.size()) {
    budget.validate();
    std::vector<SpringGroup> capped = groups;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const double k = groups[g].stiffness, angular = k * groups[g].lever * groups[g].lever;
      double cap = 1;
      if (k > budget.linear) cap = budget.linear / k;
      if (angular * cap > budget.angular) cap = budget.angular / angular;
      caps_[g] = static_cast<Scalar>(cap);
      capped[g].stiffness *= cap;
    }
    const MaxStiffness max = max_stiffness(capped);
    const double scale =
        std::min({1.0, budget.linear / std::max(max.linear, kTiny), budget.angular / std::max(max.angular, kTiny)});
    for (Scalar& cap : caps_) cap *= static_cast<Scalar>(scale);
  }

  /// Sets the energy of group g's springs, without the budget [J].
  void set_energy(std::size_t g, Scalar energy) noexcept { energies_[g] = energy; }

  /// Computes all factors; call it once all energies are set.
  void share() noexcept {
    Scalar largest = Scalar(0);
    for (std::size_t g = 0; g < caps_.size(); ++g) largest = std::max(largest, caps_[g] * energies_[g]);
    if (!(largest > Scalar(0)) || !is_finite(largest)) {
      factors_ = caps_;
      return;
    }
    Scalar sum = Scalar(0);
    for (std::size_t g = 0; g < caps_.size(); ++g) {
      const Scalar x = caps_[g] * energies_[g] / largest;
      factors_[g] = x * x * x;
      sum += factors_[g] * x;
    }
    const Scalar root = std::sqrt(std::sqrt(sum));
    const Scalar per_root3 = Scalar(1) / (root * root * root);
    for (std::size_t g = 0; g < caps_.size(); ++g) factors_[g] *= caps_[g] * per_root3;
  }
  /// Factor of group g's force, valid after `share`.
  [[nodiscard]] Scalar factor(std::size_t g) const noexcept { return factors_[g]; }
  /// Factor of group g's force if no other group is in contact.
  [[nodiscard]] Scalar alone(std::size_t g) const noexcept { return caps_[g]; }

 private:
  struct MaxStiffness {
    double linear = 0, angular = 0;
  };

  /// Largest second derivatives of U for a translation across the shaft and a rotation about T. The maximum is over
  /// shafts that touch a plane with any run of neighbouring groups, flush or tilted either way.
  [[nodiscard]] static MaxStiffness max_stiffness(const std::vector<SpringGroup>& groups) {
    MaxStiffness max;
    constexpr double kRise = 0.9;  // 1 − kShallowEnd
    std::vector<double> depth;
    for (std::size_t first = 0; first < groups.size(); ++first)
      for (std::size_t last = first; last < groups.size(); ++last)
        for (const int tilt : {-1, 0, 1}) {
          depth.clear();
          for (std::size_t g = first; g <= last; ++g) {
            const double along = last > first ? static_cast<double>(g - first) / static_cast<double>(last - first) : 1;
            depth.push_back(tilt == 0 ? 1 : tilt > 0 ? kShallowEnd + kRise * along : 1 - kRise * along);
          }
          max.linear = std::max(max.linear, curvature(groups, first, depth, false));
          max.angular = std::max(max.angular, curvature(groups, first, depth, true));
        }
    return max;
  }

  /// Second derivative of ½ ‖u‖_p², p = 2q, u_g = √k_g a_g, along d_g = √k_g (for a rotation √k_g h_g):
  /// ‖u‖^(2−p) [(p−1) Σ u^(p−2) d² − (p−2) ‖u‖^(−p) (Σ u^(p−1) d)²].
  [[nodiscard]] static double curvature(const std::vector<SpringGroup>& groups, std::size_t first,
                                        const std::vector<double>& depth, bool rotation) {
    double norm = 0, squares = 0, slope = 0;
    for (std::size_t i = 0; i < depth.size(); ++i) {
      const SpringGroup& group = groups[first + i];
      const double root = std::sqrt(group.stiffness);
      const double u = root * depth[i], d = root * (rotation ? group.lever : 1);
      const double u6 = std::pow(u, kNorm - 2);
      norm += u6 * u * u;
      squares += u6 * d * d;
      slope += u6 * u * d;
    }
    if (!(norm > 0)) return 0;
    return std::pow(norm, 2.0 / kNorm - 1) * ((kNorm - 1) * squares - (kNorm - 2) * slope * slope / norm);
  }

  std::vector<Scalar> caps_;  // s c_g
  std::vector<Scalar> energies_, factors_;
};

}  // namespace trephine
