// SPDX-License-Identifier: MIT
// Volumes, labels, recordings and names are read and written alike under the locales that hosts set.
#include <trephine/adapter/itk_labels.hpp>
#include <trephine/adapter/itk_save.hpp>
#include <trephine/session/recording_file.hpp>
#include <trephine/tool/named_tools.hpp>

#include "files.hpp"

#include <doctest/doctest.h>

#include <clocale>
#include <cstdint>
#include <locale>
#include <string>
#include <thread>
#include <variant>
#include <vector>

using namespace trephine;
using namespace trephine::test;

namespace {

/// Numbers as in most of Europe: 1.234,5.
class CommaNumbers : public std::numpunct<char> {
 protected:
  [[nodiscard]] char do_decimal_point() const override { return ','; }
  [[nodiscard]] char do_thousands_sep() const override { return '.'; }
  [[nodiscard]] std::string do_grouping() const override { return "\3"; }
};

/// The locale of C++ with commas, until the end of the scope.
class CommaLocale {
 public:
  CommaLocale() : before_(std::locale::global(std::locale(std::locale::classic(), new CommaNumbers))) {}
  ~CommaLocale() { std::locale::global(before_); }
  CommaLocale(const CommaLocale&) = delete;
  CommaLocale& operator=(const CommaLocale&) = delete;

 private:
  std::locale before_;
};

/// The locale of C with commas, if one is installed, until the end of the scope.
class CommaSetlocale {
 public:
  CommaSetlocale() {
    for (const char* const name : {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8", "es_ES.UTF-8", "it_IT.UTF-8",
                                   "nl_NL.UTF-8", "sv_SE.UTF-8", "pt_BR.UTF-8", "de-DE", "German"})
      if (std::setlocale(LC_ALL, name) != nullptr && std::string(std::localeconv()->decimal_point) == ",") {
        found_ = true;
        return;
      }
    MESSAGE("no locale with a decimal comma is installed (localedef -i de_DE -f UTF-8 de_DE.UTF-8): C's is left out");
  }
  ~CommaSetlocale() { std::setlocale(LC_ALL, "C"); }
  CommaSetlocale(const CommaSetlocale&) = delete;
  CommaSetlocale& operator=(const CommaSetlocale&) = delete;
  [[nodiscard]] bool found() const noexcept { return found_; }

