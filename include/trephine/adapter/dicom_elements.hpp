// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/adapter/volume_bytes.hpp>
#include <trephine/adapter/volume_text.hpp>

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <istream>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// Walks the elements of a DICOM file (PS3.5) by their lengths, each checked against the bytes that are there, so that
/// a damaged or unusual file ends in a reason and never in a decoder.
namespace trephine::inline TREPHINE_ALIGNED::itk_detail {

/// Elements by tag: group in the upper 16 bits.
namespace dicom_tag {
inline constexpr std::uint32_t kTransferSyntax = 0x00020010, kClass = 0x00080016, kInstance = 0x00080018,
                               kModality = 0x00080060, kDescription = 0x0008103E, kTilt = 0x00181120,
                               kSeries = 0x0020000E, kPosition = 0x00200032, kAxes = 0x00200037, kSamples = 0x00280002,
                               kPhotometric = 0x00280004, kFrames = 0x00280008, kRows = 0x00280010,
                               kColumns = 0x00280011, kPixelSpacing = 0x00280030, kAllocated = 0x00280100,
                               kStored = 0x00280101, kHighBit = 0x00280102, kSigned = 0x00280103, kPadding = 0x00280120,
                               kPaddingLimit = 0x00280121, kIntercept = 0x00281052, kSlope = 0x00281053,
                               kLookup = 0x00283000, kFloatPixels = 0x7FE00008, kDoublePixels = 0x7FE00009,
                               kPixels = 0x7FE00010, kItem = 0xFFFEE000, kItemEnd = 0xFFFEE00D,
                               kSequenceEnd = 0xFFFEE0DD;
}  // namespace dicom_tag

/// Bytes from `offset` on in the data set.
struct DicomBytes {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
};

/// A file as its elements tell it, up to the pixels.
struct DicomFile {
  std::filesystem::path path;
  bool marked = false;   // has DICOM's mark at its beginning
  std::string damage{};  // why the walk ended early; empty if it came to the pixels or the end
  std::string syntax{};
  bool explicit_types = true;
  bool big_endian = false;
  bool deflated = false;
  std::uint64_t data_set_at = 0;
  std::map<std::uint32_t, std::string> elements{};  // values of the outermost level, without long ones
  bool has_pixels = false;
  bool fragmented = false;  // pixels are compressed
  std::vector<DicomBytes> pixels{};

  [[nodiscard]] bool has(std::uint32_t tag) const { return elements.contains(tag); }
  [[nodiscard]] std::string text(std::uint32_t tag) const {
    const auto found = elements.find(tag);
    return found == elements.end() ? "" : trimmed(found->second);
  }
  /// Returns the value of an element of 16 bits.
  [[nodiscard]] std::optional<std::uint16_t> number(std::uint32_t tag) const {
    const auto found = elements.find(tag);
    if (found == elements.end() || found->second.size() < 2) return std::nullopt;
    return from_bytes<std::uint16_t>(found->second.data(), big_endian);
  }
  /// Returns the N decimal numbers of an element; nothing if it has others.
  template <int N>
  [[nodiscard]] std::optional<Eigen::Matrix<double, N, 1>> decimals(std::uint32_t tag) const {
    const auto numbers = numbers_of(text(tag), "\\");
    if (!numbers || numbers->size() != static_cast<std::size_t>(N)) return std::nullopt;
    return Eigen::Map<const Eigen::Matrix<double, N, 1>>(numbers->data());
  }
};

/// Walks one file.
class DicomWalk {
 public:
  DicomWalk(std::istream& in, std::uint64_t end, DicomFile& file) : in_(in), end_(end), file_(file) {}

  /// Reads the elements of group 2, which have a form of their own, and returns where they end.
  std::uint64_t file_meta(std::uint64_t at) {
    while (at < end_) {
      const auto head = head_at(at, true, false);
      if (!head || head->tag >> 16 != 2) return at;
      if (head->value.length > end_ - head->value.offset) return damaged();
      file_.elements[head->tag] = value(head->value);
      at = head->value.offset + head->value.length;
    }
    return at;
  }

