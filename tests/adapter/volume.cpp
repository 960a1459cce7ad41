// SPDX-License-Identifier: MIT
// Volumes in files that hold one: NRRD, NIfTI, MetaImage, and ITK images in memory.
#include "files.hpp"

#include <doctest/doctest.h>

#include <itkImageFileWriter.h>
#include <itkVector.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <variant>

using namespace trephine;
using namespace trephine::test;

namespace {

// Files keep single-precision or decimal geometry; a thousandth of a voxel is far below what is felt.
constexpr double kSamePlace = 1e-6;

itk::ImageIOBase::Pointer io_for(const std::string& extension) {
  if (extension == ".nrrd") return itk::NrrdImageIO::New().GetPointer();
  if (extension == ".nii") return itk::NiftiImageIO::New().GetPointer();
  return itk::MetaImageIO::New().GetPointer();
}

Mat3d oblique() { return rotation_from_vector<double>({0.3, -0.5, 0.2}); }

}  // namespace

TEST_CASE("every file format gives each voxel its density and its place") {
  const TemporaryFolder folder;
  Mat3d left_handed = oblique();
  left_handed.col(1) = -left_handed.col(1);
  for (const std::string extension : {".nrrd", ".nii", ".mha"})
    for (const Mat3d& direction : {Mat3d(Mat3d::Identity()), oblique(), left_handed}) {
      CAPTURE(extension);
      CAPTURE(direction);
      const auto image = make_image<std::int16_t>({7, 5, 6}, {0.4, 0.5, 1.5}, {-12, 30, 7}, direction);
      const auto path = folder / ("volume" + extension);
      write_image(*image, path, io_for(extension));
      const auto grid = read_volume_as<std::int16_t>(path);
      CHECK(grid.size() == std::array{7, 5, 6});
      CHECK((grid.spacing() - Vec3d(0.4e-3, 0.5e-3, 1.5e-3)).norm() < kSamePlace);
      CHECK(grid.X_WG().linear().determinant() > 0);
      bool same = false;
      CHECK(farthest_apart(grid, *image, same) < kSamePlace);
      CHECK(same);
    }
}

TEST_CASE("an image in memory becomes a grid at the same place, whatever index its buffer starts at") {
  const auto image = make_image<float>({7, 5, 6}, {0.4, 0.5, 1.5}, {-12, 30, 7}, oblique());
  auto region = image->GetBufferedRegion();
  region.SetIndex({{3, -2, 11}});
  image->SetRegions(region);
  bool same = false;
  CHECK(farthest_apart(grid_from_image<std::int16_t>(*image), *image, same) < kSamePlace);
  CHECK(same);
  CHECK(farthest_apart(grid_from_image<float>(*image), *image, same) < kSamePlace);
  CHECK(same);
  holds(error_of([] { (void)grid_from_image<float>(*itk::Image<float, 3>::New()); }), "no voxels");
}

TEST_CASE("read_volume picks the density type that suits the file") {
  const TemporaryFolder folder;
  const auto path = folder / "volume.nrrd";
  const auto type_of = [&path](auto pixel, double low, double high) {
    using Pixel = decltype(pixel);
    const auto image = make_image<Pixel>({4, 4, 4}, Vec3d::Ones(), Vec3d::Zero(), Mat3d::Identity());
    image->FillBuffer(static_cast<Pixel>(low));
    image->SetPixel({{1, 2, 3}}, static_cast<Pixel>(high));
    write_image(*image, path, io_for(".nrrd"));
    auto grid = read_volume(path);
    std::visit(
        [&](const auto& g) {
          CHECK(static_cast<double>(g.at(0, 0, 0)) == low);
          CHECK(static_cast<double>(g.at(1, 2, 3)) == high);
        },
        grid);
    return grid;
  };
  CHECK(std::holds_alternative<VoxelGrid<std::uint8_t>>(type_of(std::uint8_t{}, 0, 255)));
  CHECK(std::holds_alternative<VoxelGrid<std::int8_t>>(type_of(static_cast<signed char>(0), -128, 127)));
  CHECK(std::holds_alternative<VoxelGrid<std::uint16_t>>(type_of(std::uint16_t{}, 0, 5)));
  CHECK(std::holds_alternative<VoxelGrid<std::int16_t>>(type_of(std::int16_t{}, -1024, 3071)));
  CHECK(std::holds_alternative<VoxelGrid<std::int16_t>>(type_of(std::int32_t{}, -1024, 3071)));
  CHECK(std::holds_alternative<VoxelGrid<std::uint16_t>>(type_of(std::int32_t{}, 0, 65535)));
  CHECK(std::holds_alternative<VoxelGrid<float>>(type_of(std::int32_t{}, -1, 65535)));
  CHECK(std::holds_alternative<VoxelGrid<float>>(type_of(float{}, 0, 0.5)));
  CHECK(std::holds_alternative<VoxelGrid<float>>(type_of(double{}, -1000, 2000)));
}