 private:
  bool found_ = false;
};

constexpr double kSamePlace = 1e-9;  // m; decimal text and floats of millimetres

/// Files that were written before the locale was set.
struct Files {
  TemporaryFolder folder{};
  Files() {
    const auto image = make_image<std::int16_t>({7, 5, 6}, {3.5, 0.25, 1.5}, {-12.5, 1234.5, 7}, Mat3d::Identity());
    write_image(*image, folder / "a.nrrd", itk::NrrdImageIO::New().GetPointer());
    write_image(*image, folder / "a.mha", itk::MetaImageIO::New().GetPointer());
    write_image(*image, folder / "a.nii", itk::NiftiImageIO::New().GetPointer());
    for (const bool packed : {false, true}) {
      Series s;
      s.intercept = -100;
      s.slope = 2;
      if (packed) s.packed = itk::GDCMImageIO::CompressionEnum::JPEG2000;
      std::filesystem::create_directory(slices(packed));
      write_series(slices(packed), s);
      // A fraction cannot be written with ITK: the slope becomes 0.5, in two characters.
      for (const auto& entry : std::filesystem::directory_iterator(slices(packed))) {
        std::string text = bytes_of(entry.path());
        const std::string slope = packed ? std::string(
                                               "\x28\x00\x53\x10"
                                               "DS\x02\x00",
                                               8)
                                         : std::string("\x28\x00\x53\x10\x02\x00\x00\x00", 8);
        replace_bytes(text, slope + "2 ", slope + ".5");
        std::ofstream(entry.path(), std::ios::binary) << text;
      }
    }
  }
  [[nodiscard]] std::filesystem::path slices(bool packed) const { return folder / (packed ? "packed" : "plain"); }
};

void check_reading(const Files& files) {
  for (const char* const name : {"a.nrrd", "a.mha", "a.nii"}) {
    CAPTURE(name);
    const auto grid = read_volume_as<std::int16_t>(files.folder / name);
    CHECK((grid.spacing() - Vec3d(3.5e-3, 0.25e-3, 1.5e-3)).norm() < kSamePlace);
    CHECK((grid.X_WG().translation() - Vec3d(-12.5e-3, 1234.5e-3, 7e-3)).norm() < kSamePlace);
    CHECK(grid.at(3, 2, 1) == density_of(3, 2, 1));
  }
  for (const bool packed : {false, true}) {
    CAPTURE(packed);
    const auto grid = read_volume_as<float>(files.slices(packed));
    CHECK((grid.spacing() - Vec3d(0.5e-3, 0.75e-3, 1.25e-3)).norm() < kSamePlace);
    CHECK(static_cast<double>(grid.at(3, 2, 1)) == (density_of(3, 2, 1) + 100) / 4.0 - 100);
  }
}

void check_saving() {
  const TemporaryFolder folder;
  std::vector<std::int16_t> voxels(3 * 4 * 1025);
  for (std::size_t i = 0; i < voxels.size(); ++i) voxels[i] = static_cast<std::int16_t>(i);
  const Posed X_WG = make_pose<double>(rotation_from_vector<double>({0.3, -0.5, 0.2}), Vec3d(0.0123, 1.2345, -1.0 / 3));
  const VoxelGrid<std::int16_t> bone(
      {.size = {3, 4, 1025}, .spacing = {0.3e-3, 0.5e-3, 1.1e-3}, .X_WG = X_WG, .outside = -1024}, voxels);
  std::vector<std::uint8_t> marks(voxels.size());
  for (std::size_t i = 0; i < marks.size(); ++i) marks[i] = i % 3 == 0 ? 200 : 0;
  const LabelGrid<std::uint8_t> labels({.size = {3, 4, 1025}, .spacing = {0.3e-3, 0.5e-3, 1.1e-3}, .X_WG = X_WG}, marks,
                                       {{200, "nerve", {0.25F, 0.5F, 1}}});
  for (const char* const name : {"a.nrrd", "a.mha"}) {
    CAPTURE(name);
    save_volume(folder / name, bone);
    const auto again = load_volume<std::int16_t>(folder / name);
    CHECK(again.size() == bone.size());
    CHECK((again.spacing() - bone.spacing()).norm() < kSamePlace);
    CHECK((again.X_WG().matrix() - X_WG.matrix()).norm() < kSamePlace);
    CHECK(again.outside() == -1024);
    CHECK(again.at(2, 3, 1024) == bone.at(2, 3, 1024));

    save_labels(folder / name, labels);
    const auto marked = std::get<LabelGrid<std::uint8_t>>(read_labels(folder / name));
    CHECK((marked.spacing() - labels.spacing()).norm() < kSamePlace);
    CHECK(marked.structures()[0].colour == std::array{0.25F, 0.5F, 1.0F});
    CHECK(marked.voxel_count(200) == labels.voxel_count(200));
  }
  RecordedTick tick;
  tick.dt = 1.5e-3;
  save_recording((folder / "a.rec").string(), std::vector<RecordedTick>{tick});
  CHECK(load_recording((folder / "a.rec").string()).at(0).dt == 1.5e-3);
}

void check_all(const Files& files) {
  check_reading(files);
  check_saving();
  CHECK(tool_by_name("round-2.5").tool.burr().tip_radius == 1.25e-3);
}

}  // namespace

TEST_CASE("volumes, labels, recordings and names are the same under the host's locale of C") {
  const Files files;
  const CommaSetlocale locale;
  if (!locale.found()) return;
  check_all(files);
  std::thread([&files] { check_all(files); }).join();
  CHECK(std::string(std::localeconv()->decimal_point) == ",");
}

TEST_CASE("volumes, labels, recordings and names are the same under the host's locale of C++") {
  const Files files;
  const CommaLocale locale;
  check_all(files);
  std::thread([&files] { check_all(files); }).join();
  CHECK(std::use_facet<std::numpunct<char>>(std::locale()).decimal_point() == ',');
}

TEST_CASE("messages tell numbers with a point under the host's locale") {
  const CommaLocale locale;
  const auto image = make_image<float>({4, 4, 4}, {0.5, 0.5, 0.5}, Vec3d::Zero(), Mat3d::Identity());
  try {
    (void)grid_from_image<std::uint8_t>(*image);
    FAIL("negative densities fit");
  } catch (const VolumeError& e) {
    const std::string what = e.what();
    INFO(what);
    CHECK(what.find("densities from -74 to 280 do not fit") != std::string::npos);
  }
  try {
    (void)grid_from_image<std::int16_t>(*image, {.isovalue = 1234.5});
    FAIL("no surface is there");
  } catch (const VolumeError& e) {
    CHECK(std::string(e.what()).find("isovalue 1234.5:") != std::string::npos);
  }
}
