// SPDX-License-Identifier: MIT
#include "common/percentile.hpp"
#include "sweep/sweep.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

namespace {

using namespace trephine::bench;

TEST_CASE("percentiles are values that occur; what is not finite does not count") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(percentile({5, 1, nan, 3, 2, 4}, 0.5) == 3);
  CHECK(percentile({5, 1, 3, 2, 4}, 0) == 1);
  CHECK(percentile({5, 1, 3, 2, 4}, 1) == 5);
  CHECK(percentile({1, 2}, 0.95) == 2);
  CHECK(std::isnan(percentile({nan}, 0.5)));
  CHECK(std::isnan(percentile({}, 0.5)));
}

TEST_CASE("a row has as many fields as the header, and leaves undefined ones empty") {
  std::ostringstream header, text;
  write_header(header);
  Row row;
  row.setting.renderer = "surface";
  row.torque_error_rel_p95 = std::numeric_limits<double>::quiet_NaN();
  row.error_kind = "model";
  write(text, row);
  const std::string h = header.str(), t = text.str();
  CHECK(std::count(h.begin(), h.end(), ',') == std::count(t.begin(), t.end(), ','));
  CHECK(t.find(",,") != std::string::npos);
  CHECK(t.find("nan") == std::string::npos);
}

}  // namespace
