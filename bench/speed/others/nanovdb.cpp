// SPDX-License-Identifier: MIT
#include "../others.hpp"

#include <nanovdb/NanoVDB.h>
#include <nanovdb/util/GridBuilder.h>
#include <nanovdb/util/SampleFromVoxels.h>

#include <memory>

namespace trephine::bench {
namespace {

OtherSampling sampling(const VoxelGrid<std::uint8_t>& grid) {
  nanovdb::GridBuilder<float> builder(static_cast<float>(grid.outside()));
  {
    auto write = builder.getAccessor();
    for_each_voxel(grid, [&](int i, int j, int k, std::uint8_t v) {
      if (v != grid.outside()) write.setValue(nanovdb::Coord(i, j, k), static_cast<float>(v));
    });
  }
  auto handle = std::make_shared<nanovdb::GridHandle<>>(builder.getHandle<>());
  return [handle](const PosedPoints& points, float* out) {
    const auto accessor = handle->grid<float>()->getAccessor();
    const auto sampler = nanovdb::createSampler<1>(accessor);
    for (int i = 0; i < points.count; ++i) {
      const Vec3<float> u = points[i];
      out[i] = sampler(nanovdb::Vec3f(u.x(), u.y(), u.z()));
    }
  };
}

const Known known("NanoVDB", sampling);

}  // namespace
}  // namespace trephine::bench
