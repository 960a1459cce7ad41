// SPDX-License-Identifier: MIT
#include "../others.hpp"

#include <itkImage.h>
#include <itkLinearInterpolateImageFunction.h>

namespace trephine::bench {
namespace {

OtherSampling sampling(const VoxelGrid<std::uint8_t>& grid) {
  using Image = itk::Image<std::uint8_t, 3>;
  using Interpolation = itk::LinearInterpolateImageFunction<Image, float>;
  const auto image = Image::New();
  const auto extent = [&](std::size_t a) { return static_cast<itk::SizeValueType>(grid.size()[a]); };
  image->SetRegions(Image::SizeType{{extent(0), extent(1), extent(2)}});
  image->Allocate();
  for_each_voxel(grid, [&](int i, int j, int k, std::uint8_t v) { image->SetPixel({{i, j, k}}, v); });
  const auto interpolation = Interpolation::New();
  interpolation->SetInputImage(image);
  return [interpolation, outside = static_cast<float>(grid.outside())](const PosedPoints& points, float* out) {
    for (int i = 0; i < points.count; ++i) {
      const Vec3<float> u = points[i];
      Interpolation::ContinuousIndexType at;
      for (unsigned a = 0; a < 3; ++a) at[a] = u[a];
      // Beyond the image it answers nothing: who uses it must ask.
      out[i] = interpolation->IsInsideBuffer(at) ? static_cast<float>(interpolation->EvaluateAtContinuousIndex(at))
                                                 : outside;
    }
  };
}

const Known known("ITK's linear interpolator", sampling);

}  // namespace
}  // namespace trephine::bench
