// SPDX-License-Identifier: MIT
// The window's parts that need no OpenGL: camera, hand, sessions' files, keys, empty space, undo.
#include "brick_summary.hpp"
#include "heard_drill.hpp"
#include "keys.hpp"
#include "live_options.hpp"
#include "mouse_hand.hpp"
#include "script.hpp"
#include "strokes.hpp"
#include "support/near.hpp"
#include "support/spectrum.hpp"

#include <doctest/doctest.h>
#include <support/random.hpp>

#include <cstdio>
#include <fstream>
#include <map>
#include <numbers>
#include <set>
#include <string>

namespace {

using namespace live;
using trephine::test::near;
using trephine::test::Random;
using trephine::test::Spectrum;
using trephine::test::within;

Vec3d random_point(Random& random, double size) {
  return {random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)};
}

TEST_CASE("orbit camera: the ray through a pixel meets what the pixel shows, and depths are along the view") {
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    OrbitCamera c{.focus_W = random_point(random, 0.1),
                  .yaw = random.uniform(-3, 3),
                  .pitch = random.uniform(-1.5, 1.5),
                  .distance = random.uniform(0.05, 0.5)};
    const Mat3d R = c.axes();
    CHECK((R.transpose() * R - Mat3d::Identity()).norm() < 1.5e-15);
    CHECK(R.determinant() == near(1));
    const double w = 640, h = 480, x = random.uniform(0, w), y = random.uniform(0, h);
    const ViewRay ray = c.ray(x, y, w, h);
    const Vec3d p = ray.origin + 0.2 * ray.direction;
    // Where the pixel's plane at that depth says it is.
    const double m = OrbitCamera::metres_per_pixel(c.depth(p), h);
    const Vec3d expected = c.eye_W() - c.depth(p) * R.col(2) + m * (x - w / 2) * R.col(0) - m * (y - h / 2) * R.col(1);
    CHECK((p - expected).norm() < 2.5e-16);
    CHECK((c.ray(w / 2, h / 2, w, h).direction + R.col(2)).norm() < 6e-16);
    CHECK((c.pixel(p, w, h) - Vec2d(x, y)).norm() < 1e-9);
    OrbitCamera seen = c;
    seen.look_from(R.col(2));
    CHECK((seen.axes() - R).norm() < 3e-15);
  }
}

TEST_CASE("mouse hand: the tip goes under the pixel at its own depth, and pushes along the view up to its lead") {
  Random random(2);
  for (int i = 0; i < 200; ++i) {
    OrbitCamera c{
        .focus_W = random_point(random, 0.02), .yaw = random.uniform(-3, 3), .pitch = random.uniform(-1.4, 1.4)};
    Posed X = Posed::Identity();
    X.translation() = c.focus_W + random_point(random, 0.02);
    MouseHand hand(X);
    const double depth = c.depth(X.translation()), x = random.uniform(0, 640), y = random.uniform(0, 480);
    hand.move_under(c, x, y, 640, 480);
    CHECK(c.depth(hand.pose().translation()) == near(depth));
    const ViewRay ray = c.ray(x, y, 640, 480);
    CHECK((hand.pose().translation() - ray.origin).cross(ray.direction).norm() < 5e-17);
    const Vec3d drill = hand.pose().translation();
    for (int k = 0; k < 40; ++k) hand.push(c, 1e-3, drill);
    CHECK((hand.pose().translation() - drill).norm() == near(MouseHand::kMaxLead));
    CHECK((hand.pose().translation() - c.eye_W()).norm() > (drill - c.eye_W()).norm());
    const Vec3d tip = hand.pose().translation();
    hand.turn(c, 30, -20, 480);
    CHECK(hand.pose().translation() == tip);
  }
}

