// SPDX-License-Identifier: MIT
#pragma once

#include "feeler.hpp"

#include <string>
#include <variant>
#include <vector>

namespace pick {

/// What is chosen for the Line approximation. One step length serves the search for first contact and the proxies.
struct LineSetting {
  int vertices = 50;
  double step = 0.5;  ///< voxels
  bool ray_cast = false;

  /// Moves of the proxies a tick, so that short steps get as far as the default ones.
  [[nodiscard]] int iterations() const;
  friend bool operator==(const LineSetting&, const LineSetting&) = default;
};

/// What is chosen for the Surface approximation.
struct SurfaceSetting {
  int sphere = 26;
  int slices = 20;
  int per_slice = 8;
  double search_step = 0.5;  ///< voxels
  bool patches = false;      ///< PatchWeights instead of AreaWeights: the same law, summed better

  friend bool operator==(const SurfaceSetting&, const SurfaceSetting&) = default;
};

/// The coupled tool has nothing to choose.
struct CoupledSetting {
  friend bool operator==(const CoupledSetting&, const CoupledSetting&) = default;
};

/// In the order of Algorithm.
using Setting = std::variant<LineSetting, SurfaceSetting, CoupledSetting>;

[[nodiscard]] Algorithm algorithm_of(const Setting& setting);

/// In a few words, without the algorithm's name.
[[nodiscard]] std::string describe(const Setting& setting);

/// The tool and what the scene is made with, to be printed as code.
struct Scene {
  trephine::Burr burr;
  double stiffness = 800;   ///< [N/m]
  double isovalue = 0;      ///< of the bone
  double max_force = 3.3;   ///< [N]
  double max_torque = 0.1;  ///< [N·m]
};

/// C++ that makes a HapticScene named `scene` of a grid named `bone` with this setting, after
/// `#include <trephine/trephine.hpp>`.
[[nodiscard]] std::string as_code(const Setting& setting, const Scene& scene);

/// The combinations that are tried.
[[nodiscard]] std::vector<Setting> settings_to_try(Algorithm algorithm, bool quick);
/// The finest setting, which is taken for the truth, and one half as fine, which says where that can be relied on.
[[nodiscard]] Setting truth_setting(Algorithm algorithm, bool quick);
[[nodiscard]] Setting check_setting(Algorithm algorithm, bool quick);

}  // namespace pick
