// SPDX-License-Identifier: MIT
// DICOM files written here element by element: what lies in real folders beside a series, and damage of all kinds.
#include "files.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <variant>
#include <vector>

using namespace trephine;
using namespace trephine::test;

namespace {

std::string number(std::uint32_t v, int bytes, bool big = false) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text.push_back(static_cast<char>(v >> 8 * (big ? bytes - 1 - i : i) & 0xFF));
  return text;
}

enum class Syntax { kImplicit, kExplicit, kBig, kDeflated };

const char* const kCtClass = "1.2.840.10008.5.1.4.1.1.2";
const char* const kSeriesUid = "1.2.826.0.1.3680043.2.1125.5";

/// A DICOM file to be written: a slice of 4 x 3 pixels of a CT, unless told otherwise.
struct Dicom {
  Syntax syntax = Syntax::kExplicit;
  std::string sop_class = kCtClass;
  std::string modality = "CT";
  std::string uid = kSeriesUid;
  int k = 0;
  Vec3d position_mm{10, 20, 30};  // of slice 0
  bool has_place = true;
  std::string photometric = "MONOCHROME2";
  unsigned samples = 1;
  unsigned frames = 0;  // not told
  unsigned allocated = 16, stored = 16, is_signed = 1;
  std::string intercept = "-1024";
  std::optional<unsigned> padding{};
  std::vector<unsigned> pixels{};  // by default pixel i of slice k holds 100 k + i
  std::string other{};             // bytes of more elements, before the pixels
  std::string instance{};
  bool has_pixels = true;
  std::string surplus{};  // bytes after the pixels, in their element

  [[nodiscard]] bool big() const noexcept { return syntax == Syntax::kBig; }
  [[nodiscard]] std::string element(std::uint32_t tag, const std::string& type, std::string value) const {
    if (value.size() % 2 != 0) value.push_back(type == "UI" || type == "OB" ? '\0' : ' ');
    const bool meta = tag >> 16 == 2;
    const bool b = big() && !meta;
    const auto length = static_cast<std::uint32_t>(value.size());
    const std::string head = number(tag >> 16, 2, b) + number(tag & 0xFFFF, 2, b);
    if (syntax == Syntax::kImplicit && !meta) return head + number(length, 4) + value;
    const bool wide = type == "OB" || type == "OW" || type == "SQ" || type == "UN";
    return head + type + (wide ? number(0, 2) + number(length, 4, b) : number(length, 2, b)) + value;
  }
  [[nodiscard]] std::string us(std::uint32_t tag, unsigned v) const { return element(tag, "US", number(v, 2, big())); }

  [[nodiscard]] std::string data_set() const {
    std::string e = element(0x00080016, "UI", sop_class) +
                    element(0x00080018, "UI", instance.empty() ? uid + "." + std::to_string(k + 1) : instance) +
                    element(0x00080060, "CS", modality) + element(0x0020000E, "UI", uid);
    if (has_place) {
      const auto text = [](double v) { return std::to_string(v); };
      e += element(0x00200032, "DS",
                   text(position_mm.x()) + "\\" + text(position_mm.y()) + "\\" + text(position_mm.z() + 1.5 * k)) +
           element(0x00200037, "DS", "1\\0\\0\\0\\1\\0");
    }
    if (has_pixels) {
      e += us(0x00280002, samples) + element(0x00280004, "CS", photometric);
      if (frames > 0) e += element(0x00280008, "IS", std::to_string(frames));
      e += us(0x00280010, 3) + us(0x00280011, 4) + element(0x00280030, "DS", "0.75\\0.5") + us(0x00280100, allocated) +
           us(0x00280101, stored) + us(0x00280102, stored - 1) + us(0x00280103, is_signed);
      if (padding) e += element(0x00280120, is_signed == 1 ? "SS" : "US", number(*padding, 2, big()));
      e += element(0x00281052, "DS", intercept) + element(0x00281053, "DS", "1");
    }
    e += other;
    if (has_pixels) {
      std::string bytes;
      for (unsigned i = 0; i < 12 * samples * std::max(frames, 1U); ++i)
        bytes += number(pixels.empty() ? static_cast<unsigned>(100 * k) + i : pixels[i % pixels.size()],
                        static_cast<int>(allocated) / 8, big());
      e += element(0x7FE00010, "OW", bytes + surplus);
    }
    return e;
  }
  [[nodiscard]] std::string bytes() const {
    const std::array<const char*, 4> uids{"1.2.840.10008.1.2", "1.2.840.10008.1.2.1", "1.2.840.10008.1.2.2",
                                          "1.2.840.10008.1.2.1.99"};
    const std::string meta = element(0x00020001, "OB", {"\0\1", 2}) + element(0x00020002, "UI", sop_class) +
                             element(0x00020003, "UI", "1.2.3.4") +
                             element(0x00020010, "UI", uids[static_cast<std::size_t>(syntax)]);
    std::string set = data_set();
    if (syntax == Syntax::kDeflated) set = packed_by(-15, set);
    return std::string(128, '\0') + "DICM" +
           element(0x00020000, "UL", number(static_cast<std::uint32_t>(meta.size()), 4)) + meta + set;
  }
};

