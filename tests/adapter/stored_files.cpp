// SPDX-License-Identifier: MIT
// Headers of NRRD, NIfTI and MetaImage files, written here byte by byte: units, axes, scaling, lengths.
#include <trephine/adapter/itk_labels.hpp>

#include "files.hpp"

#include <doctest/doctest.h>

#include <itkImageFileReader.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

using namespace trephine;
using namespace trephine::test;

namespace {

constexpr double kSamePlace = 1e-9;  // m; text, and floats of millimetres

template <class T>
std::string raw(T v, bool big_endian = false) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &v, sizeof(T));
  return big_endian ? std::string(bytes.rbegin(), bytes.rend()) : bytes;
}

/// Numbers 0, 1, 2, ... of a type.
template <class T>
std::string ramp(int count, bool big_endian = false) {
  std::string bytes;
  for (int i = 0; i < count; ++i) bytes += raw(static_cast<T>(i), big_endian);
  return bytes;
}

std::string gzip(const std::string& bytes) { return packed_by(15 + 16, bytes); }
std::string zlib(const std::string& bytes) { return packed_by(15, bytes); }

/// A NIfTI header of 348 bytes and four more, of version 1, for 3 x 4 x 2 voxels.
struct Nifti {
  bool big_endian = false;
  std::int16_t datatype = 4;
  std::array<float, 4> pixdim{1, 0.5F, 0.6F, 0.7F};
  float slope = 0;
  float intercept = 0;
  char units = 2;
  std::int16_t qform = 0;
  std::int16_t sform = 0;
  std::array<float, 3> quaternion{};
  Vec3d qoffset = Vec3d::Zero();
  Eigen::Matrix<double, 3, 4> srow = Eigen::Matrix<double, 3, 4>::Zero();
  float offset = 352;
  std::string magic = "n+1";

  [[nodiscard]] std::string header() const {
    std::string b(352, '\0');
    const auto put = [&](std::size_t at, auto v) { b.replace(at, sizeof(v), raw(v, big_endian)); };
    put(0, std::int32_t{348});
    const std::array<std::int16_t, 8> dim{3, 3, 4, 2, 1, 1, 1, 1};
    for (std::size_t i = 0; i < 8; ++i) put(40 + 2 * i, dim[i]);
    put(70, datatype);
    put(72, static_cast<std::int16_t>(datatype == 16 ? 32 : 16));
    for (std::size_t i = 0; i < 4; ++i) put(76 + 4 * i, pixdim[i]);
    put(108, offset);
    put(112, slope);
    put(116, intercept);
    b[123] = units;
    put(252, qform);
    put(254, sform);
    for (std::size_t i = 0; i < 3; ++i) {
      put(256 + 4 * i, quaternion[i]);
      put(268 + 4 * i, static_cast<float>(qoffset[static_cast<int>(i)]));
      for (std::size_t j = 0; j < 4; ++j)
        put(280 + 16 * i + 4 * j, static_cast<float>(srow(static_cast<int>(i), static_cast<int>(j))));
    }
    b.replace(344, magic.size(), magic);
    return b;
  }
};

/// A header of version 2 with the same sform.
std::string nifti_2(const Nifti& n) {
  std::string b(544, '\0');
  const auto put = [&](std::size_t at, auto v) { b.replace(at, sizeof(v), raw(v, n.big_endian)); };
  put(0, std::int32_t{540});
  b.replace(4, 8, {"n+2\0\r\n\032\n", 8});
  put(12, n.datatype);
  const std::array<std::int64_t, 8> dim{3, 3, 4, 2, 1, 1, 1, 1};
  for (std::size_t i = 0; i < 8; ++i) put(16 + 8 * i, dim[i]);
  for (std::size_t i = 0; i < 4; ++i) put(104 + 8 * i, static_cast<double>(n.pixdim[i]));
  put(168, std::int64_t{544});
  put(176, static_cast<double>(n.slope));
  put(184, static_cast<double>(n.intercept));
  put(344, std::int32_t{n.qform});
  put(348, std::int32_t{n.sform});
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 4; ++j) put(400 + 32 * i + 8 * j, n.srow(static_cast<int>(i), static_cast<int>(j)));
  put(500, std::int32_t{n.units});
  return b;
}

