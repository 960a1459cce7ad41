// SPDX-License-Identifier: MIT
#include "session.hpp"

#include "../drill/cutting.hpp"

#ifdef TREPHINE_LIVE_HAS_DEVICES
#include "../devices/kinds.hpp"
#endif

#include <trephine/device/servo_loop.hpp>
#include <trephine/device/simulated_device.hpp>
#include <trephine/device/two_hands.hpp>
#include <trephine/stage/driven_by.hpp>
#include <trephine/tool/named_tools.hpp>

#include <algorithm>
#include <chrono>
#include <exception>
#include <sstream>
#include <utility>

namespace live {
namespace {

using namespace trephine;

constexpr double kSettles = 0.25;  // [s]: an arm does so once its hand has arrived

/// A desktop arm of six axes in a light grip; the hand's spring is what the mouse pulls at.
SimulatedDeviceOptions simulated_arm(const Posed& X_DH, double rate) {
  SimulatedDeviceOptions o;
  o.linear = {.inertia = 0.075, .damping = 0.5, .friction = 0.04, .quantum = 0.03e-3, .limit = kMaxForce};
  o.angular = {.inertia = 4e-5, .damping = 4e-4, .friction = 0, .quantum = 1e-4, .limit = kMaxTorque};
  o.rate = rate;
  o.X_DH = X_DH;
  return o;
}

/// The drill as a servo loop ticks it, timed for the instruments.
class TimedDrill {
 public:
  static constexpr bool kHasTorque = true;
  TimedDrill(PassingDrill& drill, double stiffness) : drill_(drill), stiffness_(stiffness) {}

  TickResult tick(const TickInput& input, double dt) noexcept {
    const auto start = std::chrono::steady_clock::now();
    const TickResult result = drill_.tick(input, dt);
    took_us_ = std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count();
    return result;
  }
  [[nodiscard]] double stiffness() const { return stiffness_; }
  [[nodiscard]] double took_us() const noexcept { return took_us_; }

