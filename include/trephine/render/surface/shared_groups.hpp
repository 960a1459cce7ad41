// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tick.hpp>
#include <trephine/render/shared_stiffness.hpp>
#include <trephine/render/surface/plane_law.hpp>
#include <trephine/render/surface/surface_options.hpp>
#include <trephine/tool/surface_discretization.hpp>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// Shares a stiffness budget between the groups of a Surface tool. The force law on a plane gives each group's largest
/// tangent stiffness; its springs give its energy in each tick. No allocation after construction.
template <RealScalar Scalar>
class SharedGroups {
 public:
  using Tool = ToolDiscretization<SurfaceCounts, Scalar>;

  /// - `k`: literal stiffness of the force law;
  /// - `edge_forces`: for each group its force [N] pressed into a plane up to its centre. Deeper, the force grows by as
  ///   much again per radius.
  ///
  /// Throws std::invalid_argument for a budget out of range.
  SharedGroups(const StiffnessBudget& budget, const Tool& tool, double k, std::vector<Scalar> edge_forces)
      : edge_forces_(std::move(edge_forces)) {
    constexpr int kDepths = 10;  // depths at which the law is evaluated, per radius
    std::vector<SpringGroup> springs;
    for (std::size_t g = 0; g < tool.groups().size(); ++g) {
      const auto& group = tool.groups()[g];
      const double radius = static_cast<double>(group.radius);
      const bool same_as_before =
          g > 1 && group.count == tool.groups()[g - 1].count && group.radius == tool.groups()[g - 1].radius;
      // Largest tangent stiffness: pressed into a plane as far as its centre, or with all its vertices in bone.
      double max_tangent = same_as_before ? springs.back().stiffness : 0, work = 0, previous = 0;
      for (int i = 1; i <= kDepths && !same_as_before; ++i) {
        const double force = k * mean_plane_force(tool, g, static_cast<double>(i) / kDepths);
        max_tangent = std::max(max_tangent, (force - previous) * kDepths / radius);
        work += 0.5 * (force + previous) * radius / kDepths;
        previous = force;
      }
      edge_energies_.push_back(same_as_before ? edge_energies_.back() : static_cast<Scalar>(work));
      springs.push_back({max_tangent, static_cast<double>(group.height)});
    }
    if (!fits(budget, springs)) shared_.emplace(budget, springs);
  }

  /// Scales the groups' forces and their contacts' forces so that all groups together stay within the budget. Contacts
  /// are in the groups' order: a single contact for a group whose centre is in bone, else a contact for each vertex
  /// with a spring (`spring_length` [m] > 0).
  void share(const Tool& tool, std::span<const Scalar> spring_length, std::span<SliceReport<Scalar>> groups,
             std::span<ContactPoint<Scalar>> contacts) noexcept {
    if (!shared_) return;
    std::size_t contact = 0;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const SliceReport<Scalar>& r = groups[g];
      const auto& group = tool.groups()[g];
      Scalar energy = Scalar(0);
      if (r.deep) {
        ++contact;
        energy = deep_energy(g, group.radius, r.force.norm());
      } else if (r.contacts > 0) {
        for (int i = group.first; i < group.first + group.count; ++i)
          if (const Scalar a = spring_length[static_cast<std::size_t>(i)]; a > Scalar(0))
            energy += Scalar(0.5) * contacts[contact++].force.norm() * a;
      }
      shared_->set_energy(g, energy);
    }
    shared_->share();
    contact = 0;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      SliceReport<Scalar>& r = groups[g];
      const Scalar factor = shared_->factor(g);
      r.force *= factor;
      for (int i = r.deep ? 1 : r.contacts; i > 0; --i) contacts[contact++].force *= factor;
    }
  }

 private:
  // Energy [J] of a group whose centre is in bone, with the force F = edge (1 + depth / R).
  [[nodiscard]] Scalar deep_energy(std::size_t g, Scalar radius, Scalar force) const noexcept {
    const Scalar edge = edge_forces_[g];
    const Scalar beyond = std::max(Scalar(0), force - edge);
    const Scalar depth = edge > Scalar(0) ? radius * beyond / edge : Scalar(0);
    return edge_energies_[g] + (edge + Scalar(0.5) * beyond) * depth;
  }

  std::vector<Scalar> edge_forces_, edge_energies_;  // of each group with its centre on the surface [N, J]
  std::optional<SharedStiffness<Scalar>> shared_;    // empty if all groups together fit the budget
};

}  // namespace trephine
