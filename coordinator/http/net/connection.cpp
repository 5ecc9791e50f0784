#include "coordinator/http/net/connection.h"

#include <fmt/format.h>

#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <exception>
#include <utility>

#include "common/base/log.h"
#include "coordinator/http/message/problem.h"
#include "coordinator/http/net/head_text.h"
#include "coordinator/http/net/run_on.h"

namespace ls::http {

using boost::system::error_code;

Connection::Connection(Tcp::socket socket, std::shared_ptr<const TlsIdentity> tls, Shared& shared)
    : stream_(std::move(socket), std::move(tls)),
      shared_(shared),
      limits_(shared.api.limits()),
      watchdog_(shared.io),
      buffer_(kReadBuffer) {
  shared_.open.insert(this);
  ++shared_.api.counters().connections;
}

Connection::~Connection() {
  charge(0);
  charge_answer(0);
  shared_.open.erase(this);
  --shared_.api.counters().connections;
}

void Connection::wind_down() {
  if (idle_) cut();
  if (events_wait_ != nullptr) events_wait_->cancel();
}

void Connection::cut() {
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
  charge(0);
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
  Response response;
  if (body.answer) {
    response = std::move(*body.answer);
  } else {
    response = co_await handle_on_executor(match, request);
  }
  if (response.events) {
    co_await stream_events(request, response);
    co_return false;
  }
  if (!charge_answer(response.in_memory())) {
    response = problem(503, "too much is being sent to others that read slowly; try again");
    response.headers.emplace_back("Retry-After", "2");
  }
  const bool unread = request.has_body && !parser.is_done();
  const bool kept = co_await answer(request, response, parser.keep_alive() && !unread);
  charge_answer(0);
  if (unread) co_await linger();
  co_return kept;
}

net::awaitable<Response> Connection::handle_on_executor(const Match& match, const Request& request) {
  const Executor executor = match.route->executor;
  if (executor == Executor::here) co_return shared_.api.handle(match, request);
  net::thread_pool& pool = executor == Executor::quick  ? shared_.quick
                           : executor == Executor::slow ? shared_.slow
                                                        : shared_.remote;
  bool another_coordinators = false;
  auto work = [this, &match, &request, &another_coordinators] {
    Response answer = shared_.api.handle(match, request);
    another_coordinators = shared_.api.may_be_another_coordinators(match, answer);
    return answer;
  };
  Response response = co_await run_on(pool, shared_.io, std::move(work));
  if (!another_coordinators) co_return response;
  auto ask = [this, &match, &request, &response] {
    return shared_.api.ask_other_coordinator(match, request, std::move(response));
  };
  co_return co_await run_on(shared_.remote, shared_.io, std::move(ask));
}

// Counts the answer, unless it is small. An answer larger than kMaxAnswers is let through while no other
// answer is counted.
bool Connection::charge_answer(std::uint64_t bytes) {
  shared_.answers -= std::exchange(answer_charged_, 0);
  if (bytes <= kSmallAnswer) return true;
  if (shared_.answers > 0 && shared_.answers + bytes > kMaxAnswers) return false;
  shared_.answers += answer_charged_ = bytes;
  return true;
}

net::awaitable<Connection::Read> Connection::read_header(Parser& parser) {
  if (buffer_.size() == 0) {
    idle_ = true;
    arm(SteadyClock::now() + steady_seconds(limits_.idle_seconds));
    if (co_await fill() != Read::ok) co_return Read::closed;  // no request has begun, so nothing is answered
    idle_ = false;
  }
  arm(SteadyClock::now() + steady_seconds(limits_.header_seconds));
  while (true) {
    const Parsed parsed = take_header(parser, buffer_);
    if (parsed == Parsed::too_large) co_return Read::header_too_large;
    if (parsed == Parsed::malformed) co_return Read::malformed;
    if (parsed == Parsed::done) co_return Read::ok;
    if (const Read read = co_await fill(); read != Read::ok) co_return read;
  }
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

// Answers something that could not be read as a request. (`unread` is a named variable because GCC 12
// destroys a temporary aggregate in a co_await twice.)
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
                         "bytes/s after {} s",
                         limits_.header_seconds, limits_.min_rate, limits_.body_grace_seconds));
  if (read == Read::malformed) response = problem(400, "this is not a well-formed HTTP/1.1 request");
  if (read == Read::header_too_large)
    response = problem(431, fmt::format("the request header has more than {} bytes", limits_.header_bytes));
  co_await answer_unread(response);
}

}  // namespace ls::http
