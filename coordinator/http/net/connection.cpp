// Connection: one client's connection, served by a coroutine on the network thread (the one thread that waits
// for all sockets). Work that may block runs on thread pools.
#include "coordinator/http/net/connection.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/beast/core/buffers_prefix.hpp>
#include <boost/beast/core/buffers_suffix.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/http/read.hpp>
#include <exception>
#include <utility>

#include "coordinator/http/message/message.h"
#include "core/base/log.h"

namespace ls::http {

Connection::Connection(Tcp::socket socket, std::shared_ptr<const TlsIdentity> tls, Shared& shared)
    : stream_(std::move(socket), std::move(tls)),
      shared_(shared),
      limits_(shared.api.limits()),
      watchdog_(shared.io),
      opened_(SteadyClock::now()),
      client_(Throttle::group_of(stream_.peer())),
      buffer_(kReadBuffer) {
  shared_.open.insert(this);
  ++shared_.api.counters().connections;
}

Connection::~Connection() {
  shared_.open.erase(this);
  --shared_.api.counters().connections;
}

bool Connection::older_than(double seconds) const {
  return SteadyClock::now() - opened_ > steady_seconds(seconds);
}

void Connection::wind_down() {
  if (idle_) cut();
  if (events_wait_ != nullptr) events_wait_->cancel();
}

void Connection::cut() {
  leaving_ = true;
  stream_.close();
  if (events_wait_ != nullptr) events_wait_->cancel();
}

net::awaitable<void> Connection::serve() {
  try {
    if (!co_await open()) co_return;
    while (!shared_.stopping && co_await serve_one()) {
    }
    arm(SteadyClock::now() + steady_seconds(limits_.linger_seconds));
    co_await stream_.send_goodbye();
  } catch (const std::exception& e) {
    log_warn("", fmt::format("an HTTP connection was dropped: {}", e.what()));
  }
}

// Does the TLS handshake, which may take as long as a request's header; a slow client delays only itself.
net::awaitable<bool> Connection::open() {
  arm(SteadyClock::now() + steady_seconds(limits_.header_seconds));
  const Stream::Opened opened = co_await stream_.open();
  disarm();
  if (opened == Stream::Opened::plain_text) {
    const Response refusal = problem(400, "this port speaks TLS: ask it with https://, not http://");
    co_await answer_unread(refusal);
  }
  co_return opened == Stream::Opened::ready;
}

net::awaitable<bool> Connection::serve_one() {
  body_memory_.give_back();
  serving_ = false;
  Parser parser;
  prepare(parser, limits_);
  const Read read = co_await read_header(parser);
  if (read != Read::ok) {
    co_await answer_failed_read(read);
    co_return false;
  }
  auto parsed = to_request(parser);
  if (const auto* refused = std::get_if<Response>(&parsed)) {
    co_await answer_unread(*refused);
    co_return false;
  }
  Request& request = std::get<Request>(parsed);
  request.peer = stream_.peer();
  const auto admitted = shared_.api.admit(request);
  if (const auto* response = std::get_if<Response>(&admitted)) {
    const bool kept = co_await answer(request, *response, parser.keep_alive() && !request.has_body);
    if (request.has_body) co_await linger();
    co_return kept;
  }
  if (!note_caller(request)) {
    const Response refusal =
        problem(503, fmt::format("this token has {} connections open already; close some, or wait",
                                 limits_.connections_each));
    co_await answer(request, refusal, false);
    co_await linger();
    co_return false;
  }
  co_return co_await serve_match(parser, std::get<Match>(admitted), request);
}

net::awaitable<bool> Connection::serve_match(Parser& parser, const Match& match, Request& request) {
  const Route& route = *match.route;
  Body body;
  const BodyKind kind = shared_.api.body_kind(route, request);
  if (kind == BodyKind::buffered)
    body = co_await read_whole(parser, request, shared_.api.body_limit(route, request));
  if (kind == BodyKind::blob || kind == BodyKind::archive)
    body = co_await read_streamed(parser, match, request);
  disarm();
  if (body.read != Read::ok) {
    co_await answer_failed_read(body.read);
    co_return false;
  }
  serving_ = true;
  Response response;
  if (body.answer) {
    response = std::move(*body.answer);
  } else {
    auto made = co_await handle_on_executor(match, request);
    if (!made) co_return false;
    response = std::move(*made);
  }
  if (response.events) {
    co_await stream_events(request, response);
    co_return false;
  }
  if (!answer_memory_.take(shared_.answers, caller_, response.in_memory()))
    response = problem(503, "too many large answers are being sent, which are read slowly; try again");
  const bool unread = request.has_body && !parser.is_done();
  const bool kept = co_await answer(request, response, parser.keep_alive() && !unread);
  answer_memory_.give_back();
  if (unread) co_await linger();
  co_return kept;
}

bool Connection::note_caller(const Request& request) {
  const std::string& token = request.caller.token_id;
  caller_ = token.empty() ? Throttle::group_of(stream_.peer()) : "token " + token;
  if (token.empty() || client_ == caller_) return true;
  // Connections kept open between requests, by a reverse proxy say, must not keep new ones out.
  std::size_t there = 0;
  Connection* oldest = nullptr;
  for (Connection* other : shared_.open) {
    if (other == this || other->leaving_ || other->client_ != caller_) continue;
    ++there;
    if (other->idle_ && (oldest == nullptr || other->opened_ < oldest->opened_)) oldest = other;
  }
  if (there >= limits_.connections_each) {
    if (oldest == nullptr) return false;
    oldest->cut();
  }
  client_ = caller_;
  known_ = true;
  return true;
}

Connection::Turn::Turn(Connection& connection, Pool& taken) : pool(taken), wait(connection.shared_.io) {
  wait.expires_at(SteadyClock::time_point::max());
  ticket = pool.turns.ask(connection.caller_, 0, [this] {
    come_already = true;
    wait.cancel();
  });
}

net::awaitable<void> Connection::Turn::come() {
  error_code ec;
  while (!come_already) co_await wait.async_wait(awaiting(ec));
}

net::awaitable<std::optional<Response>> Connection::handle_on_executor(const Match& match,
                                                                       const Request& request) {
  const Executor executor = match.route->executor;
  if (executor == Executor::here) co_return shared_.api.handle(match, request);
  Pool& pool = executor == Executor::quick  ? shared_.quick
               : executor == Executor::slow ? shared_.slow
                                            : shared_.remote;
  bool another_coordinators = false;
  Response response;
  {
    Turn turn(*this, pool);
    const bool waited = !turn.come_already;
    co_await turn.come();
    // What changes something is done even if the client has left; what is only read is of no use to anybody.
    const bool reads = request.method == Method::get || request.method == Method::head;
    if (waited && reads && stream_.peer_has_left()) co_return std::nullopt;
    auto work = [this, &match, &request, &another_coordinators] {
      Response answer = shared_.api.handle(match, request);
      another_coordinators = shared_.api.may_be_another_coordinators(match, answer);
      return answer;
    };
    response = co_await run_on(pool.threads, shared_.io, std::move(work));
  }
  if (!another_coordinators) co_return response;
  auto ask = [this, &match, &request, &response] {
    return shared_.api.ask_other_coordinator(match, request, std::move(response));
  };
  co_return co_await work_on(shared_.remote, std::move(ask));
}

// Sets the deadline of the operations that follow. Asio has no deadline for single reads; so when the
// deadline passes, all pending operations on the socket are cancelled. The socket stays open, so that a
// client whose request was too slow still gets an answer.
void Connection::arm(SteadyClock::time_point deadline) {
  timed_out_ = false;
  deadline_ = deadline;
  watch(deadline);
}

void Connection::watch(SteadyClock::time_point until) {
  watchdog_.expires_at(until);
  watchdog_.async_wait([this, alive = std::weak_ptr(alive_)](error_code ec) {
    if (ec || alive.expired() || SteadyClock::now() < deadline_) return;
    timed_out_ = true;
    stream_.cancel();
    // Cancels again later: Beast's operations consist of several reads, and may start another one after the
    // cancellation.
    watch(SteadyClock::now() + std::chrono::milliseconds(100));
  });
}

void Connection::disarm() {
  deadline_ = SteadyClock::time_point::max();
  watchdog_.cancel();
}

TransferPace Connection::new_pace() const {
  return {SteadyClock::now(), limits_.body_grace_seconds, limits_.min_rate};
}

net::awaitable<Read> Connection::fill() {
  error_code ec;
  buffer_.commit(co_await stream_.async_read_some(buffer_.prepare(kReadBuffer), awaiting(ec)));
  co_return read_result(ec, timed_out_);
}

net::awaitable<Read> Connection::read_header(Parser& parser) {
  if (buffer_.size() == 0) {
    idle_ = true;
    arm(SteadyClock::now() + steady_seconds(limits_.idle_seconds));
    if (co_await fill() != Read::ok) co_return Read::closed;  // no request has begun, so nothing is answered
    idle_ = false;
  }
  arm(SteadyClock::now() + steady_seconds(limits_.header_seconds));
  error_code ec;
  co_await beast::http::async_read_header(stream_, buffer_, parser, awaiting(ec));
  co_return read_result(ec, timed_out_);
}

net::awaitable<Connection::Body> Connection::read_whole(Parser& parser, Request& request,
                                                        std::uint64_t limit) {
  if (!co_await send_continue(request)) co_return Body{Read::closed, {}};
  TransferPace pace = new_pace();
  std::uint64_t received = 0;
  while (!parser.is_done()) {
    const Read read = co_await read_portion(parser, pace, received);
    if (read != Read::ok) co_return Body{read, {}};
    if (received > limit)
      co_return Body{Read::ok,
                     problem(413, fmt::format("the body has more than the {} bytes accepted here", limit))};
    if (!body_memory_.take(shared_.bodies, caller_, received))
      co_return Body{Read::ok, problem(503, "too many large requests at once; try again")};
  }
  beast::flat_buffer body = std::exchange(parser.get().body(), beast::flat_buffer());
  request.body = beast::buffers_to_string(body.data());
  co_return Body{};
}

net::awaitable<Connection::Body> Connection::read_streamed(Parser& parser, const Match& match,
                                                           const Request& request) {
  auto open = [this, &match, &request] { return shared_.api.open_upload(match, request); };
  auto opened = co_await work_on(shared_.slow, std::move(open));
  if (auto* refused = std::get_if<Response>(&opened)) co_return Body{Read::ok, std::move(*refused)};
  auto sink = std::move(std::get<std::unique_ptr<BodySink>>(opened));
  Body body;
  if (co_await send_continue(request)) {
    body = co_await read_into(parser, *sink);
  } else {
    body.read = Read::closed;
  }
  const bool whole = body.read == Read::ok && !body.answer;
  disarm();
  auto end = [sink = std::move(sink), whole]() mutable {
    std::optional<Response> answer;
    if (whole) answer = sink->finish();
    sink.reset();  // done on a thread of the pool: the destructor may remove a large file, which takes time
    return answer;
  };
  const bool unpacks = whole && shared_.api.body_kind(*match.route, request) == BodyKind::archive;
  auto answer = co_await work_on(unpacks ? shared_.bundles : shared_.slow, std::move(end));
  if (answer) body.answer = std::move(answer);
  co_return body;
}

net::awaitable<Connection::Body> Connection::read_into(Parser& parser, BodySink& sink) {
  TransferPace pace = new_pace();
  std::uint64_t received = 0;
  beast::flat_buffer& chunk = parser.get().body();
  const auto append = [&sink, &chunk] {
    const net::const_buffer bytes = chunk.cdata();
    return sink.append(std::span(static_cast<const std::byte*>(bytes.data()), bytes.size()));
  };
  while (!parser.is_done()) {
    const Read read = co_await read_portion(parser, pace, received);
    if (read == Read::ok && (chunk.size() == 0 || (chunk.size() < kBodyChunk && !parser.is_done()))) continue;
    disarm();
    // If the read has failed, the rest of the body will not arrive. The bytes that have arrived still go to
    // `sink`, so that an upload in parts makes progress even if every connection breaks within a chunk.
    const auto paused = SteadyClock::now();
    std::optional<Response> refused;
    if (chunk.size() > 0) refused = co_await work_on(shared_.slow, append);
    if (read != Read::ok) co_return Body{read, {}};
    if (refused) co_return Body{Read::ok, std::move(refused)};
    pace.waited(SteadyClock::now() - paused);
    chunk.clear();
  }
  co_return Body{};
}

// Reads the bytes of the body that arrive next, or notes that the body has ended. `received` is the body's
// number of bytes so far, to which this call adds.
net::awaitable<Read> Connection::read_portion(Parser& parser, TransferPace& pace, std::uint64_t& received) {
  const std::size_t before = parser.get().body().size();
  arm(pace.deadline());
  error_code ec;
  co_await beast::http::async_read_some(stream_, buffer_, parser, awaiting(ec));
  const std::size_t got = parser.get().body().size() - before;
  received += got;
  pace.moved(got, SteadyClock::now());
  shared_.api.counters().body_bytes += got;
  co_return read_result(ec, timed_out_);
}

net::awaitable<bool> Connection::send_continue(const Request& request) {
  if (request.header("expect").empty() || !request.has_body || buffer_.size() > 0) co_return true;
  co_return co_await write_all("HTTP/1.1 100 Continue\r\n\r\n", {});
}

net::awaitable<bool> Connection::answer(const Request& request, const Response& response, bool keep_alive) {
  keep_alive = keep_alive && !shared_.stopping;
  shared_.api.counters().answered(request.method, response.status);
  const HeadOptions options{.keep_alive = keep_alive, .method = request.method};
  const std::string head = head_text(response, options, system_unix_clock()());
  const bool bodyless = request.method == Method::head || response.status == 204 || response.status == 304;
  const auto* file = std::get_if<FileBody>(&response.body);
  if (file && !bodyless) co_return co_await write_file(head, *file) && keep_alive;
  const bool written = co_await write_all(head, bodyless ? std::span<const std::byte>{} : response.bytes());
  co_return written&& keep_alive;
}

// Sends `response` to a client whose request could not be read, and ends the connection. (answer() gets the
// named variable `unread`, not a temporary: GCC 12 destroys a temporary aggregate in a co_await twice.)
net::awaitable<void> Connection::answer_unread(const Response& response) {
  const Request unread;
  co_await answer(unread, response, false);
  co_await linger();
}

net::awaitable<void> Connection::answer_failed_read(Read read) {
  if (read == Read::closed || read == Read::ok) co_return;
  Response response;
  if (read == Read::too_slow)
    response = problem(
        408, fmt::format("the request came too slowly: its header must arrive within {} s, its body at {} "
                         "bytes/s, with pauses of at most {} s",
                         limits_.header_seconds, limits_.min_rate, limits_.body_grace_seconds));
  if (read == Read::malformed) response = problem(400, "this is not a well-formed HTTP/1.1 request");
  if (read == Read::header_too_large)
    response = problem(431, fmt::format("the request header has more than {} bytes", limits_.header_bytes));
  co_await answer_unread(response);
}

net::awaitable<bool> Connection::write_all(std::string_view head, std::span<const std::byte> body) {
  TransferPace pace = new_pace();
  const bool written = co_await write_paced(head, body, pace);
  if (written) disarm();
  co_return written;
}

net::awaitable<bool> Connection::write_paced(std::string_view head, std::span<const std::byte> body,
                                             TransferPace& pace) {
  const std::array<net::const_buffer, 2> whole = {net::buffer(head), net::buffer(body.data(), body.size())};
  beast::buffers_suffix left(whole);
  while (beast::buffer_bytes(left) > 0) {
    arm(pace.deadline());
    error_code ec;
    const auto slice = beast::buffers_prefix(kWriteSlice, left);
    const std::size_t n = co_await stream_.async_write_some(slice, awaiting(ec));
    left.consume(n);
    pace.moved(n, SteadyClock::now());
    if (ec) co_return false;
  }
  co_return true;
}

net::awaitable<bool> Connection::write_file(std::string_view head, const FileBody& file) {
  TransferPace pace = new_pace();
  std::vector<std::byte> slice(kWriteSlice);
  for (std::uint64_t offset = 0; offset < file.size;) {
    disarm();  // no deadline cancels operations of the connection while the disk is read
    const auto paused = SteadyClock::now();
    auto work = [&slice, &file, offset] {
      return read_slice(file, offset,
                        std::span(slice).first(std::min<std::uint64_t>(slice.size(), file.size - offset)));
    };
    const std::size_t n = co_await work_on(shared_.slow, std::move(work));
    if (n == 0) co_return false;
    pace.waited(SteadyClock::now() - paused);
    if (!co_await write_paced(offset == 0 ? head : std::string_view(), std::span(slice).first(n), pace))
      co_return false;
    offset += n;
  }
  if (file.size == 0) co_return co_await write_all(head, {});
  disarm();
  co_return true;
}

// Ends the answer, then reads on for a while and discards the bytes that arrive. Closing the connection while
// the client still sends would reset it, and the client would lose the answer.
net::awaitable<void> Connection::linger() {
  arm(SteadyClock::now() + steady_seconds(limits_.linger_seconds));
  co_await stream_.send_goodbye();
  for (std::uint64_t total = buffer_.size(); total < kLingerBytes; total += buffer_.size()) {
    buffer_.consume(buffer_.size());
    if (co_await fill() != Read::ok) break;
  }
}

}  // namespace ls::http
