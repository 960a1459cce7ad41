// SPDX-License-Identifier: MIT
// Folders of DICOM slices, written here: what makes a volume is read, what does not is refused with the reason.
#include "files.hpp"
#include "support/near.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <sstream>
#include <string>
#include <variant>

using namespace trephine;
using namespace trephine::test;

namespace {

// DICOM keeps positions as decimal text of up to 16 characters.
constexpr double kSamePlace = 1e-8;

/// What is said of a series of int16, which names its folder.
std::string series_error(const std::filesystem::path& path, const VolumeOptions& options = {}) {
  const std::string what = error_of([&] { (void)read_volume_as<std::int16_t>(path, options); });
  if (what != "no error") CHECK(what.find(path.string()) != std::string::npos);
  return what;
}

void check_series(const VoxelGrid<std::int16_t>& grid, const Series& s) {
  REQUIRE(grid.size() == s.size);
  CHECK((grid.spacing() - 1e-3 * s.spacing_mm).norm() < kSamePlace);
  for (int k = 0; k < s.size[2]; ++k)
    for (int j = 0; j < s.size[1]; ++j)
      for (int i = 0; i < s.size[0]; ++i) {
        REQUIRE(grid.at(i, j, k) == density_of(i, j, k));
        const Vec3d p_W = grid.X_WG() * Vec3d(grid.spacing().cwiseProduct(Vec3d(i, j, k)));
        const Vec3d p_mm = s.origin_mm + s.direction.col(0) * (i * s.spacing_mm.x()) +
                           s.direction.col(1) * (j * s.spacing_mm.y()) + s.step * (k * s.spacing_mm.z());
        REQUIRE((p_W - 1e-3 * p_mm).norm() < kSamePlace);
      }
}

}  // namespace

TEST_CASE("a series gives Hounsfield units at the patient's places") {
  const TemporaryFolder folder;
  const Series s;
  write_series(folder.path(), s);
  write_text(folder / "README", "files that are not slices may lie beside them");
  check_series(read_volume_as<std::int16_t>(folder.path()), s);
  CHECK(std::holds_alternative<VoxelGrid<std::int16_t>>(read_volume(folder.path())));
  CHECK(std::holds_alternative<VoxelGrid<std::int16_t>>(read_volume(folder.path(), {.isovalue = 0})));
}

TEST_CASE("the rescale slope is honoured") {
  const TemporaryFolder folder;
  Series s;
  s.slope = 2;
  s.intercept = -100;
  write_series(folder.path(), s);
  check_series(read_volume_as<std::int16_t>(folder.path()), s);

  // A fraction cannot be written with ITK: put it into the files, tag (0028,1053) with a length of two characters.
  const std::string before(
      "\x28\x00\x53\x10\x02\x00\x00\x00"
      "2 ",
      10);
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    std::string text = bytes_of(entry.path());
    replace_bytes(text, before, before.substr(0, 8) + ".3");
    std::ofstream(entry.path(), std::ios::binary) << text;
  }
  const auto exact = read_volume_as<float>(folder.path());
  const auto rounded = read_volume_as<std::int16_t>(folder.path());
  const auto suited = read_volume(folder.path());
  CHECK(std::holds_alternative<VoxelGrid<float>>(suited));
  for (int k = 0; k < 8; ++k) {
    const double stored = (density_of(3, 2, k) + 100) / 2;
    CHECK(static_cast<double>(exact.at(3, 2, k)) == near(stored * 0.3 - 100, 1e-6));
    CHECK(std::abs(rounded.at(3, 2, k) - (stored * 0.3 - 100)) <= 0.5 + 1e-4);
  }
}