  /// Reads the elements up to the pixels or the end.
  void data_set(std::uint64_t at) {
    while (at < end_) {
      const auto head = head_at(at, file_.explicit_types, file_.big_endian);
      if (!head) {
        damaged();
        return;
      }
      if (head->tag == dicom_tag::kPixels || head->tag == dicom_tag::kFloatPixels ||
          head->tag == dicom_tag::kDoublePixels) {
        pixels(*head);
        return;
      }
      if (head->undefined) {
        file_.elements[head->tag] = "";
        at = skip_items(head->value.offset, head->unknown ? false : file_.explicit_types, 0);
      } else {
        constexpr std::uint64_t kLongest = 1024;  // of values that are asked for
        if (head->value.length > end_ - head->value.offset) at = damaged();
        if (at == kNowhere) return;
        file_.elements[head->tag] = head->value.length <= kLongest ? value(head->value) : "";
        at = head->value.offset + head->value.length;
      }
      if (at == kNowhere) return;
    }
  }

 private:
  static constexpr std::uint64_t kNowhere = ~std::uint64_t{0};
  static constexpr std::uint32_t kUndefined = 0xFFFFFFFF;

  struct Head {
    std::uint32_t tag = 0;
    DicomBytes value{};
    bool undefined = false;  // the length
    bool unknown = false;    // the type
  };

  std::uint64_t damaged() {
    file_.damage = "ends within its header or is damaged";
    return kNowhere;
  }
  std::string value(const DicomBytes& bytes) {
    std::string text(static_cast<std::size_t>(bytes.length), '\0');
    in_.clear();
    in_.seekg(static_cast<std::streamoff>(bytes.offset));
    in_.read(text.data(), static_cast<std::streamsize>(text.size()));
    return text;
  }

  /// Returns tag, length and place of the element at `at`; nothing if the bytes end before.
  std::optional<Head> head_at(std::uint64_t at, bool explicit_types, bool big_endian) {
    if (end_ - at < 8) return std::nullopt;
    const std::string b = value({at, std::min<std::uint64_t>(12, end_ - at)});
    const auto half = [&](std::size_t i) { return from_bytes<std::uint16_t>(b.data() + i, big_endian); };
    const auto whole = [&](std::size_t i) { return from_bytes<std::uint32_t>(b.data() + i, big_endian); };
    Head head{.tag = static_cast<std::uint32_t>(half(0)) << 16 | half(2)};
    const auto is_letter = [](char c) { return c >= 'A' && c <= 'Z'; };
    std::uint32_t length = 0;
    // Some writers change to the form without types within a file.
    if (head.tag >> 16 == 0xFFFE || !explicit_types || !is_letter(b[4]) || !is_letter(b[5])) {
      length = whole(4);
      head.value.offset = at + 8;
    } else {
      constexpr std::string_view kLongTypes = "OB OD OF OL OV OW SQ SV UC UN UR UT UV";
      const std::string_view type(&b[4], 2);
      head.unknown = type == "UN";
      if (kLongTypes.find(type) != std::string_view::npos) {
        if (b.size() < 12) return std::nullopt;
        length = whole(8);
        head.value.offset = at + 12;
      } else {
        length = half(6);
        head.value.offset = at + 8;
      }
    }
    head.undefined = length == kUndefined;
    head.value.length = length;
    return head;
  }

  /// Returns where a sequence of undefined length ends.
  std::uint64_t skip_items(std::uint64_t at, bool explicit_types, int depth) {
    constexpr int kDeepest = 64;
    while (at < end_ && depth < kDeepest) {
      const auto item = head_at(at, false, file_.big_endian);
      if (!item) break;
      if (item->tag == dicom_tag::kSequenceEnd) return item->value.offset;
      if (item->tag != dicom_tag::kItem) break;
      at = item->value.offset;
      if (!item->undefined) {
        if (item->value.length > end_ - at) break;
        at += item->value.length;
        continue;
      }
      at = skip_elements(at, explicit_types, depth);
      if (at == kNowhere) return at;
    }
    return damaged();
  }
  /// Returns where an item of undefined length ends.
  std::uint64_t skip_elements(std::uint64_t at, bool explicit_types, int depth) {
    while (at < end_) {
      const auto head = head_at(at, explicit_types, file_.big_endian);
      if (!head) break;
      at = head->value.offset;
      if (head->tag == dicom_tag::kItemEnd) return at;
      if (head->undefined) {
        at = skip_items(at, head->unknown ? false : explicit_types, depth + 1);
        if (at == kNowhere) return at;
      } else {
        if (head->value.length > end_ - at) break;
        at += head->value.length;
      }
    }
    return damaged();
  }

