// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/adapter/volume_text.hpp>
#include <trephine/core/bit_cast.hpp>

#include <itk_zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <istream>
#include <limits>
#include <string>
#include <vector>

/// Reads and writes bytes of volume files, plain or compressed. Exactly as many bytes as the header announces must be
/// there: fewer leave voxels without a density, and more move the voxels by an unknown length.
namespace trephine::inline TREPHINE_ALIGNED::itk_detail {

/// Formats of compression, as zlib's window sizes.
enum class Packing : int { kNone = 0, kGzip = 15 + 32 /* or zlib's own */, kDeflate = -15 /* without a header */ };

/// Reads compressed bytes in order; a gzip file may have several members, as bgzip and pigz write them.
class Inflater {
 public:
  Inflater(std::istream& in, Packing packing) : in_(in), several_(packing == Packing::kGzip) {
    good_ = inflateInit2(&z_, static_cast<int>(packing)) == Z_OK;
  }
  ~Inflater() { inflateEnd(&z_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  /// Reads up to `count` bytes and returns how many; fewer at the end, and where the file is damaged.
  std::size_t read(std::byte* to, std::size_t count) {
    std::size_t done = 0;
    while (done < count && good_ && !ended_) {
      if (z_.avail_in == 0 && !refill()) {
        good_ = false;
        break;
      }
      const auto part = static_cast<uInt>(std::min<std::size_t>(count - done, std::numeric_limits<uInt>::max()));
      z_.next_out = reinterpret_cast<Bytef*>(to + done);
      z_.avail_out = part;
      const int result = inflate(&z_, Z_NO_FLUSH);
      done += part - z_.avail_out;
      if (result == Z_STREAM_END)
        next_member();
      else
        good_ = result == Z_OK || result == Z_BUF_ERROR;
    }
    return done;
  }
  /// Returns true unless the compressed bytes are damaged or end too early.
  [[nodiscard]] bool good() const noexcept { return good_; }

 private:
  bool refill() {
    in_.read(reinterpret_cast<char*>(buffer_.data()), static_cast<std::streamsize>(buffer_.size()));
    z_.next_in = buffer_.data();
    z_.avail_in = static_cast<uInt>(in_.gcount());
    return z_.avail_in > 0;
  }
  void next_member() {
    constexpr Bytef kGzipMark = 0x1F;
    ended_ = !several_ || (z_.avail_in == 0 && !refill()) || *z_.next_in != kGzipMark;
    if (!ended_) good_ = inflateReset(&z_) == Z_OK;
  }

  std::istream& in_;
  bool several_;
  bool good_ = false;
  bool ended_ = false;
  z_stream z_{};
  std::array<Bytef, 65536> buffer_{};
};

/// Returns true if the file starts with gzip's mark.
inline bool is_gzip(const std::filesystem::path& file) {
  std::array<char, 2> mark{};
  std::ifstream(file, std::ios::binary).read(mark.data(), 2);
  return mark[0] == '\x1F' && mark[1] == '\x8B';
}

/// Returns the first bytes of a file, uncompressed, up to `count`.
inline std::string first_bytes(const std::filesystem::path& file, std::size_t count) {
  std::string bytes(count, '\0');
  std::ifstream in(file, std::ios::binary);
  if (is_gzip(file)) {
    bytes.resize(Inflater(in, Packing::kGzip).read(reinterpret_cast<std::byte*>(bytes.data()), count));
  } else {
    in.read(bytes.data(), static_cast<std::streamsize>(count));
    bytes.resize(static_cast<std::size_t>(in.gcount()));
  }
  return bytes;
}

/// Bytes of the voxels in a file.
struct VoxelBytes {
  std::filesystem::path file;
  std::uint64_t offset = 0;  // of the compressed bytes, if they are
  bool at_end = false;       // the last bytes of the file, whatever precedes them
  std::uint64_t skip = 0;    // uncompressed bytes before the voxels
  Packing packing = Packing::kNone;
};

[[noreturn]] inline void refuse_cut(const std::string& where) {
  refuse_volume(where,
                "its voxels cannot be read: some are missing, the file was cut short or damaged; fetch it again");
}

[[noreturn]] inline void refuse_surplus(const std::string& where) {
  refuse_volume(where,
                "holds more bytes than its header's sizes and type take, so its voxels could start elsewhere; mend the "
                "header (sizes, type, bytes to skip)");
}

/// Reads the `count` bytes of a file's voxels. Throws VolumeError if there are fewer or more.
inline std::vector<std::byte> read_bytes(const VoxelBytes& voxels, std::uint64_t count, const std::string& where) {
  std::error_code error;
  const std::uint64_t length = std::filesystem::file_size(voxels.file, error);
  if (error)
    refuse_volume(where, "its voxels cannot be read: there is no file " + voxels.file.string() + "; put it there");
  std::ifstream in(voxels.file, std::ios::binary);
  std::vector<std::byte> bytes;
  if (voxels.packing == Packing::kNone) {
    const std::uint64_t before = voxels.offset + voxels.skip;
    if (length < count || (!voxels.at_end && length - count < before)) refuse_cut(where);
    if (!voxels.at_end && length > before + count) refuse_surplus(where);
    bytes.resize(static_cast<std::size_t>(count));
    in.seekg(static_cast<std::streamoff>(length - count));
    in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(count));
    if (static_cast<std::uint64_t>(in.gcount()) != count) refuse_cut(where);
    return bytes;
  }
  constexpr std::uint64_t kMaxPerByte = 1032;  // of deflate: a header that asks for more is wrong
  if (voxels.offset > length || (voxels.skip + count) / kMaxPerByte > length - voxels.offset) refuse_cut(where);
  in.seekg(static_cast<std::streamoff>(voxels.offset));
  Inflater inflater(in, voxels.packing);
  bytes.resize(static_cast<std::size_t>(std::max(voxels.skip, count)));
  std::byte one_more{};
  if (inflater.read(bytes.data(), static_cast<std::size_t>(voxels.skip)) != voxels.skip ||
      inflater.read(bytes.data(), static_cast<std::size_t>(count)) != count)
    refuse_cut(where);
  if (inflater.read(&one_more, 1) != 0) refuse_surplus(where);
  if (!inflater.good()) refuse_cut(where);
  bytes.resize(static_cast<std::size_t>(count));
  return bytes;
}

/// Returns a number from its bytes.
template <class Number>
Number from_bytes(const char* bytes, bool big_endian) {
  std::array<char, sizeof(Number)> b{};
  std::memcpy(b.data(), bytes, sizeof(Number));
  if (big_endian != (std::endian::native == std::endian::big)) std::reverse(b.begin(), b.end());
  return detail::bit_cast<Number>(b);
}

/// Reverses the bytes of each number of `width` bytes unless they have the order of this machine.
inline void to_native_order(std::vector<std::byte>& bytes, std::size_t width, bool big_endian) {
  if (width < 2 || big_endian == (std::endian::native == std::endian::big)) return;
  for (auto at = bytes.begin(); bytes.end() - at >= static_cast<std::ptrdiff_t>(width);
       at += static_cast<std::ptrdiff_t>(width))
    std::reverse(at, at + static_cast<std::ptrdiff_t>(width));
}

/// Returns the bytes compressed, in gzip's format or in zlib's own.
inline std::vector<std::byte> deflated(const void* bytes, std::size_t count, bool gzip) {
  constexpr int kMaxWindow = 15;
  constexpr int kWithGzipHeader = 16;
  z_stream z{};
  if (deflateInit2(&z, Z_DEFAULT_COMPRESSION, Z_DEFLATED, gzip ? kMaxWindow + kWithGzipHeader : kMaxWindow, 8,
                   Z_DEFAULT_STRATEGY) != Z_OK)
    return {};
  std::vector<std::byte> out;
  const auto* in = static_cast<const Bytef*>(bytes);
  std::array<std::byte, 65536> buffer{};
  std::size_t left = count;
  int result = Z_OK;
  while (result == Z_OK) {
    if (z.avail_in == 0 && left > 0) {
      z.avail_in = static_cast<uInt>(std::min<std::size_t>(left, std::numeric_limits<uInt>::max()));
      z.next_in = const_cast<Bytef*>(in);
      in += z.avail_in;
      left -= z.avail_in;
    }
    z.next_out = reinterpret_cast<Bytef*>(buffer.data());
    z.avail_out = static_cast<uInt>(buffer.size());
    result = deflate(&z, left == 0 ? Z_FINISH : Z_NO_FLUSH);
    out.insert(out.end(), buffer.begin(), buffer.end() - static_cast<std::ptrdiff_t>(z.avail_out));
  }
  deflateEnd(&z);
  return out;
}

}  // namespace trephine::itk_detail