TEST_CASE("densities that the asked type cannot hold are refused, never clamped or flattened") {
  const auto image = make_image<float>({4, 4, 4}, Vec3d::Ones(), Vec3d::Zero(), Mat3d::Identity());
  image->FillBuffer(0.0F);
  const auto with = [&image](float v) {
    image->SetPixel({{1, 1, 1}}, v);
    return image;
  };
  CHECK(grid_from_image<std::int16_t>(*with(32767.0F)).at(1, 1, 1) == 32767);
  CHECK(grid_from_image<std::int16_t>(*with(1000.4F)).at(1, 1, 1) == 1000);
  holds(error_of([&] { (void)grid_from_image<std::int16_t>(*with(32768.0F)); }), "do not fit");
  holds(error_of([&] { (void)grid_from_image<std::uint8_t>(*with(-1.0F)); }), "do not fit");
  holds(error_of([&] { (void)grid_from_image<std::int16_t>(*with(0.5F)); }), "rounded");
  holds(error_of([&] { (void)grid_from_image<float>(*with(std::numeric_limits<float>::quiet_NaN())); }), "finite");
  holds(error_of([&] { (void)grid_from_image<std::int16_t>(*with(std::numeric_limits<float>::infinity())); }),
        "finite");
}

TEST_CASE("a volume without a surface at the isovalue is refused") {
  const auto image = make_image<std::int16_t>({4, 4, 4}, Vec3d::Ones(), Vec3d::Zero(), Mat3d::Identity());
  image->FillBuffer(-1000);
  image->SetPixel({{1, 1, 1}}, 200);
  CHECK_NOTHROW((void)grid_from_image<std::int16_t>(*image, {.isovalue = 200}));
  holds(error_of([&] { (void)grid_from_image<std::int16_t>(*image, {.isovalue = 201}); }),
        "no surface at isovalue 201");
  holds(error_of([&] { (void)grid_from_image<std::int16_t>(*image, {.isovalue = -1000}); }), "no surface");
}

TEST_CASE("spacing and outside density can be given") {
  const auto image = make_image<std::int16_t>({4, 4, 4}, Vec3d::Ones(), {10, 20, 30}, Mat3d::Identity());
  const auto grid = grid_from_image<std::int16_t>(*image, {.outside = -1024, .spacing_m = Vec3d(1e-4, 2e-4, 3e-4)});
  CHECK((grid.spacing() - Vec3d(1e-4, 2e-4, 3e-4)).norm() < 1e-15);
  CHECK(grid.outside() == -1024);
  holds(error_of([&] { (void)grid_from_image<std::int16_t>(*image, {.spacing_m = Vec3d(0, 1, 1)}); }),
        "spacing must be > 0");
  holds(error_of([&] { (void)grid_from_image<std::int16_t>(*image, {.outside = 1e6}); }), "outside");
}

TEST_CASE("axes that are not perpendicular are refused") {
  Mat3d sheared = Mat3d::Identity();
  sheared.col(2) = Vec3d(0, std::sin(0.1), std::cos(0.1));
  const auto image = make_image<std::int16_t>({4, 4, 4}, Vec3d::Ones(), Vec3d::Zero(), sheared);
  holds(error_of([&] { (void)grid_from_image<std::int16_t>(*image); }), "not perpendicular");
}

