// SPDX-License-Identifier: MIT
#include "canvas.hpp"

#include <stdexcept>

#ifdef TREPHINE_EXAMPLE_HAS_PNG
#include <png.h>

#include <cstring>
#endif

namespace drill {

#ifdef TREPHINE_EXAMPLE_HAS_PNG

bool can_write_png() noexcept { return true; }

void write_png(const Canvas& canvas, const std::string& path) {
  const std::vector<std::uint8_t> bytes = canvas.srgb();
  png_image image;
  std::memset(&image, 0, sizeof image);
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(canvas.width());
  image.height = static_cast<png_uint_32>(canvas.height());
  image.format = PNG_FORMAT_RGB;
  if (png_image_write_to_file(&image, path.c_str(), 0, bytes.data(), 0, nullptr) == 0)
    throw std::runtime_error("cannot write " + path + ": " + image.message);
}

#else

bool can_write_png() noexcept { return false; }

void write_png(const Canvas&, const std::string& path) {
  throw std::runtime_error("cannot write " + path + ": built without libpng");
}

#endif

}  // namespace drill
