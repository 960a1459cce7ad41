// SPDX-License-Identifier: MIT
#include "haply_device.hpp"

#include "connection.hpp"

#include <trephine/core/number.hpp>
#include <trephine/core/tolerances.hpp>

#include <algorithm>
#include <stdexcept>

namespace haply {

using trephine::DeviceStatus;
using trephine::Vec3d;
using Event = Connection::Event;

namespace {

constexpr double kNominalRate = 4000;  // [Hz] of the arm
constexpr double kSlowRate = 1000;     // [Hz] below it walls are soft or buzz
constexpr int kProbes = 40;            // exchanges that measure the service's rate: 0.2 s at 200 Hz
constexpr auto kFirstWait = std::chrono::seconds(1);
constexpr auto kConnectWait = std::chrono::milliseconds(200);
constexpr auto kRetry = std::chrono::milliseconds(50);

}  // namespace

Device::Device(const DeviceOptions& options)
    : options_(options), connection_(std::make_unique<Connection>()), check_(options.bounds) {
  if (!(options.max_force > 0) || !(options.give_up >= 0))
    throw std::invalid_argument("haply::Device: max_force must be > 0 N and give_up >= 0 s");
  Trouble trouble = connect(kFirstWait);
  if (trouble == Trouble::kNone) trouble = probe();
  if (trouble != Trouble::kNone)
    throw std::runtime_error("no device at " + options.address + ":" + std::to_string(options.port) + ": " +
                             text(trouble));
  thread_ = std::thread([this] { exchange_messages(); });
}

Device::~Device() { stop(); }

void Device::stop() noexcept {
  if (!thread_.joinable()) return;
  quit_.store(true, std::memory_order_release);
  connection_->ring();
  thread_.join();
}

DeviceStatus Device::read(trephine::DeviceState& state) noexcept {
  if (const State* newest = states_.take()) seen_ = *newest;
  if (fault_.load(std::memory_order_relaxed) != Fault::kNone) return DeviceStatus::kFault;
  // A thread that exchanges nothing cannot tell of it.
  if (Clock::now() - seen_.arrived > options_.bounds.old && seen_.trouble == Trouble::kNone)
    seen_.trouble = Trouble::kSilent;
  const bool good = seen_.trouble == Trouble::kNone;
  state.X_DH = trephine::make_pose(trephine::Mat3d(seen_.reading.rotation), seen_.reading.position);
  state.buttons = good ? seen_.reading.buttons : 0;  // nothing is cut blindly
  state.time.reset();
  return good ? DeviceStatus::kOk : DeviceStatus::kSafetyTrip;
}

DeviceStatus Device::write(const trephine::Wrenchd& wrench_H_D) noexcept {
  const bool finite = trephine::is_finite(wrench_H_D);
  const bool good = finite && seen_.trouble == Trouble::kNone;
  Force next{.force = Vec3d::Zero(), .written = Clock::now(), .failures = seen_.failures};
  if (good) {
    const double norm = wrench_H_D.force.stableNorm();
    const double share = norm > options_.max_force ? options_.max_force / norm : 1.0;
    next.force = share * wrench_H_D.force;
  }
  forces_.post(next);
  connection_->ring();
  if (!finite) fault_.store(Fault::kNonFinite, std::memory_order_relaxed);
  if (fault_.load(std::memory_order_relaxed) != Fault::kNone) return DeviceStatus::kFault;
  return good ? DeviceStatus::kOk : DeviceStatus::kSafetyTrip;
}

double Device::handle_age() const noexcept {
  const Clock::duration turned(turned_.load(std::memory_order_relaxed));
  return std::chrono::duration<double>(Clock::now().time_since_epoch() - turned).count();
}

std::string Device::fault_text() const {
  switch (fault_.load(std::memory_order_relaxed)) {
    case Fault::kGivenUp:
      return std::string(text(Trouble::kGivenUp)) + " (last: " + text(trouble()) + ")";
    case Fault::kNonFinite:
      return "the scene gave a force that is no number: no force was sent";
    case Fault::kNone:
      break;
  }
  return text(trouble());
}

bool Device::next_change(Change& change) noexcept {
  const std::uint32_t taken = changes_taken_.load(std::memory_order_relaxed);
  if (taken == changes_made_.load(std::memory_order_acquire)) return false;
  change = changes_[taken % changes_.size()];
  changes_taken_.store(taken + 1, std::memory_order_release);
  return true;
}

// --- The exchanging thread -------------------------------------------------------------------------------------------

Trouble Device::connect(Clock::duration limit) {
  const Clock::time_point deadline = Clock::now() + limit;
  if (!connection_->open(options_.address, options_.port, deadline)) return Trouble::kLost;
  for (;;) {
    const Event event = connection_->wait(deadline);
    if (event == Event::kBell) continue;
    Inventory found;
    Trouble trouble = event == Event::kTimeout ? Trouble::kSilent : Trouble::kMessage;
    // The same device again, whatever else is plugged in by now.
    const std::string& wanted = inventory_.device_id.empty() ? options_.device_id : inventory_.device_id;
    if (event == Event::kMessage) trouble = parse_inventory(connection_->message(), wanted, found);
    if (trouble == Trouble::kNone && !inventory_.handle_id.empty() && found.handle_id != inventory_.handle_id)
      trouble = Trouble::kHandle;
    if (trouble != Trouble::kNone) {
      connection_->close();
      return trouble;
    }
    inventory_ = found;
    outstanding_ = 0;
    is_silent_ = false;
    check_.forget();
    send(Vec3d::Zero());
    return Trouble::kNone;
  }
}

Trouble Device::probe() {
  const Clock::time_point begin = Clock::now();
  for (int i = 0; i < kProbes; ++i) {
    if (connection_->wait(begin + kFirstWait) != Event::kMessage) return Trouble::kSilent;
    on_message();
    if (check_.trouble() == Trouble::kMessage) return Trouble::kMessage;
    if (outstanding_ == 0) send(Vec3d::Zero());
  }
  // By the median, because a single late state says nothing of the service.
  const double rate = 1 / std::max(round_trip_.quantile(0.5), 1e-6);
  const bool has_handle = !inventory_.handle_id.empty();
  capabilities_ = {.name = "Haply " + inventory_.product_name + " " + inventory_.device_id,
                   .input_dof = has_handle ? 6 : 3,
                   .output_dof = 3,
                   .max_force = options_.max_force,
                   .rate = rate < kSlowRate ? std::max(rate, 100.0) : kNominalRate};
  if (rate < kSlowRate)
    warnings_.push_back("the service answers " + trephine::number_text(rate, 2) + " times a second, not " +
                        trephine::number_text(kNominalRate) +
                        ": stiff walls will buzz. Connect the Inverse3 by USB, close Haply Hub's demos, or lower the "
                        "stiffness");
  if (!has_handle)
    warnings_.push_back("the service has no handle: the tool does not turn. Pair the VerseGrip in Haply Hub");
  round_trip_.clear();
  return Trouble::kNone;
}

void Device::exchange_messages() {
  const trephine::RealtimeScope scope(options_.realtime);
  while (!quit_.load(std::memory_order_acquire) && fault_.load(std::memory_order_relaxed) != Fault::kGivenUp) {
    if (!connection_->is_open()) {
      reconnect();
      continue;
    }
    const Bounds& b = options_.bounds;
    switch (connection_->wait(sent_at_ + (outstanding_ == 0 ? b.tick : is_silent_ ? b.lost : b.reply))) {
      case Event::kMessage:
        on_message();
        break;
      case Event::kBell:
        has_bell_ = true;
        break;
      case Event::kClosed:
        fail(Trouble::kLost);
        break;
      case Event::kTimeout:
        on_timeout();
        break;
    }
    if (has_bell_ && outstanding_ == 0 && connection_->is_open()) send_newest();
  }
  if (!connection_->is_open()) return;
  send(Vec3d::Zero());
  while (outstanding_ > 0 && connection_->is_open() &&
         connection_->wait(sent_at_ + options_.bounds.reply) != Event::kTimeout)
    if (!connection_->message().empty()) --outstanding_;
  connection_->close();
}

void Device::reconnect() {
  if (!is_lost_) lost_at_ = Clock::now();
  is_lost_ = true;
  const Trouble trouble = connect(kConnectWait);
  const Clock::time_point now = Clock::now();
  fail(trouble == Trouble::kNone ? Trouble::kLost : trouble);  // settling begins now
  is_lost_ = trouble != Trouble::kNone;
  if (!is_lost_) return;
  if (std::chrono::duration<double>(now - lost_at_).count() > options_.give_up)
    fault_.store(Fault::kGivenUp, std::memory_order_relaxed);
  while (!quit_.load(std::memory_order_acquire) && connection_->wait(now + kRetry) == Event::kBell) {
  }
}

void Device::on_message() {
  const Clock::time_point now = Clock::now();
  if (outstanding_ == 0) {
    // Each message more would make every later state an older one.
    fail(Trouble::kFlood);
    connection_->close();
    return;
  }
  if (--outstanding_ == 0) {
    if (!is_silent_) round_trip_.add(std::chrono::duration<double>(now - sent_at_).count());
    is_silent_ = false;
  }
  const Trouble before = check_.trouble();
  const Trouble found = parse_state(connection_->message(), inventory_, state_.reading);
  check_.add(state_.reading, found, now);
  if (found == Trouble::kNone) {
    state_.arrived = now;
    turned_.store(check_.turned().time_since_epoch().count(), std::memory_order_relaxed);
  }
  if (check_.trouble() != Trouble::kNone && check_.trouble() != before) fail(check_.trouble());
  publish();
}

void Device::on_timeout() {
  if (outstanding_ == 0) {
    if (pushes_) return fail(Trouble::kTick);
    return send(Vec3d::Zero());  // keeps the session alive
  }
  if (is_silent_) connection_->close();
  fail(is_silent_ ? Trouble::kLost : Trouble::kSilent);
  is_silent_ = true;
}

void Device::send_newest() {
  has_bell_ = false;
  const Force* next = forces_.take();
  if (next == nullptr) return;  // each force goes out once
  const bool valid = check_.trouble() == Trouble::kNone && next->failures == state_.failures &&
                     Clock::now() - next->written <= options_.bounds.tick;
  send(valid ? next->force : Vec3d::Zero());
}

void Device::send(const Vec3d& force) {
  write_force(inventory_, force, message_);
  pushes_ = force != Vec3d::Zero();
  sent_at_ = Clock::now();
  ++outstanding_;
  if (connection_->send(message_)) return;
  connection_->close();
  fail(Trouble::kFull);
}

/// Notes a trouble; takes the force away where one acts and a message can still tell.
void Device::fail(Trouble trouble) {
  const Clock::time_point now = Clock::now();
  if (state_.trouble == Trouble::kNone) ++state_.failures;
  check_.fail(trouble, now);
  const bool acts = pushes_ && connection_->is_open();
  publish();
  if (acts) {
    pushes_ = false;
    send(Vec3d::Zero());
  }
}

void Device::publish() {
  const Trouble trouble = check_.trouble();
  const bool changed = trouble != state_.trouble;
  state_.trouble = trouble;
  states_.post(state_);
  if (!changed) return;
  shown_trouble_.store(trouble, std::memory_order_relaxed);
  const std::uint32_t made = changes_made_.load(std::memory_order_relaxed);
  if (made - changes_taken_.load(std::memory_order_acquire) >= changes_.size()) return;
  changes_[made % changes_.size()] = {std::chrono::duration<double>(Clock::now() - opened_).count(), trouble};
  changes_made_.store(made + 1, std::memory_order_release);
}

}  // namespace haply
