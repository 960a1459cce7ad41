// SPDX-License-Identifier: MIT
#include "sweep/measure.hpp"

#include <stdexcept>

namespace trephine::bench {
namespace {

/// All runs by density.
struct AllRuns {
  Runs<std::uint8_t> in_8_bit;
  Runs<std::int16_t> in_16_bit;
  AllRuns() {
    for (const auto add : {add_line_runs, add_surface_runs, add_coupled_runs}) add(in_8_bit, in_16_bit);
  }
  template <class Density>
  [[nodiscard]] const Runs<Density>& of() const {
    if constexpr (std::is_same_v<Density, std::uint8_t>)
      return in_8_bit;
    else
      return in_16_bit;
  }
};
const AllRuns& all_runs() {
  static const AllRuns all;
  return all;
}

}  // namespace

Bones::Bones(const Scenario& scenario, const Image& image) : data_(std::make_unique<Data>()) {
  if (image.bits == 16)
    data_->imaged = make_image<std::int16_t>(scenario, image);
  else
    data_->imaged = make_image<std::uint8_t>(scenario, image);
}
Bones::~Bones() = default;

std::vector<std::string> variants(const std::string& renderer, const std::string& scalar, int bits) {
  std::vector<std::string> names;
  const auto take = [&](const auto& runs) {
    for (const auto& [key, run] : runs.all())
      if (std::get<0>(key) == renderer && std::get<2>(key) == scalar) names.push_back(std::get<1>(key));
  };
  bits == 16 ? take(all_runs().in_16_bit) : take(all_runs().in_8_bit);
  return names;
}

std::vector<Row> run(const Setting& s, const Bones& bones) {
  return std::visit(
      [&](const auto& imaged) {
        const auto& runs = all_runs().of<typename std::remove_cvref_t<decltype(imaged)>::Density>().all();
        const auto found = runs.find({s.renderer, s.variant, s.scalar});
        if (found == runs.end())
          throw std::invalid_argument("no " + s.renderer + " variant " + s.variant + " in " + s.scalar);
        return found->second(imaged, s);
      },
      bones.data().imaged);
}

}  // namespace trephine::bench