/// An NRRD file of 3 x 4 x 2 voxels.
std::string nrrd(const std::string& fields, const std::string& voxels = ramp<std::int16_t>(24),
                 const std::string& type = "short") {
  return "NRRD0005\ntype: " + type + "\ndimension: 3\nsizes: 3 4 2\n" + fields +
         (fields.find("endian") == std::string::npos ? "endian: little\n" : "") +
         (fields.find("encoding") == std::string::npos ? "encoding: raw\n" : "") + "\n" + voxels;
}

/// A MetaImage header of 3 x 4 x 2 voxels.
std::string meta(const std::string& lines, const std::string& data = "LOCAL", const std::string& type = "MET_SHORT") {
  return "ObjectType = Image\nNDims = 3\nBinaryData = True\nDimSize = 3 4 2\n" + lines + "ElementType = " + type +
         "\nElementDataFile = " + data + "\n";
}

const char* const kSpacing = "ElementSpacing = 0.5 0.6 0.7\n";
const char* const kSpacings = "spacings: 0.5 0.6 0.7\n";

}  // namespace

TEST_CASE("of two NIfTI transforms that disagree the sform's is taken; a sheared one is refused") {
  const TemporaryFolder folder;
  const auto path = folder / "a.nii";
  Nifti n{.qform = 1, .sform = 1, .qoffset = {1, 2, 3}};
  const Mat3d R = rotation_from_vector<double>({0.3, -0.5, 0.2});
  n.srow << R * Vec3d(0.5, 0.6, 0.7).asDiagonal(), Vec3d(10, 20, 30);
  for (const bool second : {false, true})
    for (const bool big : {false, true}) {
      CAPTURE(second);
      CAPTURE(big);
      n.big_endian = big;
      write_bytes(path, (second ? nifti_2(n) : n.header()) + ramp<std::int16_t>(24, big));
      const auto grid = read_volume_as<std::int16_t>(path);
      // From the right, front and head to the left, back and head.
      const Vec3d p_mm = R * Vec3d(0.5 * 2, 0.6 * 3, 0.7) + Vec3d(10, 20, 30);
      const Vec3d p_W = grid.X_WG() * Vec3d(grid.spacing().cwiseProduct(Vec3d(2, 3, 1)));
      CHECK((p_W - 1e-3 * Vec3d(-p_mm.x(), -p_mm.y(), p_mm.z())).norm() < 1e-8);
      CHECK(grid.at(2, 3, 1) == 23);
    }
  n.big_endian = false;
  n.srow(1, 2) += 0.25;  // a tilted gantry, as dcm2niix keeps it
  write_bytes(path, n.header() + ramp<std::int16_t>(24));
  holds(error_of(path),
        "its axes are not perpendicular (a tilted gantry?), so voxels are no boxes; resample it upright");
  n.sform = 0;
  write_bytes(path, n.header() + ramp<std::int16_t>(24));
  CHECK((read_volume_as<std::int16_t>(path).X_WG().translation() - Vec3d(-1e-3, -2e-3, 3e-3)).norm() < kSamePlace);
}

TEST_CASE("a NIfTI file without a transform, or with a qform alone, lies where ITK sees it") {
  const TemporaryFolder folder;
  const auto path = folder / "a.nii";
  for (const std::int16_t qform : {std::int16_t{0}, std::int16_t{1}})
    for (const float handed : {1.0F, -1.0F}) {
      Nifti n{.pixdim = {handed, 0.5F, 0.6F, 0.7F}, .qform = qform, .quaternion = {0.1F, -0.3F, 0.2F}};
      n.qoffset = {10, 20, 30};
      write_bytes(path, n.header() + ramp<std::int16_t>(24));
      auto reader = itk::ImageFileReader<itk::Image<std::int16_t, 3>>::New();
      reader->SetImageIO(itk::NiftiImageIO::New());
      reader->SetFileName(path.string());
      reader->Update();
      bool same = false;
      CHECK(farthest_apart(read_volume_as<std::int16_t>(path), *reader->GetOutput(), same) < 1e-7);
      CHECK(same);
    }
}