/// Writes slices 0 to `count` - 1 as IM0, IM1, ..., with an ending.
void write_slices(const TemporaryFolder& folder, Dicom slice = {}, int count = 6, const std::string& ending = "") {
  for (slice.k = 0; slice.k < count; ++slice.k)
    write_bytes(folder / ("IM" + std::to_string(slice.k) + ending), slice.bytes());
}

/// Returns true if the folder holds the volume of `write_slices`.
bool is_read(const TemporaryFolder& folder, const VolumeOptions& options = {}, int count = 6) {
  const auto grid = read_volume_as<std::int16_t>(folder.path(), options);
  bool same = grid.size() == std::array{4, 3, count};
  CHECK((grid.spacing() - Vec3d(0.5e-3, 0.75e-3, 1.5e-3)).norm() < 1e-9);
  for (int k = 0; same && k < count; ++k)
    for (int j = 0; j < 3; ++j)
      for (int i = 0; i < 4; ++i) same = same && grid.at(i, j, k) == 100 * k + 4 * j + i - 1024;
  return same;
}

/// DICOM objects that lie beside series.
std::vector<std::pair<std::string, Dicom>> companions() {
  const std::string storage = "1.2.840.10008.5.1.4.1.1.";
  return {
      {"dose", {.sop_class = storage + "481.2", .modality = "RTDOSE", .uid = "1.2.3.1", .frames = 1}},
      {"doses", {.sop_class = storage + "481.2", .modality = "RTDOSE", .uid = "1.2.3.1", .frames = 5}},
      {"contours", {.sop_class = storage + "481.3", .modality = "RTSTRUCT", .uid = "1.2.3.2", .has_pixels = false}},
      {"report", {.sop_class = storage + "88.33", .modality = "SR", .uid = "1.2.3.3", .has_pixels = false}},
      {"segmentation",
       {.sop_class = storage + "66.4", .modality = "SEG", .uid = "1.2.3.4", .has_place = false, .frames = 1}},
      {"microscopy", {.sop_class = storage + "77.1.6", .modality = "SM", .uid = "1.2.3.5", .samples = 3, .frames = 7}},
      {"capture",
       {.sop_class = storage + "7",
        .modality = "OT",
        .uid = "1.2.3.6",
        .has_place = false,
        .photometric = "RGB",
        .samples = 3,
        .allocated = 8,
        .stored = 8,
        .is_signed = 0}},
      {"grey", {.sop_class = storage + "7", .modality = "OT", .uid = "1.2.3.7", .has_place = false}},
      {"enhanced", {.sop_class = storage + "2.1", .modality = "CT", .uid = "1.2.3.8", .frames = 10}},
      {"state", {.sop_class = storage + "11.1", .modality = "PR", .uid = "1.2.3.9", .has_pixels = false}},
      {"directory",
       {.sop_class = "1.2.840.10008.1.3.10", .modality = "", .uid = "", .has_place = false, .has_pixels = false}},
  };
}

}  // namespace