TEST_CASE("files that hold no volume are refused with the reason") {
  const TemporaryFolder folder;
  const auto read = [](const std::filesystem::path& path) {
    return error_of([&path] { (void)read_volume_as<std::int16_t>(path); });
  };
  holds(read(folder / "absent.nrrd"), "no such file");

  write_text(folder / "text.nrrd", "not an image\n");
  holds(read(folder / "text.nrrd"), "no image");
  write_text(folder / "text.dcm", "not an image\n");
  holds(read(folder / "text.dcm"), "no image");
  write_text(folder / "empty.mha", "");
  holds(read(folder / "empty.mha"), "no image");

  const auto flat = make_image<std::int16_t>({9, 9, 1}, Vec3d::Ones(), Vec3d::Zero(), Mat3d::Identity());
  write_image(*flat, folder / "flat.nrrd", io_for(".nrrd"));
  holds(read(folder / "flat.nrrd"), "single slice");

  using Vectors = itk::Image<itk::Vector<float, 3>, 3>;
  auto vectors = Vectors::New();
  vectors->SetRegions(Vectors::SizeType{{4, 4, 4}});
  vectors->Allocate(true);
  write_image(*vectors, folder / "vectors.mha", io_for(".mha"));
  holds(read(folder / "vectors.mha"), "several numbers per voxel");

  using Times = itk::Image<float, 4>;
  auto times = Times::New();
  times->SetRegions(Times::SizeType{{4, 4, 4, 3}});
  times->Allocate(true);
  write_image(*times, folder / "times.nii", io_for(".nii"));
  holds(read(folder / "times.nii"), "several volumes");
}

TEST_CASE("files that were cut short are refused") {
  const TemporaryFolder folder;
  for (const std::string extension : {".nrrd", ".nii", ".nii.gz", ".mha"})
    for (const bool packed : {false, true}) {
      CAPTURE(extension);
      CAPTURE(packed);
      const auto image = make_image<std::int16_t>({16, 16, 16}, Vec3d::Ones(), Vec3d::Zero(), Mat3d::Identity());
      const auto path = folder / ((packed ? "packed" : "plain") + extension.substr(1) + extension);
      write_image(*image, path, io_for(path.extension() == ".gz" ? ".nii" : extension), packed);
      bool same = false;
      CHECK(farthest_apart(read_volume_as<std::int16_t>(path), *image, same) < kSamePlace);
      CHECK(same);
      std::filesystem::resize_file(path, std::filesystem::file_size(path) * 3 / 4);
      holds(error_of([&path] { (void)read_volume_as<std::int16_t>(path); }), "cannot be read");
    }
}

TEST_CASE("a packed file is read itself, whatever lies beside it") {
  const TemporaryFolder folder;
  const auto image = make_image<std::int16_t>({4, 4, 4}, Vec3d::Ones(), Vec3d::Zero(), Mat3d::Identity());
  write_image(*image, folder / "volume.nii.gz", io_for(".nii"));
  image->SetPixel({{1, 2, 3}}, 999);
  write_image(*image, folder / "volume.nii", io_for(".nii"));
  bool same = false;
  CHECK(farthest_apart(read_volume_as<std::int16_t>(folder / "volume.nii"), *image, same) < kSamePlace);
  CHECK(same);
  CHECK(farthest_apart(read_volume_as<std::int16_t>(folder / "volume.nii.gz"), *image, same) < kSamePlace);
  CHECK(!same);
}

TEST_CASE("a MetaImage may keep its voxels in a second file, which must be complete too") {
  const TemporaryFolder folder;
  const auto image = make_image<std::int16_t>({16, 16, 16}, Vec3d::Ones(), Vec3d::Zero(), Mat3d::Identity());
  write_image(*image, folder / "volume.mhd", io_for(".mhd"));
  bool same = false;
  CHECK(farthest_apart(read_volume_as<std::int16_t>(folder / "volume.mhd"), *image, same) < kSamePlace);
  CHECK(same);
  std::filesystem::resize_file(folder / "volume.raw", 16 * 16 * 16 * 2 - 1);
  holds(error_of([&] { (void)read_volume_as<std::int16_t>(folder / "volume.mhd"); }), "cannot be read");
  std::filesystem::remove(folder / "volume.raw");
  holds(error_of([&] { (void)read_volume_as<std::int16_t>(folder / "volume.mhd"); }), "cannot be read");
}