TEST_CASE("NIfTI units hold for spacing and origin") {
  const TemporaryFolder folder;
  const auto path = folder / "a.nii";
  for (const auto& [code, mm] : {std::pair{1, 1e3}, std::pair{2, 1.0}, std::pair{3, 1e-3}, std::pair{0, 1.0}}) {
    const int units = code;
    CAPTURE(units);
    // The upper bits are the unit of time.
    Nifti n{.units = static_cast<char>(units | 8), .sform = 1};
    const double v = units == 1 ? 1e-3 : 1;  // so that voxels are 20 µm to 7 mm
    n.srow << -0.02 * v, 0, 0, -0.5, 0, -0.02 * v, 0, -1, 0, 0, 0.04 * v, 2;
    write_bytes(path, n.header() + ramp<std::int16_t>(24));
    const auto grid = read_volume_as<std::int16_t>(path);
    CHECK((grid.spacing() - 1e-3 * mm * v * Vec3d(0.02, 0.02, 0.04)).norm() < 1e-7 * mm * 1e-3);
    CHECK((grid.X_WG().translation() - 1e-3 * mm * Vec3d(0.5, 1, 2)).norm() < 1e-7 * mm * 1e-3);
  }
}

TEST_CASE("NIfTI scaling: none with slope 0, whole densities stay whole, and NaN is refused") {
  const TemporaryFolder folder;
  const auto path = folder / "a.nii";
  const auto read = [&](float slope, float intercept) {
    write_bytes(path, Nifti{.slope = slope, .intercept = intercept}.header() + ramp<std::int16_t>(24));
    return read_volume(path);
  };
  CHECK(std::get<VoxelGrid<std::int16_t>>(read(0, 7)).at(1, 0, 0) == 1);
  CHECK(std::get<VoxelGrid<std::int16_t>>(read(std::numeric_limits<float>::quiet_NaN(), 7)).at(1, 0, 0) == 1);
  CHECK(std::get<VoxelGrid<std::int16_t>>(read(2, -1024)).at(1, 0, 0) == -1022);
  CHECK(std::get<VoxelGrid<float>>(read(0.25F, 1)).at(1, 0, 0) == 1.25F);
  write_bytes(path, Nifti{.datatype = 16}.header() + ramp<float>(23) + raw(std::numeric_limits<float>::quiet_NaN()));
  holds(error_of(path), "not finite");
}

