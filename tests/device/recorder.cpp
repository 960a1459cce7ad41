// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <trephine/core/rotation.hpp>
#include <trephine/device/replay.hpp>
#include <trephine/device/servo_loop.hpp>
#include <trephine/device/simulated_device.hpp>
#include <trephine/session/recorder.hpp>
#include <trephine/session/recording_file.hpp>

#include "device/archetypes.hpp"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

namespace {

using namespace trephine;
using namespace std::chrono_literals;

/// A hand that pushes through the floor and turns, with the spindle on for a while.
HandTarget pressing(double t) {
  return {make_pose<double>(rotation_from_vector<double>(Vec3d(0.2 * std::sin(7 * t), 0.1 * t, 0)),
                            Vec3d(0.01 * t, 0, 0.002 * std::cos(6 * t) - 0.001)),
          t > 0.1 ? 1u : 0u};
}

Recorder session(std::size_t capacity, double seconds) {
  SimulatedDevice device(SimulatedDeviceOptions{}, pressing);
  test::FloorScene scene;
  Recorder recorder(capacity);
  ServoLoop(device, scene, Registration{}, ServoOptions{}, NoPacing{})
      .run_for(std::chrono::duration<double>(seconds), recorder);
  return recorder;
}

/// A file in the temporary directory, gone with the test.
struct ScratchFile {
  std::string path;
  explicit ScratchFile(const char* name) : path((std::filesystem::temp_directory_path() / name).string()) {}
  ~ScratchFile() { std::remove(path.c_str()); }

