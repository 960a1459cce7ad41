// SPDX-License-Identifier: MIT
#include "service.hpp"

#include "messages.hpp"
#include "simulated_arm.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>

namespace haply {

namespace asio = boost::asio;
namespace beast = boost::beast;
using asio::ip::tcp;
using Clock = std::chrono::steady_clock;
using Error = boost::system::error_code;
using Json = nlohmann::json;
using trephine::Vec3d;

namespace {

constexpr const char* kDeviceId = "04EA";
constexpr const char* kHandleId = "61576";
constexpr double kForceLasts = 0.02;     // [s] a command is for one tick and then forgotten
constexpr std::uint64_t kCatchUp = 400;  // steps at once after a pause
constexpr double kLate = 0.02;           // [s]
constexpr int kFlood = 100;
constexpr std::size_t kUnread = 1000;  // states at most that wait for the client to read

Clock::duration duration(double seconds) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

void set(Json& xyz, const Vec3d& v) {
  xyz["x"] = v.x();
  xyz["y"] = v.y();
  xyz["z"] = v.z();
}

}  // namespace

/// A client.
struct Session {
  explicit Session(tcp::socket socket) : ws(std::move(socket)) {}
  beast::websocket::stream<tcp::socket> ws;
  beast::flat_buffer in{kMessageLimit};
  std::deque<std::string> out;
  bool is_open = false;  // the handshake is over
  bool is_reading = false;
};

struct Service::Impl {
  explicit Impl(const ServiceOptions& o) : options(o), arm(o.hand), fault_timer(io) {
    listen();
    port = endpoint.port();
  }

  void listen() {
    Error error;
    const asio::ip::address address = asio::ip::make_address(options.address, error);
    if (!error) endpoint = tcp::endpoint(address, endpoint.port() != 0 ? endpoint.port() : options.port);
    acceptor = std::make_unique<tcp::acceptor>(io);
    if (!error) acceptor->open(endpoint.protocol(), error);
#if !defined(_WIN32)
    if (!error) acceptor->set_option(tcp::acceptor::reuse_address(true), error);  // elsewhere it shares the port
#endif
    if (!error) acceptor->bind(endpoint, error);
    if (!error) acceptor->listen(4, error);
    if (error)
      throw std::runtime_error("cannot serve at " + options.address + ":" + std::to_string(options.port) + " (" +
                               error.message() + "): end what has that port, or choose another with --port");
    endpoint = acceptor->local_endpoint();
    accept();
  }

  void accept() {
    acceptor->async_accept([this](const Error& error, tcp::socket socket) {
      if (error) return;
      accept();
      if (session != nullptr) return;  // one client at a time: the socket closes here
      Error ignored;
      socket.set_option(tcp::no_delay(true), ignored);
      const auto s = std::make_shared<Session>(std::move(socket));
      session = s;
      s->ws.read_message_max(kMessageLimit);
      s->ws.auto_fragment(false);
      s->ws.async_accept([this, s](const Error& refused) {
        if (refused) return end(s);
        s->is_open = true;
        {
          const std::lock_guard lock(mutex);
          ++seen.sessions;
        }
        advance();
        send(s, inventory());
        read(s);
      });
    });
  }

  void read(const std::shared_ptr<Session>& s) {
    if (!s->is_open || s->is_reading || s != session) return;
    s->is_reading = true;
    s->ws.async_read(s->in, [this, s](const Error& error, std::size_t) {
      s->is_reading = false;
      if (error || s != session) return end(s);
      const auto bytes = s->in.data();
      take({static_cast<const char*>(bytes.data()), bytes.size()});
      s->in.consume(s->in.size());
      answer(s);
      if (fault != Fault::kHang && fault != Fault::kKilled) read(s);
    });
  }

  /// The session is over: no force is left on the arm.
  void end(const std::shared_ptr<Session>& s) {
    if (s != session) return;
    session.reset();
    Error ignored;
    s->ws.next_layer().close(ignored);
    command(Vec3d::Zero());
  }

  /// Reads the client's message.
  void take(std::string_view message) {
    if (first_message < 0) first_message = now();
    advance();
    const Command given = parse_command(message, kDeviceId);
    const bool is_due = options.fault != Fault::kNone && now() - first_message >= options.fault_after;
    if (is_due) start_fault(std::exchange(options.fault, Fault::kNone), options.fault_for);
    {
      const std::lock_guard lock(mutex);
      ++seen.messages;
    }
    if (given.has_force) command(given.force);
  }

