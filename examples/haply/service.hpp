// SPDX-License-Identifier: MIT
#pragma once

#include "simulated_arm.hpp"

#include <trephine/core/math.hpp>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

/// A loopback service that speaks the Inverse Service's protocol for a simulated arm, to test clients without hardware.
namespace haply {

/// The version that the loopback service tells.
inline constexpr const char* kServiceVersion = "1.0";

enum class Fault : std::uint8_t {
  kNone,
  kLate,
  kSilent,
  kHang,
  kKilled,
  kFrozen,
  kNan,
  kJump,
  kRange,
  kUnplugged,
  kNotReady,
  kHandle,
  kGarbage,
  kShape,
  kHuge,
  kFlood,
};

struct FaultText {
  Fault fault;
  const char* name;
  const char* text;
};
inline constexpr std::array<FaultText, 15> kFaults{{
    {Fault::kLate, "late", "each state comes 20 ms after its message"},
    {Fault::kSilent, "silent", "messages are read, no state follows"},
    {Fault::kHang, "hang", "nothing is read or sent, the connection stays"},
    {Fault::kKilled, "killed", "the connection is reset and no new one accepted"},
    {Fault::kFrozen, "frozen", "one state of a moving arm is repeated"},
    {Fault::kNan, "nan", "the position is null, as JSON writes a NaN"},
    {Fault::kJump, "jump", "the position jumps by 50 mm"},
    {Fault::kRange, "range", "the position is 100 m away"},
    {Fault::kUnplugged, "unplugged", "the list of arms is empty"},
    {Fault::kNotReady, "not-ready", "the arm's status is: not calibrated"},
    {Fault::kHandle, "handle", "the handle is not connected"},
    {Fault::kGarbage, "garbage", "states are cut in the middle"},
    {Fault::kShape, "shape", "states are JSON of another shape"},
    {Fault::kHuge, "huge", "states are 1 MB long"},
    {Fault::kFlood, "flood", "a hundred states follow one message"},
}};

struct ServiceOptions {
  std::string address = "127.0.0.1";
  unsigned short port = 10001;  ///< 0: any that is free
  double rate = 0;              ///< states a second at most [Hz]; 0: as fast as they are asked for
  bool handle = true;           ///< a wireless VerseGrip is there
  bool older = false;           ///< speaks as versions 3.1 to 3.4 do, not as 3.5
  /// The hand that holds the arm, in D; it is called in the service's thread.
  std::function<trephine::HandTarget(double time)> hand = SimulatedHand{};
  Fault fault = Fault::kNone;
  double fault_after = 1;  ///< after the client's first message [s]
  double fault_for = 0.3;  ///< [s]
};

/// What the service has seen. Times are on std::chrono::steady_clock, since the service's start [s].
struct Witness {
  std::uint64_t sessions = 0, messages = 0, states = 0;
  trephine::Vec3d force = trephine::Vec3d::Zero();     ///< on the arm [N]
  trephine::Vec3d position = trephine::Vec3d::Zero();  ///< [m]
  bool in_fault = false;
  std::optional<double> fault_at;  ///< first message that was not answered as usual
  std::optional<double> quiet_at;  ///< first zero force, or end of the session, after it
  int pushes = 0;                  ///< forces other than zero between the two
  std::optional<double> back_at;   ///< first force other than zero after that
  double back_force = 0;           ///< its size [N]
};

/// Runs in a thread of its own from construction to destruction. The arm is trephine's SimulatedDevice, advanced in
/// steps of 0.25 ms by the wall clock. A force acts until the next message, the end of the session, or 20 ms.
class Service {
 public:
  /// Throws std::runtime_error: what, and what to do.
  explicit Service(const ServiceOptions& options);
  ~Service();
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;

  [[nodiscard]] unsigned short port() const noexcept;
  /// Starts a fault now, for `seconds`; any thread.
  void inject(Fault fault, double seconds);
  [[nodiscard]] Witness witness() const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace haply