  [[nodiscard]] std::string bytes() const {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }
  void write(const std::string& b) const {
    std::ofstream out(path, std::ios::binary | std::ios::trunc);
    out.write(b.data(), static_cast<std::streamsize>(b.size()));
  }
  [[nodiscard]] std::string complaint() const {
    try {
      (void)load_recording(path);
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "none";
  }
};

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST_CASE("recorder: keeps the first ticks, and says when it is full") {
  Recorder recorder(3);
  CHECK(recorder.size() == 0);
  TickResult result;
  for (int i = 0; i < 5; ++i) {
    result.contact.count = i;
    CHECK(recorder.record({}, 1e-3, result) == (i < 3 ? RecordStatus::kOk : RecordStatus::kFull));
  }
  CHECK(recorder.full());
  CHECK(recorder.dropped() == 2);
  REQUIRE(recorder.ticks().size() == 3);
  CHECK(recorder.ticks()[2].result.contact.count == 2);
  recorder.clear();
  CHECK(recorder.size() == 0);
  CHECK(recorder.dropped() == 0);
  CHECK(recorder.capacity() == 3);
  CHECK_THROWS_AS(Recorder(0), std::invalid_argument);
}

TEST_CASE("replay: every output bit for bit") {
  const Recorder recorder = session(1000, 0.5);
  REQUIRE(recorder.size() == 500);
  double most = 0, removed = 0;
  for (const RecordedTick& tick : recorder.ticks()) {
    most = std::max(most, tick.result.wrench.force.norm());
    removed += tick.result.removed_mm3;
  }
  REQUIRE(most > 0.1);  // it has touched something
  REQUIRE(removed > 0);
  test::FloorScene scene;
  const ReplayReport report = replay(recorder.ticks(), scene);
  CHECK(report.ticks == 500);
  CHECK(report.identical());
  CHECK_FALSE(report.first_different);
}

TEST_CASE("replay: two sessions have the same bits") {
  const Recorder a = session(400, 0.4), b = session(400, 0.4);
  REQUIRE(a.size() == b.size());
  std::size_t same = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    same += same_bits(a.ticks()[i].result, b.ticks()[i].result) &&
            same_bits(a.ticks()[i].input.X_WT.translation(), b.ticks()[i].input.X_WT.translation());
  CHECK(same == a.size());
}

TEST_CASE("replay: finds the one bit that differs, wherever it is") {
  Recorder recorder = session(400, 0.4);
  std::vector<RecordedTick> ticks(recorder.ticks().begin(), recorder.ticks().end());
  const auto flip = [](double& x) {
    std::uint64_t bits;
    std::memcpy(&bits, &x, 8);
    bits ^= 1;
    std::memcpy(&x, &bits, 8);
  };
  const auto found_after = [&](auto&& change) {
    std::vector<RecordedTick> changed = ticks;
    change(changed[237].result);
    test::FloorScene scene;
    const ReplayReport report = replay(changed, scene);
    CHECK(report.different == 1);
    CHECK(report.first_different == std::optional<std::uint64_t>(237));
    return report;
  };
  for (int i = 0; i < 3; ++i) {
    found_after([&](TickResult& r) { flip(r.wrench.force[i]); });
    found_after([&](TickResult& r) { flip(r.wrench.torque[i]); });
  }
  found_after([&](TickResult& r) { flip(r.contact.depth); });
  found_after([&](TickResult& r) { flip(r.removed_mm3); });
  found_after([](TickResult& r) { r.status = Status::kJump; });
  found_after([](TickResult& r) { ++r.contact.count; });
  found_after([](TickResult& r) { r.contact.tip = !r.contact.tip; });
  found_after([](TickResult& r) { r.contact.shaft = !r.contact.shaft; });
  for (int i = 0; i < 3; ++i) {
    found_after([&](TickResult& r) { flip(r.structures.push.force[i]); });
    found_after([&](TickResult& r) { flip(r.structures.push.torque[i]); });
  }
  found_after([&](TickResult& r) { flip(r.structures.distance); });
  found_after([&](TickResult& r) { flip(r.structures.refused_mm3); });
  found_after([&](TickResult& r) { flip(r.structures.taken_mm3); });
  found_after([](TickResult& r) { ++r.structures.nearest; });
  found_after([](TickResult& r) { r.structures.warns = !r.structures.warns; });
  for (double CuttingSummary::*const number :
       {&CuttingSummary::thrust, &CuttingSummary::torque, &CuttingSummary::spindle, &CuttingSummary::feed})
    found_after([&](TickResult& r) { flip(r.cutting.*number); });
  const ReplayReport report = found_after([](TickResult& r) { r.wrench.force.x() = -0.0; });
  CHECK(std::signbit(report.recorded.force.x()));
  CHECK_FALSE(std::signbit(report.wrench.force.x()));

  test::FloorScene softer;
  softer.k = 499;
  CHECK(replay(recorder.ticks(), softer).different > 10);
}

TEST_CASE("recording file: gives back every bit, and replays") {
  Recorder recorder = session(300, 0.3);
  RecordedTick odd;
  odd.input.X_WT.linear()(1, 2) = std::numeric_limits<double>::quiet_NaN();
  odd.input.X_WT.translation().x() = -0.0;
  odd.input.spindle_on = true;
  odd.dt = std::numeric_limits<double>::denorm_min();
  odd.result.wrench.torque.z() = -std::numeric_limits<double>::infinity();
  odd.result.contact = {.count = -7, .tip = true, .shaft = true, .depth = 1e-300};
  odd.result.removed_mm3 = 0.25;
  odd.result.status = Status::kNonFinite;
  odd.result.structures = {.nearest = 7,
                           .distance = -0.0,
                           .push = {Vec3d(1, std::numeric_limits<double>::quiet_NaN(), 3), Vec3d(4, 5, 6)},
                           .refused_mm3 = 0.125,
                           .taken_mm3 = 1e-300,
                           .warns = true};
  odd.result.cutting = {
      .thrust = 180, .torque = -0.0, .spindle = std::numeric_limits<double>::quiet_NaN(), .feed = 1e-300};
  std::vector<RecordedTick> ticks(recorder.ticks().begin(), recorder.ticks().end());
  ticks.push_back(odd);

  const ScratchFile file("trephine_recorder_test.bin");
  save_recording(file.path, ticks);
  const std::vector<RecordedTick> back = load_recording(file.path);
  REQUIRE(back.size() == ticks.size());
  std::size_t same = 0;
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    bool equal = same_bits(ticks[i].result, back[i].result) && same_bits(ticks[i].dt, back[i].dt) &&
                 ticks[i].input.spindle_on == back[i].input.spindle_on;
    for (int e = 0; e < 16; ++e)
      equal = equal && same_bits(ticks[i].input.X_WT.matrix()(e), back[i].input.X_WT.matrix()(e));
    same += equal;
  }
  CHECK(same == ticks.size());
  test::FloorScene scene;
  CHECK(replay(std::span(back).first(300), scene).identical());

