// SPDX-License-Identifier: MIT
#include "shading.hpp"

#include <algorithm>
#include <cmath>

namespace drill {
namespace {

Vec3f mix(const Vec3f& a, const Vec3f& b, float s) { return a + s * (b - a); }

float smooth(float lo, float hi, float x) {
  const float s = std::clamp((x - lo) / (hi - lo), 0.0F, 1.0F);
  return s * s * (3 - 2 * s);
}

constexpr float kLampAngle = 0.05F;  // half the key light's width, seen from the bone [rad]

/// A number in [0, 1) that looks random (integer hash after Wellons, "lowbias32").
float noise(int seed) {
  auto x = static_cast<std::uint32_t>(seed);
  x = (x ^ (x >> 16)) * 0x7feb352dU;
  x = (x ^ (x >> 15)) * 0x846ca68bU;
  x ^= x >> 16;
  return static_cast<float>(x >> 8) / 16777216.0F;
}

/// Keeps highlights from clipping; near-linear below 0.6.
Vec3f toned(const Vec3f& c) {
  return c.unaryExpr([](float v) { return v < 0.6F ? v : 0.6F + 0.4F * (1 - std::exp(-(v - 0.6F) / 0.4F)); });
}

}  // namespace

Vec3f kDotColour() { return colour(0xff2b1f); }
Vec3f kGhostColour() { return colour(0x35c8e8); }
Vec3f kCutColour() { return colour(0xd58b74); }

Shading::Shading(const Picture& picture) : picture_(picture), camera_(picture.camera) {
  const Vec3f size = picture.bone->hi() - picture.bone->lo();
  far_ = 2 * size.norm() + camera_.height;
  to_key_ = (-0.55F * camera_.right + 0.70F * camera_.up + 0.62F * camera_.back).normalized();
  if (picture.light) to_key_ = picture.light->normalized();
  to_fill_ = (0.85F * camera_.right + 0.05F * camera_.up + 0.45F * camera_.back).normalized();
  dot_radius_ = (picture.points.size() > 1 ? 0.007F : 0.011F) * camera_.height;
  // From afar single slices are noise; from near they are what there is.
  const auto slice = static_cast<float>(picture.bone->grid().spacing().maxCoeff());
  const float four_pixels = 4 * camera_.height / 960;
  spread_ = four_pixels > 0.4F * slice ? std::min(four_pixels, 1.2F * slice) : 0.0F;
  if (picture.tool) tool_.emplace(picture.burr, *picture.tool, picture.shape);
  if (picture.ghost) ghost_.emplace(picture.burr, *picture.ghost, picture.shape);
}

Vec3f Shading::background(const Vec2f& at) const {
  const float y = at.y() / camera_.height + 0.5F;
  const Vec3f c = mix(colour(0x141a22), colour(0x3a4656), smooth(-0.1F, 1.1F, y));
  return c * (1 - 0.35F * smooth(0.35F, 0.95F, at.norm() / camera_.height));
}

bool Shading::bone_shades(const Ray& ray, float from) const {
  float to = far_;
  if (picture_.section) {  // beyond the section there is no bone
    const float before = (ray.origin - camera_.centre).dot(camera_.back);
    const float rise = ray.direction.dot(camera_.back);
    if (before >= 0 && rise >= 0) return false;
    if (rise > 0) to = std::min(to, -before / rise);
    if (rise < 0 && before > 0) from = std::max(from, -before / rise);
  }
  return picture_.bone->hit(ray, from, to).has_value();
}

float Shading::open_sky(const Vec3f& p, const Vec3f& n) const {
  const float open = picture_.bone->openness(p, n);
  if (!picture_.section) return open;
  const float behind = -(p - camera_.centre).dot(camera_.back) / (3 * picture_.bone->voxel());
  return 1 - (1 - open) * smooth(0.0F, 1.0F, behind);
}

Shading::Lit Shading::light_at(const Vec3f& p, const Vec3f& n, int seed) const {
  const float voxel = picture_.bone->voxel();
  Lit light{0, open_sky(p, n)};
  if (tool_) light.open *= 1 - 0.8F * tool_->covers(p, n);
  if (n.dot(to_key_) <= 0) return light;
  // A lamp has a size: a few rays to different parts of it, others for each of a pixel's four samples. Light from the
  // side would only show up the voxels' steps: the rays start well above them, and the light fades.
  constexpr int kRays = 3;
  const Vec3f side = to_key_.unitOrthogonal();
  const Vec3f across = to_key_.cross(side);
  int arrived = 0;
  for (int i = 0; i < kRays; ++i) {
    const int part = kRays * (seed & 3) + i;
    const float a = 2.39996F * static_cast<float>(part) + 6.2832F * noise(seed >> 2);
    const float r = kLampAngle * std::sqrt((static_cast<float>(part) + 0.5F) / (4 * kRays));
    const Vec3f to_light = (to_key_ + r * (std::cos(a) * side + std::sin(a) * across)).normalized();
    arrived += bone_shades({p + 1.2F * voxel * n, to_light}, 0.8F * voxel) ? 0 : 1;
  }
  light.key = smooth(0.0F, 0.35F, n.dot(to_key_)) * static_cast<float>(arrived) / kRays;
  if (tool_) light.key *= tool_->lets_through({p, to_key_}, kLampAngle);
  return light;
}

Vec3f Shading::lit(const Vec3f& albedo, const Vec3f& n, const Lit& light, float gloss) const {
  const float key = std::max(0.0F, (n.dot(to_key_) + 0.12F) / 1.12F) * light.key;
  const float fill = std::max(0.0F, 0.3F + 0.7F * n.dot(to_fill_)) * light.open;
  const float sky = (0.5F + 0.5F * n.dot(camera_.up)) * light.open;
  const float facing = std::max(0.0F, n.dot(camera_.back));
  const float rim = std::pow(std::max(0.0F, 1 - facing), 3.0F) * light.open;
  const Vec3f half = (to_key_ + camera_.back).normalized();
  const float shine = gloss * std::pow(std::max(0.0F, n.dot(half)), 40.0F) * light.key;
  // What leaves a crevice has met the bone more than once and taken its colour: darken warmly, not to grey.
  const Vec3f bounce = 0.10F * (1 - light.open) * albedo.cwiseProduct(Vec3f(1.0F, 0.55F, 0.35F));
  const Vec3f arriving = 0.82F * key * Vec3f(1.0F, 0.95F, 0.87F) + 0.20F * fill * Vec3f(0.72F, 0.84F, 1.0F) +
                         0.30F * sky * Vec3f(0.80F, 0.90F, 1.0F) + 0.10F * light.open * Vec3f::Ones();
  return albedo.cwiseProduct(arriving) + bounce + 0.22F * rim * Vec3f(0.75F, 0.87F, 1.0F) + shine * Vec3f::Ones();
}

Vec3f Shading::bone_colour(const Vec3f& p, int seed) const {
  const PicturedBone& bone = *picture_.bone;
  const Vec3f n = bone.normal(p, spread_);
  // Thick bone under the surface is paler. What the drill took from behind the surface leaves that as it was.
  const PicturedBone& whole = picture_.uncut != nullptr ? *picture_.uncut : bone;
  const float below = whole.above(p - 2.0F * bone.voxel() * n) / bone.most_above();
  Vec3f albedo = mix(colour(0xdccdb0), colour(0xf3e6cd), smooth(0.05F, 0.55F, below));
  if (picture_.uncut != nullptr) {
    const float missing = picture_.uncut->above(p + 0.5F * bone.voxel() * n) / bone.most_above();
    albedo = mix(albedo, kCutColour(), 0.8F * smooth(0.0F, 0.12F, missing));
  }
  if (picture_.structures != nullptr)
    if (const auto s = picture_.structures->at(p)) albedo = picture_.structures->colour_of(*s);
  return lit(albedo, n, light_at(p, n, seed), 0.07F);
}

Vec3f Shading::section_colour(const Vec3f& p) const {
  const PicturedBone& bone = *picture_.bone;
  const float share = bone.above(p) / bone.most_above();
  Vec3f c = mix(colour(0xa89a88), colour(0xfdf4e3), smooth(-0.05F, 0.60F, share));
  // A dark line along the edge of the cut face.
  const Vec3f r = camera_.right;
  const Vec3f u = camera_.up;
  const float h = 0.5F * bone.voxel();
  const float gx = (bone.above(p + h * r) - bone.above(p - h * r)) / (2 * h);
  const float gy = (bone.above(p + h * u) - bone.above(p - h * u)) / (2 * h);
  const float edge = bone.above(p) / std::max(1e-3F, std::hypot(gx, gy));
  c *= 0.35F + 0.65F * smooth(0.0F, 0.006F * camera_.height, edge);
  return 0.85F * c;
}

Vec3f Shading::structure_colour(const DrawnStructures::Hit& hit, const Vec3f& p, bool cut_face, int seed) const {
  const Vec3f c = picture_.structures->colour_of(hit.structure);
  if (!cut_face) return lit(c, hit.at.normal, light_at(p, hit.at.normal, seed), 0.15F);
  // Where the section cuts it: flat, with a dark line along its edge.
  const float inside = -picture_.structures->distance(p);
  return c * (0.35F + 0.65F * smooth(0.0F, 0.006F * camera_.height, inside));
}

Vec3f Shading::surroundings(const Vec3f& d) const {
  const float y = d.dot(camera_.up);
  Vec3f c = mix(Vec3f(0.05F, 0.055F, 0.065F), Vec3f(0.50F, 0.56F, 0.64F), smooth(-0.35F, 0.75F, y));
  // Two tall lamps, which is what makes a cylinder look round.
  const float x = d.dot(camera_.right);
  const auto strip = [x](float at, float width) { return std::exp(-(x - at) * (x - at) / (width * width)); };
  c +=
      (1.1F * strip(-0.58F, 0.22F) + 0.55F * strip(0.80F, 0.12F)) * smooth(-0.9F, -0.1F, y) * Vec3f(1.0F, 0.98F, 0.95F);
  c += 1.6F * smooth(0.80F, 0.97F, d.dot(to_key_)) * Vec3f(1.0F, 0.97F, 0.92F);
  c += 0.7F * smooth(0.70F, 0.95F, d.dot(to_fill_)) * Vec3f(0.8F, 0.9F, 1.0F);
  return c;
}

Vec3f Shading::steel_colour(const Vec3f& p, Vec3f n) const {
  const float groove = tool_->flutes(p, n);
  const float voxel = picture_.bone->voxel();
  const Ray to_light{p + 0.02F * voxel * n, to_key_};
  const float key = bone_shades(to_light, 0) ? 0.25F : 1.0F;
  const Vec3f mirrored = 2 * n.dot(camera_.back) * n - camera_.back;
  const float facing = std::clamp(n.dot(camera_.back), 0.0F, 1.0F);
  const float fresnel = 0.62F + 0.38F * std::pow(1 - facing, 5.0F);
  const float open = 0.35F + 0.65F * open_sky(p, n);
  const Vec3f diffuse = 0.16F * key * std::max(0.0F, n.dot(to_key_)) * Vec3f(0.9F, 0.95F, 1.0F);
  return groove * open * (fresnel * (0.45F + 0.55F * key) * surroundings(mirrored) + diffuse + Vec3f::Constant(0.03F));
}

Vec3f Shading::with_ghosts(Vec3f c, const Ray& ray, float nearest, float solid,
                           const std::optional<SolidHit>& tool) const {
  const auto edge = [&](const SolidHit& hit) {
    return std::pow(std::max(0.0F, 1 - std::abs(hit.normal.dot(ray.direction))), 2.5F);
  };
  constexpr float kSame = 2e-5F;  // nearer than this [m] two surfaces are one
  // What the bone hides of the drill shines through as an outline.
  if (tool && tool->t > nearest + kSame) c = mix(c, colour(0xdfe6ee), 0.06F + 0.55F * edge(*tool));
  if (ghost_)
    if (const auto hit = ghost_->hit(ray)) {
      const bool hidden = hit->t > nearest + kSame;
      const float shown = hidden ? 0.10F + 0.45F * edge(*hit) : 0.22F + 0.70F * edge(*hit);
      c = mix(c, kGhostColour() * (hidden ? 0.8F : 0.9F), std::min(shown, 0.95F));
    }
  for (const Vec3f& point : picture_.points)
    if (const auto hit = hit_ball(ray, point, dot_radius_); hit && hit->t <= solid) {
      const float facing = std::max(0.0F, hit->normal.dot(to_key_));
      const Vec3f half = (to_key_ + camera_.back).normalized();
      const float shine = 0.5F * std::pow(std::max(0.0F, hit->normal.dot(half)), 30.0F);
      const Vec3f red = (0.55F + 0.55F * facing) * kDotColour() + shine * Vec3f::Ones();
      c = mix(c, red, hit->t > nearest ? 0.5F : 1.0F);  // the drill lets it shine through
    }
  return c;
}

Ray Shading::ray_at(const Vec2f& at) const {
  return {camera_.centre + at.x() * camera_.right + at.y() * camera_.up + far_ * camera_.back, -camera_.back};
}

std::optional<float> Shading::bone_on(const Ray& ray) const {
  const float step = spread_ > 0 ? 0.5F : 0.12F;  // from near, the thin lips that a burr leaves show
  return picture_.bone->hit(ray, picture_.section ? far_ : 0.0F, 2 * far_, step);
}

std::optional<DrawnStructures::Hit> Shading::structure_on(const Ray& ray) const {
  if (picture_.structures == nullptr) return std::nullopt;
  return picture_.structures->hit(ray, picture_.section ? far_ : 0.0F, 2 * far_);
}

float Shading::solid_at(const std::optional<float>& bone, const std::optional<DrawnStructures::Hit>& structure) const {
  return std::min(bone.value_or(2 * far_), structure ? structure->at.t : 2 * far_);
}

bool Shading::shows_points() const {
  return std::any_of(picture_.points.begin(), picture_.points.end(), [&](const Vec3f& point) {
    const Vec3f p = point - camera_.centre;
    const Ray ray = ray_at({p.dot(camera_.right), p.dot(camera_.up)});
    return far_ - p.dot(camera_.back) - dot_radius_ <= solid_at(bone_on(ray), structure_on(ray));
  });
}

Vec3f Shading::seen(const Vec2f& at, int seed) const {
  const Ray ray = ray_at(at);
  const auto bone = bone_on(ray);
  const auto tool = tool_ ? tool_->hit(ray) : std::nullopt;
  const auto structure = structure_on(ray);
  Vec3f c;
  float nearest = 2 * far_;
  if (structure && (!bone || structure->at.t <= *bone) && (!tool || structure->at.t <= tool->t)) {
    nearest = structure->at.t;
    const bool cut_face = picture_.section && nearest <= far_ + 1e-6F;
    c = structure_colour(*structure, ray.origin + nearest * ray.direction, cut_face, seed);
  } else if (tool && (!bone || tool->t < *bone)) {
    nearest = tool->t;
    c = steel_colour(ray.origin + nearest * ray.direction, tool->normal);
  } else if (bone) {
    nearest = *bone;
    const Vec3f p = ray.origin + nearest * ray.direction;
    const bool cut_face = picture_.section && nearest <= far_ + 1e-6F;
    c = cut_face ? section_colour(p) : bone_colour(p, seed);
  } else {
    c = background(at);
  }
  return toned(with_ghosts(c, ray, nearest, solid_at(bone, structure), tool));
}

}  // namespace drill
