// SPDX-License-Identifier: MIT
#include "common/percentile.hpp"
#include "support/random.hpp"
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

  // Against the definition, counted.
  trephine::test::Random random(3);
  for (int n = 1; n < 60; ++n) {
    std::vector<double> v;
    for (int i = 0; i < n; ++i) v.push_back(random.below(20));
    const double q = random.uniform(0.01, 1);
    double expected = 1e9;
    for (const double x : v) {
      const auto at_or_below = std::count_if(v.begin(), v.end(), [&](double y) { return y <= x; });
      if (static_cast<double>(at_or_below) >= q * n) expected = std::min(expected, x);
    }
    CHECK(percentile(v, q) == expected);
  }
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
