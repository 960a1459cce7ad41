// SPDX-License-Identifier: MIT
#pragma once

#include "messages.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket/stream.hpp>

#include <chrono>
#include <memory>
#include <string>

namespace haply {

/// A WebSocket of text messages whose every wait has an end, and a bell by which another thread ends a wait. One thread
/// calls everything but `ring`. No member throws, but the constructor.
class Connection {
 public:
  using Clock = std::chrono::steady_clock;
  enum class Event { kMessage, kBell, kClosed, kTimeout };

  /// Throws std::runtime_error if this machine has no loopback sockets.
  Connection();
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// Connects and shakes hands until `deadline`. `address` is numeric. False: there is no such service.
  [[nodiscard]] bool open(const std::string& address, unsigned short port, Clock::time_point deadline) noexcept;
  /// Closes at once, without a farewell that could wait.
  void close() noexcept;
  [[nodiscard]] bool is_open() const noexcept { return socket_ != nullptr; }

  /// Waits for a message, the bell or the end of the connection. A message that is no text, or longer than
  /// kMessageLimit, closes the connection. Without a connection only the bell ends the wait early.
  [[nodiscard]] Event wait(Clock::time_point deadline) noexcept;
  /// The message that `wait` announced, until the next call.
  [[nodiscard]] std::string_view message() const noexcept;

  /// Hands a message to the network. False: the one before is not gone yet, the other side does not read.
  [[nodiscard]] bool send(std::string_view message) noexcept;

  /// Ends a wait. From one other thread, without waiting, lock or allocation: a datagram of one byte to the loopback
  /// address, because waking a thread by other portable means takes a lock on some platforms.
  void ring() noexcept;

 private:
  using Socket = boost::beast::websocket::stream<boost::asio::ip::tcp::socket>;
  struct Session;  // what handlers of one connection refer to, and outlives it

  void listen_to_bell() noexcept;
  void start_reading() noexcept;
  bool run_until(const bool& done, Clock::time_point deadline) noexcept;

  boost::asio::io_context io_{1};
  boost::asio::ip::udp::socket bell_{io_}, clapper_{io_};
  char knock_ = 0;
  bool rung_ = false;
  bool has_bell_read_ = false;
  std::shared_ptr<Session> socket_;
};

}  // namespace haply