TEST_CASE("wished hand: it follows at no more than a hand's speed and arrives") {
  trephine::Mailbox<HandWish> inbox;
  const trephine::Registration registration;
  WishedHand hand(inbox, registration, Posed::Identity());
  Posed X = Posed::Identity();
  X.translation() = Vec3d(0.1, 0, 0);
  X.linear() = trephine::rotation_from_vector<double>(Vec3d(0, 0, 1));
  inbox.post({X, true});
  Vec3d before = Vec3d::Zero();
  double fastest = 0;
  for (int i = 1; i <= 1000; ++i) {
    const trephine::HandTarget target = hand(1e-3 * i);
    fastest = std::max(fastest, (target.X_DH.translation() - before).norm() / 1e-3);
    before = target.X_DH.translation();
    CHECK(target.buttons == 1);
  }
  CHECK(fastest <= WishedHand::kFastest * (1 + 1e-9));
  CHECK((before - X.translation()).norm() < 1e-9);
}

TEST_CASE("keys: each has a name, a code, an action and a help of its own") {
  std::set<int> codes;
  std::set<std::string_view> names;
  std::set<Action> actions;
  for (const Key& k : kKeys) {
    codes.insert(k.code);
    names.insert(k.name);
    actions.insert(k.action);
    CHECK(!k.help.empty());
    CHECK(action_of(k.code) == k.action);
    CHECK(action_named(k.name) == k.action);
  }
  CHECK(codes.size() == kKeys.size());
  CHECK(names.size() == kKeys.size());
  CHECK(actions.size() == kKeys.size());
  CHECK(action_of(-7) == Action::kNone);
}

TEST_CASE("sessions: what is written is read back") {
  const std::string path = "written.session";
  Posed X = trephine::make_pose<double>(trephine::rotation_from_vector<double>(Vec3d(0.3, -0.2, 1)),
                                        Vec3d(0.01, -0.02, 0.03));
  const OrbitCamera camera{.focus_W = Vec3d(0.1, 0.2, 0.3), .yaw = 1, .pitch = -0.5, .distance = 0.2};
  {
    std::ofstream file(path);
    EventWriter out(file);
    out.hand(0, X);
    out.view(0, camera);
    out.hand(0.001, Posed::Identity());  // too soon
    out.spindle(0.5, true);
    out.key(0.6, Action::kClip);
    out.protect(0.65, Protection::kVeto);
    out.tool(0.66, "match-head-3");
    out.tool(0.67, "burr");
    out.hand(0.7, X);             // nothing new
    out.key(0.8, Action::kQuit);  // how it ended is no part of it
    out.quit(0.9);
  }
  const std::vector<Event> events = read_events(path);
  std::remove(path.c_str());
  REQUIRE(events.size() == 8);
  CHECK((events[0].pose.matrix() - X.matrix()).norm() < 5e-6);
  CHECK((events[1].camera.focus_W - camera.focus_W).norm() < 1e-6);
  CHECK(events[1].camera.yaw == near(camera.yaw, 1e-5));
  CHECK(events[1].camera.distance == near(camera.distance));
  CHECK(events[2].on);
  CHECK(events[3].action == Action::kClip);
  CHECK(events[4].kind == Event::Kind::kProtect);
  CHECK(events[4].protection == Protection::kVeto);
  CHECK(events[5].kind == Event::Kind::kTool);
  CHECK(events[5].file == "match-head-3");
  CHECK(events[6].file == "burr");
  CHECK(events[7].kind == Event::Kind::kQuit);
}

TEST_CASE("sessions: every command is read with what its help names, and with nothing less") {
  const std::string path = "commands.session";
  const auto reads = [&](const std::string& line) {
    std::ofstream(path) << "1 " << line << "\n";
    try {
      return read_events(path).size() == 1;
    } catch (const std::runtime_error&) {
      return false;
    }
  };
  const std::map<std::string_view, std::string> arguments{{"hand", "1 2 3 1 0 0 0"},
                                                          {"push", "0.5"},
                                                          {"move", "10 20"},
                                                          {"turn", "5 6"},
                                                          {"spindle", "on"},
                                                          {"key", "Escape"},
                                                          {"tool", "match-head-3"},
                                                          {"protect", "veto"},
                                                          {"view", "1 2 3 4 5 100"},
                                                          {"orbit", "20"},
                                                          {"size", "640 480"},
                                                          {"shot", "a.png"},
                                                          {"log", ""},
                                                          {"quit", ""}};
  CHECK(arguments.size() == commands().size());
  std::set<Event::Kind> kinds;
  for (const Command& c : commands()) {
    CAPTURE(c.word);
    REQUIRE(arguments.count(c.word) == 1);
    const std::string word(c.word), given = arguments.at(c.word);
    CHECK(reads(word + " " + given));
    CHECK(c.arguments.empty() == given.empty());
    if (!given.empty()) CHECK(!reads(word));
    CHECK(!c.help.empty());
    kinds.insert(c.kind);
  }
  CHECK(kinds.size() == commands().size());
  std::remove(path.c_str());
}

