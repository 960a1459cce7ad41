// SPDX-License-Identifier: MIT
#include "../others.hpp"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

#include <memory>

namespace trephine::bench {
namespace {

/// Its box sampler is of the grid's type: an 8-bit grid would answer whole numbers, so densities are floats here. As
/// the manual has it, the sampler goes through an accessor, which remembers the nodes it was in.
OtherSampling sampling(const VoxelGrid<std::uint8_t>& grid) {
  openvdb::initialize();
  auto copy = openvdb::FloatGrid::create(static_cast<float>(grid.outside()));
  auto write = copy->getAccessor();
  for_each_voxel(grid, [&](int i, int j, int k, std::uint8_t v) {
    if (v != grid.outside()) write.setValue(openvdb::Coord(i, j, k), static_cast<float>(v));
  });
  using Accessor = openvdb::FloatGrid::ConstAccessor;
  auto accessor = std::make_shared<Accessor>(copy->getConstAccessor());
  return [copy, accessor](const PosedPoints& points, float* out) {
    const openvdb::tools::GridSampler<Accessor, openvdb::tools::BoxSampler> sampler(*accessor, copy->transform());
    for (int i = 0; i < points.count; ++i) {
      const Vec3<float> u = points[i];
      out[i] = sampler.isSample(openvdb::Vec3R(u.x(), u.y(), u.z()));
    }
  };
}

const Known known("OpenVDB GridSampler", sampling);

}  // namespace
}  // namespace trephine::bench
