// SPDX-License-Identifier: MIT
#include "pick_options.hpp"
#include "pick_places.hpp"
#include "pick_study.hpp"

#include "support/near.hpp"

#include <doctest/doctest.h>

using trephine::test::near;

using namespace pick;

namespace {

Measured point(double us, double share, const Setting& setting = LineSetting{}) {
  Measured m{.setting = setting};
  m.p999_us = us;
  m.worst_share = share;
  return m;
}

Options parse(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), "pick_counts");
  return parse_options(static_cast<int>(arguments.size()), arguments.data());
}

}  // namespace

TEST_CASE("the front, against its definition") {
  Random random(2);
  for (int round = 0; round < 50; ++round) {
    std::vector<Measured> all;
    for (int i = 0; i < 40; ++i) {
      const double us = std::floor(random.uniform(1, 20)), share = std::floor(random.uniform(1, 20));
      all.push_back(point(us, share, LineSetting{.vertices = i + 1}));
    }
    mark_front(all);
    for (std::size_t i = 0; i < all.size(); ++i) {
      bool beaten = false;
      for (std::size_t j = 0; j < all.size(); ++j) {
        const bool no_worse = all[j].p999_us <= all[i].p999_us && all[j].worst_share <= all[i].worst_share;
        const bool equal = all[j].p999_us == all[i].p999_us && all[j].worst_share == all[i].worst_share;
        beaten = beaten || (no_worse && (!equal || j < i));
      }
      CHECK(all[i].front == !beaten);
    }
  }
}

TEST_CASE("the quickest that keeps to limits and budget, with a tenth to spare") {
  const std::vector<Measured> all{point(5, 3), point(20, 0.95), point(30, 0.89), point(31, 0.5), point(46, 0.1)};
  const Choice c = choose(all, 50);
  REQUIRE(c.recommended);
  CHECK(c.recommended->p999_us == 30);
  CHECK(c.nearest.p999_us == 46);

  const Choice tight = choose(all, 30);
  CHECK_FALSE(tight.recommended);
  CHECK(tight.within_limits->p999_us == 30);
  CHECK_FALSE(choose({point(5, 3)}, 50).within_limits);
  CHECK_THROWS_AS((void)choose({}, 50), std::invalid_argument);
}

TEST_CASE("one of the two, and why") {
  const Choice line = choose({point(30, 0.5)}, 50);
  const Choice surface = choose({point(15, 0.5, SurfaceSetting{})}, 50);
  const Choice slow = choose({point(80, 0.5, SurfaceSetting{})}, 50);
  CHECK(decide({line, surface}, 50).winner == 0U);
  CHECK(decide({line, slow}, 50).winner == 0U);
  CHECK(decide({choose({point(80, 0.5)}, 50), surface}, 50).winner == 1U);
  CHECK(decide({surface}, 50).winner == 0U);
  const Choice coupled = choose({point(45, 0.5, CoupledSetting{})}, 50);
  const Verdict three = decide({line, surface, coupled}, 50);
  CHECK(three.winner == 2U);
  const std::string keep = "keep to limits and budget, the preferred first: Coupled 45 us";
  CHECK(three.reason == keep + ", Line 30 us, Surface 15 us");
  CHECK(decide({line, slow, coupled}, 50).reason == keep + ", Line 30 us");
  CHECK(decide({choose({point(80, 2)}, 50), slow, coupled}, 50).reason == keep);
  const Verdict none = decide({choose({point(80, 2)}, 50), slow}, 50);
  CHECK_FALSE(none.winner);
  CHECK(none.reason.find("takes 80 us: Surface") != std::string::npos);
  CHECK(decide({choose({point(80, 2)}, 50)}, 50).reason.find("at any cost") != std::string::npos);
}

TEST_CASE("arguments") {
  CHECK(parse({}).budget() == 50);
  CHECK(parse({"--rate", "1000"}).budget() == 500);
  CHECK(parse({"--budget", "12.5"}).budget() == 12.5);
  CHECK(parse({"--burr-diameter", "3"}).tip_radius == trephine::test::near(0.0015));
  CHECK(parse({"--shaft-diameter", "1.6"}).shaft_radius == trephine::test::near(0.0008));
  CHECK(parse({"--tool", "pear-2.3", "--device", "Premium 1.5 6DOF"}).tool == "pear-2.3");
  CHECK(parse({"--isovalue", "-200"}).isovalue == -200);
  CHECK(parse({"--algorithm", "surface"}).algorithms == std::vector{Algorithm::kSurface});
  CHECK(parse({"--algorithm", "coupled"}).algorithms == std::vector{Algorithm::kCoupled});
  CHECK(parse({"--algorithm", "all"}).algorithms.size() == 3);
  CHECK(parse({"--force-error", "2"}).limits.force == near(0.02));
  for (const auto& wrong : std::vector<std::vector<const char*>>{{"--budget"},
                                                                 {"--budget", "x"},
                                                                 {"--budget", "inf"},
                                                                 {"--rate", "0"},
                                                                 {"--rate", "1000", "--budget", "5"},
                                                                 {"--burr-diameter", "-1"},
                                                                 {"--tool", "pear"},
                                                                 {"--device", "Omega"},
                                                                 {"--device", "Touch", "--max-force", "3"},
                                                                 {"--tool", "pear-2.3", "--shaft-length", "30"},
                                                                 {"--ct", "a", "--skull", "b"},
                                                                 {"--out", ""},
                                                                 {"stray"}})
    CHECK_THROWS_AS((void)parse(wrong), UsageError);
}
