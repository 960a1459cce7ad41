// SPDX-License-Identifier: MIT
// Which devices this computer has, what each one lacks, and a wall to feel with each.
#include "kinds.hpp"
#include "wall.hpp"

#include <trephine/core/number.hpp>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

namespace {

using namespace devices;

std::atomic<bool> interrupted{false};
void on_interrupt(int) { interrupted.store(true); }

constexpr const char* kUsage =
    "usage: devices --list                    which devices there are, and what each one lacks\n"
    "       devices --check [--device NAME]   opens the usable ones, or this one, and lets you feel a wall\n"
    "                       [--seconds S]     for so long, from 1 to 3600; 10 if not said\n";

struct Arguments {
  bool list = false, check = false;
  std::string device;
  double seconds = 10;
};

class UsageError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

Arguments parsed(const std::vector<std::string>& words) {
  Arguments arguments;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const bool has_value = i + 1 < words.size();
    if (words[i] == "--list") {
      arguments.list = true;
    } else if (words[i] == "--check") {
      arguments.check = true;
    } else if (words[i] == "--device" && has_value) {
      arguments.device = kind_named(words[++i]).name;
    } else if (words[i] == "--seconds" && has_value) {
      arguments.seconds = trephine::parse_number(words[++i]).value_or(0);
      if (!(arguments.seconds >= 1) || !(arguments.seconds <= 3600))
        throw UsageError("--seconds must be from 1 to 3600, not " + words[i]);
    } else {
      throw UsageError("there is no option " + words[i] + ", or it lacks its value; --help shows all");
    }
  }
  if (arguments.list == arguments.check) throw UsageError("say either --list or --check; --help shows all");
  return arguments;
}

void print(const Kind& kind, const Finding& finding) {
  std::printf("%-26s %s\n%-26s %s: %s\n", kind.name, kind.what, "", finding.usable ? "usable" : "not usable",
              finding.found.c_str());
  if (!finding.usable) std::printf("%-26s to do: %s\n", "", finding.to_do.c_str());
}

/// True if the device was opened, ran to its end, and gave force where it has any.
bool check(const Kind& kind, double seconds) {
  Opened opened = kind.open(pushing_hand(seconds));
  const trephine::DeviceCapabilities able = opened.use([](auto& device) { return device.capabilities(); });
  std::printf("%-26s %s: %d axes in, %d out, %.3g N\n", "", able.name.c_str(), able.input_dof, able.output_dof,
              able.max_force);
  std::printf("%-26s a wall stands %.0f mm under the handle: push down, for %.0f s\n", "", 1e3 * kWallBelow, seconds);
  std::fflush(stdout);
  const WallReport report = feel_wall(opened, seconds, interrupted, [&kind](const WallMoment& moment) {
    if (kind.simulated) return;
    std::printf("\r%-26s %4.1f s  %5.2f N ", "", moment.time, moment.force);
    std::fflush(stdout);
  });
  const trephine::RunReport& run = report.run;
  std::printf("%s%-26s %.2f N at most, %.0f Hz, %llu late, %llu trips\n", kind.simulated ? "" : "\n", "",
              report.most_force, static_cast<double>(run.ticks) / std::max(run.wall_time, 1e-9),
              static_cast<unsigned long long>(run.missed_deadlines), static_cast<unsigned long long>(run.safety_trips));
  std::printf("%-26s a tick with reading and writing: %.0f us, p99.9 %.0f us\n", "", 1e6 * run.tick_time.p50,
              1e6 * run.tick_time.p99_9);
  const bool is_felt = able.output_dof == 0 || report.most_force > 0.1;
  if (run.end == trephine::RunEnd::kFault)
    std::printf("%-26s FAILED: %s\n", "", run.reason.c_str());
  else if (!is_felt)
    std::printf("%-26s no force was sent: was the handle pushed down?\n", "");
  else
    std::printf("%-26s works\n", "");
  return run.end != trephine::RunEnd::kFault && is_felt && run.zeroed;
}

int run(const Arguments& arguments) {
  int checked = 0, failed = 0;
  for (const Kind& kind : kinds()) {
    if (!arguments.device.empty() && arguments.device != kind.name) continue;
    const Finding finding = kind.look();
    print(kind, finding);
    if (!arguments.check || (!finding.usable && arguments.device.empty()) || interrupted.load()) continue;
    ++checked;
    try {
      if (!check(kind, arguments.seconds)) ++failed;
    } catch (const std::exception& error) {
      std::printf("%-26s FAILED: %s\n", "", error.what());
      ++failed;
    }
  }
  if (arguments.check) std::printf("%d checked, %d of them failed\n", checked, failed);
  return failed > 0 ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.empty() || words[0] == "--help") {
    std::fputs(kUsage, words.empty() ? stderr : stdout);
    return words.empty() ? 2 : 0;
  }
  try {
    const Arguments arguments = parsed(words);
    std::signal(SIGINT, on_interrupt);
    return run(arguments);
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "devices: %s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "devices: %s\n", error.what());
    return 1;
  }
}
