// SPDX-License-Identifier: MIT
#pragma once

#include "picture.hpp"
#include "solids.hpp"

#include <cstdint>

namespace drill {

[[nodiscard]] Vec3f kDotColour();
[[nodiscard]] Vec3f kGhostColour();
[[nodiscard]] Vec3f kCutColour();

/// Light and materials: what the eye sees along one ray. Const, so threads share it.
class Shading {
 public:
  explicit Shading(const Picture& picture);

  /// Display-linear colour at `at`, metres from the picture's middle (right, up). `seed` varies the soft shadows.
  [[nodiscard]] Vec3f seen(const Vec2f& at, int seed) const;
  /// True if the eye sees any of the dots.
  [[nodiscard]] bool shows_points() const;

 private:
  struct Lit {
    float key;   ///< share of the key light that arrives, 0..1
    float open;  ///< share of the sky, 0..1
  };
  [[nodiscard]] Vec3f background(const Vec2f& at) const;
  [[nodiscard]] bool bone_shades(const Ray& to_light, float from) const;
  [[nodiscard]] float open_sky(const Vec3f& p, const Vec3f& n) const;
  [[nodiscard]] Lit light_at(const Vec3f& p, const Vec3f& n, int seed) const;
  [[nodiscard]] Vec3f lit(const Vec3f& albedo, const Vec3f& n, const Lit& light, float gloss) const;
  [[nodiscard]] Vec3f bone_colour(const Vec3f& p, int seed) const;
  [[nodiscard]] Vec3f section_colour(const Vec3f& p) const;
  [[nodiscard]] Vec3f structure_colour(const DrawnStructures::Hit& hit, const Vec3f& p, bool cut_face, int seed) const;
  [[nodiscard]] Vec3f steel_colour(const Vec3f& p, Vec3f n) const;
  [[nodiscard]] Vec3f surroundings(const Vec3f& direction) const;
  [[nodiscard]] Ray ray_at(const Vec2f& at) const;
  /// Where bone or a structure ends the ray [m], or beyond all of them.
  [[nodiscard]] float solid_at(const std::optional<float>& bone,
                               const std::optional<DrawnStructures::Hit>& structure) const;
  [[nodiscard]] std::optional<float> bone_on(const Ray& ray) const;
  [[nodiscard]] std::optional<DrawnStructures::Hit> structure_on(const Ray& ray) const;
  /// Adds what is translucent, and the dots. `solid` is where bone or a structure ends the ray, `nearest` where
  /// anything does.
  [[nodiscard]] Vec3f with_ghosts(Vec3f colour, const Ray& ray, float nearest, float solid,
                                  const std::optional<SolidHit>& tool) const;

  const Picture& picture_;
  Camera camera_;
  float far_;     // eye's distance from the picture's plane [m]
  Vec3f to_key_;  // toward the key light
  Vec3f to_fill_;
  float dot_radius_;
  float spread_;  // over which normals are averaged [m]
  std::optional<DrawnTool> tool_;
  std::optional<DrawnTool> ghost_;
};

}  // namespace drill
