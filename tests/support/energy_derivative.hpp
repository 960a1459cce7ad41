// SPDX-License-Identifier: MIT
#pragma once

#include "support/poses.hpp"
#include "support/raster.hpp"

#include <trephine/core/wrench.hpp>

#include <algorithm>
#include <vector>

/// Forces and torques of a renderer that has an energy, against central differences of it.
namespace trephine::test {

struct EnergyDifference {
  int poses = 0, left_out = 0;
  double force = 0, torque = 0;  ///< worst, of the force's and the torque's size
};

/// Where a stencil crosses a cell's face the interpolant has a kink, where a vertex comes or goes the law may have one:
/// the cells of all places that push.
template <class Renderer, class Grid>
[[nodiscard]] std::vector<int> cells_of_contacts(const Renderer& renderer, const Grid& grid) {
  std::vector<int> all;
  for (const auto& c : renderer.contacts()) {
    const Vec3d u = c.position.template cast<double>().cwiseQuotient(grid.spacing());
    for (int a = 0; a < 3; ++a) all.push_back(static_cast<int>(std::floor(u[a])));
  }
  return all;
}

/// At `poses` random poses within `reach` [m] of p_G that touch; those whose stencil meets a kink are counted and left
/// out. A renderer in double precision.
template <class Renderer, class Field, class Grid>
[[nodiscard]] EnergyDifference compare_with_energy(Renderer& renderer, const Field& field, const Grid& grid,
                                                   const Vec3d& p_G, double reach, int poses) {
  constexpr double kStep = 5e-9, kTurn = 5e-7;  // [m], [rad]
  Random random(91);
  EnergyDifference d;
  while (d.poses < poses) {
    const Posed X = tool_at(p_G + reach * random.unit() * random.uniform(), random.unit(), random.uniform(0, 6.28));
    const Wrenchd w = renderer.render(field, X).wrench;
    if (!(w.force.norm() > 0.02)) continue;
    ++d.poses;
    const auto at = cells_of_contacts(renderer, grid);
    bool smooth = true;
    const auto energy = [&](const Posed& Y) {
      static_cast<void>(renderer.render(field, Y));
      smooth = smooth && cells_of_contacts(renderer, grid) == at;
      return renderer.energy();
    };
    Vec3d force, torque;
    for (int a = 0; a < 3; ++a) {
      const Vec3d e = Vec3d::Unit(a);
      const auto moved = [&](double s) { return make_pose<double>(X.linear(), X.translation() + s * kStep * e); };
      const auto turned = [&](double s) {
        return make_pose<double>(rotation_from_vector(Vec3d(s * kTurn * e)) * X.linear(), X.translation());
      };
      force[a] = -(energy(moved(1)) - energy(moved(-1))) / (2 * kStep);
      torque[a] = -(energy(turned(1)) - energy(turned(-1))) / (2 * kTurn);
    }
    if (!smooth) {
      ++d.left_out;
      continue;
    }
    d.force = std::max(d.force, (force - w.force).norm() / w.force.norm());
    d.torque = std::max(d.torque, (torque - w.torque).norm() / std::max(w.torque.norm(), w.force.norm() * 1e-3));
  }
  return d;
}

}  // namespace trephine::test
