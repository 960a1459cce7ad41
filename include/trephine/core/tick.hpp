// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/status.hpp>
#include <trephine/core/wrench.hpp>

namespace trephine {

/// What a tick reads. `X_WT` is the tool's pose: origin at the burr's centre, +z along the shaft toward the handle.
struct TickInput {
  Posed X_WT = Posed::Identity();
  bool spindle_on = false;
};

/// The contact in figures, whichever renderer found it.
struct ContactSummary {
  int count = 0;       ///< vertices (Surface) or contact points (Line) that touch
  bool tip = false;    ///< the tip (sphere) is in contact
  bool shaft = false;  ///< the shaft is in contact
  double depth = 0;    ///< deepest penetration known [m]
};

/// What a tick answers. The wrench is about T's origin in W axes; it is always finite, and zero for `kBadInput` and
/// `kNonFinite`.
struct TickResult {
  Wrenchd wrench;
  ContactSummary contact;
  double removed_mm3 = 0;  ///< bone removed in this tick [mm³]
  Status status = Status::kOk;
};

/// What a renderer hands to the scene: the wrench on the tool about T's origin, in **G** axes.
template <RealScalar Scalar>
struct Rendered {
  Wrench<Scalar> wrench;
  ContactSummary contact;
  Status status = Status::kOk;
};

/// One place where the tool touches, in G axes [m, N]: `normal` points out of the bone, `force` is on the tool.
template <RealScalar Scalar>
struct ContactPoint {
  Vec3<Scalar> position = Vec3<Scalar>::Zero();
  Vec3<Scalar> normal = Vec3<Scalar>::Zero();
  Vec3<Scalar> force = Vec3<Scalar>::Zero();
};

}  // namespace trephine
