// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/stage/milling.hpp>

namespace trephine::bench {

enum class Cut { kAtOnce, kByRate, kAdvancing };

/// One type for all ways to cut. `rate` in densities a second, `speed` in m/s.
class AnyMilling {
 public:
  AnyMilling(Cut cut, double rate, double speed)
      : cut_(cut), by_rate_(RateLimitedCut<>{.rate = rate}), advancing_(AdvancingCut{.speed = speed}) {}
  void reset() noexcept {
    at_once_.reset();
    by_rate_.reset();
    advancing_.reset();
  }
  template <class Grid>
  double carve(Grid& grid, double isovalue, const Posed& from, const Posed& to, const Burr& burr,
               const CarveContext& context) noexcept {
    return cut_ == Cut::kAtOnce   ? at_once_.carve(grid, isovalue, from, to, burr, context)
           : cut_ == Cut::kByRate ? by_rate_.carve(grid, isovalue, from, to, burr, context)
                                  : advancing_.carve(grid, isovalue, from, to, burr, context);
  }

 private:
  Cut cut_;
  Milling<> at_once_;
  Milling<RateLimitedCut<>> by_rate_;
  Milling<AdvancingCut> advancing_;
};

}  // namespace trephine::bench
