// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/render/line/first_contact.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// Field over the position of the shaft's far end. Its value at e is the field's largest value along the centreline
/// from a fixed tip through e. It depends on the direction of e − tip alone, so its surface is the cone of directions
/// in which the line just touches bone. A `SurfaceProxy` in this field is the constrained rotation of a rigid line
/// about its tip, friction included.
///
/// Each tick makes a new object. `scratch` has room for tool.padded() numbers and is used by every call.
template <ContactField Base>
class ShaftField {
 public:
  using Scalar = typename Base::Scalar;
  using Tool = ToolDiscretization<LineCounts, Scalar>;
  static constexpr bool kSmoothNormals = trephine::kSmoothNormals<Base>;

  ShaftField(const Base& base, const Tool& tool, const Vec3<Scalar>& tip, Scalar* scratch) noexcept
      : base_(&base), tool_(&tool), tip_(tip), scratch_(scratch) {}

  [[nodiscard]] Scalar voxel() const noexcept { return base_->voxel(); }

  /// Centreline from the tip through e [m].
  [[nodiscard]] Centreline<Scalar> line_to(const Vec3<Scalar>& e) const noexcept {
    return {tip_, (e - tip_).normalized()};
  }

  /// Deepest point of the line through e.
  [[nodiscard]] DeepestOnLine<Scalar> deepest(const Vec3<Scalar>& e) const noexcept {
    return deepest_on_line(*base_, *tool_, line_to(e), scratch_);
  }

  /// Value at the deepest point of the line through e.
  [[nodiscard]] Scalar value(const Vec3<Scalar>& e) const noexcept { return deepest(e).value; }

  /// Bone's unit normal at the deepest point, projected perpendicular to the line: an axial force does not rotate the
  /// line. Returns false if there is no normal or it is axial.
  [[nodiscard]] bool normal(const Vec3<Scalar>& e, Vec3<Scalar>& n) const noexcept {
    const Centreline<Scalar> line = line_to(e);
    Vec3<Scalar> bone_normal;
    if (!base_->normal(line.at(deepest(e).height), bone_normal)) return false;
    const Vec3<Scalar> across = bone_normal - bone_normal.dot(line.direction) * line.direction;
    const Scalar length = across.norm();
    if (!(length > kMinAcross)) return false;
    n = across / length;
    return true;
  }

 private:
  // Smallest perpendicular part of a unit normal; below it (3.4′ from axial) rounding decides its direction.
  static constexpr auto kMinAcross = Scalar(1e-3);

  const Base* base_;
  const Tool* tool_;
  Vec3<Scalar> tip_;
  Scalar* scratch_;
};

}  // namespace trephine
