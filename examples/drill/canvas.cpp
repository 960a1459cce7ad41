// SPDX-License-Identifier: MIT
#include "canvas.hpp"

#include "stroke_font.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace drill {
namespace {

float to_linear(float s) { return s <= 0.04045F ? s / 12.92F : std::pow((s + 0.055F) / 1.055F, 2.4F); }
float to_srgb(float l) { return l <= 0.0031308F ? 12.92F * l : 1.055F * std::pow(l, 1 / 2.4F) - 0.055F; }

constexpr float kRaisedSize = 0.62F;  // of superscripts

float distance_to_segment(const Vec2f& p, const Vec2f& a, const Vec2f& b) {
  const Vec2f ab = b - a;
  const float length2 = ab.squaredNorm();
  const float s = length2 > 0 ? std::clamp((p - a).dot(ab) / length2, 0.0F, 1.0F) : 0.0F;
  return (p - a - s * ab).norm();
}

}  // namespace

Vec3f colour(unsigned rrggbb) {
  const auto channel = [&](unsigned shift) {
    return to_linear(static_cast<float>((rrggbb >> shift) & 0xFFU) / 255.0F);
  };
  return {channel(16), channel(8), channel(0)};
}

Canvas::Canvas(int width, int height)
    : width_(width),
      height_(height),
      pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), Vec3f::Zero()) {}

/// Blends `colour` where `distance(pixel centre)` is negative, with one pixel of soft edge.
template <class Distance>
void Canvas::stamp(const Vec2f& lo, const Vec2f& hi, const Vec3f& colour, float opacity, Distance&& distance) {
  const int x0 = std::max(0, static_cast<int>(lo.x()) - 1);
  const int y0 = std::max(0, static_cast<int>(lo.y()) - 1);
  const int x1 = std::min(width_ - 1, static_cast<int>(hi.x()) + 2);
  const int y1 = std::min(height_ - 1, static_cast<int>(hi.y()) + 2);
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) {
      const Vec2f centre(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F);
      const float cover = std::clamp(0.5F - distance(centre), 0.0F, 1.0F) * opacity;
      if (cover > 0) pixel(x, y) = (1 - cover) * pixel(x, y) + cover * colour;
    }
}

void Canvas::dot(const Vec2f& centre, float radius, const Vec3f& colour, float opacity) {
  const Vec2f r = Vec2f::Constant(radius);
  stamp(centre - r, centre + r, colour, opacity, [&](const Vec2f& p) { return (p - centre).norm() - radius; });
}

void Canvas::line(const Vec2f& from, const Vec2f& to, float thickness, const Vec3f& colour, float opacity) {
  const Vec2f r = Vec2f::Constant(thickness);
  stamp(from.cwiseMin(to) - r, from.cwiseMax(to) + r, colour, opacity,
        [&](const Vec2f& p) { return distance_to_segment(p, from, to) - thickness / 2; });
}

void Canvas::text(const Vec2f& at, std::string_view text, float size, const Vec3f& colour, float opacity) {
  const float half = 0.075F * size;  // half a stroke's width
  float x = at.x();
  bool raised = false;
  for (const char c : text) {
    if (c == '^') {
      raised = true;
      continue;
    }
    const float unit = (raised ? kRaisedSize : 1.0F) * size / kCapitalHeight;
    const float base = at.y() - (raised ? 0.5F * size : 0.0F);
    const auto strokes = glyph(c);
    const auto place = [&](const Vec2f& p) { return Vec2f(x + p.x() * unit, base - p.y() * unit); };
    // One stamp a glyph, so that strokes do not darken where they join.
    const Vec2f lo(x - half, base - (kCapitalHeight + 2) * unit);
    const Vec2f hi(x + glyph_advance(c) * unit + half, base + 4 * unit);
    stamp(lo, hi, colour, opacity, [&](const Vec2f& p) {
      float nearest = 1e9F;
      for (const auto& stroke : strokes)
        for (std::size_t i = 0; i < stroke.size(); ++i)
          nearest = std::min(nearest, distance_to_segment(p, place(stroke[i > 0 ? i - 1 : 0]), place(stroke[i])));
      return nearest - half;
    });
    x += glyph_advance(c) * unit;
    raised = false;
  }
}

float Canvas::text_width(std::string_view text, float size) {
  float width = 0;
  bool raised = false;
  for (const char c : text) {
    if (c != '^') width += glyph_advance(c) * (raised ? kRaisedSize : 1.0F);
    raised = c == '^';
  }
  return width * size / kCapitalHeight;
}

std::vector<std::uint8_t> Canvas::srgb() const {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(3 * pixels_.size());
  for (const Vec3f& p : pixels_)
    for (int c = 0; c < 3; ++c) {
      const float s = to_srgb(std::clamp(p[c], 0.0F, 1.0F));
      bytes.push_back(static_cast<std::uint8_t>(std::lround(255 * s)));
    }
  return bytes;
}

Canvas tiled(std::vector<Canvas> pictures, int columns) {
  const int w = pictures.front().width(), h = pictures.front().height();
  const int count = static_cast<int>(pictures.size());
  Canvas all(w * columns, h * ((count + columns - 1) / columns));
  for (int i = 0; i < count; ++i)
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x)
        all.pixel(i % columns * w + x, i / columns * h + y) = pictures[static_cast<std::size_t>(i)].pixel(x, y);
  return all;
}

void write_png(const Canvas& canvas, const std::string& path) {
  write_png(canvas.width(), canvas.height(), canvas.srgb(), path);
}

}  // namespace drill