TEST_CASE("units of length in NRRD and MetaImage files are read, unknown ones refused") {
  const TemporaryFolder folder;
  const auto spacing_of = [](const std::filesystem::path& path) {
    return read_volume_as<std::int16_t>(path).spacing();
  };
  for (const auto& [name, mm] :
       {std::pair{"mm", 1.0}, std::pair{"um", 1e-3}, std::pair{"\xC2\xB5m", 1e-3}, std::pair{"microns", 1e-3},
        std::pair{"nm", 1e-6}, std::pair{"cm", 10.0}, std::pair{"m", 1e3}, std::pair{"", 1.0}}) {
    const std::string u = name;
    CAPTURE(u);
    const double scale = mm < 1e-5 ? 1e4 : mm > 100 ? 1e-3 : 1;  // so that voxels are 5 µm to 7 mm
    const auto text = [&](double v) {
      std::ostringstream o;
      o << v * scale;
      return o.str();
    };
    const std::string quoted = "\"" + u + "\" \"" + u + "\" \"" + u + "\"\n";
    const Vec3d expected = 1e-3 * mm * scale * Vec3d(0.5, 0.6, 0.7);
    write_bytes(folder / "a.nrrd",
                nrrd("space: left-posterior-superior\nspace directions: (" + text(0.5) + ",0,0) (0," + text(0.6) +
                     ",0) (0,0," + text(0.7) + ")\nspace units: " + quoted + "space origin: (1,2,3)\n"));
    CHECK((spacing_of(folder / "a.nrrd") - expected).norm() < 1e-12);
    CHECK((read_volume_as<float>(folder / "a.nrrd").X_WG().translation() - 1e-3 * mm * Vec3d(1, 2, 3)).norm() < 1e-12);
    write_bytes(folder / "b.nrrd",
                nrrd("spacings: " + text(0.5) + " " + text(0.6) + " " + text(0.7) + "\nunits: " + quoted));
    CHECK((spacing_of(folder / "b.nrrd") - expected).norm() < 1e-12);
    write_bytes(folder / "a.mha", meta("ElementSpacing = " + text(0.5) + " " + text(0.6) + " " + text(0.7) +
                                       "\nOffset = 1 2 3\nDistanceUnits = " + u + "\n") +
                                      ramp<std::int16_t>(24));
    CHECK((spacing_of(folder / "a.mha") - expected).norm() < 1e-12);
    CHECK((read_volume_as<float>(folder / "a.mha").X_WG().translation() - 1e-3 * mm * Vec3d(1, 2, 3)).norm() < 1e-12);
  }
  write_bytes(folder / "a.nrrd", nrrd(std::string(kSpacings) + "units: \"ell\" \"ell\" \"ell\"\n"));
  holds(error_of(folder / "a.nrrd"), "its unit of length 'ell' is unknown; give spacing_m in the options");
  write_bytes(folder / "a.mha", meta(std::string(kSpacing) + "DistanceUnits = ell\n") + ramp<std::int16_t>(24));
  holds(error_of(folder / "a.mha"), "its unit of length 'ell' is unknown; give spacing_m in the options");
  CHECK(error_of(folder / "a.mha", {.spacing_m = Vec3d(1e-5, 1e-5, 1e-5)}) == "no error");
}

TEST_CASE("a file without a spacing needs one in the options; micro-CT of 5 to 50 micrometres just works") {
  const TemporaryFolder folder;
  const auto voxels = ramp<std::int16_t>(24);
  write_bytes(folder / "a.nrrd", nrrd(""));
  write_bytes(folder / "b.nrrd", nrrd("spacings: nan 0.5 0.5\n"));
  write_bytes(folder / "c.nrrd", nrrd("space: RAS\nspace directions: (0,0,0) (0,1,0) (0,0,1)\n"));
  write_bytes(folder / "d.mha", meta("") + voxels);
  write_bytes(folder / "e.nii", Nifti{.pixdim = {1, 0, 0, 0}}.header() + voxels);
  for (const char* const name : {"a.nrrd", "b.nrrd", "c.nrrd", "d.mha", "e.nii"}) {
    CAPTURE(name);
    holds(error_of(folder / name), "tells no spacing");
    holds(error_of(folder / name), "give spacing_m in the options");
    for (const double um : {5.0, 50.0}) {
      const auto grid = read_volume_as<std::int16_t>(folder / name, {.spacing_m = 1e-6 * um * Vec3d::Ones()});
      CHECK((grid.spacing() - 1e-6 * um * Vec3d::Ones()).norm() < 1e-15);
    }
  }
  for (const char* const um : {"5", "50"}) {
    const std::string three = std::string(um) + " " + um + " " + um + "\n";
    write_bytes(folder / "a.nrrd", nrrd("spacings: " + three + "units: \"um\" \"um\" \"um\"\n"));
    write_bytes(folder / "d.mha", meta("ElementSpacing = " + three + "DistanceUnits = um\n") + voxels);
    write_bytes(folder / "e.nii",
                Nifti{.pixdim = {1, std::stof(um), std::stof(um), std::stof(um)}, .units = 3}.header() + voxels);
    for (const char* const name : {"a.nrrd", "d.mha", "e.nii"})
      CHECK((read_volume_as<float>(folder / name).spacing() - 1e-6 * std::stod(um) * Vec3d::Ones()).norm() < 1e-12);
  }
  write_bytes(folder / "labels.nrrd", nrrd("", ramp<std::uint8_t>(24), "uchar"));
  CHECK_THROWS_AS((void)read_labels(folder / "labels.nrrd"), VolumeError);
  CHECK_NOTHROW((void)read_labels(folder / "labels.nrrd", {.spacing_m = Vec3d(1e-3, 1e-3, 1e-3)}));
}

