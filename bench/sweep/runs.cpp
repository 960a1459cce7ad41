// SPDX-License-Identifier: MIT
#include "sweep/bones.hpp"

#include <stdexcept>

namespace trephine::bench {

Bones::Bones(const Scenario& scenario, const Image& image) : data_(std::make_unique<Data>()) {
  if (image.bits == 16)
    data_->imaged = make_image<std::int16_t>(scenario, image);
  else
    data_->imaged = make_image<std::uint8_t>(scenario, image);
}
Bones::~Bones() = default;

namespace {

template <class R>
std::vector<std::string> names(const R& runs, const std::string& scalar) {
  std::vector<std::string> all;
  for (const auto& [key, run] : runs)
    if (key.second == scalar) all.push_back(key.first);
  return all;
}

}  // namespace

std::vector<std::string> surface_variants(const std::string& scalar, int bits) {
  return bits == 16 ? names(surface_runs_16(), scalar) : names(surface_runs_8(), scalar);
}
std::vector<std::string> line_variants(const std::string& scalar, int bits) {
  return bits == 16 ? names(line_runs_16(), scalar) : names(line_runs_8(), scalar);
}

std::vector<Row> run(const Setting& setting, const Bones& bones) {
  const auto key = std::pair(setting.variant, setting.scalar);
  const auto with = [&](const auto& runs, const auto& imaged) {
    const auto found = runs.find(key);
    if (found == runs.end())
      throw std::invalid_argument("no " + setting.renderer + " variant " + setting.variant + " in " + setting.scalar);
    return found->second(imaged, setting);
  };
  const bool surface = setting.renderer == "surface";
  const bool line = setting.renderer == "line";
  return std::visit(
      [&](const auto& imaged) {
        using Density = typename std::remove_cvref_t<decltype(imaged)>::Density;
        if constexpr (std::is_same_v<Density, std::uint8_t>)
          return with(surface ? surface_runs_8() : line ? line_runs_8() : coupled_runs_8(), imaged);
        else
          return with(surface ? surface_runs_16() : line ? line_runs_16() : coupled_runs_16(), imaged);
      },
      bones.data().imaged);
}

}  // namespace trephine::bench