TEST_CASE("each uncompressed transfer syntax is read, with the pixels' order of bytes") {
  for (const Syntax syntax : {Syntax::kImplicit, Syntax::kExplicit, Syntax::kBig, Syntax::kDeflated}) {
    CAPTURE(static_cast<int>(syntax));
    const TemporaryFolder folder;
    write_slices(folder, {.syntax = syntax});
    CHECK(is_read(folder));
  }
  // A data set without the file's beginning, as old archives keep it.
  const TemporaryFolder folder;
  for (Dicom d{.syntax = Syntax::kImplicit}; d.k < 6; ++d.k)
    write_bytes(folder / ("IM" + std::to_string(d.k)), d.data_set());
  CHECK(is_read(folder));
}

TEST_CASE("companions block no series, chosen or not, whatever their names") {
  for (const char* const ending : {"", ".dcm"})
    for (const auto& [kind, companion] : companions()) {
      const std::string name = kind;
      CAPTURE(name);
      const TemporaryFolder folder;
      write_slices(folder, {}, 6, ending);
      write_bytes(folder / (name + ending), companion.bytes());
      CHECK(is_read(folder));
      CHECK(is_read(folder, {.series = kSeriesUid}));
      CHECK(list_dicom_series(folder.path()).size() == 1);
    }
  const TemporaryFolder folder;
  write_slices(folder, {}, 6, ".dcm");
  for (const auto& [name, companion] : companions()) write_bytes(folder / (name + ".dcm"), companion.bytes());
  CHECK(is_read(folder));
}

TEST_CASE("companions alone are told by kind, as a folder and as files") {
  for (const auto& [kind, companion] : companions()) {
    const std::string name = kind;
    CAPTURE(name);
    const TemporaryFolder folder;
    write_bytes(folder / name, companion.bytes());
    if (name == "grey") {
      holds(error_of(folder.path()), "no image position");
      continue;
    }
    holds(error_of(folder.path()), "holds no slices but 1 ");
    holds(error_of(folder / name), "in DICOM; export its volume as one file per slice, or as NRRD or NIfTI");
  }
  const TemporaryFolder folder;
  write_bytes(folder / "enhanced.dcm", Dicom{.frames = 10}.bytes());
  holds(error_of(folder / "enhanced.dcm"), "is a multi-frame object in DICOM; export its volume");
  holds(error_of(folder.path()), "holds no slices but 1 multi-frame object; export the series");
}

TEST_CASE("a slice that was cut anywhere is named, and ends no process") {
  const TemporaryFolder folder;
  write_slices(folder);
  const std::string whole = Dicom{.k = 5}.bytes();
  for (std::size_t length = 0; length < whole.size(); ++length) {
    write_bytes(folder / "IM5", whole.substr(0, length));
    const std::string error = error_of(folder.path());
    INFO(length);
    INFO(error);
    REQUIRE(error.find((folder / "IM5").string()) != std::string::npos);
    const std::string alone = error_of(folder / "IM5");
    REQUIRE(alone != "no error");
  }
}

TEST_CASE("damaged slices end in a volume or in a reason") {
  const TemporaryFolder folder;
  write_slices(folder);
  const std::string whole =
      Dicom{.k = 5,
            .other = Dicom{}.element(0x00400275, "SQ", "") +
                     std::string("\x40\x00\x60\x02SQ\0\0\xff\xff\xff\xff\xfe\xff\x00\xe0\xff\xff\xff\xff"
                                 "\x08\x00\x00\x01SH\x02\x00"
                                 "ab\xfe\xff\x0d\xe0\0\0\0\0\xfe\xff\xdd\xe0\0\0\0\0",
                                 46)}
          .bytes();
  std::mt19937 random(20261129);
  int read = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    std::string damaged = whole;
    for (int i = 0; i < 1 + trial % 3; ++i)
      damaged[128 + random() % (damaged.size() - 128)] = static_cast<char>(trial % 2 == 0 ? random() % 256 : 0xFF);
    write_bytes(folder / "IM5", damaged);
    read += error_of(folder.path()) == "no error" ? 1 : 0;
  }
  CHECK(read > 100);   // many bytes matter to nobody
  CHECK(read < 2900);  // and many do
}

