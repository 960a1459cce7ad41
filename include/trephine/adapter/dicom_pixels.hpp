// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/adapter/compressed_pixels.hpp>
#include <trephine/adapter/dicom_elements.hpp>
#include <trephine/adapter/itk_image.hpp>
#include <trephine/adapter/stored_image.hpp>
#include <trephine/adapter/volume_bytes.hpp>
#include <trephine/adapter/volume_text.hpp>
#include <trephine/core/bit_cast.hpp>

#include <itkGDCMImageIO.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

/// Reads the pixels of a DICOM slice as densities. Plain pixels are read here; compressed ones are given to ITK in a
/// file of their own, with the few elements that describe them, so that no other element can mislead the decoder.
namespace trephine::inline TREPHINE_ALIGNED::itk_detail {

/// Returns the last line of an ITK message, which gives the reason.
inline std::string last_line(const std::string& text) {
  const auto end = text.find_last_not_of(" \n\r\t");
  if (end == std::string::npos) return "no reason given";
  const auto begin = text.find_last_of('\n', end);
  return text.substr(begin == std::string::npos ? 0 : begin + 1,
                     end - (begin == std::string::npos ? 0 : begin + 1) + 1);
}

/// How a slice's pixels are stored.
struct PixelForm {
  int columns = 0;
  int rows = 0;
  unsigned allocated = 0;  // bits
  unsigned stored = 0;     // bits
  unsigned high_bit = 0;
  bool is_signed = false;
  double slope = 1;
  double intercept = 0;

  [[nodiscard]] std::size_t count() const noexcept {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  }
  /// Returns the number in the stored bits, without the others, which overlays may use.
  [[nodiscard]] std::int64_t number(std::uint32_t bits) const noexcept {
    const std::uint32_t mask = stored == 32 ? ~std::uint32_t{0} : (std::uint32_t{1} << stored) - 1;
    const std::uint32_t v = bits >> (high_bit + 1 - stored) & mask;
    const bool negative = is_signed && (v >> (stored - 1) & 1U) != 0;
    return negative ? static_cast<std::int64_t>(v) - static_cast<std::int64_t>(mask) - 1 : static_cast<std::int64_t>(v);
  }
};

/// Returns the form of a slice's pixels. Throws VolumeError if the header contradicts itself.
inline PixelForm pixel_form(const DicomFile& file) {
  namespace tag = dicom_tag;
  const std::string where = file.path.string();
  PixelForm form{.columns = file.number(tag::kColumns).value_or(0),
                 .rows = file.number(tag::kRows).value_or(0),
                 .allocated = file.number(tag::kAllocated).value_or(0),
                 .is_signed = file.number(tag::kSigned).value_or(0) == 1};
  form.stored = file.number(tag::kStored).value_or(static_cast<std::uint16_t>(form.allocated));
  form.high_bit = file.number(tag::kHighBit).value_or(static_cast<std::uint16_t>(form.stored - 1));
  if (form.columns < 1 || form.rows < 1) refuse_volume(where, "its header tells no size of the image");
  if ((form.allocated != 8 && form.allocated != 16 && form.allocated != 32) || form.stored < 1 ||
      form.stored > form.allocated || form.high_bit + 1 < form.stored || form.high_bit >= form.allocated)
    refuse_volume(where, "its pixels have " + std::to_string(form.stored) + " bits in " +
                             std::to_string(form.allocated) + ", which is not read; convert it");
  if (file.has(tag::kLookup) && !file.has(tag::kSlope))
    refuse_volume(where, "its densities come from a table (Modality LUT), which is not read; convert it");
  const auto decimal = [&](std::uint32_t of, double otherwise) {
    if (file.text(of).empty()) return otherwise;
    const auto v = file.decimals<1>(of);
    if (!v || !std::isfinite((*v)[0]) || (of == tag::kSlope && (*v)[0] == 0))
      refuse_volume(where,
                    "its rescale slope or intercept is no usable number: '" + file.text(of) + "'; export it again");
    return (*v)[0];
  };
  form.slope = decimal(tag::kSlope, 1);
  form.intercept = decimal(tag::kIntercept, 0);
  return form;
}

/// Numbers of a slice, and which of them are padding, without a density of their own.
struct SlicePixels {
  std::vector<std::int64_t> numbers;
  std::vector<bool> padding;
};

/// The values that mark padding.
class Padding {
 public:
  Padding(const DicomFile& file, const PixelForm& form) : form_(form), raw_(file.number(dicom_tag::kPadding)) {
    if (!raw_ || form.allocated > 16) raw_.reset();
    if (!raw_) return;
    const std::int64_t value = as_number(*raw_);
    const std::int64_t limit = as_number(file.number(dicom_tag::kPaddingLimit).value_or(*raw_));
    // A value beyond the stored bits is found by its bits alone: cut to them it could be bone's.
    if (value == form.number(*raw_)) {
      from_ = std::min(value, limit);
      to_ = std::max(value, limit);
    }
  }
  [[nodiscard]] bool holds(std::int64_t number) const noexcept { return from_ <= number && number <= to_; }
  [[nodiscard]] bool holds(std::uint32_t bits, std::int64_t number) const noexcept {
    return (raw_ && bits == *raw_) || holds(number);
  }

