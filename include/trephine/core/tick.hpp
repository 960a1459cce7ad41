// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/status.hpp>
#include <trephine/core/wrench.hpp>

#include <limits>

/// Inputs and outputs of a tick, for scenes and renderers.
namespace trephine::inline TREPHINE_ALIGNED {

/// Input of a tick. `X_WT` is the tool's pose: origin at the burr's centre, +z along the shaft toward the handle.
struct TickInput {
  Posed X_WT = Posed::Identity();
  bool spindle_on = false;
};

/// Summary of the contact set, the same for every renderer.
struct ContactSummary {
  int count = 0;       ///< vertices (Surface) or contact points (Line) in contact
  bool tip = false;    ///< the tip (sphere) is in contact
  bool shaft = false;  ///< the shaft is in contact
  double depth = 0;    ///< largest penetration depth found [m]
};

/// Structures in one tick: distances and push of its guards, volumes at the floors of its cuts, and its membranes. A
/// scene without such parts leaves the defaults, and so does a tick that ends with `kBadInput`.
struct StructureSummary {
  int nearest = -1;  ///< number of the structure nearest to the tool at the device's pose; -1: unknown
  double distance = std::numeric_limits<double>::infinity();  ///< of the whole tool from it [m]; negative inside
  Wrenchd push;            ///< of the guards, on the tool about T's origin in W axes, as their stages added it
  double refused_mm3 = 0;  ///< protected bone that cuts would have taken in this tick, each voxel once [mm³]
  double taken_mm3 = 0;    ///< bone of watched structures that cuts took in this tick, each voxel once [mm³]
  bool warns = false;      ///< the nearest structure is guarded and nearer than its margin
  bool tears = false;      ///< a membrane tears in this tick, at some place; no recording holds this and `soft_force`
  double soft_force = 0;   ///< true force on the virtual tool of the membrane pressed most [N] (`SoftStructures`)
};

/// True forces of cutting in one tick, before the device's share, as a `CuttingForce` computed them. A scene without
/// one leaves the defaults, and so does a tick that ends with `kBadInput` or `kNonFinite`.
struct CuttingSummary {
  double thrust = 0;   ///< magnitude of the contact's force on the head; of a drill along its axis [N]
  double torque = 0;   ///< of the bone about the spindle's axis [N·m]
  double spindle = 0;  ///< speed [rad/s]
  double feed = 0;     ///< speed at which the law lets the head advance [m/s]
};

/// Output of a tick. The wrench is about T's origin in W axes. It is always finite, and zero for `kBadInput` and
/// `kNonFinite`.
struct TickResult {
  Wrenchd wrench;
  ContactSummary contact;
  double removed_mm3 = 0;  ///< bone removed in this tick [mm³]
  Status status = Status::kOk;
  StructureSummary structures{};  ///< `wrench - structures.push` is the contact's, unless a later stage changed the sum
  CuttingSummary cutting{};
};

/// Output of a renderer: the wrench on the tool about T's origin, in **G** axes.
template <RealScalar Scalar>
struct Rendered {
  Wrench<Scalar> wrench;
  ContactSummary contact;
  Status status = Status::kOk;
  /// False if this tick could not evaluate contact in the bone as it is. The scene then cuts nothing: a cut that the
  /// renderer does not feel would put it off again, at each tick.
  bool evaluated = true;
};

/// One contact of tool and bone, in G: position [m], unit normal out of the bone, force on the tool [N].
template <RealScalar Scalar>
struct ContactPoint {
  Vec3<Scalar> position = Vec3<Scalar>::Zero();
  Vec3<Scalar> normal = Vec3<Scalar>::Zero();
  Vec3<Scalar> force = Vec3<Scalar>::Zero();
};

}  // namespace trephine
