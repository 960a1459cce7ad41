// SPDX-License-Identifier: MIT
#pragma once

#include "png_file.hpp"

#include <trephine/core/math.hpp>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

/// A small drawing surface: linear colours in, anti-aliased dots, lines and text on top, 8-bit sRGB out.
namespace drill {

using Vec2f = Eigen::Vector2f;
using Vec3f = trephine::Vec3<float>;

class Canvas {
 public:
  Canvas(int width, int height);

  [[nodiscard]] int width() const noexcept { return width_; }
  [[nodiscard]] int height() const noexcept { return height_; }
  /// Linear RGB; 1 is white.
  [[nodiscard]] Vec3f& pixel(int x, int y) noexcept {
    return pixels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
  }

  // Positions and sizes in pixels from the upper left corner; `opacity` 0..1.
  void dot(const Vec2f& centre, float radius, const Vec3f& colour, float opacity = 1);
  void line(const Vec2f& from, const Vec2f& to, float thickness, const Vec3f& colour, float opacity = 1);
  /// Writes `text` with its baseline's left end at `at`; `size` is the height of a capital letter.
  /// '^' raises the next character, '*' is a middle dot.
  void text(const Vec2f& at, std::string_view text, float size, const Vec3f& colour, float opacity = 1);
  /// Width that `text` takes at that size.
  [[nodiscard]] static float text_width(std::string_view text, float size);

  /// Rows of 8-bit sRGB triples, top row first.
  [[nodiscard]] std::vector<std::uint8_t> srgb() const;

 private:
  template <class Distance>
  void stamp(const Vec2f& lo, const Vec2f& hi, const Vec3f& colour, float opacity, Distance&& distance);

  int width_;
  int height_;
  std::vector<Vec3f> pixels_;
};

/// A colour as people write it, 0xRRGGBB in sRGB, made linear.
[[nodiscard]] Vec3f colour(unsigned rrggbb);

/// Pictures of one size in rows of `columns`.
[[nodiscard]] Canvas tiled(std::vector<Canvas> pictures, int columns);

/// Throws std::runtime_error as `write_png` of bytes does.
void write_png(const Canvas& canvas, const std::string& path);

}  // namespace drill
