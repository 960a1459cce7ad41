// SPDX-License-Identifier: MIT
#pragma once

#include "bridge_core.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/steady_timer.hpp>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

namespace robots {

namespace asio = boost::asio;
using asio::ip::udp;

/// A BridgeCore at a UDP port, IPv4. One thread runs the context, and all calls but `io_context::stop` are its own.
class UdpBridge {
 public:
  /// Binds the address; port 0 takes a free one. Throws boost::system::system_error if that fails.
  UdpBridge(asio::io_context& context, const asio::ip::address_v4& address, std::uint16_t port, BridgeCore& core)
      : socket_(context, udp::endpoint(address, port)), timer_(context), core_(core) {
    socket_.non_blocking(true);
    receive();
    watch();
  }

  [[nodiscard]] udp::endpoint endpoint() const { return socket_.local_endpoint(); }
  /// Time on the bridge's clock [s].
  [[nodiscard]] static double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  }

 private:
  static constexpr auto kWatch = std::chrono::milliseconds(1);
  static constexpr int kMostErrors = 1000;  // one after the other: the socket is broken

  void receive() {
    socket_.async_receive_from(asio::buffer(buffer_), from_, [this](boost::system::error_code error, std::size_t size) {
      if (error == asio::error::operation_aborted) return;
      // Windows reports a robot that is gone as an error of the next call.
      if (error && ++errors_ > kMostErrors) throw boost::system::system_error(error, "robot_bridge's socket");
      if (!error) {
        errors_ = 0;
        send(core_.receive(std::string_view(buffer_.data(), size), sender(from_), now()));
      }
      receive();
    });
  }
  void watch() {
    timer_.expires_after(kWatch);
    timer_.async_wait([this](boost::system::error_code error) {
      if (error) return;
      send(core_.watch(now()));
      watch();
    });
  }

  void send(const std::optional<Command>& command) {
    if (!command || !core_.robot()) return;
    const BridgeCore::Sender to = *core_.robot();
    const udp::endpoint robot(asio::ip::address_v4(static_cast<std::uint32_t>(to >> 16)),
                              static_cast<std::uint16_t>(to & 0xffff));
    boost::system::error_code ignored;  // a lost command is silence, which the robot must bear anyway
    socket_.send_to(asio::buffer(to_json(*command)), robot, 0, ignored);
  }
  [[nodiscard]] static BridgeCore::Sender sender(const udp::endpoint& from) {
    return BridgeCore::Sender{from.address().to_v4().to_uint()} << 16 | from.port();
  }

  udp::socket socket_;
  asio::steady_timer timer_;
  BridgeCore& core_;
  udp::endpoint from_;
  std::array<char, kLargestMessage + 1> buffer_{};  // one more, so that a longer message is not taken for a whole one
  int errors_ = 0;
};

}  // namespace robots