TEST_CASE_TEMPLATE("each way to store whole numbers is read", Pixel, std::uint8_t, signed char, std::uint16_t,
                   std::int16_t) {
  const TemporaryFolder folder;
  Series s;
  constexpr bool kSigned = std::numeric_limits<Pixel>::is_signed;
  s.size = {6, 5, 2};           // densities of -82 to 100
  s.offset = kSigned ? 0 : 82;  // into the range of 8 bits
  s.intercept = 0;              // what is stored is what is read
  write_series<Pixel>(folder.path(), s);
  const std::string file = bytes_of(std::filesystem::directory_iterator(folder.path())->path());
  const std::string allocated{"\x28\x00\x00\x01\x02\x00\x00\x00", 8}, sign{"\x28\x00\x03\x01\x02\x00\x00\x00", 8};
  REQUIRE(file.find(allocated + char{8 * sizeof(Pixel)}) != std::string::npos);
  REQUIRE(file.find(sign + char{kSigned}) != std::string::npos);
  const auto grid = read_volume_as<std::int16_t>(folder.path());
  REQUIRE(grid.size() == s.size);
  for (int k = 0; k < s.size[2]; ++k)
    for (int j = 0; j < s.size[1]; ++j)
      for (int i = 0; i < s.size[0]; ++i) REQUIRE(grid.at(i, j, k) == s.offset + density_of(i, j, k));
}

TEST_CASE("twelve bits in sixteen are read, signed or not, whatever the other four hold") {
  for (const bool is_signed : {false, true})
    for (const int others : {0x0000, 0xF000}) {
      CAPTURE(is_signed);
      CAPTURE(others);
      const TemporaryFolder folder;
      Series s;
      s.intercept = 0;
      s.offset = is_signed ? 0 : 200;
      if (is_signed)
        write_series<std::int16_t>(folder.path(), s);
      else
        write_series<std::uint16_t>(folder.path(), s);
      // ITK writes 16 bits stored of 16: say 12, and fill the four above them.
      for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
        std::string file = bytes_of(entry.path());
        replace_bytes(file, {"\x28\x00\x01\x01\x02\x00\x00\x00\x10\x00", 10},
                      {"\x28\x00\x01\x01\x02\x00\x00\x00\x0c\x00", 10});
        replace_bytes(file, {"\x28\x00\x02\x01\x02\x00\x00\x00\x0f\x00", 10},
                      {"\x28\x00\x02\x01\x02\x00\x00\x00\x0b\x00", 10});
        for (std::size_t at = file.size() - 2 * std::size_t{12} * 10 + 1; at < file.size(); at += 2)
          file[at] = static_cast<char>((file[at] & 0x0F) | (others >> 8));
        std::ofstream(entry.path(), std::ios::binary) << file;
      }
      const auto grid = read_volume_as<std::int16_t>(folder.path());
      for (int k = 0; k < s.size[2]; ++k)
        for (int j = 0; j < s.size[1]; ++j)
          for (int i = 0; i < s.size[0]; ++i) REQUIRE(grid.at(i, j, k) == s.offset + density_of(i, j, k));
    }
}

TEST_CASE("compressed series are read; one without a decoder is refused") {
  using Packed = itk::GDCMImageIO::CompressionEnum;
  for (const Packed packed : {Packed::JPEG, Packed::JPEG2000}) {
    const TemporaryFolder folder;
    Series s;
    s.packed = packed;
    write_series(folder.path(), s);
    check_series(read_volume_as<std::int16_t>(folder.path()), s);
  }
  const TemporaryFolder folder;
  Series s;
  s.packed = Packed::JPEG2000;
  write_series(folder.path(), s);
  const auto file = std::filesystem::directory_iterator(folder.path())->path();
  std::string bytes = bytes_of(file);
  replace_bytes(bytes, "1.2.840.10008.1.2.4.90", "1.2.840.10008.1.2.4.94");  // pixels that a server keeps
  std::ofstream(file, std::ios::binary) << bytes;
  holds(series_error(folder.path()), "cannot be read (no decoder for transfer syntax 1.2.840.10008.1.2.4.94)");
}

TEST_CASE("an oblique series lies obliquely") {
  const TemporaryFolder folder;
  Series s;
  s.direction = rotation_from_vector<double>({0.3, -0.5, 0.2});
  s.step = s.direction.col(2);
  write_series(folder.path(), s);
  check_series(read_volume_as<std::int16_t>(folder.path()), s);
}

TEST_CASE("a tilted gantry is refused, with its angle") {
  const TemporaryFolder folder;
  Series s;
  const double tilt = 18.5 * std::numbers::pi / 180;
  s.step = {0, std::tan(tilt), 1};
  write_series(folder.path(), s);
  holds(series_error(folder.path()), "sheared by 18.5 degrees");
  holds(series_error(folder.path()), "tilted gantry");
}

