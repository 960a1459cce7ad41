// SPDX-License-Identifier: MIT
// Tests every adapter against its counterpart: six pushes for axes and units, rate, latency, and what comes of each
// fault. The rule for all of them: zero force within 10 ms, and after it a ramp or a fault that says what to do.
#include "counterparts.hpp"

#include <trephine/core/number.hpp>
#include <trephine/device/servo_loop.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace {

using namespace devices;
using trephine::Posed, trephine::TickRecord;
using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr double kPush = 1.0;      // [N]
constexpr double kStep = 5e-3;     // of the hand [m]
constexpr double kWithin = 0.010;  // of zero force [s]
constexpr double kRampedStep = 4;  // [N] a tick of 1 ms may bring kPush / 100; late ticks bring more

double now() { return std::chrono::duration<double>(Clock::now().time_since_epoch()).count(); }

/// A vector that threads share, a number at a time: it changes slowly.
struct Shared {
  std::array<std::atomic<double>, 3> at{};
  void set(const Vec3d& v) {
    for (std::size_t i = 0; i < 3; ++i) at[i].store(v[static_cast<int>(i)]);
  }
  [[nodiscard]] Vec3d get() const { return {at[0].load(), at[1].load(), at[2].load()}; }
};

/// Pushes as it is told, wherever the tool is: so nothing but adapter and loop can take the force away.
struct PushingScene {
  static constexpr bool kHasTorque = false;
  const Shared& push_U;
  trephine::TickResult tick(const trephine::TickInput&, double) noexcept {
    trephine::TickResult result;
    result.wrench.force = push_U.get();
    return result;
  }
};

/// An adapter in a servo loop of its own thread, with its counterpart.
class Running {
 public:
  Running(const Testable& kind, const Shared& hand, const Shared& push) : scene_{push} {
    counterpart_ = kind.open(
        [&hand](double) { return trephine::HandTarget(trephine::make_pose<double>(Mat3d::Identity(), hand.get())); });
    thread_ = std::thread([this] {
      counterpart_->opened().use([this](auto& device) {
        trephine::ServoLoop loop(device, scene_, counterpart_->opened().registration(Mat3d::Identity(), Vec3d::Zero()));
        report = loop.run_until([this](const TickRecord&) { return over_.load(); },
                                [this](const TickRecord& tick) { observe(tick); });
      });
      ended.store(true);
    });
  }
  ~Running() {
    over_.store(true);
    thread_.join();
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

  void finish() {
    over_.store(true);
    while (!ended.load()) std::this_thread::sleep_for(1ms);
  }
  /// Waits for the whole push, 3 s at most.
  [[nodiscard]] bool pushes() const {
    for (int i = 0; i < 3000 && !ended.load(); ++i) {
      if (ramp.load() >= 1 && counterpart_->felt().norm() > 0.9 * kPush) return true;
      std::this_thread::sleep_for(1ms);
    }
    return false;
  }
  /// Waits for the first tick, likewise.
  [[nodiscard]] bool ticks() const {
    for (int i = 0; i < 3000 && ramp.load() == 0; ++i) std::this_thread::sleep_for(1ms);
    return ramp.load() > 0;
  }
  [[nodiscard]] Counterpart& counterpart() { return *counterpart_; }

  Shared tool_U;
  std::atomic<double> ramp{0}, steepest{0}, last_zero{0};
  std::atomic<bool> ended{false};
  trephine::RunReport report;  // once it has ended

 private:
  void observe(const TickRecord& tick) {
    tool_U.set(tick.input.X_WT.translation());
    const double sent = tick.sent.force.norm();
    // The slope of a ramp: newtons a millisecond of the loop's own time.
    steepest.store(std::max(steepest.load(), (sent - last_) / std::max(tick.dt, 1e-3) * 1e-3));
    last_ = sent;
    if (sent == 0) last_zero.store(now());
    ramp.store(tick.ramp);
  }

  PushingScene scene_;
  std::unique_ptr<Counterpart> counterpart_;
  double last_ = 0;
  std::atomic<bool> over_{false};
  std::thread thread_;
};

/// Where --csv writes the times of faults, as tables of figures have them.
std::FILE* csv = nullptr;

std::string machine() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.rfind("model name", 0) == 0)
      return line.substr(line.find(": ") + 2) + ", " + std::to_string(std::thread::hardware_concurrency()) + " cores";
  return "unknown machine";
}

/// A row of the table: a fault and a kind of device.
void tabulate(const Testable& kind, Fault fault, const std::string& value, const char* unit, int times) {
  if (csv == nullptr) return;
  std::fprintf(csv, "%s / %s,%s,%s,median of %d,\"%s\"\n", kFaultNames[static_cast<std::size_t>(fault)],
               kind.name.substr(0, kind.name.find("-simulated")).c_str(), value.c_str(), unit, times,
               machine().c_str());
}