  save_recording(file.path, {});
  CHECK(load_recording(file.path).empty());
}

TEST_CASE("recording file: any path of the file system serves, and is told") {
  const std::filesystem::path folder = std::filesystem::temp_directory_path();
  const std::filesystem::path path = folder / std::filesystem::path(u8"trephine_Schädel_骨.bin");
  save_recording(path, session(10, 0.01).ticks());
  CHECK(load_recording(path).size() == 10);
  std::filesystem::remove(path);
  std::string message;
  try {
    (void)load_recording(path);
  } catch (const std::runtime_error& e) {
    message = e.what();
  }
  CHECK(message.find("Sch\xc3\xa4"
                     "del") != std::string::npos);
}

TEST_CASE("recording file: files of older versions still load, without what they lack") {
  // Two ticks as each version wrote them: 176 and 256 bytes each, 288 now.
  std::vector<RecordedTick> ticks = {session(20, 0.02).ticks()[7], session(20, 0.02).ticks()[8]};
  for (RecordedTick& tick : ticks) {
    tick.result.structures.distance = 1e-3;
    tick.result.cutting = {.thrust = 3, .torque = 4e-3, .spindle = 100, .feed = 1e-3};
  }
  for (const int version : {1, 2}) {
    CAPTURE(version);
    const ScratchFile file("trephine_recorder_older_version.bin");
    save_recording(file.path, ticks);
    const std::string now = file.bytes();
    REQUIRE(now.size() == 32 + 2 * 288 + 8);
    const std::size_t bytes = version == 1 ? 176 : 256;
    std::string old = now.substr(0, 32) + now.substr(32, bytes) + now.substr(32 + 288, bytes);
    old[12] = static_cast<char>(version);
    old[16] = static_cast<char>(bytes & 255);
    old[17] = static_cast<char>(bytes >> 8);
    append_number(old, recording_detail::fnv1a(old));
    file.write(old);
    const std::vector<RecordedTick> back = load_recording(file.path);
    REQUIRE(back.size() == 2);
    for (std::size_t i = 0; i < 2; ++i) {
      TickResult expected = ticks[i].result;
      expected.cutting = {};
      if (version == 1) expected.structures = {};
      CHECK(same_bits(back[i].result, expected));
      CHECK(back[i].input.X_WT.matrix() == ticks[i].input.X_WT.matrix());
    }
    // Either version with the other's ticks is refused.
    old[12] = 3;
    file.write(old);
    CHECK(contains(file.complaint(), std::to_string(bytes) + " bytes a tick"));
    std::string other = now;
    other[12] = static_cast<char>(version);
    file.write(other);
    CHECK(contains(file.complaint(), "288 bytes a tick"));
  }
}

TEST_CASE("recording file: refuses what is cut, altered, foreign or missing, and says why") {
  const ScratchFile file("trephine_recorder_refused.bin");
  CHECK(contains(file.complaint(), "cannot be opened"));
  CHECK(contains(file.complaint(), file.path));
  save_recording(file.path, session(20, 0.02).ticks());
  const std::string good = file.bytes();
  REQUIRE(file.complaint() == "none");

  for (const std::size_t keep : {std::size_t{0}, std::size_t{7}, std::size_t{39}}) {
    file.write(good.substr(0, keep));
    CHECK(contains(file.complaint(), "too short"));
  }
  for (const std::size_t cut : {std::size_t{1}, std::size_t{8}, std::size_t{289}, good.size() - 40}) {
    file.write(good.substr(0, good.size() - cut));
    CHECK(contains(file.complaint(), "cut short"));
  }
  file.write(good + std::string(288, '\0'));
  CHECK(contains(file.complaint(), "has 20 ticks"));
  file.write("PNG" + good.substr(3));
  CHECK(contains(file.complaint(), "not a trephine recording"));
  std::string other = good;
  std::swap(other[8], other[11]);
  std::swap(other[9], other[10]);
  file.write(other);
  CHECK(contains(file.complaint(), "other byte order"));
  other = good;
  for (const int version : {0, 4}) {
    other[12] = static_cast<char>(version);
    file.write(other);
    CHECK(contains(file.complaint(), "version " + std::to_string(version) + ", this reads 1 to 3"));
  }
  other = good;
  other[16] = 8;
  file.write(other);
  CHECK(contains(file.complaint(), "bytes a tick"));
  // A count that would need all memory must not get it.
  other = good;
  for (std::size_t i = 24; i < 32; ++i) other[i] = '\xff';
  file.write(other);
  CHECK(contains(file.complaint(), "has 18446744073709551615 ticks"));
  // Any single altered byte is found.
  int missed = 0;
  for (std::size_t i = 0; i < good.size(); i += 13) {
    other = good;
    other[i] = static_cast<char>(other[i] ^ 0x10);
    file.write(other);
    missed += file.complaint() == "none";
  }
  CHECK(missed == 0);
  CHECK_THROWS_AS(save_recording("/nonexistent-folder/recording", {}), std::runtime_error);
}

}  // namespace
