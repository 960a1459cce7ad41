// SPDX-License-Identifier: MIT
// Folders of DICOM slices, written here: what makes a volume is read, what does not is refused with the reason.
#include "files.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>
#include <string>
#include <variant>

using namespace trephine;
using namespace trephine::test;

namespace {

// DICOM keeps positions as decimal text of up to 16 characters.
constexpr double kSamePlace = 1e-8;

std::string error_of(const std::filesystem::path& path, const VolumeOptions& options = {}) {
  try {
    (void)read_volume_as<std::int16_t>(path, options);
  } catch (const VolumeError& e) {
    const std::string what = e.what();
    CHECK(what.find('\n') == std::string::npos);
    CHECK(what.find(path.string()) != std::string::npos);
    return what;
  }
  return "no error";
}

void check_says(const std::string& text, const std::string& part) {
  INFO(text);
  CHECK(text.find(part) != std::string::npos);
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
    std::stringstream bytes;
    bytes << std::ifstream(entry.path(), std::ios::binary).rdbuf();
    std::string text = bytes.str();
    const auto at = text.find(before);
    REQUIRE(at != std::string::npos);
    text.replace(at + 8, 2, ".3");
    std::ofstream(entry.path(), std::ios::binary) << text;
  }
  const auto exact = read_volume_as<float>(folder.path());
  const auto rounded = read_volume_as<std::int16_t>(folder.path());
  const auto suited = read_volume(folder.path());
  CHECK(std::holds_alternative<VoxelGrid<float>>(suited));
  for (int k = 0; k < 8; ++k) {
    const double stored = (density_of(3, 2, k) + 100) / 2;
    CHECK(static_cast<double>(exact.at(3, 2, k)) == doctest::Approx(stored * 0.3 - 100).epsilon(1e-6));
    CHECK(std::abs(rounded.at(3, 2, k) - (stored * 0.3 - 100)) <= 0.5 + 1e-4);
  }
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
  check_says(error_of(folder.path()), "sheared by 18.5 degrees");
  check_says(error_of(folder.path()), "tilted gantry");
}

TEST_CASE("a shift below what the option allows is no tilt") {
  const TemporaryFolder folder;
  Series s;
  s.step = {0, 0.02, 1};  // seven steps of 1.25 mm: 0.175 mm, a third of a pixel
  write_series(folder.path(), s);
  CHECK(error_of(folder.path()) == "no error");
  check_says(error_of(folder.path(), {.shift_tolerance = 0.1}), "sheared");
}

TEST_CASE("missing and repeated slices are refused") {
  for (const int missing : {1, 3, 6}) {
    const TemporaryFolder folder;
    Series s;
    s.missing = missing;
    write_series(folder.path(), s);
    check_says(error_of(folder.path()), "not evenly spaced (slice_tolerance 0.1)");
    check_says(error_of(folder.path()), "is a slice missing?");
  }
  const TemporaryFolder folder;
  Series s;
  s.repeated = 4;
  write_series(folder.path(), s);
  check_says(error_of(folder.path()), "two slices at one place");
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

  check_says(error_of(folder.path()), "holds 2 series, choose one");
  check_says(error_of(folder.path()), b.uid);
  try {
    (void)read_volume(folder.path());
    FAIL("read a folder with two series unasked");
  } catch (const SeveralSeries& e) {
    CHECK(e.series().size() == 2);
  }
  check_series(read_volume_as<std::int16_t>(folder.path(), {.series = "2"}), b);
  check_series(read_volume_as<std::int16_t>(folder.path(), {.series = a.uid}), a);
  check_says(error_of(folder.path(), {.series = "3"}), "has no series '3'");
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
  check_says(error_of(folder.path()), "holds 2 series");
  check_series(read_volume_as<std::int16_t>(folder.path(), {.series = "2"}), s);
  check_says(error_of(folder.path(), {.series = "1"}), "single slice");
}

TEST_CASE("folders and files that make no volume are refused") {
  {
    const TemporaryFolder folder;
    check_says(error_of(folder.path()), "holds no DICOM file");
    write_text(folder / "notes.txt", "nothing to see");
    check_says(error_of(folder.path()), "holds no DICOM file");
  }
  {
    const TemporaryFolder folder;
    write_series(folder.path(), Series{});
    const auto slice = folder / "95.dcm";
    REQUIRE(std::filesystem::exists(slice));
    check_says(error_of(slice), "single DICOM file; give the folder");
    write_text(folder / "00.dcm", "a download that went wrong");
    check_says(error_of(folder.path()), "00.dcm: is named .dcm and is no DICOM file");
  }
  {
    // Secondary captures (screenshots) carry no place.
    const TemporaryFolder folder;
    Series s;
    s.modality = "OT";
    s.intercept = 0;
    write_series(folder.path(), s);
    check_says(error_of(folder.path()), "no image position");
  }
}

TEST_CASE("a slice that was cut short is refused") {
  const TemporaryFolder folder;
  write_series(folder.path(), Series{});
  const auto slice = folder / "96.dcm";
  std::filesystem::resize_file(slice, std::filesystem::file_size(slice) - 1);
  check_says(error_of(folder.path()), "96.dcm: its voxels cannot be read: some are missing");
}