int failures = 0;
void verdict(bool good, const char* what, const std::string& found) {
  std::printf("  %-4s %-14s %s\n", good ? "ok" : "FAIL", what, found.c_str());
  std::fflush(stdout);
  if (!good) ++failures;
}

std::string printed(const char* format, auto... values) {
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

bool has_force(Counterpart& counterpart) {
  return counterpart.opened().use([](auto& device) { return device.capabilities().output_dof; }) > 0;
}

/// The vendor's axes as this program was told them, against those that the adapter's kind claims.
void check_axes(const Testable& kind) {
  Shared hand, push;
  Running running(kind, hand, push);
  Mat3d R_UD;
  R_UD << kind.right_D.transpose(), kind.up_D.transpose(), kind.right_D.cross(kind.up_D).transpose();
  double worst_m = 0, worst_N = 0;
  std::this_thread::sleep_for(700ms);  // until the loop ticks and the arm is at rest
  const Vec3d home = running.tool_U.get();
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {1.0, -1.0}) {
      const Vec3d way = sign * Vec3d::Unit(axis);
      hand.set(kStep * way);
      std::this_thread::sleep_for(400ms);
      worst_m = std::max(worst_m, (running.tool_U.get() - home - kStep * way).norm());
      hand.set(Vec3d::Zero());
      push.set(kPush * way);
      // A trip on a busy machine is ramped away: the force has two seconds to be what it should be.
      double off_N = kPush;
      for (int i = 0; i < 2000 && off_N > 0.01 && has_force(running.counterpart()); ++i) {
        std::this_thread::sleep_for(1ms);
        off_N = (R_UD * running.counterpart().felt() - kPush * way).norm();
      }
      worst_N = std::max(worst_N, off_N);
      push.set(Vec3d::Zero());
    }
  if (has_force(running.counterpart()))
    verdict(worst_m < 0.5e-3 && worst_N < 0.02, "six pushes",
            printed("off by %.2f mm of 5 mm and %.3f N of 1 N, at most", 1e3 * worst_m, worst_N));
  else
    verdict(worst_m < 0.5e-3, "six pushes", printed("off by %.2f mm of 5 mm, at most; no force", 1e3 * worst_m));
  running.finish();
  const double wall = std::max(running.report.wall_time, 1e-9);
  verdict(running.report.end != trephine::RunEnd::kFault, "rate",
          printed("%.0f Hz, %llu trips%s", static_cast<double>(running.report.ticks) / wall,
                  static_cast<unsigned long long>(running.report.safety_trips),
                  running.report.end == trephine::RunEnd::kFault ? (", " + running.report.reason).c_str() : ""));
}

/// From a change of what the scene wants until the motors give it.
void check_latency(const Testable& kind, int times) {
  Shared hand, push;
  push.set(kPush * Vec3d::UnitY());
  Running running(kind, hand, push);
  if (!has_force(running.counterpart())) return;
  if (!running.pushes()) return verdict(false, "latency", "no force came");
  std::vector<double> took;
  for (int i = 0; i < times; ++i) {
    const double wanted = i % 2 == 0 ? 0.5 : 1.0;
    std::this_thread::sleep_for(std::chrono::microseconds(3000 + 37 * i));
    const double start = now();
    push.set(wanted * kPush * Vec3d::UnitY());
    while (std::abs(running.counterpart().felt().norm() - wanted) > 0.1 && now() - start < 0.1) {
    }
    took.push_back(now() - start);
  }
  std::sort(took.begin(), took.end());
  const double median = took[took.size() / 2];
  verdict(median < kWithin, "latency", printed("%.2f ms (median), %.2f ms (most)", 1e3 * median, 1e3 * took.back()));
}

