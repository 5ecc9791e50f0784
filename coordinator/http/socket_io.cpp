// Reading and writing with deadlines.
#include <boost/asio/buffer.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "coordinator/http/connection.h"

namespace ls::http {

using boost::system::error_code;

// A deadline can't be given to one read: when it passes, whatever waits on the socket is cancelled. The
// socket stays open, so that a request that was too slow still gets an answer.
void Connection::arm(SteadyClock::time_point deadline) {
  timed_out_ = false;
  deadline_ = deadline;
  watchdog_.expires_at(deadline);
  watchdog_.async_wait([this, alive = std::weak_ptr(alive_)](error_code ec) {
    if (ec || alive.expired() || SteadyClock::now() < deadline_) return;
    timed_out_ = true;
    error_code ignored;
    socket_.cancel(ignored);
  });
}

void Connection::disarm() {
  deadline_ = SteadyClock::time_point::max();
  watchdog_.cancel();
}

SteadyClock::time_point Connection::pace(SteadyClock::time_point began, std::uint64_t bytes) const {
  return began + steady_seconds(limits_.body_grace_seconds + static_cast<double>(bytes) / limits_.min_rate);
}

net::awaitable<Connection::Read> Connection::fill() {
  if (buffer_.size() >= kReadBuffer) co_return Read::malformed;
  error_code ec;
  const auto space = buffer_.prepare(kReadBuffer - buffer_.size());
  const std::size_t n = co_await socket_.async_read_some(space, net::redirect_error(net::use_awaitable, ec));
  if (ec) co_return timed_out_ ? Read::too_slow : Read::closed;
  buffer_.commit(n);
  co_return Read::ok;
}

net::awaitable<bool> Connection::write_all(std::string_view head, std::span<const std::byte> body) {
  const auto began = SteadyClock::now();
  const std::size_t total = head.size() + body.size();
  std::size_t sent = 0;
  while (sent < total) {
    arm(pace(began, sent));
    const std::string_view head_left = head.substr(std::min(sent, head.size()));
    const auto body_left = body.subspan(sent - std::min(sent, head.size()));
    const std::array<net::const_buffer, 2> buffers = {
        net::buffer(head_left.data(), head_left.size()),
        net::buffer(body_left.data(), std::min(body_left.size(), kWriteSlice))};
    error_code ec;
    sent += co_await socket_.async_write_some(buffers, net::redirect_error(net::use_awaitable, ec));
    if (ec) co_return false;
  }
  disarm();
  co_return true;
}

// Closing while the client still sends would reset the connection and lose the answer: read on for a little.
net::awaitable<void> Connection::linger() {
  error_code ec;
  socket_.shutdown(Tcp::socket::shutdown_send, ec);
  arm(SteadyClock::now() + steady_seconds(limits_.linger_seconds));
  for (std::uint64_t total = buffer_.size(); total < kLingerBytes; total += buffer_.size()) {
    buffer_.consume(buffer_.size());
    if (co_await fill() != Read::ok) break;
  }
}

}  // namespace ls::http