TEST_CASE("sessions: what ended a recording ends a script, and gives a replay to the hand") {
  for (const char* end : {"key Escape", "quit"}) {
    CAPTURE(end);
    const std::string path = "ended.session";
    std::ofstream(path) << "0 spindle on\n1 " << end << "\n2 spindle off\n";
    for (const Playback::End whose : {Playback::End::kProgram, Playback::End::kHand}) {
      Playback playback(read_events(path), whose);
      int done = 0;
      const auto count = [&](const Event&) { ++done; };
      CHECK(playback.play(0.5, count));
      CHECK(!playback.is_over());
      CHECK(playback.play(1.5, count) == (whose == Playback::End::kHand));
      CHECK(playback.is_over());
      CHECK(playback.play(9, count) == (whose == Playback::End::kHand));
      CHECK(done == 1);
    }
    std::remove(path.c_str());
  }
  Playback nothing({}, Playback::End::kHand);
  CHECK(nothing.is_over());
  CHECK(nothing.play(0, [](const Event&) {}));
}

TEST_CASE("sessions: a wrong line is refused with its number") {
  const std::string path = "wrong_line.session";
  for (const char* line : {"hand 1 2 3 1 0 0 0",
                           "1 hand 1 2 3 1 0 0",
                           "1 hand 1 2 3 9 0 0 0",
                           "1 key Nothing",
                           "1 spindle maybe",
                           "1 view 0 0 0 0 99 100",
                           "1 fly",
                           "nan quit",
                           "1 quit now",
                           "1 size 1 1",
                           "1 push nan",
                           "1 push 1e9",
                           "1 move inf 2",
                           "1 turn 1 -inf",
                           "1 view 0 0 0 nan 0 100",
                           "1 shot",
                           "1 orbit fast",
                           "1 protect maybe",
                           "1 protect",
                           "1 tool",
                           "1 tool nail-3"}) {
    CAPTURE(line);
    std::ofstream(path) << "# a comment\n\n0 spindle on\n" << line << "\n";
    std::string message;
    try {
      (void)read_events(path);
    } catch (const std::runtime_error& e) {
      message = e.what();
    }
    CHECK(message.find("line 4") != std::string::npos);
  }
  std::remove(path.c_str());
  CHECK_THROWS_AS((void)read_events("/nowhere"), std::runtime_error);
}

TEST_CASE("empty space: distances are Chebyshev's, as brute force finds them, and never too long after cuts") {
  Random random(3);
  for (int round = 0; round < 20; ++round) {
    const std::array<int, 3> n{1 + static_cast<int>(random.uniform(0, 9)), 1 + static_cast<int>(random.uniform(0, 9)),
                               1 + static_cast<int>(random.uniform(0, 9))};
    std::vector<std::uint8_t> holds(static_cast<std::size_t>(n[0] * n[1] * n[2]));
    for (auto& h : holds) h = random.uniform(0, 1) < 0.03 ? 1 : 0;
    const auto brute = [&](std::size_t at) {
      const auto place = [&](std::size_t b) {
        const int i = static_cast<int>(b);
        return std::array<int, 3>{i % n[0], i / n[0] % n[1], i / n[0] / n[1]};
      };
      int best = EmptySpace::kFarthest;
      for (std::size_t b = 0; b < holds.size(); ++b) {
        if (holds[b] == 0) continue;
        int d = 0;
        for (std::size_t a = 0; a < 3; ++a) d = std::max(d, std::abs(place(at)[a] - place(b)[a]));
        best = std::min(best, d);
      }
      return best;
    };
    EmptySpace space(n, holds);
    for (std::size_t b = 0; b < holds.size(); ++b) CHECK(space.distances()[b] == brute(b));
    for (std::size_t b = 0; b < holds.size(); ++b)
      if (holds[b] != 0 && random.uniform(0, 1) < 0.5) {
        holds[b] = 0;
        CHECK(space.set(b, false) >= 1);
      }
    for (std::size_t b = 0; b < holds.size(); ++b) CHECK(space.distances()[b] <= brute(b));
  }
}