/// One fault befalls a hand that is pushed. Returns the time until the force is zero [s], or infinity.
double befall(const Testable& kind, Fault fault, std::string& said, bool& returns_well) {
  Shared hand, push;
  push.set(kPush * Vec3d::UnitY());
  // A hand that moves a little: repeated poses are then stale ones.
  std::atomic<bool> over{false};
  std::thread trembling([&] {
    for (int i = 0; !over.load(); ++i) {
      hand.set(1e-3 * std::sin(0.05 * i) * Vec3d::UnitX());
      std::this_thread::sleep_for(1ms);
    }
  });
  double quiet = std::numeric_limits<double>::infinity();
  {
    Running running(kind, hand, push);
    const bool pushes = has_force(running.counterpart());
    if (pushes ? running.pushes() : running.ticks()) {
      const double start = now();
      running.counterpart().inject(fault);
      while (now() - start < 0.25 && quiet > 1) {
        if (pushes ? running.counterpart().felt().norm() < 1e-6 : running.ended.load()) quiet = now() - start;
        if (fault == Fault::kJump && running.last_zero.load() >= start) quiet = running.last_zero.load() - start;
      }
      // From here on the force may come back by a ramp alone, while the fault lasts and after it.
      running.steepest.store(0);
      std::this_thread::sleep_for(50ms);
      running.ramp.store(0);
      running.counterpart().heal();
      for (int i = 0; i < 1500 && !running.ended.load() && running.ramp.load() < 1; ++i)
        std::this_thread::sleep_for(1ms);
      if (running.ended.load()) {
        said = running.report.reason;
        returns_well = running.report.reason.find(": ") != std::string::npos || kind.name == "simulated";
      } else {
        said = printed("comes back by %.3f N/ms at most", running.steepest.load());
        returns_well = running.steepest.load() < kRampedStep * kPush / 100;
      }
    } else {
      said = "no force came before it: " + (running.ended.load() ? running.report.reason : "the loop waits");
    }
  }
  over.store(true);
  trembling.join();
  return quiet;
}

void check_faults(const Testable& kind, int times) {
  for (std::size_t i = 0; i < kFaultNames.size(); ++i) {
    const Fault fault = static_cast<Fault>(i);
    std::string why_not;
    bool pushes = true;
    {
      const auto counterpart = kind.open([](double) { return trephine::HandTarget(); });
      why_not = counterpart->cannot(fault);
      pushes = has_force(*counterpart);
    }
    if (!why_not.empty()) {
      std::printf("  --   %-14s cannot happen: %s\n", kFaultNames[i], why_not.c_str());
      tabulate(kind, fault, "–", "", times);
      continue;
    }
    std::vector<double> took;
    std::string said;
    bool returns_well = true;
    for (int n = 0; n < times; ++n) took.push_back(befall(kind, fault, said, returns_well));
    std::sort(took.begin(), took.end());
    // A machine that is busy with other things may keep any thread waiting: the median is judged.
    const double median = took[took.size() / 2];
    tabulate(kind, fault, printed("%.1f", 1e3 * median), "ms", times);
    const bool bounded = median <= kWithin || (std::isfinite(median) && !pushes);
    verdict(
        bounded && returns_well, kFaultNames[i],
        printed("zero after %.1f ms (median of %d), %.1f ms (most); ", 1e3 * median, times, 1e3 * took.back()) + said);
  }
}

constexpr const char* kUsage =
    "usage: devices_conformance [--device NAME] [--times N] [--csv FILE]\n"
    "Tests each adapter, or one, against its counterpart; each fault N times (3), from 1 to 1000. FILE gets the "
    "times.\n";

}  // namespace

int main(int argc, char** argv) {
  std::string only;
  int times = 3;
  for (int i = 1; i < argc; ++i) {
    const bool has_value = i + 1 < argc;
    if (std::strcmp(argv[i], "--help") == 0) {
      std::fputs(kUsage, stdout);
      return 0;
    }
    if (std::strcmp(argv[i], "--device") == 0 && has_value) {
      only = argv[++i];
    } else if (std::strcmp(argv[i], "--csv") == 0 && has_value) {
      csv = std::fopen(argv[++i], "w");
      if (csv == nullptr) {
        std::fprintf(stderr, "devices_conformance: cannot write %s\n", argv[i]);
        return 2;
      }
      std::fputs("name,value,unit,set,machine\n", csv);
    } else if (std::strcmp(argv[i], "--times") == 0 && has_value) {
      times = static_cast<int>(trephine::parse_number(argv[++i]).value_or(0));
    } else {
      times = 0;
    }
    if (times < 1 || times > 1000) {
      std::fputs(kUsage, stderr);
      return 2;
    }
  }
  try {
    int tested = 0;
    for (const Testable& kind : testable_kinds()) {
      if (!only.empty() && only != kind.name) continue;
      ++tested;
      std::printf("%s\n", kind.name.c_str());
      check_axes(kind);
      check_latency(kind, 20);
      check_faults(kind, times);
    }
    if (tested == 0) throw std::invalid_argument("no device of this build has a counterpart named " + only);
    if (csv != nullptr && std::fclose(csv) != 0) throw std::runtime_error("the file of --csv is not whole");
    std::printf("%d kinds of devices, %d failures\n", tested, failures);
    return failures > 0 ? 1 : 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "devices_conformance: %s\n", error.what());
    return 1;
  }
}
