// SPDX-License-Identifier: MIT
#include "sweep/measure.hpp"

#include <stdexcept>

namespace trephine::bench {
namespace {

const Runs& all_runs() {
  static const Runs all = [] {
    Runs runs;
    for (const auto add : {add_line_runs, add_surface_runs, add_coupled_runs}) add(runs);
    return runs;
  }();
  return all;
}

}  // namespace

Bones::Bones(const Scenario& scenario, const Image& image)
    : data_(std::make_unique<Data>(Data{make_image(scenario, image)})) {}
Bones::~Bones() = default;

std::vector<std::string> variants(const std::string& renderer) {
  std::vector<std::string> names;
  for (const auto& [key, run] : all_runs())
    if (key.first == renderer) names.push_back(key.second);
  return names;
}

std::vector<Row> run(const Setting& s, const Bones& bones) {
  const auto found = all_runs().find({s.renderer, s.variant});
  if (found == all_runs().end()) throw std::invalid_argument("no " + s.renderer + " variant " + s.variant);
  return found->second(bones.data().imaged, s);
}

}  // namespace trephine::bench
