// SPDX-License-Identifier: MIT
#include "connection.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/address.hpp>

#include <stdexcept>

namespace haply {

namespace asio = boost::asio;
namespace beast = boost::beast;
using asio::ip::tcp;
using asio::ip::udp;
using Error = boost::system::error_code;

struct Connection::Session {
  explicit Session(asio::io_context& io) : socket(io) {}
  Socket socket;
  beast::flat_buffer in{kMessageLimit + 1024};
  std::string out;
  bool is_reading = false, has_message = false, is_sending = false, is_closed = false;
  bool handshake_done = false, is_good = false;
};

Connection::Connection() {
  const udp::endpoint loopback(asio::ip::address_v4::loopback(), 0);
  Error error;
  for (udp::socket* s : {&bell_, &clapper_}) {
    if (!error) s->open(udp::v4(), error);
    if (!error) s->bind(loopback, error);
    if (!error) s->non_blocking(true, error);
  }
  if (!error) bell_.connect(clapper_.local_endpoint(), error);
  if (!error) clapper_.connect(bell_.local_endpoint(), error);
  if (error) throw std::runtime_error("no socket on the loopback address: " + error.message());
}

Connection::~Connection() { close(); }

void Connection::ring() noexcept {
  const char byte = 0;
  Error ignored;  // a full queue of knocks is as good as one more
  clapper_.send(asio::buffer(&byte, 1), 0, ignored);
}

void Connection::listen_to_bell() noexcept {
  if (has_bell_read_) return;
  has_bell_read_ = true;
  bell_.async_receive(asio::buffer(&knock_, 1), [this](const Error&, std::size_t) {
    has_bell_read_ = false;
    rung_ = true;
    Error error;
    for (int more = 0; more < 1000 && !error; ++more) bell_.receive(asio::buffer(&knock_, 1), 0, error);
  });
}

bool Connection::run_until(const bool& done, Clock::time_point deadline) noexcept {
  try {
    io_.restart();
    while (!done && io_.run_one_until(deadline) > 0) {
    }
  } catch (...) {  // out of memory, or a system without timers: as if nothing had come
  }
  return done;
}

bool Connection::open(const std::string& address, unsigned short port, Clock::time_point deadline) noexcept {
  close();
  try {
    const auto session = std::make_shared<Session>(io_);
    const tcp::endpoint endpoint(asio::ip::make_address(address), port);
    const std::string host = address + ":" + std::to_string(port);
    session->socket.next_layer().async_connect(endpoint, [session, host](const Error& refused) {
      session->handshake_done = static_cast<bool>(refused);
      if (refused) return;
      Error ignored;
      session->socket.next_layer().set_option(tcp::no_delay(true), ignored);
      session->socket.read_message_max(kMessageLimit);
      session->socket.auto_fragment(false);
      session->socket.async_handshake(host, "/", [session](const Error& error) {
        session->handshake_done = true;
        session->is_good = !error;
      });
    });
    socket_ = session;
    if (run_until(session->handshake_done, deadline) && session->is_good) return true;
  } catch (...) {  // an address that is none, or no memory
  }
  close();
  return false;
}

void Connection::close() noexcept {
  if (socket_ == nullptr) return;
  try {
    Error ignored;
    socket_->socket.next_layer().shutdown(tcp::socket::shutdown_both, ignored);
    socket_->socket.next_layer().close(ignored);
    socket_.reset();
    io_.restart();
    io_.poll();  // the handlers, which keep the session until they have run
  } catch (...) {
  }
}

void Connection::start_reading() noexcept {
  const auto session = socket_;
  if (session == nullptr || session->is_reading || session->has_message || session->is_closed) return;
  session->is_reading = true;
  session->socket.async_read(session->in, [session](const Error& error, std::size_t) {
    session->is_reading = false;
    session->has_message = !error && session->socket.got_text();
    session->is_closed = !session->has_message;
  });
}

Connection::Event Connection::wait(Clock::time_point deadline) noexcept {
  try {
    if (socket_ != nullptr && socket_->has_message) {  // the one that was announced before
      socket_->in.consume(socket_->in.size());
      socket_->has_message = false;
    }
    bool is_late = false;
    for (;;) {
      listen_to_bell();
      start_reading();
      if (socket_ != nullptr && socket_->is_closed) {
        close();
        return Event::kClosed;
      }
      if (socket_ != nullptr && socket_->has_message) return Event::kMessage;
      if (rung_) {
        rung_ = false;
        return Event::kBell;
      }
      if (is_late) return Event::kTimeout;
      io_.restart();
      if (io_.run_one_until(deadline) > 0) continue;
      io_.poll();  // after a deadline the other call looks at nothing
      is_late = true;
    }
  } catch (...) {
    close();
    return Event::kClosed;
  }
}

std::string_view Connection::message() const noexcept {
  if (socket_ == nullptr || !socket_->has_message) return {};
  const auto bytes = socket_->in.data();
  return {static_cast<const char*>(bytes.data()), bytes.size()};
}

bool Connection::send(std::string_view message) noexcept {
  try {
    const auto session = socket_;
    if (session == nullptr || session->is_closed) return true;  // `wait` tells of it
    if (session->is_sending) {
      io_.restart();
      io_.poll();
      if (session->is_sending) return false;
    }
    session->out.assign(message);
    session->is_sending = true;
    session->socket.text(true);
    session->socket.async_write(asio::buffer(session->out), [session](const Error& error, std::size_t) {
      session->is_sending = false;
      if (error) session->is_closed = true;
    });
  } catch (...) {
    close();
  }
  return true;
}

}  // namespace haply
