// SPDX-License-Identifier: MIT
#include "device_setup.hpp"
#include "dhd_standin/dhd_standin.hpp"

#include <cmath>
#include <vector>

namespace force_dimension {

std::string set_up_devices() {
  // Down from the middle of the workspace to 4 mm below the bone's top and up again, with the spindle on.
  const auto hand = [](double time) {
    const double z = -0.007 * (1 - std::cos(time));
    return trephine::HandTarget(trephine::Posed(Eigen::Translation3d(0, 0, z)), 1U);
  };
  std::vector<dhd_standin::Model> models;
  for (const std::string& name : dhd_standin::model_names()) {
    models.push_back(dhd_standin::model(name));
    models.back().hand = hand;
  }
  dhd_standin::plug(models);
  return "built without the Force Dimension SDK: a simulated device and hand stand in for the real ones";
}

}  // namespace force_dimension
