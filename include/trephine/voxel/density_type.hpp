// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/grid_geometry.hpp>

#include <concepts>
#include <cstdint>
#include <type_traits>

namespace trephine::inline TREPHINE_ALIGNED {

/// The type of a bone's voxels. Files hold these numbers.
enum class DensityType : std::uint8_t { kUint8 = 0, kInt8 = 1, kUint16 = 2, kInt16 = 3, kFloat = 4 };

template <VoxelDensity Density>
inline constexpr DensityType kDensityType = std::same_as<Density, std::uint8_t>    ? DensityType::kUint8
                                            : std::same_as<Density, std::int8_t>   ? DensityType::kInt8
                                            : std::same_as<Density, std::uint16_t> ? DensityType::kUint16
                                            : std::same_as<Density, std::int16_t>  ? DensityType::kInt16
                                                                                   : DensityType::kFloat;

/// Calls `use(std::type_identity<Density>{})` for a type that is known at run time, which must be one of the five.
template <class Use>
decltype(auto) with_density_type(DensityType type, Use&& use) {
  switch (type) {
    case DensityType::kUint8:
      return use(std::type_identity<std::uint8_t>{});
    case DensityType::kInt8:
      return use(std::type_identity<std::int8_t>{});
    case DensityType::kUint16:
      return use(std::type_identity<std::uint16_t>{});
    case DensityType::kInt16:
      return use(std::type_identity<std::int16_t>{});
    case DensityType::kFloat:
      break;
  }
  return use(std::type_identity<float>{});
}

}  // namespace trephine
