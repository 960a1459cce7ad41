// SPDX-License-Identifier: MIT
#include "picture.hpp"

#include "shading.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <thread>
#include <utility>

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

/// A line of the legend.
struct Entry {
  std::string text;
  Vec3f colour;
  bool ring = false;
};

std::vector<Entry> legend_of(const Picture& picture, bool shows_points) {
  std::vector<Entry> entries;
  if (picture.uncut != nullptr) entries.push_back({"bone cut by the drill", kCutColour()});
  if (picture.tool) entries.push_back({picture.tool_label, colour(0xc3cad3)});
  if (picture.ghost) entries.push_back({picture.ghost_label, kGhostColour(), true});
  if (picture.structures != nullptr)
    for (std::size_t i = 0; i < picture.structures->structures().size(); ++i)
      entries.push_back({picture.structures->structures()[i].name, picture.structures->colour_of(static_cast<int>(i))});
  if (shows_points) entries.push_back({picture.points_label, kDotColour()});
  return entries;
}

/// Where the writing stands: title above the scene, legend and scale bar below it, so that no writing hides bone.
/// Pixels.
class Layout {
 public:
  Layout(const Canvas& canvas, std::vector<Entry> entries)
      : w_(static_cast<float>(canvas.width())), h_(static_cast<float>(canvas.height())), entries_(std::move(entries)) {
    // Entries beside each other, as many as leave room for the scale bar.
    float x = kLeft * w_, y = 0;
    for (const Entry& e : entries_) {
      const float wide = 0.0245F * w_ + Canvas::text_width(e.text, size());
      if (x > kLeft * w_ && x + wide > kLegendEnd * w_) {
        x = kLeft * w_;
        y += line();
      }
      places_.emplace_back(x, y);
      x += wide + 0.03F * w_;
    }
    foot_ = std::max(y + 2.4F * line(), 0.085F * h_);
  }

  [[nodiscard]] int first_row() const { return static_cast<int>(0.1F * h_); }
  [[nodiscard]] int end_row() const { return static_cast<int>(h_ - foot_); }

  void draw_title(Canvas& canvas, const Picture& picture) const {
    canvas.text({kLeft * w_, 0.048F * h_}, picture.title, 0.025F * h_, white());
    canvas.text({kLeft * w_, 0.082F * h_}, picture.subtitle, size(), colour(0xc9d1dc));
  }

  void draw_legend(Canvas& canvas) const;
  void draw_scale_bar(Canvas& canvas, float per_metre) const {
    const float length = scale_bar_length(0.22F * w_ / per_metre);
    const Vec2f right(0.965F * w_, h_ - 0.022F * h_), left = right - Vec2f(length * per_metre, 0);
    const Vec2f tick(0, 0.008F * h_);
    canvas.line(left, right, 3, white());
    canvas.line(left - tick, left + tick, 3, white());
    canvas.line(right - tick, right + tick, 3, white());
    const std::string text = in_millimetres(length);
    const float middle = (left.x() + right.x() - Canvas::text_width(text, 0.019F * h_)) / 2;
    canvas.text({middle, left.y() - 0.021F * h_}, text, 0.019F * h_, white());
  }

 private:
  static constexpr float kLeft = 0.035F, kLegendEnd = 0.72F;  // [widths]
  [[nodiscard]] static Vec3f white() { return colour(0xf2f4f7); }
  [[nodiscard]] float size() const { return 0.0165F * h_; }
  [[nodiscard]] float line() const { return 2.1F * size(); }

  float w_, h_;
  std::vector<Entry> entries_;
  std::vector<Vec2f> places_;  // of the entries, from the foot's first line
  float foot_ = 0;             // height
};

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

void Layout::draw_legend(Canvas& canvas) const {
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const Vec2f base = places_[i] + Vec2f(0.008F * w_, h_ - foot_ + 1.5F * line());
    draw_mark(canvas, base - Vec2f(0, size() / 2), 0.55F * size(), entries_[i].colour, entries_[i].ring);
    canvas.text(base + Vec2f(0.0165F * w_, 0), entries_[i].text, size(), white());
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
  const Layout layout(canvas, legend_of(picture, shading.shows_points()));
  const int first = layout.first_row(), end = layout.end_row();
  const float pixel = picture.camera.height / static_cast<float>(end - first);
  const Vec3f ground = colour(0x141a22);
  std::atomic<int> next_row{0};
  const auto work = [&] {
    for (int y = next_row++; y < height; y = next_row++)
      for (int x = 0; x < width; ++x) {
        if (y < first || y >= end) {
          canvas.pixel(x, y) = ground;
          continue;
        }
        Vec3f sum = Vec3f::Zero();
        for (int s = 0; s < 4; ++s) {
          // A rotated grid: four different rows and columns, so near-horizontal and near-vertical edges get all steps.
          constexpr std::array<float, 4> kX{0.375F, 0.875F, 0.125F, 0.625F};
          constexpr std::array<float, 4> kY{0.125F, 0.375F, 0.625F, 0.875F};
          const auto i = static_cast<std::size_t>(s);
          const Vec2f at((static_cast<float>(x) + kX[i] - 0.5F * static_cast<float>(width)) * pixel,
                         (0.5F * static_cast<float>(first + end) - static_cast<float>(y) - kY[i]) * pixel);
          sum += shading.seen(at, 4 * (y * width + x) + s);
        }
        canvas.pixel(x, y) = sum / 4;
      }
  };
  std::vector<std::thread> helpers;
  for (unsigned i = 1; i < std::max(1U, std::thread::hardware_concurrency()); ++i) helpers.emplace_back(work);
  work();
  for (auto& h : helpers) h.join();
  layout.draw_title(canvas, picture);
  layout.draw_legend(canvas);
  layout.draw_scale_bar(canvas, 1 / pixel);
  return canvas;
}

}  // namespace drill
