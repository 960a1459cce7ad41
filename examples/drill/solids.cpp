// SPDX-License-Identifier: MIT
#include "solids.hpp"

#include <algorithm>
#include <cmath>

namespace drill {

std::optional<SolidHit> hit_ball(const Ray& ray, const Vec3f& centre, float radius) {
  const Vec3f from = ray.origin - centre;
  const float b = from.dot(ray.direction);
  // The distance of the ray's foot rather than |from|² − r²: those cancel where the eye is far away.
  const float root2 = radius * radius - (from - b * ray.direction).squaredNorm();
  if (!(root2 > 0)) return std::nullopt;
  const float t = -b - std::sqrt(root2);
  if (!(t > 0)) return std::nullopt;
  return SolidHit{t, (from + t * ray.direction) / radius};
}

DrawnTool::DrawnTool(const trephine::Burr& burr, const trephine::Pose<float>& X_GT, const trephine::RevolvedTool* shape)
    : shape_(shape),
      X_GT_(X_GT),
      X_TG_(X_GT.inverse()),
      tip_radius_(static_cast<float>(burr.tip_radius)),
      shaft_radius_(static_cast<float>(burr.shaft_radius)),
      shaft_length_(static_cast<float>(burr.shaft_length)) {}

float DrawnTool::distance(const Vec3f& p_T) const {
  return static_cast<float>(shape_->outline().signed_distance(p_T.head<2>().norm(), p_T.z()));
}

// Sphere tracing: no step goes past the surface.
std::optional<SolidHit> DrawnTool::hit_outline(const Ray& ray) const {
  constexpr int kSteps = 200;
  constexpr float kOnSurface = 2e-6F;  // [m]
  const trephine::ToolBounds bounds = shape_->bounds();
  const auto low = static_cast<float>(bounds.z_low), high = static_cast<float>(bounds.z_high);
  const float radius = std::hypot((high - low) / 2, static_cast<float>(bounds.radius));
  const Vec3f o = X_TG_ * ray.origin, d = X_TG_.linear() * ray.direction;
  const Vec3f to_middle = Vec3f(0, 0, (low + high) / 2) - o;
  const float along = to_middle.dot(d), beside2 = (to_middle - along * d).squaredNorm();
  if (!(beside2 < radius * radius)) return std::nullopt;
  const float half = std::sqrt(radius * radius - beside2);
  float t = std::max(0.0F, along - half);
  for (int i = 0; i < kSteps && t < along + half; ++i) {
    const Vec3f p = o + t * d;
    const float away = distance(p);
    if (away < kOnSurface) {
      if (!(t > 0)) return std::nullopt;
      trephine::ProfileLanes<double> rho, z;
      rho.fill(p.head<2>().norm());
      z.fill(p.z());
      trephine::Profile at;
      shape_->profile(rho, z, at);
      const Vec3f side = rho[0] > 1e-9 ? Vec3f(p.x(), p.y(), 0).normalized() : Vec3f(Vec3f::UnitX());
      const Vec3f normal =
          static_cast<float>(at.normal_rho[0]) * side + static_cast<float>(at.normal_z[0]) * Vec3f::UnitZ();
      return SolidHit{t, X_GT_.linear() * normal};
    }
    t += away;
  }
  return std::nullopt;
}

std::optional<SolidHit> DrawnTool::hit(const Ray& ray) const {
  if (shape_ != nullptr) return hit_outline(ray);
  std::optional<SolidHit> nearest = hit_ball(ray, X_GT_.translation(), tip_radius_);
  const auto offer = [&](float t, const Vec3f& normal) {
    if (t > 0 && (!nearest || t < nearest->t)) nearest = SolidHit{t, normal};
  };
  if (!(shaft_length_ > 0)) return nearest;
  const Vec3f o = X_TG_ * ray.origin;
  const Vec3f d = X_TG_.linear() * ray.direction;
  const float a = d.x() * d.x() + d.y() * d.y();
  if (a > 1e-12F) {
    const float b = (o.x() * d.x() + o.y() * d.y()) / a;
    const float miss = (o.x() * d.y() - o.y() * d.x());  // times 1/sqrt(a): distance from the axis
    const float root2 = shaft_radius_ * shaft_radius_ / a - miss * miss / (a * a);
    if (root2 > 0) {
      const float t = -b - std::sqrt(root2);
      const Vec3f p = o + t * d;
      if (p.z() >= 0 && p.z() <= shaft_length_)
        offer(t, X_GT_.linear() * Vec3f(p.x() / shaft_radius_, p.y() / shaft_radius_, 0));
    }
  }
  if (d.z() < 0) {  // the flat end, seen from above only
    const float t = (shaft_length_ - o.z()) / d.z();
    const Vec3f p = o + t * d;
    if (p.head<2>().squaredNorm() <= shaft_radius_ * shaft_radius_) offer(t, X_GT_.linear().col(2));
  }
  return nearest;
}

float DrawnTool::flutes(const Vec3f& p, Vec3f& normal) const {
  const Vec3f q = X_TG_ * p / tip_radius_;
  if (shape_ != nullptr ? q.z() * tip_radius_ > static_cast<float>(shape_->bounds().head_top) : q.squaredNorm() > 1.02F)
    return 1;
  constexpr float kFlutes = 8;
  // They run out toward the axis.
  const float rim =
      shape_ != nullptr ? std::min(1.0F, q.head<2>().norm()) : std::sqrt(std::max(0.0F, 1 - q.z() * q.z()));
  const float phase = kFlutes * std::atan2(q.y(), q.x()) + 3.2F * q.z();
  const Vec3f around = X_GT_.linear() * Vec3f(-q.y(), q.x(), 0);
  normal = (normal + 0.55F * rim * std::sin(phase) * around).normalized();
  return 1 - 0.30F * rim * (1 + std::cos(phase));
}

float DrawnTool::lets_through(const Ray& to_lamp, float half_angle) const {
  // How far inside the outline of a body of that radius the ray passes at a distance t, in widths of the penumbra.
  const auto open = [&](float t, float beside, float radius) {
    if (t <= 0) return 1.0F;
    return std::clamp(0.5F + (beside - radius) / (2 * half_angle * t + 1e-5F), 0.0F, 1.0F);
  };
  if (shape_ != nullptr) {
    const Vec3f o = X_TG_ * to_lamp.origin, d = X_TG_.linear() * to_lamp.direction;
    const float far = o.norm() + static_cast<float>(shape_->bounds().arm());
    float share = 1, least = 1e-5F;
    for (float t = least; t < far && share > 0;) {
      const float away = distance(o + t * d);
      share = std::min(share, open(t, away, 0));
      t += std::max(away, least);
      least = 2e-5F;
    }
    return share;
  }
  const Vec3f to_ball = X_GT_.translation() - to_lamp.origin;
  const float t_ball = to_ball.dot(to_lamp.direction);
  const float share = open(t_ball, (to_ball - t_ball * to_lamp.direction).norm(), tip_radius_);
  if (!(shaft_length_ > 0)) return share;
  // Nearest approach of ray and shaft's axis; the flat end is treated as round.
  const Vec3f axis = X_GT_.linear().col(2);
  const float cosine = axis.dot(to_lamp.direction);
  const float square = std::max(1e-6F, 1 - cosine * cosine);
  const float along = (cosine * t_ball - axis.dot(to_ball)) / square;
  const Vec3f on_axis = to_ball + std::clamp(along, 0.0F, shaft_length_) * axis;
  const float t = on_axis.dot(to_lamp.direction);
  return std::min(share, open(t, (on_axis - t * to_lamp.direction).norm(), shaft_radius_));
}

float DrawnTool::covers(const Vec3f& p, const Vec3f& n) const {
  const Vec3f to = X_GT_.translation() - p;
  const float distance2 = std::max(to.squaredNorm(), tip_radius_ * tip_radius_);
  const float facing = std::max(0.0F, n.dot(to) / std::sqrt(distance2));
  return facing * tip_radius_ * tip_radius_ / distance2;
}

}  // namespace drill