  void command(const Vec3d& force) {
    applied = force;
    applied_at = arm.time();
    const std::lock_guard lock(mutex);
    seen.force = force;
    const bool is_zero = force == Vec3d::Zero();
    if (!seen.fault_at) return;
    if (!seen.quiet_at) {
      if (is_zero) seen.quiet_at = now();
      if (!is_zero) ++seen.pushes;
    } else if (!is_zero && !seen.back_at) {
      seen.back_at = now();
      seen.back_force = force.norm();
    }
  }

  void start_fault(Fault which, double seconds) {
    fault = which;
    frozen.clear();
    end_fault_after(seconds);
    const std::lock_guard lock(mutex);
    seen.in_fault = true;
    seen.fault_at.reset();
    seen.quiet_at.reset();
    seen.back_at.reset();
    seen.pushes = 0;
  }

  void end_fault_after(double seconds) {
    fault_timer.expires_after(duration(seconds));
    fault_timer.async_wait([this](const Error& error) {
      if (error) return;
      try {
        if (fault == Fault::kKilled) listen();
      } catch (const std::runtime_error&) {
        return end_fault_after(0.1);  // the port is not free yet
      }
      fault = Fault::kNone;
      if (session != nullptr) read(session);  // after a hang
      const std::lock_guard lock(mutex);
      seen.in_fault = false;
    });
  }

  /// Sends the state that the client's message asks for, or does what the fault wants instead.
  void answer(const std::shared_ptr<Session>& s) {
    if (fault != Fault::kNone) {
      const std::lock_guard lock(mutex);
      if (!seen.fault_at) {
        seen.fault_at = now();
        if (seen.force == Vec3d::Zero()) seen.quiet_at = seen.fault_at;
      }
    }
    switch (fault) {
      case Fault::kSilent:
      case Fault::kHang:
        return;
      case Fault::kKilled: {
        acceptor->close();
        Error ignored;
        s->ws.next_layer().set_option(asio::socket_base::linger(true, 0), ignored);  // a reset, as a dead process's
        return end(s);
      }
      case Fault::kLate:
        return send_after(s, kLate);
      case Fault::kFlood:
        fault = Fault::kNone;  // once
        for (int i = 0; i < kFlood; ++i) send(s, state().dump());
        return;
      default:
        break;
    }
    if (options.rate > 0) {
      const double due = std::max(now(), next_sample);
      next_sample = due + 1 / options.rate;
      return send_after(s, due - now());
    }
    send(s, faulty());
  }

  void send_after(const std::shared_ptr<Session>& s, double seconds) {
    const auto timer = std::make_shared<asio::steady_timer>(io, duration(seconds));
    timer->async_wait([this, s, timer](const Error& error) {
      if (error || s != session) return;
      advance();
      send(s, faulty());
    });
  }

  void send(const std::shared_ptr<Session>& s, std::string text) {
    {
      const std::lock_guard lock(mutex);
      ++seen.states;
    }
    if (s->out.size() > kUnread) return end(s);  // the client asks and does not read
    s->out.push_back(std::move(text));
    if (s->out.size() == 1) write(s);
  }

  void write(const std::shared_ptr<Session>& s) {
    s->ws.text(true);
    s->ws.async_write(asio::buffer(s->out.front()), [this, s](const Error& error, std::size_t) {
      if (error || s != session) return end(s);
      s->out.pop_front();
      if (!s->out.empty()) write(s);
    });
  }

  /// Brings the arm up to the present, under the force in effect.
  void advance() {
    if (first_message < 0) return;
    const auto due = static_cast<std::uint64_t>((now() - first_message) / SimulatedArm::kStep) - skipped;
    if (due > arm.steps() + kCatchUp) skipped += due - arm.steps() - kCatchUp;
    for (std::uint64_t i = arm.steps(), n = std::min(due, i + kCatchUp); i < n; ++i) {
      if (arm.time() - applied_at > kForceLasts) applied.setZero();
      arm.step(applied);
    }
    const std::lock_guard lock(mutex);
    seen.position = arm.position();
  }

