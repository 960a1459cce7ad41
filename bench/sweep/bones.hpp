// SPDX-License-Identifier: MIT
#pragma once

#include "sweep/measure.hpp"
#include "sweep/runs.hpp"

#include <functional>
#include <map>
#include <variant>

namespace trephine::bench {

struct Bones::Data {
  std::variant<Imaged<std::uint8_t>, Imaged<std::int16_t>> imaged;
};

/// Runs of one density type by variant and scalar.
template <VoxelDensity Density>
using Runs = std::map<std::pair<std::string, std::string>,
                      std::function<std::vector<Row>(const Imaged<Density>&, const Setting&)>>;

[[nodiscard]] const Runs<std::uint8_t>& surface_runs_8();
[[nodiscard]] const Runs<std::int16_t>& surface_runs_16();
[[nodiscard]] const Runs<std::uint8_t>& line_runs_8();
[[nodiscard]] const Runs<std::uint8_t>& coupled_runs_8();
[[nodiscard]] const Runs<std::int16_t>& coupled_runs_16();
[[nodiscard]] const Runs<std::int16_t>& line_runs_16();

}  // namespace trephine::bench
