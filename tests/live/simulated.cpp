// SPDX-License-Identifier: MIT
// Sessions in simulated time end as tests/web/sessions.csv says. The page in a browser is held to the same file, so
// that both do the same.
#include "loaded.hpp"
#include "script.hpp"
#include "simulate.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <fstream>
#include <iomanip>
#include <sstream>
#include <string>

namespace {

using namespace live;

Loaded bone_named(const std::string& name) {
  drill::Options options;
  if (name == "temporal") options.phantom = drill::Phantom::kTemporalBone;
  Loaded loaded = made(options);
  if (name == "temporal")
    loaded.guarded = guard_temporal_bone(loaded.bone, LiveOptions{}.margin, [](double /*share*/) {});
  return loaded;
}

TEST_CASE("sessions in simulated time end as the file that the page is held to says") {
  std::ifstream file(TREPHINE_WEB_SESSIONS);
  std::string line;
  REQUIRE(std::getline(file, line));
  int rows = 0;
  while (std::getline(file, line)) {
    for (char& c : line)
      if (c == ',') c = ' ';
    std::istringstream in(line);
    std::string session, bone;
    double removed = 0, ticks = 0;
    Vec3d force;
    REQUIRE((in >> session >> bone >> removed >> force[0] >> force[1] >> force[2] >> ticks));
    CAPTURE(session);
    const Simulated end =
        simulate(bone_named(bone), LiveOptions{}, read_events(std::string(TREPHINE_PROJECT) + "/" + session));
    INFO("now " << std::setprecision(12) << end.removed_mm3 << "," << end.force.x() << "," << end.force.y() << ","
                << end.force.z() << "," << end.ticks);
    // Compilers round differently, and each cut follows the one before.
    CHECK(std::abs(end.removed_mm3 - removed) <= 1e-6 * removed);
    CHECK((end.force - force).norm() <= 1e-5 * force.norm() + 1e-9);
    CHECK(static_cast<double>(end.ticks) == ticks);
    ++rows;
  }
  CHECK(rows >= 3);
}

TEST_CASE("a second hand leans its tube on the bone beside the drill, and the drill's session is the same to the bit") {
  const std::string session = std::string(TREPHINE_PROJECT) + "/examples/live/pecking.session";
  LiveOptions options;
  const Simulated alone = simulate(bone_named("tooth"), options, read_events(session));
  options.second_hand = true;
  const Simulated both = simulate(bone_named("tooth"), options, read_events(session));
  CHECK(alone.removed_mm3 > 0);
  CHECK(both.removed_mm3 == alone.removed_mm3);  // the tube cuts nothing
  CHECK(both.force == alone.force);
  CHECK(both.ticks == alone.ticks);
  CHECK(alone.most_second_N == 0);
  CHECK(both.most_second_N > 0.1);
  CHECK(both.most_second_N < kMaxForce);
}

}  // namespace
