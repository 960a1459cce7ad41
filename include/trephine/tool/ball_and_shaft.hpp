// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/shape.hpp>

namespace trephine {

/// A burr as a body: its ball and its shaft.
class BallAndShaft {
 public:
  /// Throws std::invalid_argument for a burr that is none.
  BallAndShaft(const Burr& burr) : burr_(burr) { burr.validate(); }

  [[nodiscard]] const Burr& burr() const noexcept { return burr_; }

 private:
  Burr burr_;
};

}  // namespace trephine
