// SPDX-License-Identifier: MIT
#pragma once

#include "bone.hpp"
#include "picture.hpp"
#include "run_log.hpp"
#include "structure_show.hpp"
#include "surgeon.hpp"

#include <string>
#include <vector>

namespace drill {

/// One picture to be made, and its file's name.
struct Shot {
  std::string file;
  Picture picture;
};

/// The whole bone with the drill on its way.
[[nodiscard]] Shot shot_of_whole(const Bone& bone, const PicturedBone& surface, const Surgeon& surgeon);
/// The spot from near, before drilling.
[[nodiscard]] Shot shot_of_spot(const Bone& bone, const PicturedBone& surface, const Surgeon& surgeon);

/// The drill leaning over in its hole at the run's pictured tick, by the shaft on the rim if that touches, from outside
/// and cut open along the hole, and the hole that is left. The bone no longer changes once the shaft leans, so one
/// surface serves all.
[[nodiscard]] std::vector<Shot> shots_of_run(const Bone& bone, const PicturedBone& before, const PicturedBone& after,
                                             const Surgeon& surgeon, const RunLog& log);

/// The bone cut open along the ways to the structures. `show`: what was drilled, with the drill on its way to the
/// structure `shown`; null for the bone before.
[[nodiscard]] Picture picture_of_structures(const Bone& bone, const PicturedBone& before, const PicturedBone& after,
                                            const DrawnStructures& structures, const Surgeon& surgeon, int shown,
                                            const Show* show);

}  // namespace drill
