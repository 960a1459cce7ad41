// SPDX-License-Identifier: MIT
#pragma once

#include "support/random.hpp"

#include <trephine/core/math.hpp>
#include <trephine/core/rotation.hpp>
#include <trephine/core/spatial.hpp>

/// Where tools stand, and the ways between.
namespace trephine::test {

/// A tool whose ball is at `tip` and whose shaft points along `direction`, turned about it by `spin` [rad].
[[nodiscard]] inline Posed tool_at(const Vec3d& tip, const Vec3d& direction, double spin = 0) {
  const Mat3d R = rotation_between<double>(Vec3d::UnitZ(), direction.normalized());
  return make_pose<double>(R * rotation_from_vector(Vec3d(0, 0, spin)), tip);
}

/// A tool anywhere within `reach` of a point, turned in any way.
[[nodiscard]] inline Posed random_pose(Random& random, const Vec3d& about, double reach) {
  const Vec3d tip = about + reach * random.arrow(), direction = random.unit();
  return tool_at(tip, direction, random.uniform(0, 6));
}

/// The pose `share` of the way from a to b: translation and rotation at even speed.
[[nodiscard]] inline Posed between(const Posed& a, const Posed& b, double share) {
  const Vec3d w = rotation_vector(Mat3d(a.linear().transpose() * b.linear()));
  return make_pose<double>(a.linear() * rotation_from_vector(Vec3d(share * w)),
                           a.translation() + share * (b.translation() - a.translation()));
}

/// Spatial vector (v, arm × v). It is the Jacobian row of a body point at `arm` moving along v, and the wrench of a
/// force v that acts there.
[[nodiscard]] inline Vec6d with_moment(const Vec3d& v, const Vec3d& arm) noexcept {
  Vec6d spatial;
  spatial << v, arm.cross(v);
  return spatial;
}

}  // namespace trephine::test