TEST_CASE("a shift below what the option allows is no tilt") {
  const TemporaryFolder folder;
  Series s;
  s.step = {0, 0.02, 1};  // seven steps of 1.25 mm: 0.175 mm, a third of a pixel
  write_series(folder.path(), s);
  CHECK(series_error(folder.path()) == "no error");
  holds(series_error(folder.path(), {.shift_tolerance = 0.1}), "sheared");
}

TEST_CASE("missing and repeated slices are refused") {
  for (const int missing : {1, 3, 6}) {
    const TemporaryFolder folder;
    Series s;
    s.missing = missing;
    write_series(folder.path(), s);
    holds(series_error(folder.path()), "not evenly spaced (slice_tolerance 0.1)");
    holds(series_error(folder.path()), "is a slice missing?");
  }
  const TemporaryFolder folder;
  Series s;
  s.repeated = 4;
  write_series(folder.path(), s);
  holds(series_error(folder.path()), "two slices at one place");
}

TEST_CASE("several series are listed, and one can be chosen") {
  const TemporaryFolder folder;
  Series a;
  a.prefix = "a";
  Series b = a;
  b.prefix = "b";
  b.uid = "1.2.826.0.1.3680043.2.1125.2";
  b.size[2] = 5;
  write_series(folder.path(), a);
  write_series(folder.path(), b);

  const auto series = list_dicom_series(folder.path());
  REQUIRE(series.size() == 2);
  CHECK(series[0].uid == a.uid);
  CHECK(series[0].slices == 8);
  CHECK(series[1].number == 2);
  CHECK(series[1].slices == 5);
  CHECK(series[1].modality == "CT");
  CHECK(series[1].description == "made by a test");

  holds(series_error(folder.path()), "holds 2 series, choose one");
  holds(series_error(folder.path()), b.uid);
  try {
    (void)read_volume(folder.path());
    FAIL("read a folder with two series unasked");
  } catch (const SeveralSeries& e) {
    CHECK(e.series().size() == 2);
  }
  check_series(read_volume_as<std::int16_t>(folder.path(), {.series = "2"}), b);
  check_series(read_volume_as<std::int16_t>(folder.path(), {.series = a.uid}), a);
  holds(series_error(folder.path(), {.series = "3"}), "has no series '3'");
}

TEST_CASE("a scout image of the same series UID is a series of its own") {
  const TemporaryFolder folder;
  Series s;
  s.prefix = "s";
  Series scout = s;
  scout.prefix = "a";
  scout.size[2] = 1;
  scout.direction = rotation_from_vector<double>({std::numbers::pi / 2, 0, 0});
  write_series(folder.path(), s);
  write_series(folder.path(), scout);
  holds(series_error(folder.path()), "holds 2 series");
  check_series(read_volume_as<std::int16_t>(folder.path(), {.series = "2"}), s);
  holds(series_error(folder.path(), {.series = "1"}), "single slice");
}

TEST_CASE("folders and files that make no volume are refused") {
  {
    const TemporaryFolder folder;
    holds(series_error(folder.path()), "holds no DICOM file");
    write_text(folder / "notes.txt", "nothing to see");
    holds(series_error(folder.path()), "holds no DICOM file");
  }
  {
    const TemporaryFolder folder;
    write_series(folder.path(), Series{});
    const auto slice = folder / "95.dcm";
    REQUIRE(std::filesystem::exists(slice));
    holds(series_error(slice), "single DICOM file; give the folder");
    write_text(folder / "00.dcm", "a download that went wrong");
    holds(series_error(folder.path()), "00.dcm: is named .dcm and is no DICOM file");
  }
  {
    // Secondary captures (screenshots) carry no place.
    const TemporaryFolder folder;
    Series s;
    s.modality = "OT";
    s.intercept = 0;
    write_series(folder.path(), s);
    holds(series_error(folder.path()), "no image position");
  }
}

TEST_CASE("a slice that was cut short is refused") {
  const TemporaryFolder folder;
  write_series(folder.path(), Series{});
  const auto slice = folder / "96.dcm";
  std::filesystem::resize_file(slice, std::filesystem::file_size(slice) - 1);
  holds(series_error(folder.path()), "96.dcm: its voxels cannot be read: some are missing");
}
