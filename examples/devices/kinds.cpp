// SPDX-License-Identifier: MIT
#include "kinds.hpp"

#include <array>

namespace devices {

std::span<const Kind> kinds() {
  static const std::array all{simulated_kind(),
                              haply_kind(),
                              haply_simulated_kind(),
                              force_dimension_kind(),
                              force_dimension_simulated_kind(),
                              openhaptics_kind(),
                              openhaptics_simulated_kind(),
                              spacemouse_kind()};
  return all;
}

const Kind& kind_named(const std::string& name) {
  std::string names;
  for (const Kind& kind : kinds()) {
    if (name == kind.name) return kind;
    names += (names.empty() ? "" : ", ") + std::string(kind.name);
  }
  throw UnknownDevice("there is no device '" + name + "'; there are: " + names);
}

std::function<trephine::HandTarget(double)> in_base(const Hand& hand, const Opened& frames) {
  const trephine::Registration user = frames.registration(Mat3d::Identity(), Vec3d::Zero());
  return [hand, user](double time) mutable {
    trephine::HandTarget target = hand(time);
    target.X_DH = user.handle_pose(target.X_DH);
    return target;
  };
}

Finding left_out(const std::string& for_want_of, const std::string& to_do) {
  return {.usable = false, .found = "not in this build, for want of " + for_want_of, .to_do = to_do};
}

}  // namespace devices