TEST_CASE("damaged compressed slices end in a volume or in a reason") {
  using Packed = itk::GDCMImageIO::CompressionEnum;
  for (const Packed packed : {Packed::JPEG, Packed::JPEG2000}) {
    const TemporaryFolder folder;
    Series s;
    s.packed = packed;
    s.size = {12, 10, 2};
    write_series(folder.path(), s);
    const auto file = folder / "99.dcm";
    const std::string whole = bytes_of(file);
    std::mt19937 random(20261129);
    for (int trial = 0; trial < 300; ++trial) {
      std::string damaged = whole;
      if (trial % 2 == 0)
        damaged.resize(128 + random() % (damaged.size() - 128));
      else
        damaged[damaged.size() - 1 - random() % 400] = static_cast<char>(random() % 256);
      write_bytes(file, damaged);
      (void)error_of(folder.path());
    }
    write_bytes(file, whole);
    CHECK(error_of(folder.path()) == "no error");
  }
}

TEST_CASE("an end slice that is empty, cut or without pixels is named, whatever its name") {
  for (const char* const ending : {"", ".dcm"}) {
    CAPTURE(ending);
    const TemporaryFolder folder;
    write_slices(folder, {}, 6, ending);
    const auto last = folder / (std::string("IM5") + ending);
    const auto check = [&](const std::string& bytes, const std::string& reason) {
      write_bytes(last, bytes);
      holds(error_of(folder.path()), last.string() + ": " + reason);
      holds(error_of(folder.path(), {.series = kSeriesUid}), last.string() + ": " + reason);
    };
    check("", "is empty");
    check(Dicom{.k = 5}.bytes().substr(0, 300), "ends within its header or is damaged");
    check(Dicom{.k = 5, .has_pixels = false}.bytes(), "holds no pixels");
    check(std::string(4096, '\0'), "is named ");
  }
  // Files that are no slices by name or series do not block.
  const TemporaryFolder folder;
  write_slices(folder);
  write_text(folder / "README", "");
  write_text(folder / "notes.txt", "nothing");
  write_bytes(folder / "other", Dicom{.uid = "1.2.3", .has_pixels = false}.bytes());
  CHECK(is_read(folder));
}

TEST_CASE("slices that are shifted in their plane are refused, and duplicates told as such") {
  const TemporaryFolder folder;
  write_slices(folder);
  for (const int k : {2, 3})
    write_bytes(folder / ("IM" + std::to_string(k)), Dicom{.k = k, .position_mm = {13, 20, 30}}.bytes());
  holds(error_of(folder.path()), "IM2: is shifted by 3 mm in its plane against the first slice");
  write_slices(folder);
  write_bytes(folder / "copy of IM1", Dicom{.k = 1}.bytes());
  holds(error_of(folder.path()), "is the same slice as ");
  write_bytes(folder / "copy of IM1", Dicom{.k = 1, .instance = "1.2.3.4.5"}.bytes());
  holds(error_of(folder.path()), "two slices at one place");
}

TEST_CASE("padding is no bone, however it is stored") {
  // Unsigned pixels with -2000 as 63536; twelve bits with the same; signed pixels above all others.
  for (const auto& form : {std::array{16U, 0U, 63536U}, std::array{12U, 0U, 63536U}, std::array{16U, 1U, 32767U},
                           std::array{12U, 1U, 63536U}}) {
    const unsigned stored = form[0], is_signed = form[1], padding = form[2];
    CAPTURE(stored);
    CAPTURE(is_signed);
    const TemporaryFolder folder;
    Dicom slice{.stored = stored, .is_signed = is_signed, .padding = padding};
    slice.pixels = {padding, 900, 1000, 1100, 1200, padding, 2040, 900, 900, 900, 900, padding};
    write_slices(folder, slice);
    const auto grid = read_volume_as<std::int16_t>(folder.path());
    CHECK(grid.at(1, 0, 0) == 900 - 1024);
    CHECK(grid.at(2, 1, 0) == 2040 - 1024);
    for (int k = 0; k < 6; ++k)
      for (const auto& [i, j] : {std::pair{0, 0}, std::pair{1, 1}, std::pair{3, 2}})
        CHECK(grid.at(i, j, k) <= 900 - 1024);
  }
}