TEST_CASE("each space of NRRD gives the patient's axes") {
  const TemporaryFolder folder;
  const auto path = folder / "a.nrrd";
  for (const auto& [name, sign] :
       {std::pair{"left-posterior-superior", Vec3d(1, 1, 1)}, std::pair{"LPS", Vec3d(1, 1, 1)},
        std::pair{"right-anterior-superior", Vec3d(-1, -1, 1)}, std::pair{"RAS", Vec3d(-1, -1, 1)},
        std::pair{"left-anterior-superior", Vec3d(1, -1, 1)}, std::pair{"LAS", Vec3d(1, -1, 1)},
        std::pair{"3D-right-handed", Vec3d(1, 1, 1)}}) {
    const std::string space = name;
    CAPTURE(space);
    write_bytes(path,
                nrrd("space: " + space + "\nspace directions: (0.5,0,0) (0,0.6,0) (0,0,0.7)\nspace origin: (1,2,3)\n"));
    const auto grid = read_volume_as<std::int16_t>(path);
    // The density of the voxel that lies at the place of number (2, 3, 1), whatever the order of the slices.
    const Vec3d p_W = 1e-3 * sign.cwiseProduct(Vec3d(1 + 2 * 0.5, 2 + 3 * 0.6, 3 + 0.7));
    const Vec3d u = (grid.X_WG().inverse() * p_W).cwiseQuotient(grid.spacing());
    const Eigen::Vector3i at = u.array().round().cast<int>();
    CHECK((u - at.cast<double>()).norm() < 1e-6);
    CHECK(at.x() == 2);
    CHECK(at.y() == 3);
    REQUIRE(grid.contains(at.x(), at.y(), at.z()));
    CHECK(grid.at(at.x(), at.y(), at.z()) == 23);
  }
}

TEST_CASE("MetaImage's intensity function is applied") {
  const TemporaryFolder folder;
  const auto path = folder / "a.mha";
  write_bytes(path, meta(std::string(kSpacing) +
                         "ElementToIntensityFunctionSlope = 2\nElementToIntensityFunctionOffset = -1024\n") +
                        ramp<std::int16_t>(24));
  CHECK(std::get<VoxelGrid<std::int16_t>>(read_volume(path)).at(1, 0, 0) == -1022);
  write_bytes(path, meta(std::string(kSpacing) + "ElementToIntensityFunctionSlope = 0.5\n") + ramp<std::int16_t>(24));
  CHECK(std::get<VoxelGrid<float>>(read_volume(path)).at(1, 0, 0) == 0.5F);
}