  /// Finds the pixels' bytes: one run, or fragments behind a table of offsets.
  void pixels(const Head& head) {
    file_.has_pixels = head.tag == dicom_tag::kPixels;
    if (!file_.has_pixels) file_.elements[head.tag] = "";
    if (!head.undefined) {
      file_.pixels = {head.value};
      return;
    }
    file_.fragmented = true;
    std::uint64_t at = head.value.offset;
    bool table = true;
    while (at < end_) {
      const auto item = head_at(at, false, file_.big_endian);
      if (!item || item->undefined) break;
      if (item->tag == dicom_tag::kSequenceEnd) return;
      if (item->tag != dicom_tag::kItem || item->value.length > end_ - item->value.offset) break;
      if (!table) file_.pixels.push_back(item->value);
      table = false;
      at = item->value.offset + item->value.length;
    }
    file_.pixels.clear();  // cut short
  }

  std::istream& in_;
  std::uint64_t end_;
  DicomFile& file_;
};

inline constexpr std::string_view kDicomDeflated = "1.2.840.10008.1.2.1.99";

/// Opens a file's data set: the file itself, or its elements uncompressed in memory, at the same offsets.
inline std::unique_ptr<std::istream> open_data_set(const DicomFile& file) {
  auto in = std::make_unique<std::ifstream>(file.path, std::ios::binary);
  if (!file.deflated) return in;
  in->seekg(static_cast<std::streamoff>(file.data_set_at));
  Inflater inflater(*in, Packing::kDeflate);
  std::string all(static_cast<std::size_t>(file.data_set_at), '\0');
  std::array<std::byte, 65536> part{};
  constexpr std::size_t kMax = std::size_t{1} << 31;  // no slice is longer
  while (all.size() < kMax) {
    const std::size_t n = inflater.read(part.data(), part.size());
    if (n == 0) break;
    all.append(reinterpret_cast<const char*>(part.data()), n);
  }
  return std::make_unique<std::istringstream>(std::move(all));
}

/// Returns a file's elements; nothing if it does not look like DICOM.
inline std::optional<DicomFile> walk_dicom(const std::filesystem::path& path) {
  DicomFile file{.path = path};
  std::error_code error;
  std::uint64_t end = std::filesystem::file_size(path, error);
  std::ifstream in(path, std::ios::binary);
  std::string start(132, '\0');
  in.read(start.data(), 132);
  start.resize(static_cast<std::size_t>(in.gcount()));
  std::uint64_t at = 0;
  if (start.size() == 132 && start.substr(128) == "DICM") at = 132;
  file.marked = at > 0;
  // Without the mark: files of before 1993, and exports of a data set alone. Their first element is of group 2 or 8.
  const auto group = start.size() < 8 ? std::uint16_t{0} : from_bytes<std::uint16_t>(start.data(), false);
  if (error || (!file.marked && (group != 2 && group != 8))) return std::nullopt;

  DicomWalk meta(in, end, file);
  at = meta.file_meta(at);
  if (!file.damage.empty()) return file.marked ? std::optional(file) : std::nullopt;
  file.syntax = file.text(dicom_tag::kTransferSyntax);
  file.big_endian = file.syntax == "1.2.840.10008.1.2.2";
  file.deflated = file.syntax == kDicomDeflated;
  file.data_set_at = at;
  const std::unique_ptr<std::istream> data = open_data_set(file);
  if (file.deflated) {
    data->seekg(0, std::ios::end);
    end = static_cast<std::uint64_t>(data->tellg());
  }
  // Whether elements tell their type is seen from the first of them, which some headers contradict.
  data->clear();
  data->seekg(static_cast<std::streamoff>(at + 4));
  const auto first = static_cast<char>(data->get());
  const auto second = static_cast<char>(data->get());
  file.explicit_types = first >= 'A' && first <= 'Z' && second >= 'A' && second <= 'Z';
  DicomWalk(*data, end, file).data_set(at);
  if (!file.marked && !file.has(dicom_tag::kClass) && !file.has(dicom_tag::kRows)) return std::nullopt;
  return file;
}

}  // namespace trephine::itk_detail
