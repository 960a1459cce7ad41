// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/ball_and_shaft.hpp>
#include <trephine/tool/revolved_tool.hpp>

#include <variant>

namespace trephine::inline TREPHINE_ALIGNED {

/// The head of an AnyTool.
class AnyHead {
 public:
  AnyHead(const CuttingBall& head) : head_(head) {}  // NOLINT(google-explicit-constructor)
  AnyHead(const CuttingHead& head) : head_(head) {}  // NOLINT(google-explicit-constructor)

  /// Calls `body` with the CuttingBall or the CuttingHead.
  template <class Body>
  decltype(auto) visit(Body&& body) const {
    if (const auto* ball = std::get_if<CuttingBall>(&head_)) return body(*ball);
    return body(*std::get_if<CuttingHead>(&head_));
  }

 private:
  std::variant<CuttingBall, CuttingHead> head_;
};

/// A tool whose kind is chosen at run time, a burr or a revolved tool: for scenes that change between both. Distances
/// are those of the tool itself, bit for bit; the choice costs a branch for 16 points.
class AnyTool {
 public:
  /// Throws std::invalid_argument for a burr that `Burr::validate` refuses.
  AnyTool(const Burr& burr) : tool_(BallAndShaft(burr)) {}  // NOLINT(google-explicit-constructor): a tool is any tool
  AnyTool(const RevolvedTool& tool) : tool_(tool) {}        // NOLINT(google-explicit-constructor)

  /// Calls `body` with the BallAndShaft or the RevolvedTool.
  template <class Body>
  decltype(auto) visit(Body&& body) const {
    if (const auto* burr = std::get_if<BallAndShaft>(&tool_)) return body(*burr);
    return body(*std::get_if<RevolvedTool>(&tool_));
  }

  [[nodiscard]] const Burr& burr() const noexcept {
    return visit([](const auto& tool) -> const Burr& { return tool.burr(); });
  }
  [[nodiscard]] ToolBounds bounds() const noexcept {
    return visit([](const auto& tool) { return tool.bounds(); });
  }
  [[nodiscard]] AnyHead cutting_head(double allowance) const noexcept {
    return visit([&](const auto& tool) { return AnyHead(tool.cutting_head(allowance)); });
  }
  void profile(const ProfileLanes<double>& rho, const ProfileLanes<double>& z, Profile& out) const noexcept {
    visit([&](const auto& tool) { tool.profile(rho, z, out); });
  }
  void distances(const ProfileLanes<float>& rho, const ProfileLanes<float>& z,
                 ProfileLanes<float>& out) const noexcept {
    visit([&](const auto& tool) { tool.distances(rho, z, out); });
  }

 private:
  std::variant<BallAndShaft, RevolvedTool> tool_;
};

static_assert(ToolShape<AnyTool>);

}  // namespace trephine
