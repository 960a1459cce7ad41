// SPDX-License-Identifier: MIT
// A loopback service that speaks the Inverse Service's protocol, with a simulated arm in a simulated hand. Not
// affiliated with Haply.
#include "../devices/arguments.hpp"
#include "service.hpp"

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <string>
#include <thread>

namespace {

using namespace haply;
using devices::Arguments, devices::UsageError;

std::atomic<bool> interrupted{false};
void on_interrupt(int) { interrupted.store(true); }

constexpr const char* kUsage =
    "usage: haply_service [options]\n"
    "Serves a simulated Inverse3 and VerseGrip on this machine, as the Haply Inverse Service does, to test clients\n"
    "without hardware (this program is not affiliated with Haply).\n\n"
    "  --port P              the simulation channel's port, 0 for any that is free (10001)\n"
    "  --address A           a numeric address other than the loopback one; others can then send forces (127.0.0.1)\n"
    "  --rate HZ             states a second at most, 200 for a slow service (as fast as they are asked for)\n"
    "  --fault NAME[@S]      a fault, S seconds after the client's first message (1); see --list-faults\n"
    "  --fault-seconds S     how long the fault lasts (0.3)\n"
    "  --older               speaks as versions 3.1 to 3.4 do, not as 3.5\n"
    "  --no-handle           there is no VerseGrip\n"
    "  --still               the hand keeps its place, instead of down and up by 20 mm every 8 s\n"
    "  --seconds S           end by itself (run until Ctrl-C)\n"
    "  --list-faults, --version, --help\n";

const FaultText& fault_by_name(const std::string& name) {
  for (const FaultText& f : kFaults)
    if (name == f.name) return f;
  throw UsageError("--fault: '" + name + "' is no fault; --list-faults lists them");
}

void run(const ServiceOptions& options, double seconds) {
  using Clock = std::chrono::steady_clock;
  const Service service(options);
  std::printf("haply_service %s: a simulated Inverse3 at ws://%s:%u, %s\n", kServiceVersion, options.address.c_str(),
              static_cast<unsigned>(service.port()), options.older ? "as versions 3.1 to 3.4" : "as version 3.5");
  if (options.address.rfind("127.", 0) != 0 && options.address != "::1")
    std::printf("note: other machines can reach this address\n");
  std::fflush(stdout);
  const Clock::time_point begin = Clock::now();
  Witness before = service.witness();
  while (!interrupted.load() &&
         (seconds == 0 || std::chrono::duration<double>(Clock::now() - begin).count() < seconds)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    const Witness now = service.witness();
    if (now.sessions != before.sessions) std::printf("session %llu\n", static_cast<unsigned long long>(now.sessions));
    if (now.in_fault && !before.in_fault) std::printf("fault begins\n");
    if (before.in_fault && !now.in_fault) {
      if (now.fault_at && now.quiet_at)
        std::printf("fault over: zero force %.1f ms after its first sign, %d other forces in between\n",
                    1e3 * (*now.quiet_at - *now.fault_at), now.pushes);
      else
        std::printf("fault over: no zero force came, %d other forces\n", now.pushes);
    }
    std::fflush(stdout);
    before = now;
  }
  std::printf("%llu messages, %llu states\n", static_cast<unsigned long long>(before.messages),
              static_cast<unsigned long long>(before.states));
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const Arguments arguments(argc, argv, {"--port", "--address", "--rate", "--fault", "--fault-seconds", "--seconds"},
                              {"--older", "--no-handle", "--still", "--list-faults", "--version", "--help"});
    if (arguments.has("--help")) return std::fputs(kUsage, stdout) < 0 ? 1 : 0;
    if (arguments.has("--version")) return std::printf("haply_service %s\n", kServiceVersion) < 0 ? 1 : 0;
    if (arguments.has("--list-faults")) {
      for (const FaultText& f : kFaults) std::printf("%-10s %s\n", f.name, f.text);
      return 0;
    }
    ServiceOptions options;
    options.address = arguments.text("--address", options.address);
    options.port = arguments.port(0);
    options.rate = arguments.number("--rate", 0, 1, 100000);
    options.older = arguments.has("--older");
    options.handle = !arguments.has("--no-handle");
    options.hand = haply::SimulatedHand{!arguments.has("--still")};
    options.fault_for = arguments.number("--fault-seconds", options.fault_for, 0.01, 3600);
    if (arguments.has("--fault")) {
      const std::string fault = arguments.text("--fault", {});
      const std::size_t at = fault.find('@');
      options.fault = fault_by_name(fault.substr(0, at)).fault;
      if (at != std::string::npos) options.fault_after = Arguments::checked("--fault", fault.substr(at + 1), 0, 86400);
    }
    const double seconds = arguments.number("--seconds", 0, 0.1, 86400);
    std::signal(SIGINT, on_interrupt);
    std::signal(SIGTERM, on_interrupt);
    run(options, seconds);
    return 0;
  } catch (const UsageError& error) {
    std::fprintf(stderr, "haply_service: %s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "haply_service: %s\n", error.what());
    return 1;
  }
}