TEST_CASE("shares of bone: cells' means, at three sizes") {
  Random random(4);
  std::array<std::int16_t, 1000> haloed{};
  for (auto& v : haloed) v = static_cast<std::int16_t>(random.uniform(-1000, 2000));
  const BrickShares s = shares_of(haloed, 300, 400);
  const auto share = [&](std::size_t i, std::size_t j, std::size_t k) {
    return std::clamp((haloed[((k + 1) * 10 + j + 1) * 10 + i + 1] - 300.0) / 400 + 0.5, 0.0, 1.0);
  };
  double all = 0;
  for (std::size_t k = 0; k < 8; ++k)
    for (std::size_t j = 0; j < 8; ++j)
      for (std::size_t i = 0; i < 8; ++i) all += share(i, j, k);
  CHECK(s.of_8 == within(255 * all / 512, 0.5));  // a byte
  double corner = 0;
  for (std::size_t c = 0; c < 8; ++c) corner += share(6 + c % 2, 4 + c / 2 % 2, 2 + c / 4);
  CHECK(s.of_2[(1 * 4 + 2) * 4 + 3] == within(255 * corner / 8, 0.5));
}

TEST_CASE("undo: the bone is what it was before the stroke, bit for bit, and whole after all strokes") {
  Random random(5);
  const std::array<int, 3> n{29, 22, 19};  // no whole bricks
  std::vector<std::int16_t> voxels(static_cast<std::size_t>(n[0] * n[1] * n[2]));
  for (auto& v : voxels) v = static_cast<std::int16_t>(random.uniform(0, 2000));
  drill::Grid grid({.size = n, .spacing = Vec3d::Constant(1e-3)}, std::span<const std::int16_t>(voxels));
  Reader reader(grid, false);
  Strokes strokes;
  std::array<std::int16_t, 1000> haloed{};
  const auto follow = [&] {
    reader.poll([&](std::size_t b) {
      reader.copy_brick(b, haloed);
      strokes.changed(b, haloed);
    });
  };
  std::vector<std::vector<std::int16_t>> states;
  for (int stroke = 0; stroke < 6; ++stroke) {
    follow();
    strokes.begin(stroke);
    states.emplace_back(voxels.size());
    grid.copy_voxels(states.back());
    for (int cut = 0; cut < 4; ++cut) {
      const int j = static_cast<int>(random.uniform(0, n[1])), k = static_cast<int>(random.uniform(0, n[2])),
                x = static_cast<int>(random.uniform(0, n[0] - 6));
      grid.lower_row(j, k, x, x + 5, [](int, std::int16_t old) { return static_cast<std::int16_t>(old / 2); });
      grid.commit();
    }
  }
  std::vector<std::int16_t> now(voxels.size());
  while (!strokes.empty()) {
    follow();
    const PastBone past = strokes.take_last();
    set_bone(grid, past.bricks);
    CHECK(past.removed_mm3 == static_cast<double>(states.size()) - 1);
    grid.copy_voxels(now);
    CHECK(now == states.back());
    states.pop_back();
  }
  CHECK(now == voxels);
}

