// SPDX-License-Identifier: MIT
#include "picture.hpp"

#include "shading.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <thread>

namespace drill {
namespace {

/// The largest of 1, 2, 5 x 10^n millimetres that fits into `most` metres.
float scale_bar_length(float most) {
  float best = 1e-6F;
  for (float decade = 1e-5F; decade < 10; decade *= 10)
    for (const float m : {1.0F, 2.0F, 5.0F})
      if (m * decade <= most) best = std::max(best, m * decade);
  return best;
}

std::string in_millimetres(float metres) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g mm", static_cast<double>(std::round(metres * 1e5F) / 100));
  return text.data();
}

/// Darkens the ground under a block of writing, softly, so that it can be read on bright bone too.
void darken(Canvas& canvas, const Vec2f& lo, const Vec2f& hi) {
  const float soft = 0.06F * static_cast<float>(canvas.height());
  const int x0 = std::max(0, static_cast<int>(lo.x() - soft));
  const int x1 = std::min(canvas.width() - 1, static_cast<int>(hi.x() + soft));
  const int y0 = std::max(0, static_cast<int>(lo.y() - soft));
  const int y1 = std::min(canvas.height() - 1, static_cast<int>(hi.y() + soft));
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) {
      const Vec2f p(static_cast<float>(x), static_cast<float>(y));
      const Vec2f outside = (lo - p).cwiseMax(p - hi).cwiseMax(0.0F);
      const float s = std::clamp(1 - outside.norm() / soft, 0.0F, 1.0F);
      canvas.pixel(x, y) *= 1 - 0.78F * s * s * (3 - 2 * s);
    }
}

void draw_scale_bar(Canvas& canvas, const Camera& camera) {
  const auto w = static_cast<float>(canvas.width());
  const auto h = static_cast<float>(canvas.height());
  const float per_metre = h / camera.height;
  const float length = scale_bar_length(0.22F * w / per_metre);
  const Vec2f right(0.955F * w, 0.945F * h);
  const Vec2f left = right - Vec2f(length * per_metre, 0);
  const Vec2f tick(0, 0.008F * h);
  const Vec3f white = colour(0xf2f4f7);
  const float size = 0.019F * h;
  darken(canvas, left - Vec2f(0, 2.1F * size), right + tick);
  canvas.line(left, right, 3, white);
  canvas.line(left - tick, left + tick, 3, white);
  canvas.line(right - tick, right + tick, 3, white);
  const std::string text = in_millimetres(length);
  canvas.text({(left.x() + right.x() - Canvas::text_width(text, size)) / 2, left.y() - 1.1F * size}, text, size, white);
}

/// A dot, or for what is translucent a ring round a faint one.
void draw_mark(Canvas& canvas, const Vec2f& at, float radius, const Vec3f& ink, bool ring) {
  canvas.dot(at, radius, ink, ring ? 0.35F : 1.0F);
  if (!ring) return;
  constexpr int kSides = 24;
  const auto corner = [&](int i) {
    const float a = 6.2831853F * static_cast<float>(i) / kSides;
    return Vec2f(at + 1.1F * radius * Vec2f(std::cos(a), std::sin(a)));
  };
  for (int i = 0; i < kSides; ++i) canvas.line(corner(i), corner(i + 1), 2, ink);
}

void draw_labels(Canvas& canvas, const Picture& picture) {
  const auto w = static_cast<float>(canvas.width());
  const auto h = static_cast<float>(canvas.height());
  const Vec3f white = colour(0xf2f4f7);
  const Vec3f grey = colour(0xc9d1dc);
  const Vec2f corner(0.035F * w, 0.065F * h);
  const float wide =
      std::max(Canvas::text_width(picture.title, 0.025F * h), Canvas::text_width(picture.subtitle, 0.0165F * h));
  darken(canvas, corner - Vec2f(0, 0.03F * h), corner + Vec2f(wide, 0.045F * h));
  canvas.text(corner, picture.title, 0.025F * h, white);
  canvas.text(corner + Vec2f(0, 0.038F * h), picture.subtitle, 0.0165F * h, grey);

  struct Entry {
    std::string text;
    Vec3f colour;
    bool ring = false;
  };
  std::vector<Entry> entries;  // from the bottom up
  if (!picture.points.empty()) entries.push_back({picture.points_label, kDotColour()});
  if (picture.structures != nullptr)
    for (int i = static_cast<int>(picture.structures->structures().size()) - 1; i >= 0; --i)
      entries.push_back(
          {picture.structures->structures()[static_cast<std::size_t>(i)].name, picture.structures->colour_of(i)});
  if (picture.ghost) entries.push_back({picture.ghost_label, kGhostColour(), true});
  if (picture.tool) entries.push_back({picture.tool_label, colour(0xc3cad3)});
  if (picture.uncut != nullptr) entries.push_back({"bone cut by the drill", kCutColour()});
  const float size = 0.0165F * h;
  const float line = 2.1F * size;
  float widest = 0;
  for (const Entry& e : entries) widest = std::max(widest, Canvas::text_width(e.text, size));
  const Vec2f lowest(0.045F * w, 0.952F * h);
  darken(canvas, lowest - Vec2f(size, line * static_cast<float>(entries.size())),
         lowest + Vec2f(widest + 0.02F * w, 0));
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const Vec2f base = lowest - Vec2f(0, line * static_cast<float>(i));
    draw_mark(canvas, base - Vec2f(0, size / 2), 0.55F * size, entries[i].colour, entries[i].ring);
    canvas.text(base + Vec2f(0.017F * w, 0), entries[i].text, size, white);
  }
}

}  // namespace

Camera look_at(const Vec3f& centre, const Vec3f& from, const Vec3f& up, float height) {
  Camera camera;
  camera.centre = centre;
  camera.back = from.normalized();
  Vec3f right = up.cross(camera.back);
  if (!(right.norm() > 1e-3F)) right = camera.back.unitOrthogonal();
  camera.right = right.normalized();
  camera.up = camera.back.cross(camera.right);
  camera.height = height;
  return camera;
}

Canvas draw(const Picture& picture, int width, int height) {
  Canvas canvas(width, height);
  const Shading shading(picture);
  const float pixel = picture.camera.height / static_cast<float>(height);
  std::atomic<int> next_row{0};
  const auto work = [&] {
    for (int y = next_row++; y < height; y = next_row++)
      for (int x = 0; x < width; ++x) {
        Vec3f sum = Vec3f::Zero();
        for (int s = 0; s < 4; ++s) {
          // A rotated grid: four different rows and columns, so near-horizontal and near-vertical edges get all steps.
          constexpr std::array<float, 4> kX{0.375F, 0.875F, 0.125F, 0.625F};
          constexpr std::array<float, 4> kY{0.125F, 0.375F, 0.625F, 0.875F};
          const auto i = static_cast<std::size_t>(s);
          const Vec2f at((static_cast<float>(x) + kX[i] - 0.5F * static_cast<float>(width)) * pixel,
                         (0.5F * static_cast<float>(height) - static_cast<float>(y) - kY[i]) * pixel);
          sum += shading.seen(at, 4 * (y * width + x) + s);
        }
        canvas.pixel(x, y) = sum / 4;
      }
  };
  std::vector<std::thread> helpers;
  for (unsigned i = 1; i < std::max(1U, std::thread::hardware_concurrency()); ++i) helpers.emplace_back(work);
  work();
  for (auto& h : helpers) h.join();
  draw_labels(canvas, picture);
  draw_scale_bar(canvas, picture.camera);
  return canvas;
}

}  // namespace drill