 private:
  [[nodiscard]] std::int64_t as_number(std::uint16_t bits) const noexcept {
    return form_.is_signed ? std::int64_t{detail::bit_cast<std::int16_t>(bits)} : std::int64_t{bits};
  }
  PixelForm form_;
  std::optional<std::uint16_t> raw_;
  std::int64_t from_ = 1;
  std::int64_t to_ = 0;
};

/// Reads uncompressed pixels.
inline SlicePixels plain_pixels(const DicomFile& file, const PixelForm& form, const Padding& padding) {
  constexpr std::string_view kGeneralElectric = "1.2.840.113619.5.2";  // its pixels alone are big-endian
  constexpr std::array<std::string_view, 6> kPlain{
      "", "1.2.840.10008.1.2", "1.2.840.10008.1.2.1", "1.2.840.10008.1.2.2", kDicomDeflated, kGeneralElectric};
  const std::string where = file.path.string();
  if (std::find(kPlain.begin(), kPlain.end(), file.syntax) == kPlain.end())
    refuse_volume(where, "its voxels cannot be read: they should be compressed and are not; export it again");
  const std::size_t width = form.allocated / 8;
  const std::uint64_t needed = form.count() * width;
  const DicomBytes at = file.pixels.at(0);
  if (at.length < needed) refuse_cut(where);
  const auto in = open_data_set(file);
  std::vector<std::byte> bytes(static_cast<std::size_t>(needed));
  in->seekg(static_cast<std::streamoff>(at.offset));
  in->read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(needed));
  if (static_cast<std::uint64_t>(in->gcount()) != needed) refuse_cut(where);
  // Zeros, or less than a row, are padding; more belongs to another image.
  std::uint64_t surplus = at.length - needed;
  if (surplus >= std::max<std::uint64_t>(needed / static_cast<std::uint64_t>(form.rows), 2))
    for (char c = 0; surplus > 0 && in->get(c); --surplus)
      if (c != '\0') refuse_surplus(where);
  to_native_order(bytes, width, file.big_endian || file.syntax == kGeneralElectric);
  SlicePixels pixels{.numbers = std::vector<std::int64_t>(form.count()), .padding = std::vector<bool>(form.count())};
  const auto each = [&]<class Raw>(const Raw* raw) {
    for (std::size_t i = 0; i < form.count(); ++i) {
      pixels.numbers[i] = form.number(raw[i]);
      pixels.padding[i] = padding.holds(raw[i], pixels.numbers[i]);
    }
  };
  if (width == 1) each(reinterpret_cast<const std::uint8_t*>(bytes.data()));
  if (width == 2) each(reinterpret_cast<const std::uint16_t*>(bytes.data()));
  if (width == 4) each(reinterpret_cast<const std::uint32_t*>(bytes.data()));
  return pixels;
}

