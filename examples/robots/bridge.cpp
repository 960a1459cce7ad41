// SPDX-License-Identifier: MIT
// Drills a block of bone with a robot that a hand moves: reports come as JSON over UDP, and commands go back. A barrier
// keeps the tool from a nerve in the bone.
#include "../devices/arguments.hpp"
#include "udp_bridge.hpp"
#include "udp_robot.hpp"

#include <boost/asio/signal_set.hpp>

#include <atomic>
#include <cmath>
#include <cstdio>
#include <exception>
#include <future>
#include <string>

namespace {

using namespace robots;

using devices::UsageError;
constexpr auto number = devices::Arguments::checked;

struct Arguments {
  asio::ip::address_v4 address = asio::ip::address_v4::loopback();
  std::uint16_t port = 5520;
  double seconds = 0;   // 0: until Ctrl-C
  double simulate = 0;  // [s]
  bool help = false;
};

constexpr const char* kUsage =
    "usage: robot_bridge [options]\n"
    "Takes a robot's reports as JSON over UDP and answers each with a command.\n\n"
    "  --address A    IPv4 address to listen at (127.0.0.1: this machine alone)\n"
    "  --port P       UDP port, 0 to 65535; 0 takes a free one (5520)\n"
    "  --seconds S    end by itself (run until Ctrl-C)\n"
    "  --simulate S   a simulated robot drills for S seconds, 0.5 to 86400\n"
    "  --help         this text\n";

Arguments parse_arguments(int argc, const char* const* argv) {
  Arguments out;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (name == "--help") {
      out.help = true;
      return out;
    }
    if (name != "--address" && name != "--port" && name != "--seconds" && name != "--simulate")
      throw UsageError("unknown option '" + name + "'; --help lists what there is");
    if (++i == argc) throw UsageError(name + " needs a value");
    const std::string value = argv[i];
    if (name == "--address") {
      boost::system::error_code error;
      out.address = asio::ip::make_address_v4(value, error);
      if (error) throw UsageError("--address: '" + value + "' is no IPv4 address");
    }
    if (name == "--port") {
      const double port = number(name, value, 0, 65535);
      if (port != std::floor(port)) throw UsageError("--port: '" + value + "' is not a whole number");
      out.port = static_cast<std::uint16_t>(port);
    }
    if (name == "--seconds") out.seconds = number(name, value, 0.1, 86400);
    if (name == "--simulate") out.simulate = number(name, value, 0.5, 86400);
  }
  if (out.simulate > 0 && !out.address.is_loopback()) throw UsageError("--simulate is for a loopback address");
  return out;
}

/// A robot whose hand leads the tool by a spring through the nerve and back; returns once `seconds` are over.
void simulate(const udp::endpoint& bridge, double seconds, const std::atomic<bool>& ends) {
  UdpRobot robot(bridge, DrillCell::start());
  for (int tick = 0; tick < seconds * 1000 && !ends.load(); ++tick) {
    const double t = 1e-3 * tick;
    const Vec3d wanted(12e-3 + 2e-3 * std::sin(t), 12e-3 + 3e-3 * std::sin(0.7 * t), 15e-3 + 7e-3 * std::cos(t));
    const Vec3d pull = 1500 /* N/m */ * (wanted - robot.robot().X_WT().translation());
    robot.step({std::min(1.0, 15 / pull.norm()) * pull, Vec3d::Zero()}, true);
    if (tick % 500 != 499 || !robot.command()) continue;
    const Command& c = *robot.command();
    std::printf("%5.1f s: %-8s %5.2f mm to the nerve%s\n", t, to_string(c.operating_state), 1e3 * c.distance,
                c.limited ? ", held by the barrier" : "");
  }
}

int run(const Arguments& arguments) {
  DrillCell cell;
  BridgeCore core(cell, [](const std::string& line) {
    std::printf("robot_bridge: %s\n", line.c_str());
    std::fflush(stdout);
  });
  asio::io_context context;
  UdpBridge bridge(context, arguments.address, arguments.port, core);
  std::printf("robot_bridge: listens at %s:%u\n", arguments.address.to_string().c_str(), bridge.endpoint().port());
  if (!arguments.address.is_loopback())
    std::printf("robot_bridge: beware, whoever reaches that address can move the tool\n");
  std::fflush(stdout);
  asio::signal_set signals(context, SIGINT, SIGTERM);
  signals.async_wait([&](auto, int) { context.stop(); });
  asio::steady_timer end(context);
  if (arguments.seconds > 0) {
    end.expires_after(
        std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(arguments.seconds)));
    end.async_wait([&](auto) { context.stop(); });
  }
  std::atomic<bool> ends{false};
  std::future<void> robot;  // its destructor waits for the end
  if (arguments.simulate > 0)
    robot = std::async(std::launch::async, [&] {
      simulate(bridge.endpoint(), arguments.simulate, ends);
      context.stop();
    });
  try {
    context.run();
  } catch (...) {
    ends.store(true);
    throw;
  }
  ends.store(true);
  std::printf("robot_bridge: removed %.1f mm3\n", cell.removed_mm3());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const Arguments arguments = parse_arguments(argc, argv);
    if (arguments.help) return std::fputs(kUsage, stdout), 0;
    return run(arguments);
  } catch (const UsageError& error) {
    std::fprintf(stderr, "robot_bridge: %s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "robot_bridge: %s\n", error.what());
    return 1;
  }
}
