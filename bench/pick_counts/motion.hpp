// SPDX-License-Identifier: MIT
#pragma once

#include "feeler.hpp"

#include <optional>

namespace pick {

/// A tool on its way, by the distance s [m] it has gone: T's origin moves on a straight line, the tool turns about it.
struct Motion {
  trephine::Posed start = trephine::Posed::Identity();  ///< X_GT at s = 0
  trephine::Vec3d velocity = trephine::Vec3d::Zero();   ///< of T's origin, in G, per metre of s
  trephine::Vec3d turn = trephine::Vec3d::Zero();       ///< rotation vector in G [rad per metre of s]

  [[nodiscard]] trephine::Posed at(double s) const {
    return trephine::make_pose<double>(trephine::rotation_from_vector<double>(s * turn) * start.linear(),
                                       start.translation() + s * velocity);
  }
};

/// A tool whose shaft (+z) points along the unit vector `shaft`, T's origin at p_GT.
[[nodiscard]] inline trephine::Posed tool_pose(const trephine::Vec3d& p_GT, const trephine::Vec3d& shaft) {
  trephine::Mat3d R;
  R.col(2) = shaft;
  R.col(0) = shaft.unitOrthogonal();
  R.col(1) = shaft.cross(R.col(0));
  return trephine::make_pose<double>(R, p_GT);
}

/// The turn about T's origin that moves the shaft's point at `height` [m] along the unit vector `way`, square to
/// `shaft`, by a metre per metre of s.
[[nodiscard]] inline trephine::Vec3d turn_toward(const trephine::Vec3d& shaft, const trephine::Vec3d& way,
                                                 double height) {
  return shaft.cross(way) / height;
}

/// The distance at which the tool first touches, to a hundredth of a step; none where it touches from the start or not
/// within `reach` [m]. A bone thinner than `step` [m] may be passed over.
[[nodiscard]] inline std::optional<double> find_touch(Feeler& feeler, const Field& field, const Motion& motion,
                                                      double reach, double step) {
  if (feeler.touches(field, motion.at(0))) return std::nullopt;
  double free = 0;
  for (double s = step; s <= reach; s += step) {
    if (!feeler.touches(field, motion.at(s))) {
      free = s;
      continue;
    }
    for (double held = s; held - free > 0.01 * step;) {
      const double middle = 0.5 * (free + held);
      (feeler.touches(field, motion.at(middle)) ? held : free) = middle;
    }
    return free;
  }
  return std::nullopt;
}

/// Poses of `ticks` ticks that go evenly from `gap` before the touch to `depth` after it, and stay there for two more.
inline void press(const Motion& motion, double touch, double gap, double depth, int ticks,
                  std::vector<trephine::Posed>& out) {
  for (int i = 0; i < ticks; ++i) {
    const double share = static_cast<double>(i) / (ticks - 1);
    out.push_back(motion.at(std::max(0.0, touch - gap) + share * (depth + std::min(gap, touch))));
  }
  for (int i = 0; i < 2; ++i) out.push_back(out.back());
}

/// Poses of `ticks` ticks of the last pose moved on by `step` [m, in G] a tick.
inline void slide(const trephine::Vec3d& step, int ticks, std::vector<trephine::Posed>& out) {
  for (int i = 0; i < ticks; ++i) {
    trephine::Posed X = out.back();
    X.translation() += step;
    out.push_back(X);
  }
}

}  // namespace pick
