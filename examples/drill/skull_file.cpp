// SPDX-License-Identifier: MIT
#include "skull_file.hpp"

#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace drill {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& file, const std::string& what) {
  throw std::runtime_error(file.string() + ": " + what +
                           " (expected: matrix.dat and main.plist, unpacked from an InVesalius project)");
}

std::string read_text(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) fail(file, "cannot be opened");
  return {std::istreambuf_iterator<char>(in), {}};
}

/// The text between `<tag>` and `</tag>` after `from`, which moves behind it.
std::string next_value(const std::string& xml, const std::string& tag, std::size_t& from, const fs::path& file) {
  const auto open = xml.find("<" + tag + ">", from);
  const auto close = xml.find("</" + tag + ">", open);
  if (open == std::string::npos || close == std::string::npos) fail(file, "a <" + tag + "> is missing");
  from = close;
  return xml.substr(open + tag.size() + 2, close - open - tag.size() - 2);
}

/// Three numbers of the array that follows `<key>key</key>`.
template <class Number>
std::array<Number, 3> triple(const std::string& xml, const std::string& key, const std::string& tag,
                             const fs::path& file) {
  std::size_t at = xml.find("<key>" + key + "</key>");
  if (at == std::string::npos) fail(file, "the key '" + key + "' is missing");
  std::array<Number, 3> values{};
  for (auto& v : values) {
    const std::string text = next_value(xml, tag, at, file);
    std::istringstream s(text);
    if (!(s >> v)) fail(file, "'" + key + "' holds '" + text + "', which is no number");
  }
  return values;
}

}  // namespace

trephine::VoxelGrid<std::int16_t> read_skull(const std::string& folder) {
  const fs::path plist = fs::path(folder) / "main.plist";
  const fs::path matrix = fs::path(folder) / "matrix.dat";
  const std::string xml = read_text(plist);
  const auto shape = triple<int>(xml, "shape", "integer", plist);  // z, y, x
  const auto spacing_mm = triple<double>(xml, "spacing", "real", plist);
  for (const int n : shape)
    if (n < 1 || n > 4096) fail(plist, "'shape' holds " + std::to_string(n) + ", which is no volume's size");

  const auto nx = static_cast<std::size_t>(shape[2]);
  const auto ny = static_cast<std::size_t>(shape[1]);
  const auto nz = static_cast<std::size_t>(shape[0]);
  const std::string bytes = read_text(matrix);
  if (bytes.size() != 2 * nx * ny * nz)
    fail(matrix, "holds " + std::to_string(bytes.size()) + " bytes where main.plist promises " +
                     std::to_string(2 * nx * ny * nz));

  std::vector<std::int16_t> voxels(nx * ny * nz);
  for (std::size_t k = 0; k < nz; ++k)
    for (std::size_t j = 0; j < ny; ++j)
      for (std::size_t i = 0; i < nx; ++i) {
        const std::size_t from = 2 * ((k * ny + (ny - 1 - j)) * nx + i);
        const auto low = static_cast<unsigned char>(bytes[from]);
        const auto high = static_cast<unsigned char>(bytes[from + 1]);
        voxels[(k * ny + j) * nx + i] = static_cast<std::int16_t>(low | (high << 8));
      }
  return {{.size = {shape[2], shape[1], shape[0]},
           .spacing = 1e-3 * trephine::Vec3d(spacing_mm[0], spacing_mm[1], spacing_mm[2])},
          voxels};
}

}  // namespace drill
