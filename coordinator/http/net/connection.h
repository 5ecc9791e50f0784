// One client's connection, from accept to close, served by a coroutine on the network thread (the one thread
// that waits for all sockets). Includes Boost: only the files of the server loop may include this header.
#pragma once

#include <array>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <chrono>
#include <cstdint>
#include <memory>
#include <set>
#include <string>

#include "coordinator/http/api/api.h"
#include "coordinator/http/net/byte_stream.h"
#include "coordinator/http/net/event_queue.h"
#include "coordinator/http/net/request_head.h"

namespace ls::http {

namespace net = boost::asio;
using Tcp = net::ip::tcp;
using SteadyClock = std::chrono::steady_clock;

inline SteadyClock::duration steady_seconds(double seconds) {
  return std::chrono::duration_cast<SteadyClock::duration>(std::chrono::duration<double>(seconds));
}

class Connection;

// State that all connections share. Only the network thread uses it, except for the thread pools.
struct Shared {
  net::io_context& io;
  net::thread_pool& quick;
  net::thread_pool& slow;
  net::thread_pool& bundles;
  net::thread_pool& remote;
  Api& api;
  std::set<Connection*> open;
  std::size_t event_streams = 0;
  std::uint64_t buffered = 0;  // bytes of request bodies in memory
  std::uint64_t answers = 0;   // bytes of answers in memory
  bool stopping = false;
};

class Connection {
 public:
  Connection(Tcp::socket socket, std::shared_ptr<const TlsIdentity> tls, Shared& shared);
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  net::awaitable<void> serve();

  bool idle() const { return idle_; }
  // For a stopping server: closes the connection now if no request is in progress, else after the answer to
  // that request.
  void wind_down();
  void cut();  // closes now

 private:
  enum class Read { ok, closed, too_slow, malformed, header_too_large };
  // The result of reading a body. If `answer` is set, the body was rejected with it, and the client may still
  // be sending the rest.
  struct Body {
    Read read = Read::ok;
    std::optional<Response> answer;
  };

  // connection.cpp
  net::awaitable<bool> open();       // false: the caller closes the connection
  net::awaitable<bool> serve_one();  // false: the caller closes the connection
  net::awaitable<Read> read_header(Parser& parser);
  net::awaitable<bool> serve_match(Parser& parser, const Match& match, Request& request);
  net::awaitable<Response> handle_on_executor(const Match& match, const Request& request);
  // Counts an answer of this many bytes in Shared::answers. False: all answers together would exceed
  // kMaxAnswers.
  bool charge_answer(std::uint64_t bytes);
  net::awaitable<bool> answer(const Request& request, const Response& response, bool keep_alive);
  net::awaitable<void> answer_unread(const Response& response);
  net::awaitable<void> answer_failed_read(Read read);

  // body_reader.cpp
  net::awaitable<Body> read_whole(Parser& parser, Request& request, std::uint64_t limit);
  net::awaitable<Body> read_streamed(Parser& parser, const Match& match, const Request& request);
  net::awaitable<Body> read_into(Parser& parser, BodySink& sink);
  net::awaitable<Read> read_portion(Parser& parser, std::string& into, SteadyClock::time_point began,
                                    std::uint64_t& received);
  net::awaitable<bool> send_continue(const Request& request);
  // Counts a request's body of this many bytes in Shared::buffered. False: all bodies together would exceed
  // kMaxBuffered.
  bool charge(std::uint64_t bytes);

  // event_writer.cpp
  net::awaitable<void> stream_events(const Request& request, const Response& response);
  net::awaitable<void> write_events(EventQueue& queue, const Caller& reader);
  void watch_reader();

  // socket_io.cpp
  net::awaitable<Read> fill();  // reads more bytes into buffer_
  net::awaitable<bool> write_all(std::string_view head, std::span<const std::byte> body);
  net::awaitable<bool> write_file(std::string_view head, const FileBody& file);
  // Sends `head` and `body`, which is all or a slice of a response's body. Of the whole, `sent` bytes have
  // been sent since `began`; it is increased by what is sent now. False: the client takes the bytes too
  // slowly (see Limits::min_rate) or has gone.
  net::awaitable<bool> write_paced(std::string_view head, std::span<const std::byte> body,
                                   SteadyClock::time_point began, std::uint64_t& sent);
  net::awaitable<void> linger();
  void arm(SteadyClock::time_point deadline);
  void disarm();
  SteadyClock::time_point pace(SteadyClock::time_point began, std::uint64_t bytes) const;

  Stream stream_;
  Shared& shared_;
  const Limits& limits_;
  net::steady_timer watchdog_;
  SteadyClock::time_point deadline_ = SteadyClock::time_point::max();
  bool timed_out_ = false;
  bool idle_ = true;
  bool reader_gone_ = false;                  // the reader of an event stream has closed the connection
  net::steady_timer* events_wait_ = nullptr;  // set while an event stream runs
  std::uint64_t charged_ = 0, answer_charged_ = 0;
  std::array<char, 64> discard_{};
  beast::flat_buffer buffer_;
  // Callbacks hold a weak_ptr to this and do nothing once the connection has been destroyed.
  std::shared_ptr<const bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace ls::http
