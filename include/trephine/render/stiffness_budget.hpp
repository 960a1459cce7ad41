// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/refuse.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace trephine {

/// The largest tangent stiffness that a tool may be felt with at T, however many of its vertices touch: what the device
/// renders stably (`DeviceCapabilities`), in the world's measures.
struct StiffnessBudget {
  double linear = 0;   ///< [N/m], > 0
  double angular = 0;  ///< about T [N·m/rad], > 0

  /// Throws std::invalid_argument.
  void validate() const {
    if (!(linear > 0) || !std::isfinite(linear)) refuse("StiffnessBudget", "linear must be > 0 N/m", linear);
    if (!(angular > 0) || !std::isfinite(angular)) refuse("StiffnessBudget", "angular must be > 0 N·m/rad", angular);
  }
};

/// A group of contact springs that act at one height of the tool, as the budget sees it.
struct SpringGroup {
  double stiffness = 0;  ///< largest tangent stiffness of the group by itself [N/m]
  double lever = 0;      ///< distance of its force from T [m]
  bool force = true;     ///< counts for the linear stiffness (a shaft that gives torque alone does not)
};

/// Whether all groups together, each as stiff as it gets, are within the budget as they are: nothing is to be shared.
[[nodiscard]] inline bool fits(const StiffnessBudget& budget, const std::vector<SpringGroup>& groups) noexcept {
  double linear = 0, angular = 0;
  for (const SpringGroup& g : groups) {
    if (g.force) linear += g.stiffness;
    angular += g.stiffness * g.lever * g.lever;
  }
  return linear <= budget.linear && angular <= budget.angular;
}

/// How groups of springs share a stiffness budget without making energy.
///
/// Springs add up: K = Σ k_i, K_θ = Σ k_i h_i². A factor that follows the number of contacts would keep the sum, but it
/// jumps with each vertex that enters or leaves, and a force that jumps makes energy. So it is the energies that are
/// joined, by a norm that is nearly their maximum:
///
///     U = s (Σ (c_g U_g)^q)^(1/q),  q = 4,     F_g' = s c_g (c_g U_g / (Σ (c U)^q)^(1/q))^(q-1) F_g .
///
/// That is again the gradient of an energy where the F_g are, steady in the pose, with a force of zero for a group that
/// has just touched. c_g = min(1, K/k_g, K_θ/(k_g h_g²)) keeps each group within the budget by itself; s keeps flush
/// and leaning shafts within it: N equal groups are N^(1/q) times as stiff as one (2.1 for 20), not N times. The price
/// is that one group alone has 1/N^(1/q) of the budget, not all.
///
/// Factors do not depend on the order of calls; no allocation after construction.
template <RealScalar Scalar>
class SharedStiffness {
 public:
  /// Throws std::invalid_argument for a budget out of range.
  SharedStiffness(const StiffnessBudget& budget, const std::vector<SpringGroup>& groups)
      : caps_(groups.size()), energies_(groups.size()), factors_(groups.size()) {
    budget.validate();
    std::vector<SpringGroup> capped = groups;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const double k = groups[g].stiffness, angular = k * groups[g].lever * groups[g].lever;
      double cap = 1;
      if (groups[g].force && k > budget.linear) cap = budget.linear / k;
      if (angular * cap > budget.angular) cap = budget.angular / angular;
      caps_[g] = static_cast<Scalar>(cap);
      capped[g].stiffness *= cap;
    }
    const Stiffest most = stiffest(capped);
    const double share =
        std::min({1.0, budget.linear / std::max(most.linear, 1e-300), budget.angular / std::max(most.angular, 1e-300)});
    for (Scalar& cap : caps_) cap *= static_cast<Scalar>(share);
  }

  /// Energy of group g's springs as they are without a budget [J].
  void set_energy(std::size_t g, Scalar energy) noexcept { energies_[g] = energy; }

  /// After all energies are set.
  void share() noexcept {
    Scalar largest = Scalar(0);
    for (std::size_t g = 0; g < caps_.size(); ++g) largest = std::max(largest, caps_[g] * energies_[g]);
    if (!(largest > Scalar(0)) || !std::isfinite(largest)) {
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
    const Scalar to_force = Scalar(1) / (root * root * root);
    for (std::size_t g = 0; g < caps_.size(); ++g) factors_[g] *= caps_[g] * to_force;
  }
  /// What group g's force is multiplied with.
  [[nodiscard]] Scalar factor(std::size_t g) const noexcept { return factors_[g]; }
  /// The same for a group that touches alone.
  [[nodiscard]] Scalar alone(std::size_t g) const noexcept { return caps_[g]; }

 private:
  struct Stiffest {
    double linear = 0, angular = 0;
  };

  /// Over shafts that lie on a plane with any run of neighbouring groups, flush or leaning either way: the second
  /// derivatives of U for a shift across and for a turn about T.
  [[nodiscard]] static Stiffest stiffest(const std::vector<SpringGroup>& groups) {
    Stiffest most;
    std::vector<double> depth;
    for (std::size_t first = 0; first < groups.size(); ++first)
      for (std::size_t last = first; last < groups.size(); ++last)
        for (const int lean : {-1, 0, 1}) {
          depth.clear();
          for (std::size_t g = first; g <= last; ++g) {
            const double along = last > first ? static_cast<double>(g - first) / static_cast<double>(last - first) : 1;
            depth.push_back(lean == 0 ? 1 : lean > 0 ? 0.1 + 0.9 * along : 1 - 0.9 * along);
          }
          most.linear = std::max(most.linear, curvature(groups, first, depth, false));
          most.angular = std::max(most.angular, curvature(groups, first, depth, true));
        }
    return most;
  }

  /// Of ½ ‖u‖_p², p = 2q, u_g = √k_g a_g, along d_g = √k_g (or √k_g h_g):
  /// ‖u‖^(2−p) [(p−1) Σ u^(p−2) d² − (p−2) ‖u‖^(−p) (Σ u^(p−1) d)²].
  [[nodiscard]] static double curvature(const std::vector<SpringGroup>& groups, std::size_t first,
                                        const std::vector<double>& depth, bool turn) {
    constexpr int kP = 8;
    double norm = 0, squares = 0, slope = 0;
    for (std::size_t i = 0; i < depth.size(); ++i) {
      const SpringGroup& group = groups[first + i];
      if (!turn && !group.force) continue;
      const double root = std::sqrt(group.stiffness);
      const double u = root * depth[i], d = root * (turn ? group.lever : 1);
      const double u6 = std::pow(u, kP - 2);
      norm += u6 * u * u;
      squares += u6 * d * d;
      slope += u6 * u * d;
    }
    if (!(norm > 0)) return 0;
    return std::pow(norm, 2.0 / kP - 1) * ((kP - 1) * squares - (kP - 2) * slope * slope / norm);
  }

  std::vector<Scalar> caps_, energies_, factors_;
};

}  // namespace trephine
