// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/render/line/first_contact.hpp>

namespace trephine {

/// The shaft as a field over where its far end points: at e the value is that of the deepest place of the centreline
/// from a fixed tip through e. It depends on the direction of e − tip alone, so its surface is the cone of directions
/// in which the line just touches bone, and a `SurfaceProxy` that moves in it is the constrained rotation of a rigid
/// line about its tip, friction included. Built anew each tick; `scratch` holds tool.padded() numbers and is used by
/// every call.
template <ContactField Base>
class ShaftField {
 public:
  using Scalar = typename Base::Scalar;
  using Tool = ToolDiscretization<LineCounts, Scalar>;
  static constexpr bool kSmoothNormals = trephine::kSmoothNormals<Base>;

  ShaftField(const Base& base, const Tool& tool, const Vec3<Scalar>& tip, bool refined, Scalar* scratch) noexcept
      : base_(&base), tool_(&tool), tip_(tip), refined_(refined), scratch_(scratch) {}

  [[nodiscard]] Scalar voxel() const noexcept { return base_->voxel(); }

  [[nodiscard]] Centreline<Scalar> line_to(const Vec3<Scalar>& e) const noexcept {
    return {tip_, (e - tip_).normalized()};
  }

  /// The deepest place of the line through e.
  [[nodiscard]] DeepestOnLine<Scalar> deepest(const Vec3<Scalar>& e) const noexcept {
    return deepest_on_line(*base_, *tool_, line_to(e), refined_, scratch_);
  }

  /// Value there.
  [[nodiscard]] Scalar value(const Vec3<Scalar>& e) const noexcept { return deepest(e).value; }

  /// The surface's normal at the deepest place, turned square to the line: an axial push cannot turn it. False where
  /// there is no normal or it is axial.
  [[nodiscard]] bool normal(const Vec3<Scalar>& e, Vec3<Scalar>& n) const noexcept {
    const Centreline<Scalar> line = line_to(e);
    Vec3<Scalar> m;
    if (!base_->normal(line.at(deepest(e).height), m)) return false;
    m -= m.dot(line.direction) * line.direction;
    const Scalar length = m.norm();
    if (!(length > Scalar(1e-3))) return false;
    n = m / length;
    return true;
  }

 private:
  const Base* base_;
  const Tool* tool_;
  Vec3<Scalar> tip_;
  bool refined_;
  Scalar* scratch_;
};

}  // namespace trephine
