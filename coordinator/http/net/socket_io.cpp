// Reading and writing with deadlines.
#include <boost/asio/buffer.hpp>

#include "coordinator/http/net/connection.h"
#include "coordinator/http/net/run_on.h"

namespace ls::http {

using boost::system::error_code;

// Sets the deadline of the operations that follow. Asio gives single reads no deadline; so when it passes,
// all pending operations on the socket are cancelled. The socket stays open, so that a client whose request
// was too slow still gets an answer.
void Connection::arm(SteadyClock::time_point deadline) {
  timed_out_ = false;
  deadline_ = deadline;
  watchdog_.expires_at(deadline);
  watchdog_.async_wait([this, alive = std::weak_ptr(alive_)](error_code ec) {
    if (ec || alive.expired() || SteadyClock::now() < deadline_) return;
    timed_out_ = true;
    stream_.cancel();
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
  const std::size_t n = co_await stream_.read_some(space, ec);
  if (ec) co_return timed_out_ ? Read::too_slow : Read::closed;
  buffer_.commit(n);
  co_return Read::ok;
}

net::awaitable<bool> Connection::write_all(std::string_view head, std::span<const std::byte> body) {
  std::uint64_t sent = 0;
  const bool written = co_await write_paced(head, body, SteadyClock::now(), sent);
  if (written) disarm();
  co_return written;
}

net::awaitable<bool> Connection::write_paced(std::string_view head, std::span<const std::byte> body,
                                             SteadyClock::time_point began, std::uint64_t& sent) {
  const std::size_t total = head.size() + body.size();
  std::size_t done = 0;
  while (done < total) {
    arm(pace(began, sent));
    const std::string_view head_left = head.substr(std::min(done, head.size()));
    const auto body_left = body.subspan(done - std::min(done, head.size()));
    const std::array<net::const_buffer, 2> buffers = {
        net::buffer(head_left.data(), head_left.size()),
        net::buffer(body_left.data(), std::min(body_left.size(), kWriteSlice))};
    error_code ec;
    const std::size_t n = co_await stream_.write_some(buffers, ec);
    done += n;
    sent += n;
    if (ec) co_return false;
  }
  co_return true;
}

net::awaitable<bool> Connection::write_file(std::string_view head, const FileBody& file) {
  const auto began = SteadyClock::now();
  std::uint64_t sent = 0;
  std::vector<std::byte> slice(kWriteSlice);
  for (std::uint64_t offset = 0; offset < file.size;) {
    disarm();  // time spent on the disk does not count; only writing to the client does
    auto work = [&slice, &file, offset] {
      return read_slice(file, offset,
                        std::span(slice).first(std::min<std::uint64_t>(slice.size(), file.size - offset)));
    };
    const std::size_t n = co_await run_on(shared_.slow, shared_.io, std::move(work));
    if (n == 0) co_return false;
    if (!co_await write_paced(offset == 0 ? head : std::string_view(), std::span(slice).first(n), began,
                              sent))
      co_return false;
    offset += n;
  }
  if (file.size == 0) co_return co_await write_all(head, {});
  disarm();
  co_return true;
}

// Ends the answer, then reads on for a while and throws away what arrives. Closing the connection while the
// client still sends would reset it, and the client would lose the answer.
net::awaitable<void> Connection::linger() {
  arm(SteadyClock::now() + steady_seconds(limits_.linger_seconds));
  co_await stream_.send_goodbye();
  for (std::uint64_t total = buffer_.size(); total < kLingerBytes; total += buffer_.size()) {
    buffer_.consume(buffer_.size());
    if (co_await fill() != Read::ok) break;
  }
}

}  // namespace ls::http
