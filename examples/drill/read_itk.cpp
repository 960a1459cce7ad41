// SPDX-License-Identifier: MIT
// Compiled only where ITK is; see bone.cpp for what stands in.
#include "read_itk.hpp"

#include <trephine/adapter/itk.hpp>

namespace drill {

Grid read_ct(const std::string& path, const std::string& series) {
  trephine::VolumeOptions options;
  options.series = series;
  return trephine::read_volume_as<std::int16_t>(path, options);
}

}  // namespace drill
