// SPDX-License-Identifier: MIT
#pragma once

#include "pictured_bone.hpp"

#include <trephine/tool/revolved_tool.hpp>
#include <trephine/tool/shape.hpp>

#include <optional>

/// Balls and drills as rays meet them.
namespace drill {

struct SolidHit {
  float t = 0;  ///< along the ray [m]
  Vec3f normal = Vec3f::UnitZ();
};

[[nodiscard]] std::optional<SolidHit> hit_ball(const Ray& ray, const Vec3f& centre, float radius);

/// A drill at a pose, ready to be met: ball with cutting flutes, shaft with a flat end; or a tool of any outline.
class DrawnTool {
 public:
  /// `shape` must live as long; if there is none the burr is drawn.
  DrawnTool(const trephine::Burr& burr, const trephine::Pose<float>& X_GT, const trephine::RevolvedTool* shape);

  [[nodiscard]] std::optional<SolidHit> hit(const Ray& ray) const;
  /// Share of the light that flutes leave at a place on the ball, and the normal bent by them; the shaft is smooth.
  [[nodiscard]] float flutes(const Vec3f& p, Vec3f& normal) const;
  /// How much of the sky over p with normal n the ball covers, 0..1.
  [[nodiscard]] float covers(const Vec3f& p, const Vec3f& n) const;
  /// Share of a lamp's light that gets past the tool along a ray to the lamp's middle: soft at the shadow's edge, the
  /// softer the farther away. `half_angle`: of the lamp [rad].
  [[nodiscard]] float lets_through(const Ray& to_lamp, float half_angle) const;

  [[nodiscard]] const trephine::Pose<float>& pose() const noexcept { return X_GT_; }

 private:
  /// Signed distance of a place in T from the outline [m].
  [[nodiscard]] float distance(const Vec3f& p_T) const;
  [[nodiscard]] std::optional<SolidHit> hit_outline(const Ray& ray) const;

  const trephine::RevolvedTool* shape_;
  trephine::Pose<float> X_GT_;
  trephine::Pose<float> X_TG_;
  float tip_radius_;
  float shaft_radius_;
  float shaft_length_;
};

}  // namespace drill
