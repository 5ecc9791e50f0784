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

#include "coordinator/base/turns.h"
#include "coordinator/http/api/api.h"
#include "coordinator/http/net/byte_stream.h"
#include "coordinator/http/net/event_queue.h"
#include "coordinator/http/net/pace.h"
#include "coordinator/http/net/request_head.h"
#include "coordinator/http/net/shares.h"

namespace ls::http {

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

// Threads for one kind of work. Callers take turns (only the network thread uses `turns`): there are at least
// twice as many threads as one caller may use, so that one caller's work never holds up another's.
struct Pool {
  explicit Pool(const PoolSize& size)
      : threads(size.threads), turns({.places = size.threads, .places_each = size.each}) {}

  net::thread_pool threads;
  coordinator::Turns turns;
};

class Connection;

// State that all connections share. Only the network thread uses it; work that may block is passed to the
// thread pools.
struct Shared {
  Shared(net::io_context& network, Api& routes)
      : io(network),
        api(routes),
        quick(routes.limits().quick),
        slow(routes.limits().slow),
        bundles(routes.limits().bundles),
        remote(routes.limits().remote),
        bodies(routes.limits().body_memory),
        answers(routes.limits().answer_memory) {}

  net::io_context& io;
  Api& api;
  Pool quick, slow, bundles, remote;
  std::set<Connection*> open;
  std::size_t event_streams = 0;
  Shares bodies;   // bytes of request bodies in memory
  Shares answers;  // bytes of answers in memory
  bool stopping = false;
};

class Connection {
 public:
  Connection(Tcp::socket socket, std::shared_ptr<const TlsIdentity> tls, Shared& shared);
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  net::awaitable<void> serve();

  // Text under which this client's use is counted: "token ID" from its first request with a right token on,
  // else its address.
  const std::string& client() const { return client_; }
  bool known() const { return known_; }  // true: a request on this connection had a right token
  // True if the connection may be closed to make room for others: it is silent between requests, or nobody
  // has shown a token on it and it has sent no whole request.
  bool may_yield() const { return !leaving_ && (idle_ || (!known_ && !serving_)); }
  SteadyClock::time_point opened() const { return opened_; }
  bool older_than(double seconds) const;
  bool streams_events() const { return streaming_; }
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
  // nullopt: the client has left while its request waited for its turn, so that nobody needs the answer
  net::awaitable<std::optional<Response>> handle_on_executor(const Match& match, const Request& request);
  // Notes whose connection this is from now on. If this caller has too many, the oldest that is silent
  // between requests is closed. False: there is none.
  bool note_caller(const Request& request);

  // A request's turn on a pool: waits with the network thread free, and gives the turn back when destroyed.
  struct Turn {
    Turn(Connection& connection, Pool& pool);
    ~Turn() { pool.turns.leave(ticket); }
    Turn(const Turn&) = delete;
    net::awaitable<void> come();

    Pool& pool;
    net::steady_timer wait;
    coordinator::Turns::Ticket ticket = 0;
    bool come_already = false;
  };
  // Runs blocking work on the pool, when it is this caller's turn.
  template <class Work>
  net::awaitable<std::invoke_result_t<Work&>> work_on(Pool& pool, Work work) {
    Turn turn(*this, pool);
    co_await turn.come();
    co_return co_await run_on(pool.threads, shared_.io, std::move(work));
  }

  // Deadlines
  void arm(SteadyClock::time_point deadline);
  void watch(SteadyClock::time_point until);
  void disarm();
  TransferPace new_pace() const;

  // Reading
  net::awaitable<Read> fill();  // reads more bytes into buffer_
  net::awaitable<Read> read_header(Parser& parser);
  net::awaitable<Body> read_whole(Parser& parser, Request& request, std::uint64_t limit);
  net::awaitable<Body> read_streamed(Parser& parser, const Match& match, const Request& request);
  net::awaitable<Body> read_into(Parser& parser, BodySink& sink);
  net::awaitable<Read> read_portion(Parser& parser, TransferPace& pace, std::uint64_t& received);
  net::awaitable<bool> send_continue(const Request& request);

  // Writing
  net::awaitable<bool> answer(const Request& request, const Response& response, bool keep_alive);
  net::awaitable<void> answer_unread(const Response& response);
  net::awaitable<void> answer_failed_read(Read read);
  net::awaitable<bool> write_all(std::string_view head, std::span<const std::byte> body);
  net::awaitable<bool> write_file(std::string_view head, const FileBody& file);
  // Sends `head` and `body`; `body` is the whole body of a response or a slice of it. False: the client
  // receives too slowly (see Limits::min_rate) or has gone.
  net::awaitable<bool> write_paced(std::string_view head, std::span<const std::byte> body,
                                   TransferPace& pace);
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
  bool idle_ = true;      // true while no byte of a request has arrived
  bool serving_ = false;  // true from the end of a request's body to the end of its answer
  bool known_ = false;
  bool leaving_ = false;    // true after cut()
  bool streaming_ = false;  // true while this is an event stream
  const SteadyClock::time_point opened_;
  std::string client_;  // as client() says
  std::string caller_;  // the same of the present request alone: its token, or the address
  net::steady_timer* events_wait_ = nullptr;  // timer on which an event stream waits; null: no stream runs
  Shares::Held body_memory_, answer_memory_;
  beast::flat_buffer buffer_;
  // Callbacks hold a weak_ptr to alive_ and do nothing once the connection has been destroyed.
  std::shared_ptr<const bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace ls::http
