// SPDX-License-Identifier: MIT
#include "support/near.hpp"

#include <trephine/tool/named_tools.hpp>

#include <doctest/doctest.h>

#include <stdexcept>
#include <string>

namespace {

using namespace trephine;
using namespace trephine::test;

TEST_CASE("named tools: every family's diameters make a tool of that diameter, with its edges") {
  for (const ToolFamily& family : kToolFamilies)
    for (int i = 0; i <= 20; ++i) {
      const double mm = family.least + (family.most - family.least) * i / 20;
      const std::string name = std::string(family.name) + "-" + std::to_string(mm);
      CAPTURE(name);
      const NamedTool named = tool_by_name(name);
      CHECK(2e3 * named.tool.burr().tip_radius == near(mm, 1e-6));
      CHECK(named.tool.bounds().core_radius > 0);
      CHECK(named.tool.bounds().head_top < named.tool.bounds().z_high);
      CHECK(named.edges.flutes == family.flutes);
      CHECK((named.edges.kind == CuttingEdges::Kind::kDiamond) == (family.name == "diamond"));
    }
}

TEST_CASE("named tools: other names are refused with all that there are") {
  for (const char* const name : {"", "round", "round-", "round-x", "round-3mm", "round-0.5", "round-8", "twist--2",
                                 "ball-3", "rounder-3", "round-nan", "disc-inf"}) {
    CAPTURE(name);
    CHECK_THROWS_AS((void)tool_by_name(name), std::invalid_argument);
  }
  CHECK_THROWS_WITH(
      (void)tool_by_name("ball-3"),
      "trephine::tool_by_name: the name must be a family and a diameter in mm, as round-3: round-0.6 to 7, "
      "diamond-0.6 to 7, match-head-1.5 to 5, pear-0.8 to 4, cylinder-0.8 to 4, taper-0.9 to 4, barrel-3 to "
      "8, disc-3 to 20, twist-1 to 6, reamer-4 to 14, got ball-3");
}

}  // namespace