  /// The present state. Built once and then changed in place, which takes a tenth of the time.
  const Json& state() {
    const trephine::Quatd q = arm.rotation();
    const std::uint32_t buttons = arm.buttons();
    Json& device = all["inverse3"][0];
    Json& of_arm = device["state"];
    set(of_arm["cursor_position"], arm.position());
    set(of_arm["cursor_velocity"], arm.velocity());
    set(of_arm["current_cursor_force"], applied);
    of_arm["control_mode"] = applied == Vec3d::Zero() ? "idle" : "force";
    device["status"]["calibrated"] = fault != Fault::kNotReady;
    if (!options.handle) return all;
    Json& handle = all["wireless_verse_grip"][0];
    Json& orientation = handle["state"]["orientation"];
    set(orientation, q.vec());
    orientation["w"] = q.w();
    Json& pressed = handle["state"]["buttons"];
    pressed["a"] = (buttons & 1U) != 0;
    pressed["b"] = (buttons & 2U) != 0;
    pressed["c"] = (buttons & 4U) != 0;
    handle["status"]["connected"] = fault != Fault::kHandle;
    return all;
  }

  /// The first message: the state, and what does not change.
  std::string inventory() {
    Json first = state();
    first["inverse3"][0]["config"] = {{"type", "inverse3"}, {"handedness", "right"}, {"port", "simulated"}};
    if (options.handle)
      first["wireless_verse_grip"][0]["config"] = {{"type", "wireless_verse_grip"}, {"port", "simulated"}};
    return first.dump();
  }

  [[nodiscard]] Json first_state() const {
    Json built{{"inverse3", Json::array()}, {"wireless_verse_grip", Json::array()}, {"verse_grip", Json::array()}};
    built["inverse3"].push_back(
        {{"device_id", kDeviceId},
         {"state", Json::object()},
         {"status", {{"in_use", true}, {"power_supply", true}, {"ready", true}, {"started", true}}}});
    if (options.handle)
      built["wireless_verse_grip"].push_back({{"device_id", kHandleId},
                                              {"state", {{"battery_level", 0.9}}},
                                              {"status", {{"awake", true}, {"ready", true}}}});
    if (!options.older) built["session_id"] = 1;
    return built;
  }

  /// The message of a state, as the present fault wants it.
  std::string faulty() {
    if (fault == Fault::kNone) return state().dump();
    Json wrong = state();
    Json& position = wrong["inverse3"][0]["state"]["cursor_position"];
    switch (fault) {
      case Fault::kFrozen:
        if (frozen.empty()) frozen = wrong.dump();
        return frozen;
      case Fault::kNan:
        position["z"] = std::nan("");
        break;
      case Fault::kJump:
        position["y"] = arm.position().y() + 0.05;
        break;
      case Fault::kRange:
        position["x"] = 100.0;
        break;
      case Fault::kUnplugged:
        wrong["inverse3"] = Json::array();
        break;
      case Fault::kGarbage:
        return wrong.dump().substr(0, 200);
      case Fault::kShape:
        return Json({{"inverse3", {{kDeviceId, wrong["inverse3"][0]}}}}).dump();
      case Fault::kHuge:
        return std::string(1 << 20, ' ') + wrong.dump();
      default:
        break;
    }
    return wrong.dump();
  }

  [[nodiscard]] double now() const { return std::chrono::duration<double>(Clock::now() - began).count(); }

  ServiceOptions options;
  const Clock::time_point began = Clock::now();
  asio::io_context io{1};
  tcp::endpoint endpoint;
  unsigned short port = 0;
  std::unique_ptr<tcp::acceptor> acceptor;
  std::shared_ptr<Session> session;
  SimulatedArm arm;
  Json all = first_state();
  Vec3d applied = Vec3d::Zero();
  double applied_at = 0, first_message = -1, next_sample = 0;
  std::uint64_t skipped = 0;  // steps that a long pause left out
  Fault fault = Fault::kNone;
  asio::steady_timer fault_timer;
  std::string frozen;
  mutable std::mutex mutex;
  Witness seen;
  std::thread thread;
};

Service::Service(const ServiceOptions& options) : impl_(std::make_shared<Impl>(options)) {
  impl_->thread = std::thread([impl = impl_.get()] { impl->io.run(); });
}

Service::~Service() {
  impl_->io.stop();
  impl_->thread.join();
}

unsigned short Service::port() const noexcept { return impl_->port; }

void Service::inject(Fault fault, double seconds) {
  asio::post(impl_->io, [impl = impl_.get(), fault, seconds] { impl->start_fault(fault, seconds); });
}

Witness Service::witness() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->seen;
}

}  // namespace haply
