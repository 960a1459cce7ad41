// SPDX-License-Identifier: MIT
#pragma once

#include "contact_cases.hpp"
#include "settings.hpp"

#include <trephine/core/wrench.hpp>

#include <memory>
#include <vector>

namespace pick {

/// A renderer with one setting, ready to be led through cases again and again.
class Player {
 public:
  virtual ~Player() = default;
  /// Leads the tool through all cases, each from a renderer without history. Adds the wrench of every tick (in G, on
  /// the tool about T's origin) to `wrenches` where that is given. `ns` has room for every tick's time and keeps the
  /// shorter of what it holds and what it took now: what the tick itself needs, without what else the machine does.
  virtual void play(const Bones& bones, const std::vector<Case>& cases, std::vector<float>& ns,
                    std::vector<trephine::Wrenchd>* wrenches) = 0;
};

/// Throws std::invalid_argument for settings or a tool that the library refuses. `bones` are those that it is led
/// through.
[[nodiscard]] std::unique_ptr<Player> make_player(const Setting& setting, const Scene& scene, const Bones& bones);

}  // namespace pick
