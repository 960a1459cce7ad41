// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/adapter/itk.hpp>
#include <trephine/core/rotation.hpp>

#include <doctest/doctest.h>

#include <itkGDCMImageIO.h>
#include <itkImageFileWriter.h>
#include <itkImageRegionIteratorWithIndex.h>
#include <itkMetaDataObject.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <itk_zlib.h>

#include <concepts>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <random>
#include <sstream>
#include <string>

namespace trephine::test {

/// A folder of its own that goes with the object.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::random_device seed;
    path_ =
        std::filesystem::temp_directory_path() / ("trephine-test-" + std::to_string(seed()) + std::to_string(seed()));
    std::filesystem::create_directories(path_);
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  [[nodiscard]] std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

inline void write_text(const std::filesystem::path& path, const std::string& text) { std::ofstream(path) << text; }

inline std::string bytes_of(const std::filesystem::path& path) {
  std::stringstream bytes;
  bytes << std::ifstream(path, std::ios::binary).rdbuf();
  return bytes.str();
}

inline void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

/// What a VolumeError says, in one line, or "no error".
template <std::invocable F>
std::string error_of(F&& f) {
  try {
    f();
  } catch (const VolumeError& e) {
    const std::string what = e.what();
    CHECK(what.find('\n') == std::string::npos);
    return what;
  }
  return "no error";
}
/// Likewise, as a volume is read.
inline std::string error_of(const std::filesystem::path& path, const VolumeOptions& options = {}) {
  return error_of([&] { (void)read_volume_as<float>(path, options); });
}

inline void holds(const std::string& text, const std::string& part) {
  INFO(text);
  CHECK(text.find(part) != std::string::npos);
}

/// Packed by zlib, in the form that `window` names (deflateInit2).
inline std::string packed_by(int window, std::string bytes) {
  z_stream z{};
  REQUIRE(deflateInit2(&z, 6, Z_DEFLATED, window, 8, Z_DEFAULT_STRATEGY) == Z_OK);
  std::string out(deflateBound(&z, static_cast<uLong>(bytes.size())) + 64, '\0');
  z.next_in = reinterpret_cast<Bytef*>(bytes.data());
  z.avail_in = static_cast<uInt>(bytes.size());
  z.next_out = reinterpret_cast<Bytef*>(out.data());
  z.avail_out = static_cast<uInt>(out.size());
  REQUIRE(deflate(&z, Z_FINISH) == Z_STREAM_END);
  deflateEnd(&z);
  return out.substr(0, z.total_out);
}

/// Replaces a text by one of the same length, at the only place.
inline void replace_bytes(std::string& in, const std::string& before, const std::string& after) {
  const auto at = in.find(before);
  REQUIRE(at != std::string::npos);
  REQUIRE(in.find(before, at + 1) == std::string::npos);
  in.replace(at, after.size(), after);
}

/// A density that tells its voxel; even, so that a rescale slope of 2 can store it.
inline int density_of(int i, int j, int k) { return 10 * i - 8 * j + 100 * k - 50; }

template <class Pixel>
typename itk::Image<Pixel, 3>::Pointer make_image(const std::array<int, 3>& size, const Vec3d& spacing_mm,
                                                  const Vec3d& origin_mm, const Mat3d& direction) {
  using Image = itk::Image<Pixel, 3>;
  auto image = Image::New();
  typename Image::SizeType n;
  typename Image::SpacingType spacing;
  typename Image::PointType origin;
  typename Image::DirectionType axes;
  for (unsigned a = 0; a < 3; ++a) {
    n[a] = static_cast<itk::SizeValueType>(size[a]);
    spacing[a] = spacing_mm[a];
    origin[a] = origin_mm[a];
    for (unsigned b = 0; b < 3; ++b) axes(a, b) = direction(a, b);
  }
  image->SetRegions(n);
  image->SetSpacing(spacing);
  image->SetOrigin(origin);
  image->SetDirection(axes);
  image->Allocate();
  for (itk::ImageRegionIteratorWithIndex<Image> it(image, image->GetBufferedRegion()); !it.IsAtEnd(); ++it) {
    const auto u = it.GetIndex();
    it.Set(static_cast<Pixel>(density_of(static_cast<int>(u[0]), static_cast<int>(u[1]), static_cast<int>(u[2]))));
  }
  return image;
}

template <class Image>
void write_image(const Image& image, const std::filesystem::path& path, itk::ImageIOBase::Pointer io,
                 bool packed = false) {
  auto writer = itk::ImageFileWriter<Image>::New();
  writer->SetImageIO(io);
  writer->SetFileName(path.string());
  writer->SetInput(&image);
  writer->UseInputMetaDataDictionaryOff();
  writer->SetUseCompression(packed);
  writer->Update();
}

/// A DICOM series to be written, a file a slice.
struct Series {
  std::array<int, 3> size{12, 10, 8};
  Vec3d spacing_mm{0.5, 0.75, 1.25};  // last: between slices, along `step`
  Vec3d origin_mm{-30, 40, 50};
  Mat3d direction = Mat3d::Identity();
  Vec3d step = Vec3d::UnitZ();  // where the next slice lies, in mm: step * spacing_mm.z()
  std::string uid = "1.2.826.0.1.3680043.2.1125.1";
  std::string modality = "CT";
  double slope = 1;
  double intercept = -1000;
  int missing = -1;      // this slice is not written
  int repeated = -1;     // this slice lies where its predecessor lies
  std::string prefix{};  // of the files' names
  int offset = 0;        // added to the densities
  std::optional<itk::GDCMImageIO::CompressionEnum> packed{};
};

/// Writes slices with densities offset + density_of(i, j, k), in files whose names sort against the order of the
/// slices.
template <class Pixel = std::int16_t>
void write_series(const std::filesystem::path& folder, const Series& s) {
  using Image = itk::Image<Pixel, 3>;
  for (int k = 0; k < s.size[2]; ++k) {
    if (k == s.missing) continue;
    const int at = k == s.repeated ? k - 1 : k;
    const Vec3d origin = s.origin_mm + at * s.spacing_mm.z() * s.step;
    const auto image = make_image<Pixel>({s.size[0], s.size[1], 1}, s.spacing_mm, origin, s.direction);
    for (itk::ImageRegionIteratorWithIndex<Image> it(image, image->GetBufferedRegion()); !it.IsAtEnd(); ++it) {
      const auto u = it.GetIndex();
      it.Set(static_cast<Pixel>(s.offset + density_of(static_cast<int>(u[0]), static_cast<int>(u[1]), k)));
    }
    auto io = itk::GDCMImageIO::New();
    io->KeepOriginalUIDOn();
    auto& tags = image->GetMetaDataDictionary();
    const auto set = [&tags](const char* key, const std::string& value) {
      itk::EncapsulateMetaData<std::string>(tags, key, value);
    };
    const auto text = [](double v) {
      std::ostringstream o;
      o << v;
      return o.str();
    };
    set("0008|0060", s.modality);
    set("0028|0004", "MONOCHROME2");
    set("0008|103e", "made by a test");
    set("0020|000d", s.uid + ".9");
    set("0020|000e", s.uid);
    set("0008|0018", s.uid + ".7." + std::to_string(k));
    // ITK takes densities as they shall be read and stores (density - intercept) / slope.
    set("0028|1052", text(s.intercept));
    set("0028|1053", text(s.slope));
    auto writer = itk::ImageFileWriter<Image>::New();
    writer->SetImageIO(io);
    writer->SetFileName((folder / (s.prefix + std::to_string(100 - k) + ".dcm")).string());
    writer->SetInput(image);
    if (s.packed) {
      io->SetCompressionType(*s.packed);
      writer->UseCompressionOn();
    }
    writer->Update();
  }
}

/// Largest distance [m] between where ITK and the grid see the image's voxels, over all of them; and their densities.
template <class Grid, class Image>
double farthest_apart(const Grid& grid, const Image& image, bool& same_densities) {
  double farthest = 0;
  same_densities = true;
  const Posed X_GW = grid.X_WG().inverse();
  for (itk::ImageRegionConstIteratorWithIndex<Image> it(&image, image.GetBufferedRegion()); !it.IsAtEnd(); ++it) {
    typename Image::PointType p;
    image.TransformIndexToPhysicalPoint(it.GetIndex(), p);
    const Vec3d p_W = 1e-3 * Vec3d(p[0], p[1], p[2]);
    const Vec3d u = (X_GW * p_W).cwiseQuotient(grid.spacing());
    const Eigen::Vector3i nearest = u.array().round().template cast<int>();
    if (!grid.contains(nearest.x(), nearest.y(), nearest.z())) return std::numeric_limits<double>::infinity();
    farthest = std::max(farthest, (u - nearest.template cast<double>()).cwiseProduct(grid.spacing()).norm());
    same_densities = same_densities && static_cast<double>(grid.at(nearest.x(), nearest.y(), nearest.z())) ==
                                           static_cast<double>(it.Get());
  }
  return farthest;
}

/// All of a file.
[[nodiscard]] inline std::string text_of(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

[[nodiscard]] inline std::size_t files_in(const TemporaryFolder& folder) {
  const auto all = std::filesystem::directory_iterator(folder.path());
  return static_cast<std::size_t>(std::distance(begin(all), end(all)));
}

}  // namespace trephine::test
