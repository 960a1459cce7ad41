// SPDX-License-Identifier: MIT
// libspnav itself, talking to a daemon that the test plays on a socket of its own.
#include "spnav_source.hpp"

#include "spacemouse_device.hpp"
#include "spnav_posrot.hpp"

#include <doctest/doctest.h>

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace {

using namespace spacemouse;
using namespace trephine;

/// The daemon's side: a connection, a greeting that is answered with the protocol's first version, packets of eight
/// words. Libspnav finds it by the environment's SPNAV_SOCKET.
class Daemon {
 public:
  Daemon() {
    std::string folder = "/tmp/trephine_spnav_XXXXXX";
    if (mkdtemp(folder.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = folder + "/socket";
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path_.c_str(), sizeof(address.sun_path) - 1);
    listening_ = socket(AF_UNIX, SOCK_STREAM, 0);
    if (bind(listening_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0 ||
        listen(listening_, 1) != 0)
      throw std::runtime_error("no socket at " + path_);
    setenv("SPNAV_SOCKET", path_.c_str(), 1);
    thread_ = std::thread([this] {
      connection_ = accept(listening_, nullptr, nullptr);
      std::int32_t greeting = 0;
      if (read(connection_, &greeting, sizeof(greeting)) == sizeof(greeting)) send_bytes(&greeting, sizeof(greeting));
    });
  }
  ~Daemon() {
    greeted();
    leave();
    close(listening_);
    unlink(path_.c_str());
    rmdir(path_.substr(0, path_.rfind('/')).c_str());
    unsetenv("SPNAV_SOCKET");
  }

  /// To be called once somebody has connected.
  void greeted() {
    if (thread_.joinable()) thread_.join();
  }
  void send_event(const std::array<std::int32_t, 8>& words) { send_bytes(words.data(), sizeof(words)); }
  void motion(int x, int y, int z, int rx, int ry, int rz) { send_event({0, x, y, z, rx, ry, rz, 16}); }
  void button(int number, bool pressed) { send_event({pressed ? 1 : 2, number, 0, 0, 0, 0, 0, 0}); }
  void leave() {
    if (connection_ >= 0) close(connection_);
    connection_ = -1;
  }

 private:
  void send_bytes(const void* bytes, std::size_t size) {
    if (send(connection_, bytes, size, MSG_NOSIGNAL) != static_cast<ssize_t>(size)) failed_ = true;
  }

  std::string path_;
  int listening_ = -1;
  int connection_ = -1;
  bool failed_ = false;
  std::thread thread_;
};

}  // namespace

TEST_CASE("libspnav: events come through, and a daemon that leaves is noticed") {
  Daemon daemon;
  SpnavSource source;
  daemon.greeted();
  CHECK(source.next().kind == Event::kNone);
  daemon.motion(1, -2, 3, -4, 5, -6);
  daemon.button(1, true);
  daemon.button(1, false);
  const Event moved = source.next();
  CHECK(moved.kind == Event::kMotion);
  CHECK(moved.deflection.x == 1);
  CHECK(moved.deflection.y == -2);
  CHECK(moved.deflection.z == 3);
  CHECK(moved.deflection.rx == -4);
  CHECK(moved.deflection.ry == 5);
  CHECK(moved.deflection.rz == -6);
  const Event pressed = source.next();
  CHECK(pressed.kind == Event::kButton);
  CHECK(pressed.button == 1);
  CHECK(pressed.pressed);
  CHECK_FALSE(source.next().pressed);
  CHECK(source.next().kind == Event::kNone);
  daemon.leave();
  CHECK(source.next().kind == Event::kLost);
  CHECK(source.next().kind == Event::kLost);
}

TEST_CASE("libspnav: a device that is unplugged lets go of the cap") {
  Daemon daemon;
  SpnavSource source;
  daemon.greeted();
  spacemouse::Device mouse(source, {});
  DeviceState state;
  daemon.motion(350, 0, 0, 0, 0, 0);
  CHECK(mouse.read_after(0, state) == DeviceStatus::kOk);
  CHECK(mouse.read_after(0.01, state) == DeviceStatus::kOk);
  const double there = state.X_DH.translation().x();
  CHECK(there > 0);
  daemon.send_event({3, 1, 0, 0, 0, 0, 0, 0});  // a device was removed
  CHECK(mouse.read_after(0, state) == DeviceStatus::kOk);
  CHECK(mouse.read_after(0.1, state) == DeviceStatus::kOk);
  CHECK(state.X_DH.translation().x() == there);
}

TEST_CASE("libspnav: poses agree with the library's own helper for moving objects") {
  RateIntegrator ours({.speed = 1.0, .turn = 1.0, .full = 1000, .dead = 0});
  std::vector<Deflection> events;
  for (int i = 0; i < 60; ++i) {
    events.push_back({3 * i - 40, 70 - i, 2 * i, 90 - 4 * i, 3 * i, 20 + i});
    ours.deflect(events.back());
    ours.advance(1.0);
  }
  const spacemouse::test::PosRot theirs = spacemouse::test::moved_by_libspnav(events);
  constexpr double kSinglePrecision = 1e-6;  // 60 products of floats
  const Quatd q(ours.pose().linear());
  const Quatd p(theirs.quaternion[3], theirs.quaternion[0], theirs.quaternion[1], theirs.quaternion[2]);
  CHECK(q.angularDistance(p) < kSinglePrecision);
  CHECK(rotation_vector<double>(ours.pose().linear()).norm() > 1);
  CHECK((ours.pose().translation() - Vec3d(theirs.position.data())).norm() < kSinglePrecision);
}

TEST_CASE("libspnav: no daemon is an error that says what to do") {
  setenv("SPNAV_SOCKET", "/nonexistent/socket", 1);
  if (access("/var/run/spnav.sock", F_OK) != 0)
    CHECK_THROWS_WITH_AS(SpnavSource(), doctest::Contains("start spacenavd"), std::runtime_error);
  unsetenv("SPNAV_SOCKET");
}
