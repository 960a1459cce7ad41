// SPDX-License-Identifier: MIT
#include "png_file.hpp"

#include <stdexcept>

#ifdef TREPHINE_EXAMPLE_HAS_PNG
#include <png.h>

#include <cstring>
#endif

namespace drill {

#ifdef TREPHINE_EXAMPLE_HAS_PNG

bool can_write_png() noexcept { return true; }

void write_png(int width, int height, std::span<const std::uint8_t> rgb, const std::string& path) {
  if (rgb.size() != 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    throw std::invalid_argument("write_png: the picture's size and its bytes differ");
  png_image image;
  std::memset(&image, 0, sizeof image);
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_RGB;
  if (png_image_write_to_file(&image, path.c_str(), 0, rgb.data(), 0, nullptr) == 0)
    throw std::runtime_error("cannot write " + path + ": " + image.message);
}

#else

bool can_write_png() noexcept { return false; }

void write_png(int, int, std::span<const std::uint8_t>, const std::string& path) {
  throw std::runtime_error("cannot write " + path + ": built without libpng");
}

#endif

}  // namespace drill
