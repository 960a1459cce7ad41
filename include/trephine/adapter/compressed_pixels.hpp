// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/adapter/volume_bytes.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

/// Checks compressed images by their markers before a decoder sees them: image size, lengths and the mark at the end.
/// Some decoders end the process at headers that contradict themselves.
namespace trephine::inline TREPHINE_ALIGNED::itk_detail {

/// Size that an image must have.
struct StreamForm {
  unsigned columns = 0;
  unsigned rows = 0;
  unsigned bits = 0;  // that a pixel takes in memory
};

/// Numbers of a stream, most significant byte first; 0 beyond its end, which is then noted.
class StreamReader {
 public:
  explicit StreamReader(std::string_view bytes) : bytes_(bytes) {}
  [[nodiscard]] std::uint32_t at(std::size_t offset, std::size_t width) {
    if (offset > bytes_.size() || width > bytes_.size() - offset) {
      whole_ = false;
      return 0;
    }
    std::uint32_t v = 0;
    for (std::size_t i = 0; i < width; ++i) v = v << 8 | static_cast<unsigned char>(bytes_[offset + i]);
    return v;
  }
  [[nodiscard]] bool whole() const noexcept { return whole_; }
  [[nodiscard]] std::size_t size() const noexcept { return bytes_.size(); }

 private:
  std::string_view bytes_;
  bool whole_ = true;
};

/// Returns true if pixels of these bits take as many bytes as the header tells.
inline bool fills(std::uint32_t bits, const StreamForm& form) { return bits > 1 && (bits + 7) / 8 * 8 == form.bits; }

/// JPEG and JPEG-LS (ITU-T T.81, T.87).
inline bool is_whole_jpeg(std::string_view bytes, const StreamForm& form) {
  StreamReader in(bytes);
  if (in.at(0, 2) != 0xFFD8) return false;
  bool has_frame = false;
  bool lossless = false;
  bool has_scan = false;
  for (std::size_t at = 2; in.whole() && at < in.size();) {
    const std::uint32_t marker = in.at(at, 2);
    if (marker == 0xFFFF) {  // filling
      ++at;
      continue;
    }
    if (marker == 0xFFD9) return has_scan;
    if (marker < 0xFF01 || marker == 0xFFD8) return false;
    const std::uint32_t length = in.at(at + 2, 2);
    if (length < 2 || length > in.size() - at - 2) return false;
    const bool frame = marker >= 0xFFC0 && marker <= 0xFFCF && marker != 0xFFC4 && marker != 0xFFC8 && marker != 0xFFCC;
    if (frame || marker == 0xFFF7) {
      if (has_frame || length < 11 || !fills(in.at(at + 4, 1), form) || in.at(at + 5, 2) != form.rows ||
          in.at(at + 7, 2) != form.columns || in.at(at + 9, 1) != 1)
        return false;
      has_frame = true;
      lossless = marker == 0xFFC3;
    }
    // A scan of one component; where lossless, with one of seven predictors.
    if (marker == 0xFFDA && (length != 8 || in.at(at + 4, 1) != 1)) return false;
    if (marker == 0xFFDA && lossless && (in.at(at + 7, 1) - 1 > 6 || in.at(at + 8, 1) != 0 || in.at(at + 9, 1) > 15))
      return false;
    at += 2 + length;
    if (marker != 0xFFDA) continue;
    if (!has_frame) return false;
    has_scan = true;
    // Coded data: until a marker that is neither stuffing nor a restart.
    const auto coded = [&] {
      const std::uint32_t next = in.at(at, 2);
      return next >> 8 != 0xFF || (next & 0xFF) < 0x80 || (next >= 0xFFD0 && next <= 0xFFD7);
    };
    while (in.whole() && coded()) ++at;
  }
  return false;
}

/// JPEG 2000 (ITU-T T.800): the main header and the lengths of the tiles' parts.
inline bool is_whole_jpeg_2000(std::string_view bytes, const StreamForm& form) {
  StreamReader in(bytes);
  if (in.at(0, 4) != 0xFF4FFF51) return false;
  const std::size_t size = 4;  // the segment of sizes, from its length
  const auto number = [&](std::size_t i) { return in.at(size + 4 + 4 * i, 4); };
  const bool same = number(0) - number(2) == form.columns && number(1) - number(3) == form.rows &&
                    number(0) >= form.columns && number(1) >= form.rows;
  const bool tiles = number(4) > 0 && number(5) > 0 && number(6) <= number(2) && number(7) <= number(3) &&
                     number(6) + std::uint64_t{number(4)} > number(2) &&
                     number(7) + std::uint64_t{number(5)} > number(3);
  const bool component =
      in.at(size + 36, 2) == 1 && fills((in.at(size + 38, 1) & 0x7F) + 1, form) && in.at(size + 39, 2) == 0x0101;
  if (!same || !tiles || !component || in.at(size, 2) != 41) return false;
  bool has_tile = false;
  for (std::size_t at = size + 41; in.whole() && at < in.size();) {
    const std::uint32_t marker = in.at(at, 2);
    if (marker == 0xFFD9) return has_tile;
    if (marker >> 8 != 0xFF) return false;
    const bool part = marker == 0xFF90;
    if (has_tile && !part) return false;
    std::uint64_t length = part ? in.at(at + 6, 4) : in.at(at + 2, 2) + std::uint64_t{2};
    if (part && length == 0) return bytes.substr(bytes.size() - 3).find("\xFF\xD9") != std::string_view::npos;
    if (length < (part ? 14U : 4U) || length > in.size() - at) return false;
    has_tile = has_tile || part;
    at += static_cast<std::size_t>(length);
  }
  return false;
}

/// Runs of equal bytes (PS3.5, annex G): a table of segments, each of one byte of all pixels.
inline bool is_whole_rle(std::string_view bytes, const StreamForm& form) {
  if (bytes.size() < 64) return false;
  const auto word = [&](std::size_t i) { return from_bytes<std::uint32_t>(bytes.data() + 4 * i, false); };
  const std::size_t segments = word(0);
  if (segments != (form.bits + 7) / 8) return false;
  for (std::size_t s = 1; s <= segments; ++s) {
    const std::size_t end = s < segments ? word(s + 1) : bytes.size();
    std::size_t at = word(s);
    if (at < 64 || at > end || end > bytes.size()) return false;
    std::uint64_t pixels = 0;
    while (at < end && pixels < std::uint64_t{form.columns} * form.rows) {
      const auto code = static_cast<signed char>(bytes[at]);
      const std::size_t run = code >= 0 ? static_cast<std::size_t>(code) + 1 : 1;
      if (code != -128) pixels += code >= 0 ? run : static_cast<std::size_t>(1 - code);
      at += 1 + (code == -128 ? 0 : run);
    }
    if (at > end || pixels != std::uint64_t{form.columns} * form.rows) return false;
  }
  return true;
}

/// Returns true if compressed pixels of a transfer syntax have the size and the end that their header tells.
inline bool is_whole_stream(const std::string& syntax, std::string_view bytes, const StreamForm& form) {
  if (syntax == "1.2.840.10008.1.2.5") return is_whole_rle(bytes, form);
  if (syntax == "1.2.840.10008.1.2.4.90" || syntax == "1.2.840.10008.1.2.4.91") return is_whole_jpeg_2000(bytes, form);
  return is_whole_jpeg(bytes, form);
}

}  // namespace trephine::itk_detail