TEST_CASE("motor: it drives the law of cutting, and the slider sets its speed") {
  DrillSettings drill{.law = true};
  const trephine::CuttingForce::Options without = drill.cutting();
  drill.motor = trephine::motor_by_name("air-turbine");
  CHECK(without.stall_torque > drill.motor->stall_torque);
  CHECK(drill.cutting().stall_torque == drill.motor->stall_torque);
  CHECK(drill.cutting().speed == drill.motor->speed);
  CHECK(drill.cutting().force_scale == without.force_scale);
  drill.tuning.turns = 3000;
  CHECK(drill.cutting().speed == trephine::rpm(3000));
}

double loudness(const std::vector<float>& samples) {
  double sum = 0;
  for (const float s : samples) sum += static_cast<double>(s) * static_cast<double>(s);
  return std::sqrt(sum / static_cast<double>(samples.size()));
}

/// A drill and the sound of it: buffers of 5 ms, after five ticks each.
class Listener {
 public:
  static constexpr double kRate = 44100, kDt = 1e-3;

  std::vector<float> hear(double seconds, bool spindle_on, double force = 0, double removal_mm3_s = 0) {
    std::vector<float> all, piece(220);
    for (double t = 0; t < seconds; t += 5 * kDt) {
      for (int i = 0; i < 5; ++i) box_.post(state_ = drill_.after(spindle_on, force, kDt * removal_mm3_s, kDt));
      sound_.fill(piece, kRate);
      all.insert(all.end(), piece.begin(), piece.end());
    }
    return all;
  }
  /// Of the teeth [Hz].
  [[nodiscard]] double pitch() const { return state_.spindle * state_.teeth / (2 * std::numbers::pi); }

 private:
  HeardDrill drill_;
  trephine::Mailbox<trephine::CuttingSoundState> box_;
  trephine::CuttingSound sound_{HeardDrill::kOptions, box_};
  trephine::CuttingSoundState state_;
};

/// The loudest of the lines about a pitch [Hz].
double strongest_line(const std::vector<float>& samples, double around) {
  const Spectrum heard(std::vector<double>(samples.begin(), samples.end()));
  double best = 0, most = 0;
  for (double f = 0.8 * around; f < 1.2 * around; f += 1)
    if (const double a = heard.at(f / Listener::kRate); a > most) most = a, best = f;
  return best;
}

TEST_CASE("heard drill: silent at rest, a pitch that sinks under load within 20 ms, louder in bone, no clicks") {
  Listener listener;
  CHECK(loudness(listener.hear(0.2, false)) == 0);
  static_cast<void>(listener.hear(1, true));
  const std::vector<float> spinning = listener.hear(0.4, true);
  CHECK(listener.pitch() == near(HeardDrill::kIdlePitch, 0.01));
  CHECK(strongest_line(spinning, HeardDrill::kIdlePitch) == near(HeardDrill::kIdlePitch, 0.02));
  const double free = loudness(spinning);
  CHECK(free > 0.05);
  static_cast<void>(listener.hear(0.02, true, 4));
  CHECK(listener.pitch() < 0.88 * HeardDrill::kIdlePitch);
  const double pressed = loudness(listener.hear(0.4, true, 4));
  CHECK(pressed > 1.3 * free);
  // Denser bone gives less at the same force, and is quieter.
  const double in_dense = loudness(listener.hear(0.4, true, 4, 2)), in_soft = loudness(listener.hear(0.4, true, 4, 10));
  CHECK(in_dense > 1.05 * pressed);
  CHECK(in_soft > 1.3 * in_dense);
  const std::vector<float> loudest = listener.hear(0.4, true, 8, 40);
  float steepest = 0, most = 0;
  for (std::size_t i = 1; i < loudest.size(); ++i) {
    steepest = std::max(steepest, std::abs(loudest[i] - loudest[i - 1]));
    most = std::max(most, std::abs(loudest[i]));
  }
  CHECK(steepest < 0.25F);
  CHECK(most < 1);
  static_cast<void>(listener.hear(1, false));
  CHECK(loudness(listener.hear(0.2, false)) == 0);
}

}  // namespace