TEST_CASE("files with more bytes than their header takes are refused: a header's bytes would be voxels") {
  const TemporaryFolder folder;
  const auto voxels = ramp<std::int16_t>(24);
  const std::string header(40, 'h');
  write_bytes(folder / "a.raw", header + voxels);
  write_bytes(folder / "a.mhd", meta(kSpacing, "a.raw"));
  write_bytes(folder / "a.nhdr", nrrd(std::string(kSpacings) + "data file: a.raw\n", ""));
  write_bytes(folder / "b.nrrd", nrrd(kSpacings, header + voxels));
  write_bytes(folder / "c.nrrd", nrrd(std::string(kSpacings) + "encoding: gzip\n", gzip(header + voxels)));
  write_bytes(folder / "d.nii", Nifti{}.header() + header + voxels);
  write_bytes(folder / "e.nii.gz", gzip(Nifti{}.header() + header + voxels));
  write_bytes(folder / "f.mha", meta(kSpacing) + header + voxels);
  for (const char* const name : {"a.mhd", "a.nhdr", "b.nrrd", "c.nrrd", "d.nii", "e.nii.gz", "f.mha"}) {
    CAPTURE(name);
    holds(error_of(folder / name), "holds more bytes than its header's sizes and type take");
  }
  // Headers that tell how many bytes to skip.
  write_bytes(folder / "a.mhd", meta(std::string(kSpacing) + "HeaderSize = 40\n", "a.raw"));
  write_bytes(folder / "b.mhd", meta(std::string(kSpacing) + "HeaderSize = -1\n", "a.raw"));
  write_bytes(folder / "a.nhdr", nrrd(std::string(kSpacings) + "byte skip: 40\ndata file: a.raw\n", ""));
  write_bytes(folder / "b.nhdr", nrrd(std::string(kSpacings) + "byteskip: -1\ndatafile: a.raw\n", ""));
  write_bytes(folder / "c.nhdr", nrrd(std::string(kSpacings) + "line skip: 1\ndata file: b.raw\n", ""));
  write_bytes(folder / "b.raw", "a line\n" + voxels);
  for (const char* const name : {"a.mhd", "b.mhd", "a.nhdr", "b.nhdr", "c.nhdr"}) {
    CAPTURE(name);
    CHECK(read_volume_as<std::int16_t>(folder / name).at(2, 3, 1) == 23);
  }
}

TEST_CASE("packed files that were cut short are refused, however well the rest unpacks") {
  const TemporaryFolder folder;
  std::string noise;
  for (int i = 0; i < 48; ++i) noise += static_cast<char>(i * i * 37 % 251);
  const std::string packed = zlib(noise);
  const std::string lines = std::string(kSpacing) + "CompressedData = True\n";
  write_bytes(folder / "a.mha", meta(lines) + packed);
  CHECK(error_of(folder / "a.mha") == "no error");
  for (const std::size_t cut : {std::size_t{1}, std::size_t{8}, packed.size() - 4}) {
    CAPTURE(cut);
    write_bytes(folder / "a.mha", meta(lines) + packed.substr(0, packed.size() - cut));
    holds(error_of(folder / "a.mha"), "some are missing");
    write_bytes(folder / "b.mha", meta(lines + "CompressedDataSize = " + std::to_string(packed.size() - cut) + "\n") +
                                      packed.substr(0, packed.size() - cut));
    holds(error_of(folder / "b.mha"), "some are missing");
    const std::string gz = gzip(noise);
    write_bytes(folder / "c.nrrd", nrrd(std::string(kSpacings) + "encoding: gzip\n", gz.substr(0, gz.size() - cut)));
    holds(error_of(folder / "c.nrrd"), "some are missing");
  }
  // A header that announces more than any file holds takes no memory.
  write_bytes(folder / "d.nrrd",
              "NRRD0005\ntype: double\ndimension: 3\nsizes: 60000 60000 60000\nspacings: 1 1 1\n"
              "endian: little\nencoding: gzip\n\n" +
                  gzip(noise));
  holds(error_of(folder / "d.nrrd"), "some are missing");
}

