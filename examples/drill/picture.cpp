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

/// Darkens the picture along its upper and lower edge, so that writing can be read on bright bone too. Heights of the
/// bands as shares of the picture's; as much again is the way from dark to none.
void darken_edges(Canvas& canvas, float upper, float lower) {
  constexpr float kFade = 0.08F;
  const auto h = static_cast<float>(canvas.height());
  for (int y = 0; y < canvas.height(); ++y) {
    const float at = (static_cast<float>(y) + 0.5F) / h;
    const float inside = std::clamp(1 + std::max(upper - at, at - 1 + lower) / kFade, 0.0F, 1.0F);
    const float keep = 1 - 0.72F * inside * inside * (3 - 2 * inside);
    for (int x = 0; x < canvas.width(); ++x) canvas.pixel(x, y) *= keep;
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
  canvas.line(left, right, 3, white);
  canvas.line(left - tick, left + tick, 3, white);
  canvas.line(right - tick, right + tick, 3, white);
  const std::string text = in_millimetres(length);
  const float size = 0.019F * h;
  canvas.text({(left.x() + right.x() - Canvas::text_width(text, size)) / 2, left.y() - 1.1F * size}, text, size, white);
}

void draw_labels(Canvas& canvas, const Picture& picture) {
  const auto w = static_cast<float>(canvas.width());
  const auto h = static_cast<float>(canvas.height());
  const Vec3f white = colour(0xf2f4f7);
  const Vec3f grey = colour(0xc9d1dc);
  canvas.text({0.035F * w, 0.065F * h}, picture.title, 0.025F * h, white);
  canvas.text({0.035F * w, 0.103F * h}, picture.subtitle, 0.0165F * h, grey);

  float y = 0.952F * h;
  const float size = 0.0165F * h;
  const auto entry = [&](const std::string& text, const Vec3f& c, bool ring) {
    const Vec2f at(0.045F * w, y - size / 2);
    canvas.dot(at, 0.55F * size, c, ring ? 0.35F : 1.0F);
    if (ring)
      for (int i = 0; i < 24; ++i) {
        const float a = static_cast<float>(i) * 0.2618F;
        const float b = a + 0.2618F;
        const float r = 0.6F * size;
        canvas.line(at + r * Vec2f(std::cos(a), std::sin(a)), at + r * Vec2f(std::cos(b), std::sin(b)), 2, c);
      }
    canvas.text({0.062F * w, y}, text, size, white);
    y -= 2.1F * size;
  };
  if (!picture.points.empty()) entry(picture.points_label, kDotColour(), false);
  if (picture.ghost) entry(picture.ghost_label, kGhostColour(), true);
  if (picture.tool) entry(picture.tool_label, colour(0xc3cad3), false);
  if (picture.uncut != nullptr) entry("bone cut by the drill", kCutColour(), false);
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
  const int entries = (picture.tool ? 1 : 0) + (picture.ghost ? 1 : 0) + (picture.points.empty() ? 0 : 1) +
                      (picture.uncut != nullptr ? 1 : 0);
  darken_edges(canvas, 0.11F, 0.06F + 0.035F * static_cast<float>(entries));
  draw_labels(canvas, picture);
  draw_scale_bar(canvas, picture.camera);
  return canvas;
}

}  // namespace drill
