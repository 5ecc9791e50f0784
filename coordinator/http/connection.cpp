#include "coordinator/http/connection.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <exception>

#include "common/base/log.h"
#include "coordinator/http/head_text.h"
#include "coordinator/http/problem.h"
#include "coordinator/http/run_on.h"
#include "coordinator/http/uri.h"

namespace ls::http {
namespace {

namespace bhttp = beast::http;
using boost::system::error_code;
using Header = bhttp::request_header<bhttp::fields>;

std::string lower_case(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  return out;
}

// Of these a second one would let two readers of a request disagree.
constexpr std::string_view kOnce[] = {
    "host", "authorization", "content-type", "content-length", "transfer-encoding", "origin", "expect"};

std::optional<Response> refuse_header(const Header& header) {
  for (const std::string_view name : kOnce)
    if (header.count(name) > 1)
      return problem(400, fmt::format("the request has more than one '{}' header", name));
  if (header.version() != 10 && header.version() != 11) return problem(505, "speak HTTP/1.1 or HTTP/1.0");
  if (header.version() == 11 && header.count(bhttp::field::host) == 0)
    return problem(400, "the request has no 'Host' header");
  if (const auto coding = header[bhttp::field::transfer_encoding];
      !coding.empty() && lower_case(coding) != "chunked")
    return problem(501, "of the transfer codings only 'chunked' is understood");
  if (const auto expect = header[bhttp::field::expect];
      !expect.empty() && lower_case(expect) != "100-continue")
    return problem(400, "of the expectations only '100-continue' is understood");
  if (header.target().size() > kMaxTarget)
    return problem(414, fmt::format("the request target has more than {} characters", kMaxTarget));
  return std::nullopt;
}

// What Beast has parsed as our own value, or the answer to a request that can't be one.
std::variant<Response, Request> to_request(const Parser& parser) {
  const Header& header = parser.get();
  if (auto refused = refuse_header(header)) return *refused;
  Request request;
  const auto method = parse_method(std::string_view(header.method_string()));
  if (!method) return problem(501, "this method is not known here");
  request.method = *method;
  if (*method == Method::options && header.target() == "*") {
    Response response;
    response.status = 204;
    return response;
  }
  auto target = parse_target(std::string_view(header.target()));
  if (!target) return problem(target.error());
  request.segments = std::move(target->segments);
  request.query = std::move(target->query);
  for (const auto& field : header)
    request.headers.emplace_back(lower_case(std::string_view(field.name_string())),
                                 std::string(field.value()));
  if (const auto length = parser.content_length()) request.content_length = *length;
  request.has_body = parser.chunked() || request.content_length.value_or(0) > 0;
  return request;
}

}  // namespace

Connection::Connection(Tcp::socket socket, Shared& shared)
    : socket_(std::move(socket)),
      shared_(shared),
      limits_(shared.api.limits()),
      watchdog_(shared.io),
      buffer_(kReadBuffer) {
  shared_.open.insert(this);
  ++shared_.api.counters().connections;
}

Connection::~Connection() {
  charge(0);
  shared_.open.erase(this);
  --shared_.api.counters().connections;
}

void Connection::wind_down() {
  if (idle_) cut();
  if (events_wait_ != nullptr) events_wait_->cancel();
}

void Connection::cut() {
  error_code ignored;
  socket_.close(ignored);
  if (events_wait_ != nullptr) events_wait_->cancel();
}

net::awaitable<void> Connection::serve() {
  try {
    while (!shared_.stopping && co_await serve_one()) {
    }
  } catch (const std::exception& e) {
    log_warn("", fmt::format("an HTTP connection was dropped: {}", e.what()));
  }
}

net::awaitable<bool> Connection::serve_one() {
  charge(0);
  Parser parser;
  parser.header_limit(static_cast<std::uint32_t>(limits_.header_bytes));
  parser.body_limit(boost::none);  // bounded per route, while it is read
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
  } else if (route.lane == Lane::here) {
    response = shared_.api.handle(match, request);
  } else {
    auto work = [this, &match, &request] { return shared_.api.handle(match, request); };
    response = co_await run_on(route.lane == Lane::quick ? shared_.quick : shared_.slow, shared_.io,
                               std::move(work));
  }
  if (response.events) {
    co_await stream_events(request, response);
    co_return false;
  }
  const bool unread = request.has_body && !parser.is_done();
  const bool kept = co_await answer(request, response, parser.keep_alive() && !unread);
  if (unread) co_await linger();
  co_return kept;
}

net::awaitable<Connection::Read> Connection::read_header(Parser& parser) {
  if (buffer_.size() == 0) {
    idle_ = true;
    arm(SteadyClock::now() + steady_seconds(limits_.idle_seconds));
    if (co_await fill() != Read::ok) co_return Read::closed;  // nothing was asked: nothing to answer
    idle_ = false;
  }
  arm(SteadyClock::now() + steady_seconds(limits_.header_seconds));
  while (true) {
    error_code ec;
    buffer_.consume(parser.put(buffer_.data(), ec));
    if (ec == bhttp::error::header_limit) co_return Read::header_too_large;
    if (ec && ec != bhttp::error::need_more && ec != bhttp::error::need_buffer) co_return Read::malformed;
    if (parser.is_header_done()) co_return Read::ok;
    if (const Read read = co_await fill(); read != Read::ok) co_return read;
  }
}

net::awaitable<bool> Connection::answer(const Request& request, const Response& response, bool keep_alive) {
  keep_alive = keep_alive && !shared_.stopping;
  shared_.api.counters().answered(request.method, response.status);
  const HeadOptions options{.keep_alive = keep_alive, .method = request.method};
  const std::string head = head_text(response, options, system_unix_clock()());
  const bool bodyless = request.method == Method::head || response.status == 204 || response.status == 304;
  const bool written = co_await write_all(head, bodyless ? std::span<const std::byte>{} : response.bytes());
  co_return written&& keep_alive;
}

// To what could not be read as a request. (A named one: GCC 12 destroys a temporary aggregate in a co_await
// twice.)
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