/// A file that holds the compressed pixels of a slice, and goes with the object.
class PixelFile {
 public:
  PixelFile(const DicomFile& file, const PixelForm& form, const std::string& stream) {
    std::random_device seed;
    path_ = std::filesystem::temp_directory_path() /
            ("trephine-" + std::to_string(seed()) + "-" + std::to_string(seed()) + ".dcm");
    std::ofstream(path_, std::ios::binary) << content(file, form, stream);
  }
  ~PixelFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  PixelFile(const PixelFile&) = delete;
  PixelFile& operator=(const PixelFile&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

 private:
  static std::string little(std::uint32_t v, int bytes) {
    std::string text;
    for (int i = 0; i < bytes; ++i) text.push_back(static_cast<char>(v >> 8 * i & 0xFF));
    return text;
  }
  static std::string element(std::uint32_t tag, const std::string& type, std::string value) {
    if (value.size() % 2 != 0) value.push_back(type == "UI" || type == "OB" ? '\0' : ' ');
    const auto length = static_cast<std::uint32_t>(value.size());
    return little(tag >> 16, 2) + little(tag & 0xFFFF, 2) + type +
           (type == "OB" ? little(0, 2) + little(length, 4) : little(length, 2)) + value;
  }
  static std::string content(const DicomFile& file, const PixelForm& form, const std::string& stream) {
    namespace tag = dicom_tag;
    const std::string capture = "1.2.840.10008.5.1.4.1.1.7";  // a class without a rescaling
    const std::string meta = element(0x00020001, "OB", {"\0\1", 2}) + element(0x00020002, "UI", capture) +
                             element(0x00020003, "UI", "1.2.826.0.1.3680043.2.1125.1") +
                             element(tag::kTransferSyntax, "UI", file.syntax);
    const auto number = [](std::uint32_t of, unsigned v) { return element(of, "US", little(v, 2)); };
    std::string all = std::string(128, '\0') + "DICM" +
                      element(0x00020000, "UL", little(static_cast<std::uint32_t>(meta.size()), 4)) + meta +
                      element(tag::kClass, "UI", capture) +
                      element(tag::kInstance, "UI", "1.2.826.0.1.3680043.2.1125.1") + number(tag::kSamples, 1) +
                      element(tag::kPhotometric, "CS", "MONOCHROME2") +
                      number(tag::kRows, static_cast<unsigned>(form.rows)) +
                      number(tag::kColumns, static_cast<unsigned>(form.columns)) +
                      number(tag::kAllocated, form.allocated) + number(tag::kStored, form.stored) +
                      number(tag::kHighBit, form.high_bit) + number(tag::kSigned, form.is_signed ? 1 : 0);
    const auto item = [](std::uint32_t of, const std::string& value) {
      return little(of >> 16, 2) + little(of & 0xFFFF, 2) + little(static_cast<std::uint32_t>(value.size()), 4) + value;
    };
    all += little(tag::kPixels >> 16, 2) + little(tag::kPixels & 0xFFFF, 2) + "OB" + little(0, 2) +
           little(0xFFFFFFFF, 4) + item(tag::kItem, "");
    all += item(tag::kItem, stream);
    return all + item(tag::kSequenceEnd, "");
  }

  std::filesystem::path path_;
};

/// Decodes compressed pixels with ITK.
inline SlicePixels decoded_pixels(const DicomFile& file, const PixelForm& form, const Padding& padding) {
  constexpr std::string_view kKnown =
      "1.2.840.10008.1.2.4.50 1.2.840.10008.1.2.4.51 1.2.840.10008.1.2.4.57 1.2.840.10008.1.2.4.70 "
      "1.2.840.10008.1.2.4.80 1.2.840.10008.1.2.4.81 1.2.840.10008.1.2.4.90 1.2.840.10008.1.2.4.91 "
      "1.2.840.10008.1.2.5 ";
  const std::string where = file.path.string();
  if (kKnown.find(file.syntax + " ") == std::string_view::npos || file.syntax.empty())
    refuse_volume(where, "its voxels cannot be read (no decoder for transfer syntax " + file.syntax +
                             "); export it uncompressed");
  if (file.pixels.empty()) refuse_cut(where);
  std::string stream;
  std::ifstream from(file.path, std::ios::binary);
  for (const DicomBytes& fragment : file.pixels) {
    std::string bytes(static_cast<std::size_t>(fragment.length), '\0');
    from.seekg(static_cast<std::streamoff>(fragment.offset));
    from.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    stream += bytes;
  }
  const StreamForm size{
      .columns = static_cast<unsigned>(form.columns), .rows = static_cast<unsigned>(form.rows), .bits = form.allocated};
  if (!is_whole_stream(file.syntax, stream, size))
    refuse_volume(where,
                  "its voxels cannot be read: the compressed image is cut short, damaged or of another size than "
                  "the header tells; fetch it again");
  if (stream.size() % 2 != 0) stream.push_back('\0');
  const PixelFile own(file, form, stream);
  SlicePixels pixels;
  try {
    const auto io = itk::GDCMImageIO::New();
    io->SetFileName(own.path().string());
    io->ReadImageInformation();
    itk::ImageIORegion region(io->GetNumberOfDimensions());
    for (unsigned a = 0; a < io->GetNumberOfDimensions(); ++a) region.SetSize(a, io->GetDimensions(a));
    io->SetIORegion(region);
    if (static_cast<std::size_t>(io->GetImageSizeInPixels()) != form.count() || io->GetNumberOfComponents() != 1)
      refuse_volume(where, "its voxels cannot be read: the compressed image has another size than the header tells");
    std::vector<std::byte> bytes(static_cast<std::size_t>(io->GetImageSizeInBytes()));
    io->Read(bytes.data());
    const auto each = [&]<class Pixel>(Pixel) {
      const auto* const in = reinterpret_cast<const Pixel*>(bytes.data());
      pixels.numbers.assign(in, in + form.count());
    };
    using Component = itk::IOComponentEnum;
    switch (io->GetComponentType()) {
      case Component::UCHAR:
        each(std::uint8_t{});
        break;
      case Component::CHAR:
        each(std::int8_t{});
        break;
      case Component::USHORT:
        each(std::uint16_t{});
        break;
      case Component::SHORT:
        each(std::int16_t{});
        break;
      case Component::UINT:
        each(std::uint32_t{});
        break;
      case Component::INT:
        each(std::int32_t{});
        break;
      default:
        refuse_volume(where, "its voxels are no plain numbers");
    }
  } catch (const itk::ExceptionObject& e) {
    refuse_volume(where, "its voxels cannot be read (" + last_line(e.GetDescription()) + "); is the file complete?");
  }
  pixels.padding.resize(form.count());
  for (std::size_t i = 0; i < form.count(); ++i) pixels.padding[i] = padding.holds(pixels.numbers[i]);
  return pixels;
}

/// Reads a slice's pixels and calls `visit(const Pixel*, count)` with their densities. Padding, which may be any
/// number, gets the smallest of the slice's others unless it is below them.
template <class Visit>
void read_slice(const DicomFile& file, Visit&& visit) {
  const PixelForm form = pixel_form(file);
  const Padding padding(file, form);
  SlicePixels pixels = file.fragmented ? decoded_pixels(file, form, padding) : plain_pixels(file, form, padding);
  std::optional<std::int64_t> lowest;
  for (std::size_t i = 0; i < form.count(); ++i)
    if (!pixels.padding[i]) lowest = std::min(lowest.value_or(pixels.numbers[i]), pixels.numbers[i]);
  for (std::size_t i = 0; i < form.count(); ++i)
    if (pixels.padding[i]) pixels.numbers[i] = std::min(pixels.numbers[i], lowest.value_or(0));
  const auto type = form.allocated == 8    ? (form.is_signed ? Number::kI8 : Number::kU8)
                    : form.allocated == 16 ? (form.is_signed ? Number::kI16 : Number::kU16)
                                           : (form.is_signed ? Number::kI32 : Number::kU32);
  with_number(type, [&]<class Stored>(Stored) {
    std::vector<Stored> stored(form.count());
    std::transform(pixels.numbers.begin(), pixels.numbers.end(), stored.begin(),
                   [](std::int64_t v) { return static_cast<Stored>(v); });
    visit_scaled(stored.data(), stored.size(), form.slope, form.intercept, visit);
  });
}

}  // namespace trephine::itk_detail