 private:
  PassingDrill& drill_;
  double stiffness_;
  double took_us_ = 0;
};

bool same_burr(const Burr& a, const Burr& b) {
  return a.tip_radius == b.tip_radius && a.shaft_radius == b.shaft_radius && a.shaft_length == b.shaft_length;
}

bool same_tool(const DrillSettings& a, const DrillSettings& b) {
  if (a.shape() != nullptr && b.shape() != nullptr) return a.tool_name == b.tool_name;
  return a.shape() == b.shape() && same_burr(a.burr, b.burr);
}

/// Gives the settings the guard's potential and the soft structures for their tool, if there are structures.
void fit_potential(DrillSettings& settings) {
  if (settings.guarded == nullptr) return;
  const RevolvedTool* const shape = settings.shape();
  const AnyTool tool = shape != nullptr ? AnyTool(*shape) : AnyTool(settings.burr);
  settings.potential = potential_for(*settings.guarded, tool);
  settings.soft = soft_for(*settings.guarded, tool);
}

/// The registration at another scale that leaves the tool where it is.
Registration rescaled(const Registration& from, const Posed& X_DH, double scale) {
  const Vec3d p_WD = from.tool_pose(X_DH).translation() - from.X_WD().linear() * (scale * X_DH.translation());
  return Registration(make_pose<double>(from.X_WD().linear(), p_WD), from.X_HT(), scale);
}

}  // namespace

trephine::CuttingForce::Options DrillSettings::cutting() const {
  const CuttingEdges edges = shape() != nullptr ? tool_by_name(tool_name).edges : CuttingEdges{};
  const drill::SpindleUse& use = drill::use_of(edges);
  trephine::CuttingForce::Options options = drill::cutting_with(
      edges, strength,
      {.turns = use.turns, .force_scale = tuning.force_scale > 0 ? tuning.force_scale : use.force_scale});
  if (motor) options = driven_by(options, *motor);
  if (tuning.turns > 0) options.speed = trephine::rpm(tuning.turns);
  return options;
}

std::unique_ptr<HeldDrill> make_drill(drill::Grid& bone, double isovalue, const DrillSettings& settings,
                                      Inboxes& inboxes) {
  switch (settings.renderer) {
    case Renderer::kLine:
      return line_drill(bone, isovalue, settings, inboxes);
    case Renderer::kSurface:
      return surface_drill(bone, isovalue, settings, inboxes);
    case Renderer::kCoupled:
      break;
  }
  return coupled_drill(bone, isovalue, settings, inboxes);
}

Session::Session(drill::Grid& bone, double isovalue, const SessionOptions& options, const Posed& start)
    : bone_(bone), isovalue_(isovalue), options_(options), start_(start), running_(options), drill_(bone, isovalue) {
  view_.probe = view_.tool = start;
  wishes_.post({start, false});
  if (options_.drill.potential == nullptr) fit_potential(options_.drill);
  running_ = options_;
#ifdef TREPHINE_LIVE_HAS_DEVICES
  follows_wishes_ = options_.device == kMouse || devices::kind_named(options_.device).simulated;
#endif
  drill_.take(make_drill(bone_, isovalue_, options_.drill, inboxes_), options_.drill);
  if (options_.second_hand)
    second_ = std::make_unique<SecondHand>(bone_, isovalue_, options_.R_WU, options_.drill.burr.tip_radius, start_);
  if (!options_.simulated) thread_ = std::thread([this] { run(); });
}

Session::~Session() { (void)end(); }

trephine::TimeSummary Session::end() {
  over_.store(true);
  pending_.store(true);
  if (thread_.joinable()) thread_.join();
  return tick_time_.summary();
}

void Session::simulate(std::function<bool(double)> after_tick) {
  after_tick_ = std::move(after_tick);
  run();
  if (failed()) throw std::runtime_error(report());
}

const TickView& Session::view() noexcept {
  if (const TickView* latest = views_.take()) view_ = *latest;
  return view_;
}

void Session::carry(const HandWish& wish) noexcept {
  if (follows_wishes_) {
    const double way = (wish.X_WT.translation() - view_.probe.translation()).norm();
    drill_.carry(wish.X_WT, kSettles + way / WishedHand::kFastest);
  }
  this->wish(wish);
}

void Session::run() {
  try {
    // The middle of the device's workspace is the tool's place at the start.
    wished_ = Registration(make_pose<double>(running_.R_WU, start_.translation()), Posed::Identity(), running_.scale);
    registration_ = wished_;
    X_DH_ = registration_.handle_pose(start_);
#ifdef TREPHINE_LIVE_HAS_DEVICES
    if (running_.device != kMouse) return run_on_opened();
#endif
    SimulatedDevice device(simulated_arm(X_DH_, running_.rate), WishedHand(wishes_, registration_, start_));
    if (running_.simulated)
      run_on<NoPacing>(device);
    else
      run_on<SleepPacing>(device);
  } catch (const std::exception& e) {
    say(e.what());
    failed_.store(true, std::memory_order_release);
  }
}

#ifdef TREPHINE_LIVE_HAS_DEVICES
void Session::run_on_opened() {
  // The mouse's hand is asked by the device, in a thread that may be another: its registration stays as it is.
  devices::Opened opened = devices::kind_named(running_.device).open(WishedHand(wishes_, wished_, start_));
  registration_ = opened.registration(running_.R_WU, start_.translation(), running_.scale);
  X_DH_ = registration_.handle_pose(start_);
  opened.use([this](auto& device) { run_on<SleepPacing>(device); });
}
#endif

template <class Pacing, class Loop, class Ends, class Observe>
trephine::RunReport Session::run_both(Loop& loop, const Ends& ends, const Observe& observe) {
  SimulatedDeviceOptions arm = simulated_arm(second_->tool_W(), running_.rate);
  SimulatedDevice device(arm, second_->script());
  ServoLoop second(device, *second_, Registration{}, {.rate = running_.rate}, Pacing{});
  return TwoHands{loop, second}
      .run_until(ends, observe,
                 [this](const TickRecord& tick) {
                   second_->follow(view_in_tick_.probe);
                   view_in_tick_.second = second_->tool_W();
                   view_in_tick_.second_N = tick.sent.force.norm();
                 })
      .first;
}

template <class Pacing, class Device>
void Session::run_on(Device& device) {
  while (!over_.load()) {
    std::vector<std::function<void()>> commands;
    {
      const std::lock_guard lock(between_);
      commands.swap(commands_);
      pending_.store(over_.load());
    }
    std::string refused;
    for (const auto& work : commands) try {
        work();
      } catch (const std::exception& e) {
        refused = std::string("\n") + e.what();  // all stays as it was
      }
    if (running_.scale != registration_.scale()) registration_ = rescaled(registration_, X_DH_, running_.scale);
    TimedDrill drill(drill_, running_.drill.stiffness);
    ServoLoop loop(device, drill, registration_, {.rate = running_.rate}, Pacing{});
    std::ostringstream text;
    text << loop.capabilities().name << ", " << 1.0 / loop.period() << " Hz";
    for (const std::string& warning : loop.warnings()) text << "\n" << warning;
    say(text.str() + refused);

    const double period = loop.period();
    const bool guarded = running_.drill.guarded != nullptr;
    TickView& view = view_in_tick_;
    const auto observe = [&](const TickRecord& tick) noexcept {
      removed_mm3_ += tick.result.removed_mm3;
      if (tick.index > 0 && tick.dt > 1.5 * period) missed_ += static_cast<std::uint64_t>(tick.dt / period - 0.5);
      X_DH_ = tick.state.X_DH;
      view.tick = ++ticks_;
      view.probe = tick.input.X_WT;
      view.tool = drill_.tool_W();
      view.passes = drill_.passes();
      view.wrench = tick.result.wrench;
      view.contact = tick.result.contact;
      view.status = tick.result.status;
      view.spindle_on = tick.input.spindle_on;
      view.cutting = tick.result.cutting;
      view.removed_mm3 = removed_mm3_;
      view.missed = missed_;
      if (guarded) {
        view.structures = drill_.structures();
        const bool is_closer = closest_.nearest < 0 || view.structures.distance < closest_.distance;
        if (view.structures.nearest >= 0 && is_closer) closest_ = view.structures;
        most_push_N_ = std::max(most_push_N_, view.structures.push_N);
        view.closest = closest_;
        view.most_push_N = most_push_N_;
        // A burr that only dents a soft structure takes nothing of it.
        const bool takes =
            !view.passes && (view.structures.pressed < 0 || view.structures.torn == view.structures.pressed);
        path_.follow(tick.input.spindle_on && takes, view.tool.translation(), running_.drill.burr.tip_radius);
      }
      std::array<ContactPoint<double>, TickView::kContacts> contacts{};
      view.contact_count = drill_.contacts_W(contacts);
      for (std::size_t i = 0; i < view.contact_count; ++i) view.contacts[i] = contacts[i].position;
      views_.post(view);
      heard_.post(
          heard_drill_.after(tick.input.spindle_on, tick.result.wrench.force.norm(), tick.result.removed_mm3, tick.dt));
      tick_time_.add(1e-6 * drill.took_us());
      history_.add({static_cast<float>(tick.result.wrench.force.norm()),
                    static_cast<float>(tick.result.wrench.torque.norm()), static_cast<float>(drill.took_us())});
    };
    const auto ends = [&](const TickRecord&) {
      if constexpr (!Pacing::kRealTime) {
        if (!after_tick_(static_cast<double>(ticks_) * period)) {
          over_.store(true);
          pending_.store(true);
        }
      }
      return pending_.load(std::memory_order_acquire);
    };
    const RunReport report = second_ != nullptr ? run_both<Pacing>(loop, ends, observe) : loop.run_until(ends, observe);
    if (report.end == RunEnd::kFault) throw std::runtime_error(report.reason);
  }
}

void Session::command(std::function<void()> work) {
  const std::lock_guard lock(between_);
  commands_.push_back(std::move(work));
  pending_.store(true, std::memory_order_release);
}

void Session::change(const SessionOptions& options) {
  if (!(options.scale > 0) || !(options.scale <= 10))
    throw std::invalid_argument("the scale must be > 0 and at most 10");
  options.drill.burr.validate();
  SessionOptions next = options;
  if (!same_tool(options_.drill, next.drill)) fit_potential(next.drill);
  options_ = next;
  command([this, options = std::move(next)] {
    const auto same = [](const DrillSettings& a, const DrillSettings& b) {
      return a.renderer == b.renderer && a.mills_by_law() == b.mills_by_law() && a.stiffness == b.stiffness &&
             same_tool(a, b);
    };
    if (!same(running_.drill, options.drill))
      drill_.take(make_drill(bone_, isovalue_, options.drill, inboxes_), options.drill);
    running_ = options;
  });
}

void Session::tune(const Tuning& tuning) {
  DrillSettings& drill = options_.drill;
  const Tuning before = std::exchange(drill.tuning, tuning);
  if (tuning.feed != before.feed) inboxes_.feed.post(tuning.cut(drill.burr));
  if (tuning.damping != before.damping) inboxes_.damping.post(tuning.damped());
  if (drill.mills_by_law()) {
    if (tuning.teeth != before.teeth) inboxes_.teeth.post(tuning.teeth_passing());
  } else if (tuning.vibration != before.vibration) {
    inboxes_.vibration.post(tuning.trembling());
  }
  if (tuning.turns != before.turns || tuning.force_scale != before.force_scale) inboxes_.law.post(drill.cutting());
  if (tuning.force_scale != before.force_scale) inboxes_.felt.post(drill.felt_scale());
  if (tuning.force != before.force) inboxes_.limits.post(tuning.limited());
}

void Session::protect(Protection protection) {
  if (options_.drill.guarded == nullptr) return;
  options_.drill.protection = protection;
  inboxes_.guard.post(guard_options(protection));
  inboxes_.refuses.post(protection == Protection::kVeto);
}

void Session::restore() {
  command([this] {
    bone_.restore();
    drill_.heal();
    drill_.bone_rose();
    if (second_ != nullptr) second_->bone_rose();
    removed_mm3_ = 0;
    closest_ = {};
    most_push_N_ = 0;
    if (const auto& guarded = running_.drill.guarded) {
      guarded->watch->reset_counts();
      guarded->refuse->reset_counts();
    }
  });
}

void Session::bring_back(PastBone past) {
  command([this, past = std::move(past)] {
    set_bone(bone_, past.bricks);
    drill_.heal();
    drill_.bone_rose();
    if (second_ != nullptr) second_->bone_rose();
    removed_mm3_ = past.removed_mm3;
    if (const auto& guarded = running_.drill.guarded) guarded->watch->forget_put_back(bone_);
  });
}

std::string Session::report() const {
  const std::lock_guard lock(between_);
  return report_;
}

void Session::say(const std::string& text) {
  const std::lock_guard lock(between_);
  report_ = text;
}

}  // namespace live
