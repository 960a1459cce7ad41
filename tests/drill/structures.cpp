// SPDX-License-Identifier: MIT
// Structures that the example makes, and what its drill does to them with each protection.
#include "structures.hpp"
#include "phantom.hpp"
#include "structure_show.hpp"

#include <trephine/voxel/density_field.hpp>

#include <doctest/doctest.h>

#include <cstddef>
#include <cstdint>

namespace {

using namespace drill;

/// The tooth in voxels of 0.25 mm, and a place on its crown.
const Bone& tooth() {
  static const Bone bone = [] {
    Bone b{.name = "tooth",
           .unit = "levels",
           .grid = tooth_phantom<std::int16_t>({.size = {104, 104, 72}, .spacing = 0.25e-3}),
           .isovalue = PhantomDensities::kIsovalue,
           .burr = {},
           .notes = {}};
    b.burr = fitting_burr(b.grid, {});
    return b;
  }();
  return bone;
}

Surgeon surgeon() { return {find_spot(tooth()), tooth().burr, {}}; }

}  // namespace

TEST_CASE("made structures lie below their entries, the dura without bone") {
  const MadeStructures made = make_structures(tooth(), surgeon());
  const StructureLabels& labels = made.labels;
  const trephine::Posed X_SW = labels.X_WS().inverse();
  const trephine::Vec3d in = -surgeon().frame_W().col(2);
  const double voxel = labels.spacing().norm();
  for (int s = 0; s < kSpotStructures; ++s) {
    CAPTURE(s);
    const Approach& way = made.approaches[static_cast<std::size_t>(s)];
    const auto label_below = [&](double depth) { return labels.label_at(X_SW * (way.entry_W + depth * in)); };
    CHECK(label_below(way.depth - voxel) == 0);
    CHECK(label_below(way.depth + voxel) == s + 1);
  }
  const auto& n = labels.size();
  const trephine::DensityField<std::int16_t, double> field(tooth().grid, tooth().isovalue);
  int bony = 0;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        if (labels.at(i, j, k) != kDura + 1) continue;
        const trephine::Vec3d p_W = labels.X_WS() * labels.spacing().cwiseProduct(trephine::Vec3d(i, j, k));
        bony += field.value(tooth().grid.X_WG().inverse() * p_W) >= 0 ? 1 : 0;
      }
  CHECK(bony == 0);
}

TEST_CASE("the drill takes of each structure without protection, and nothing with the veto") {
  const StructureShow show = show_structures(tooth(), {}, make_structures(tooth(), surgeon()));
  CHECK(check(show) == 0);
  for (std::size_t s = 0; s < kSpotStructures; ++s) {
    CAPTURE(s);
    const auto run = [&](Protection p) -> const ShowRun& { return show.shows[static_cast<std::size_t>(p)].runs[s]; };
    CHECK(run(Protection::kNothing).greatest_guard() == 0);
    CHECK(run(Protection::kGuard).greatest_guard() > 0.2);
    CHECK(run(Protection::kGuard).taken_mm3 < 0.1 * run(Protection::kNothing).taken_mm3);
    CHECK(run(Protection::kVeto).rows.back().refused_mm3 > 0);
    // Volumes of a tick are of all structures; the one that is drilled is often the nearest.
    double refused = 0, taken = 0;
    int nearest = 0, warned = 0;
    for (const ShowRow& row : run(Protection::kVeto).rows) {
      refused += row.tick.refused_mm3;
      nearest += row.tick.nearest == static_cast<int>(s) ? 1 : 0;
      warned += row.tick.warns ? 1 : 0;
    }
    for (const ShowRow& row : run(Protection::kNothing).rows) taken += row.tick.taken_mm3;
    CHECK(refused >= run(Protection::kVeto).rows.back().refused_mm3 - 1e-6);
    CHECK(taken >= run(Protection::kNothing).taken_bone_mm3 - 1e-6);
    CHECK(nearest > 100);
    CHECK(warned > 100);
  }
}