TEST_CASE("MONOCHROME1 is a way to draw: densities are those that are stored") {
  const TemporaryFolder folder;
  write_slices(folder, {.photometric = "MONOCHROME1"});
  CHECK(is_read(folder));
}

TEST_CASE("pixel elements that are too short or too long are refused") {
  const TemporaryFolder folder;
  write_slices(folder);
  std::string bytes = Dicom{.k = 3}.bytes();
  // The element says 18 bytes of 24, and so many are there.
  const std::string head = std::string("\xE0\x7F\x10\x00OW\0\0", 8);
  replace_bytes(bytes, head + number(24, 4), head + number(18, 4));
  write_bytes(folder / "IM3", bytes.substr(0, bytes.size() - 6));
  holds(error_of(folder.path()), "IM3: its voxels cannot be read: some are missing");
  write_bytes(folder / "IM3", Dicom{.k = 3, .surplus = "12345678"}.bytes());
  holds(error_of(folder.path()), "IM3: holds more bytes than its header's sizes and type take");
  for (const std::string& padding : {std::string("12"), std::string(100, '\0')}) {
    write_bytes(folder / "IM3", Dicom{.k = 3, .surplus = padding}.bytes());
    CHECK(is_read(folder));
  }
}

TEST_CASE("compressed images whose headers contradict the slice's are refused before a decoder ends the process") {
  const TemporaryFolder folder;
  Series s;
  s.packed = itk::GDCMImageIO::CompressionEnum::JPEG2000;
  s.size = {12, 10, 2};
  write_series(folder.path(), s);
  const std::string whole = bytes_of(folder / "99.dcm");
  const auto at = whole.find("\xFF\x4F\xFF\x51");
  REQUIRE(at != std::string::npos);
  // The last bytes of the image's columns and rows, and its bits.
  for (const auto& [place, value] : {std::pair{11, 13}, std::pair{15, 9}, std::pair{42, 3}, std::pair{41, 2}}) {
    const int offset = place;
    CAPTURE(offset);
    std::string damaged = whole;
    damaged[at + static_cast<std::size_t>(offset)] = static_cast<char>(value);
    write_bytes(folder / "99.dcm", damaged);
    holds(error_of(folder.path()), "the compressed image is cut short, damaged or of another size");
  }
}

TEST_CASE("runs of equal bytes are read") {
  for (const bool damaged : {false, true}) {
    const TemporaryFolder folder;
    for (Dicom d; d.k < 6; ++d.k) {
      std::string bytes = d.bytes();
      replace_bytes(bytes, {"1.2.840.10008.1.2.1\0", 20}, {"1.2.840.10008.1.2.5\0", 20});
      bytes.resize(bytes.size() - 24 - 12);  // without the pixel element
      // The high bytes and the low bytes of the pixels, each in one literal run.
      std::string high(1, '\x0B'), low(1, '\x0B');
      for (unsigned i = 0; i < 12; ++i) {
        const unsigned v = static_cast<unsigned>(100 * d.k) + i;
        high.push_back(static_cast<char>(v >> 8));
        low.push_back(static_cast<char>(v & 0xFF));
      }
      const std::string segments = number(2, 4) + number(64, 4) + number(damaged && d.k == 2 ? 999 : 64 + 13, 4) +
                                   std::string(52, '\0') + high + low;
      const auto item = [](unsigned tag, const std::string& value) {
        return number(0xFFFE, 2) + number(tag, 2) + number(static_cast<std::uint32_t>(value.size()), 4) + value;
      };
      bytes += std::string("\xE0\x7F\x10\x00OB\0\0\xFF\xFF\xFF\xFF", 12) + item(0xE000, "") + item(0xE000, segments) +
               item(0xE0DD, "");
      write_bytes(folder / ("IM" + std::to_string(d.k)), bytes);
    }
    if (damaged)
      holds(error_of(folder.path()), "IM2: its voxels cannot be read: the compressed image is cut short");
    else
      CHECK(is_read(folder));
  }
}
