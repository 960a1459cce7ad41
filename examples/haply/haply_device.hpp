// SPDX-License-Identifier: MIT
#pragma once

#include "state_check.hpp"

#include <trephine/device/device.hpp>
#include <trephine/device/realtime.hpp>
#include <trephine/device/statistics.hpp>
#include <trephine/stage/mailbox.hpp>

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace haply {

class Connection;

struct DeviceOptions {
  std::string address = "127.0.0.1";  ///< numeric
  unsigned short port = 10001;
  std::string device_id{};  ///< as Haply Hub lists it; empty: the first Inverse3
  double max_force = 10;    ///< [N]
  double give_up = 30;      ///< a service that is away for longer is a fault [s]
  Bounds bounds{};
  trephine::RealtimeOptions realtime{};  ///< for the thread that exchanges messages
};

/// A change of what `text(Trouble)` tells.
struct Change {
  double time = 0;  ///< since the device was opened [s]
  Trouble trouble = Trouble::kNone;
};

/// What the device's two threads pass to each other.
namespace exchange {

/// From the exchanging thread to the servo thread.
struct State {
  Reading reading;
  Trouble trouble = Trouble::kStart;
  Clock::time_point arrived;
  std::uint64_t failures = 0;
};

/// The other way; `failures` as in the state that the force was computed from.
struct Force {
  trephine::Vec3d force = trephine::Vec3d::Zero();
  Clock::time_point written;
  std::uint64_t failures = 0;
};

}  // namespace exchange

/// A Haply Inverse3 by its local Inverse Service, for trephine's servo loop. Not affiliated with Haply.
///
/// A thread of the device exchanges messages: each `write` gives it one force, it sends each force once, and each
/// message brings one state. `read` returns the newest. D is the service's frame: x right, y forward, z up. H is the
/// cursor, turned as the handle, whose +y points away from the hand; without a handle rotation is not read.
///
/// Zero force within 10 ms, and a safety trip, follow every failure: a late, silent, lost or flooding service, a state
/// that is malformed, out of range, frozen or a jump, a device or handle that is gone, a late servo loop. The thread
/// sends the zero itself, so that it needs no tick. A force from before a failure is never sent after it. The trip ends
/// once the states were good for `Bounds::settle`, and the servo loop ramps. A lost service is looked for until
/// `give_up`, then `read` returns kFault and `fault_text` says what to do.
///
/// Threads: `read` and `write` in the servo thread; `next_change` in one thread; `trouble`, `handle_age`, `fault_text`
/// in any; the rest in the controlling thread. `read` and `write` take no lock or memory and do not wait.
class Device {
 public:
  /// Connects and measures the service's rate. Throws std::runtime_error: what, and what to do.
  explicit Device(const DeviceOptions& options = {});
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  [[nodiscard]] trephine::DeviceCapabilities capabilities() const { return capabilities_; }
  [[nodiscard]] trephine::DeviceStatus read(trephine::DeviceState& state) noexcept;
  trephine::DeviceStatus write(const trephine::Wrenchd& wrench_H_D) noexcept;

  /// Sends a last zero and closes the connection; after the servo loop's last tick. Safe to call twice.
  void stop() noexcept;
  /// Times from sending a message to its state [s]; after `stop`.
  [[nodiscard]] trephine::TimeSummary round_trip() const { return round_trip_.summary(); }

  [[nodiscard]] const std::vector<std::string>& warnings() const noexcept { return warnings_; }
  [[nodiscard]] Trouble trouble() const noexcept { return shown_trouble_.load(std::memory_order_relaxed); }
  /// Time since the handle's rotation last changed [s]; a handle at rest may repeat itself.
  [[nodiscard]] double handle_age() const noexcept;
  [[nodiscard]] std::string fault_text() const;
  /// Takes the oldest change that was not taken yet. More than a hundred that nobody takes are dropped.
  [[nodiscard]] bool next_change(Change& change) noexcept;

 private:
  using State = exchange::State;
  using Force = exchange::Force;
  enum class Fault : std::uint8_t { kNone, kGivenUp, kNonFinite };

  // The exchanging thread's, and the constructor's before it starts.
  Trouble connect(Clock::duration limit);
  Trouble probe();
  void exchange_messages();
  void reconnect();
  void on_message();
  void on_timeout();
  void send_newest();
  void send(const trephine::Vec3d& force);
  void fail(Trouble trouble);
  void publish();

  DeviceOptions options_;
  trephine::DeviceCapabilities capabilities_;
  std::vector<std::string> warnings_;
  const Clock::time_point opened_ = Clock::now();

  // The exchanging thread's.
  std::unique_ptr<Connection> connection_;
  Inventory inventory_;
  StateCheck check_;
  State state_;
  std::string message_;
  int outstanding_ = 0;     // messages whose states are due
  bool is_silent_ = false;  // a zero was sent because a state was due
  bool has_bell_ = false;   // the servo loop wrote while a state was due
  bool pushes_ = false;     // the last force was not zero
  bool is_lost_ = false;    // the connection, since `lost_at_`
  Clock::time_point sent_at_, lost_at_;
  trephine::TimeHistogram round_trip_;

  State seen_;  // the servo thread's
  std::atomic<Fault> fault_{Fault::kNone};

  trephine::Mailbox<State> states_;
  trephine::Mailbox<Force> forces_;
  std::atomic<Trouble> shown_trouble_{Trouble::kStart};
  std::atomic<Clock::rep> turned_{0};
  std::array<Change, 128> changes_{};
  std::atomic<std::uint32_t> changes_made_{0}, changes_taken_{0};
  std::atomic<bool> quit_{false};
  std::thread thread_;
};

static_assert(trephine::HapticDevice<Device>);

}  // namespace haply
