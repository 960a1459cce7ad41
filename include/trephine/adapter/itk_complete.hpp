// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/adapter/itk_image.hpp>

#include <itkGDCMImageIO.h>
#include <itkImageIOBase.h>
#include <itkMetaDataObject.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

/// Refuses truncated files (a full disk, a broken download). ITK's readers for DICOM, NIfTI and MetaImage accept them
/// and leave missing voxels uninitialised or zero: bone or air that is not the patient's. NRRD's reader refuses them
/// itself.
namespace trephine::inline TREPHINE_ALIGNED::itk_detail {

inline std::uint32_t little_endian_32(const char* bytes) {
  std::array<unsigned char, 4> b{};
  std::memcpy(b.data(), bytes, 4);
  return static_cast<std::uint32_t>(b[0] | b[1] << 8 | b[2] << 16) | static_cast<std::uint32_t>(b[3]) << 24;
}

/// Returns a whole number from ITK's metadata of a file; 0 if the key is missing.
inline std::uint64_t metadata_number(const itk::ImageIOBase& io, const char* key) {
  std::string text;
  itk::ExposeMetaData(io.GetMetaDataDictionary(), key, text);
  return text.empty() ? 0 : std::strtoull(text.c_str(), nullptr, 10);
}

/// Searches the pixel element whose length is that of the image and returns true if the file holds all of it. A file
/// without such an element is compressed; its decoder detects truncation.
inline bool dicom_is_complete(const std::string& file, const itk::ImageIOBase& io) {
  std::ifstream stream(file, std::ios::binary);
  const std::vector<char> bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  const auto pixels = static_cast<std::uint64_t>(io.GetImageSizeInPixels());
  const std::uint64_t expected =
      (pixels * metadata_number(io, "0028|0100") / 8 + 1) / 2 * 2;  // DICOM pads to even lengths
  constexpr std::array<char, 4> kPixelData{'\xE0', '\x7F', '\x10', '\x00'};
  auto at = bytes.begin();
  while (true) {
    at = std::search(at, bytes.end(), kPixelData.begin(), kPixelData.end());
    const auto left = static_cast<std::uint64_t>(bytes.end() - at);
    if (left < 12) return left == 0;
    // The length follows the tag directly, or after a type of two letters and two reserved bytes.
    const bool has_type = at[4] == 'O' && (at[5] == 'W' || at[5] == 'B');
    if (little_endian_32(&at[has_type ? 8 : 4]) == expected) return left >= expected + (has_type ? 12 : 8);
    ++at;
  }
}

/// Compares the needed length with the file's, or with the uncompressed length that gzip stores at the file's end.
inline bool nifti_is_complete(const std::string& file, const itk::ImageIOBase& io) {
  namespace fs = std::filesystem;
  const std::uint64_t voxels =
      static_cast<std::uint64_t>(io.GetImageSizeInPixels()) * metadata_number(io, "bitpix") / 8;
  fs::path path = file;
  const bool compressed = path.extension() == ".gz";
  fs::path plain = compressed ? path.stem() : path;
  if (plain.extension() == ".hdr") {
    plain = (path.parent_path() / plain.filename()).replace_extension(".img");
    path = fs::exists(plain) ? plain : fs::path(plain.string() + ".gz");
  }
  std::error_code error;
  const std::uint64_t length = fs::file_size(path, error);
  if (error) return false;
  const std::uint64_t needed = metadata_number(io, "vox_offset") + voxels;
  if (path.extension() != ".gz") return length >= needed;
  std::array<char, 4> end{};
  std::ifstream stream(path, std::ios::binary);
  stream.seekg(-4, std::ios::end);
  stream.read(end.data(), 4);
  return stream && little_endian_32(end.data()) == static_cast<std::uint32_t>(needed);
}

/// Parses the text header for file, offset and length of the voxels, and compares them with the file's length.
inline bool meta_is_complete(const std::string& file, const itk::ImageIOBase& io) {
  namespace fs = std::filesystem;
  std::ifstream stream(file, std::ios::binary);
  auto needed = static_cast<std::uint64_t>(io.GetImageSizeInBytes());
  std::uint64_t offset = 0;
  std::string line;
  while (std::getline(stream, line)) {
    const auto equals = line.find('=');
    if (equals == std::string::npos) return false;
    const auto trimmed = [](std::string text) {
      text.erase(0, std::min(text.find_first_not_of(" \t"), text.size()));
      text.erase(text.find_last_not_of(" \t\r") + 1);
      return text;
    };
    const std::string key = trimmed(line.substr(0, equals));
    const std::string value = trimmed(line.substr(equals + 1));
    // Compressed: any length may be right, unless the next key gives it.
    if (key == "CompressedData" && (value == "True" || value == "true" || value == "1")) needed = 0;
    if (key == "CompressedDataSize") needed = std::strtoull(value.c_str(), nullptr, 10);
    if (key == "HeaderSize" && value != "-1") offset = std::strtoull(value.c_str(), nullptr, 10);
    if (key == "ElementDataFile") {
      fs::path data = fs::path(file).parent_path() / value;
      if (value == "LOCAL" || value == "Local" || value == "local") {
        data = file;
        offset = static_cast<std::uint64_t>(stream.tellg());
      } else if (value.find('%') != std::string::npos || value.starts_with("LIST")) {
        refuse_volume(file, "keeps its voxels in several files; store it in one");
      }
      std::error_code error;
      const std::uint64_t length = fs::file_size(data, error);
      return !error && length >= offset + needed;
    }
  }
  return false;
}

/// Reads an image's voxels into `buffer`. Throws VolumeError if voxels are missing; passes on ITK's
/// itk::ExceptionObject.
inline void read_completely(itk::ImageIOBase& io, const std::string& file, std::vector<std::byte>& buffer) {
  bool complete = true;
  if (dynamic_cast<itk::GDCMImageIO*>(&io) != nullptr)
    complete = dicom_is_complete(file, io);
  else if (dynamic_cast<itk::NiftiImageIO*>(&io) != nullptr)
    complete = nifti_is_complete(file, io);
  else if (dynamic_cast<itk::MetaImageIO*>(&io) != nullptr)
    complete = meta_is_complete(file, io);
  if (!complete) refuse_volume(file, "its voxels cannot be read: some are missing, the file was cut short");
  buffer.resize(static_cast<std::size_t>(io.GetImageSizeInBytes()));
  io.Read(buffer.data());
}

}  // namespace trephine::itk_detail
