// SPDX-License-Identifier: MIT
// Structures that the example makes, and what its drill does to them with each protection.
#include "structures.hpp"
#include "small_tooth.hpp"
#include "structure_show.hpp"

#include <trephine/voxel/density_field.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cstddef>

using namespace drill;

TEST_CASE("made structures lie below their entries, the dura without bone") {
  const MadeStructures made = make_structures(small_tooth(), small_tooth_surgeon());
  const StructureLabels& labels = made.labels;
  const trephine::Posed X_SW = labels.X_WS().inverse();
  const trephine::Vec3d in = -small_tooth_surgeon().frame_W().col(2);
  const double voxel = labels.spacing().norm();
  for (int s = 0; s < kSpotStructures; ++s) {
    CAPTURE(s);
    const Approach& way = made.approaches[static_cast<std::size_t>(s)];
    const auto label_below = [&](double depth) { return labels.label_at(X_SW * (way.entry_W + depth * in)); };
    CHECK(label_below(way.depth - voxel) == 0);
    CHECK(label_below(way.depth + voxel) == s + 1);
  }
  const auto& n = labels.size();
  const trephine::DensityField<std::int16_t, double> field(small_tooth().grid, small_tooth().isovalue);
  int bony = 0;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        if (labels.at(i, j, k) != kDura + 1) continue;
        const trephine::Vec3d p_W = labels.X_WS() * labels.spacing().cwiseProduct(trephine::Vec3d(i, j, k));
        bony += field.value(small_tooth().grid.X_WG().inverse() * p_W) >= 0 ? 1 : 0;
      }
  CHECK(bony == 0);
}

TEST_CASE("the drill takes of each structure without protection, and nothing with the veto") {
  const StructureShow show = show_structures(small_tooth(), {}, make_structures(small_tooth(), small_tooth_surgeon()));
  CHECK(check(show) == 0);
  for (std::size_t s = 0; s < kSpotStructures; ++s) {
    CAPTURE(s);
    const auto run = [&](Protection p) -> const ShowRun& { return show.shows[static_cast<std::size_t>(p)].runs[s]; };
    CHECK(run(Protection::kNothing).greatest_guard() == 0);
    CHECK(run(Protection::kGuard).greatest_guard() > 0.2);
    CHECK(run(Protection::kGuard).swept_mm3 < 0.03 * run(Protection::kNothing).swept_mm3);
    CHECK(run(Protection::kVeto).rows.back().refused_mm3 > 0);
    // Volumes of a tick are of all structures; the one that is drilled is often the nearest.
    double refused = 0, taken = 0;
    int nearest = 0, warned = 0;
    double least_drawn = 1, least_device = 1;
    for (const ShowRow& row : run(Protection::kVeto).rows) {
      if (row.drawn_nearest >= 0) least_drawn = std::min(least_drawn, row.drawn_distance);
      if (row.tick.nearest >= 0) least_device = std::min(least_device, row.tick.distance);
      refused += row.tick.refused_mm3;
      nearest += row.tick.nearest == static_cast<int>(s) ? 1 : 0;
      warned += row.tick.warns ? 1 : 0;
    }
    for (const ShowRow& row : run(Protection::kNothing).rows) taken += row.tick.taken_mm3;
    CHECK(refused >= run(Protection::kVeto).rows.back().refused_mm3 - 1e-6);
    CHECK(taken >= run(Protection::kNothing).taken_mm3 - 1e-6);
    // The device's pose is deep in bone that the veto kept; the drawn drill stays out of it.
    CHECK(least_device < least_drawn - 1e-4);
    CHECK(least_drawn > 0);
    CHECK(least_drawn < run(Protection::kVeto).least_distance() + 0.02 * show.field->spacing().maxCoeff());
    CHECK(nearest > 100);
    CHECK(warned > 100);
  }
}