TEST_CASE("gzip of several members, as of bgzip and pigz, and unpacked files of a packed name are read") {
  const TemporaryFolder folder;
  const std::string whole = Nifti{}.header() + ramp<std::int16_t>(24);
  const std::string empty_block("\x1f\x8b\x08\x04\0\0\0\0\0\xff\x06\0\x42\x43\x02\0\x1b\0\x03\0\0\0\0\0\0\0\0\0", 28);
  write_bytes(folder / "two.nii.gz", gzip(whole.substr(0, 100)) + gzip(whole.substr(100)));
  write_bytes(folder / "bgzip.nii.gz", gzip(whole) + empty_block);
  write_bytes(folder / "plain.nii.gz", whole);
  write_bytes(folder / "packed.nii", gzip(whole));
  write_bytes(folder / "two.nrrd",
              nrrd(std::string(kSpacings) + "encoding: gzip\n",
                   gzip(ramp<std::int16_t>(24).substr(0, 7)) + gzip(ramp<std::int16_t>(24).substr(7))));
  for (const char* const name : {"two.nii.gz", "bgzip.nii.gz", "plain.nii.gz", "packed.nii", "two.nrrd"}) {
    CAPTURE(name);
    CHECK(read_volume_as<std::int16_t>(folder / name).at(2, 3, 1) == 23);
  }
}

TEST_CASE("odd headers have their own reason, or none") {
  const TemporaryFolder folder;
  const auto voxels = ramp<std::int16_t>(24);
  write_bytes(folder / "blank.mhd", "\n" + meta(std::string("\n") + kSpacing + "  \n", "a.raw"));
  write_bytes(folder / "a.raw", voxels);
  CHECK(read_volume_as<std::int16_t>(folder / "blank.mhd").at(2, 3, 1) == 23);
  write_bytes(folder / "windows.mhd",
              "ObjectType = Image\r\nNDims = 3\r\nDimSize = 3 4 2\r\nElementSpacing = 1 1 1\r\n"
              "ElementType = MET_SHORT\r\nElementDataFile = a.raw\r\n");
  CHECK(read_volume_as<std::int16_t>(folder / "windows.mhd").at(2, 3, 1) == 23);
  write_bytes(folder / "gone.mhd", meta(kSpacing, "gone.raw"));
  holds(error_of(folder / "gone.mhd"), "there is no file " + (folder / "gone.raw").string());
  write_bytes(folder / "gone.nhdr", nrrd(std::string(kSpacings) + "data file: gone.raw\n", ""));
  holds(error_of(folder / "gone.nhdr"), "there is no file " + (folder / "gone.raw").string());
  write_bytes(folder / "gone.hdr", Nifti{.offset = 0, .magic = "ni1"}.header().substr(0, 348));
  holds(error_of(folder / "gone.hdr"), "there is no file " + (folder / "gone.img").string());
  write_bytes(folder / "gone.img", voxels);
  CHECK(read_volume_as<std::int16_t>(folder / "gone.hdr").at(2, 3, 1) == 23);
  CHECK(read_volume_as<std::int16_t>(folder / "gone.img").at(2, 3, 1) == 23);
  write_bytes(folder / "analyze.hdr", Nifti{.magic = ""}.header().substr(0, 348));
  write_bytes(folder / "analyze.img", voxels);
  holds(error_of(folder / "analyze.hdr"), "is an Analyze file, which tells left from right nowhere");
  write_bytes(folder / "order.nrrd", nrrd(std::string(kSpacings) + "endian: pdp\n"));
  holds(error_of(folder / "order.nrrd"), "tells no order of bytes");
  write_bytes(folder / "text.nrrd", nrrd(std::string(kSpacings) + "encoding: ascii\n",
                                         "0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23\n"));
  CHECK(std::get<VoxelGrid<std::int16_t>>(read_volume(folder / "text.nrrd")).at(2, 3, 1) == 23);
  write_bytes(folder / "hex.nrrd", nrrd(std::string(kSpacings) + "encoding: hex\n"));
  holds(error_of(folder / "hex.nrrd"), "its encoding 'hex' is not read");
  write_bytes(folder / "colour.nii", Nifti{.datatype = 128}.header() + voxels);
  holds(error_of(folder / "colour.nii"), "no plain numbers (datatype 128)");
}
