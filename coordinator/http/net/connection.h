// One client's connection, from accept to close, served by a coroutine on the network thread (the one thread
// that waits for all sockets). Includes Boost: only the files of the server loop may include this header.
#pragma once

#include <boost/asio/async_result.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <chrono>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <type_traits>
#include <utility>

#include "coordinator/http/api/api.h"
#include "coordinator/http/net/byte_stream.h"
#include "coordinator/http/net/event_queue.h"
#include "coordinator/http/net/request_head.h"

namespace ls::http {

using SteadyClock = std::chrono::steady_clock;

inline SteadyClock::duration steady_seconds(double seconds) {
  return std::chrono::duration_cast<SteadyClock::duration>(std::chrono::duration<double>(seconds));
}

// Runs blocking work on a thread pool. The coroutine that awaits run_on() resumes on the network thread with
// the result. `work` must not throw and must return a movable value. A work guard must keep `io` running
// until `work` has returned.
template <class Work>
net::awaitable<std::invoke_result_t<Work&>> run_on(net::thread_pool& pool, net::io_context& io, Work work) {
  using Value = std::invoke_result_t<Work&>;
  auto initiate = [&pool, &io, work = std::move(work)](auto handler) mutable {
    net::post(pool, [&io, work = std::move(work), handler = std::move(handler)]() mutable {
      Value value = work();
      net::post(io, [value = std::move(value), handler = std::move(handler)]() mutable {
        std::move(handler)(std::move(value));
      });
    });
  };
  co_return co_await net::async_initiate<const net::use_awaitable_t<>, void(Value)>(std::move(initiate),
                                                                                    net::use_awaitable);
}

class Connection;

// State that all connections share. Only the network thread uses it; work that may block is passed to the
// thread pools.
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
  // For a server that stops: closes the connection immediately if no request is in progress, else after the
  // answer to that request.
  void wind_down();
  void cut();  // closes the connection immediately

 private:
  // The result of reading a request's body. `answer` is the response to the request if it is known already:
  // the body was rejected (the client may still be sending the rest), or the BodySink, which receives bodies
  // piece by piece, has processed all of it.
  struct Body {
    Read read = Read::ok;
    std::optional<Response> answer;
  };

  net::awaitable<bool> open();       // false: the caller closes the connection
  net::awaitable<bool> serve_one();  // false: the caller closes the connection
  net::awaitable<bool> serve_match(Parser& parser, const Match& match, Request& request);
  net::awaitable<Response> handle_on_executor(const Match& match, const Request& request);

  // Deadlines
  void arm(SteadyClock::time_point deadline);
  void watch(SteadyClock::time_point until);
  void disarm();
  SteadyClock::time_point pace(SteadyClock::time_point began, std::uint64_t bytes) const;

  // Reading
  net::awaitable<Read> fill();  // reads more bytes into buffer_
  net::awaitable<Read> read_header(Parser& parser);
  net::awaitable<Body> read_whole(Parser& parser, Request& request, std::uint64_t limit);
  net::awaitable<Body> read_streamed(Parser& parser, const Match& match, const Request& request);
  net::awaitable<Body> read_into(Parser& parser, BodySink& sink);
  net::awaitable<Read> read_portion(Parser& parser, SteadyClock::time_point began, std::uint64_t& received);
  net::awaitable<bool> send_continue(const Request& request);
  // Counts `bytes` in Shared::buffered as the size of this connection's request body, in place of the size
  // counted before. False: nothing is counted, since all bodies together would exceed kMaxBuffered.
  bool charge(std::uint64_t bytes);

  // Writing
  net::awaitable<bool> answer(const Request& request, const Response& response, bool keep_alive);
  net::awaitable<void> answer_unread(const Response& response);
  net::awaitable<void> answer_failed_read(Read read);
  // Counts `bytes` in Shared::answers as the size of this connection's answer, in place of the size counted
  // before. False: nothing is counted, since all answers together would exceed kMaxAnswers.
  bool charge_answer(std::uint64_t bytes);
  net::awaitable<bool> write_all(std::string_view head, std::span<const std::byte> body);
  net::awaitable<bool> write_file(std::string_view head, const FileBody& file);
  // Sends `head` and `body`; `body` is the whole body of a response or a slice of it. The transfer of the
  // whole body began at `began`; `sent` is its number of bytes sent so far, to which this call adds. False:
  // the client receives too slowly (see Limits::min_rate) or has gone.
  net::awaitable<bool> write_paced(std::string_view head, std::span<const std::byte> body,
                                   SteadyClock::time_point began, std::uint64_t& sent);
  net::awaitable<void> linger();

  // Event streams (defined in event_writer.cpp)
  net::awaitable<void> stream_events(const Request& request, const Response& response);
  net::awaitable<void> write_events(EventQueue& queue, const Caller& reader);
  net::awaitable<void> reader_leaves();

  Stream stream_;
  Shared& shared_;
  const Limits& limits_;
  net::steady_timer watchdog_;
  SteadyClock::time_point deadline_ = SteadyClock::time_point::max();
  bool timed_out_ = false;
  bool idle_ = true;
  net::steady_timer* events_wait_ = nullptr;  // timer on which an event stream waits; null: no stream runs
  std::uint64_t charged_ = 0, answer_charged_ = 0;
  beast::flat_buffer buffer_;
  // Callbacks hold a weak_ptr to alive_ and do nothing once the connection has been destroyed.
  std::shared_ptr<const bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace ls::http
