// SPDX-License-Identifier: MIT
#include "drawn_structures.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace drill {

using trephine::Vec3d;

DrawnStructures::DrawnStructures(Field whole, Field left, std::vector<trephine::Structure> structures,
                                 const trephine::Posed& X_SG)
    : whole_(std::move(whole)), left_(std::move(left)), structures_(std::move(structures)), X_SG_(X_SG) {}

std::optional<DrawnStructures::Hit> DrawnStructures::hit(const Ray& ray, float from, float to) const {
  const Vec3d o = X_SG_ * ray.origin.cast<double>(), d = X_SG_.linear() * ray.direction.cast<double>();
  // The distance bounds the step, but for the interpolation's error of a fraction of a voxel.
  const double voxel = left_->spacing().minCoeff(), near = 0.02 * voxel;
  for (double t = static_cast<double>(from); t <= static_cast<double>(to);) {
    Vec3d gradient;
    const auto [distance, structure] = left_->nearest(o + t * d, gradient);
    if (distance < near) {
      const Vec3d n = X_SG_.linear().transpose() * gradient;
      return Hit{{static_cast<float>(t), n.normalized().cast<float>()}, structure};
    }
    t += std::max(0.9 * distance, 0.05 * voxel);
  }
  return std::nullopt;
}

std::optional<int> DrawnStructures::at(const Vec3f& p) const {
  const auto [distance, structure] = whole_->nearest(X_SG_ * p.cast<double>());
  if (distance < 0) return structure;
  return std::nullopt;
}

float DrawnStructures::distance(const Vec3f& p) const {
  return static_cast<float>(whole_->nearest(X_SG_ * p.cast<double>()).distance);
}

Vec3f DrawnStructures::colour_of(int structure) const {
  const auto& c = structures_[static_cast<std::size_t>(structure)].colour;
  return Vec3f(c[0], c[1], c[2]).array().pow(2.2F);  // from sRGB
}

}  // namespace drill
