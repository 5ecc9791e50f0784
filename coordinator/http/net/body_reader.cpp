// Reads bodies: into memory, or streamed into a sink.
#include <fmt/format.h>

#include <boost/asio/use_awaitable.hpp>

#include "coordinator/http/message/problem.h"
#include "coordinator/http/net/connection.h"
#include "coordinator/http/net/run_on.h"

namespace ls::http {

net::awaitable<Connection::Body> Connection::read_whole(Parser& parser, Request& request,
                                                        std::uint64_t limit) {
  if (!co_await send_continue(request)) co_return Body{Read::closed, {}};
  const auto began = SteadyClock::now();
  std::uint64_t received = 0;
  while (!parser.is_done()) {
    const Read read = co_await read_portion(parser, request.body, began, received);
    if (read != Read::ok) co_return Body{read, {}};
    if (received > limit)
      co_return Body{Read::ok,
                     problem(413, fmt::format("the body has more than the {} bytes accepted here", limit))};
    if (!charge(received))
      co_return Body{Read::ok, problem(503, "too many large requests at once; try again")};
  }
  co_return Body{};
}

net::awaitable<Connection::Body> Connection::read_streamed(Parser& parser, const Match& match,
                                                           const Request& request) {
  auto open = [this, &match, &request] { return shared_.api.open_upload(match, request); };
  auto opened = co_await run_on(shared_.slow, shared_.io, std::move(open));
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
    sink.reset();  // here, on a thread of the pool, because it may remove a large file, which takes time
    return answer;
  };
  const bool unpacks = whole && shared_.api.body_kind(*match.route, request) == BodyKind::archive;
  auto answer = co_await run_on(unpacks ? shared_.bundles : shared_.slow, shared_.io, std::move(end));
  if (answer) body.answer = std::move(answer);
  co_return body;
}

net::awaitable<Connection::Body> Connection::read_into(Parser& parser, BodySink& sink) {
  auto began = SteadyClock::now();
  std::uint64_t received = 0;
  std::string chunk;
  while (!parser.is_done()) {
    const Read read = co_await read_portion(parser, chunk, began, received);
    if (read != Read::ok) {
      // The rest of the body will not arrive. What has arrived still goes to the sink, so that an upload in
      // parts makes progress even if no connection lasts for a whole chunk.
      disarm();
      auto keep = [&sink, &chunk] {
        return chunk.empty() ? std::nullopt : sink.append(std::as_bytes(std::span(chunk)));
      };
      co_await run_on(shared_.slow, shared_.io, std::move(keep));
      co_return Body{read, {}};
    }
    if (chunk.empty() || (chunk.size() < kBodyChunk && !parser.is_done())) continue;
    disarm();
    const auto paused = SteadyClock::now();
    auto append = [&sink, &chunk] { return sink.append(std::as_bytes(std::span(chunk))); };
    auto refused = co_await run_on(shared_.slow, shared_.io, std::move(append));
    if (refused) co_return Body{Read::ok, std::move(refused)};
    began += SteadyClock::now() - paused;  // the time spent on our disk does not count as the client's
    chunk.clear();
  }
  co_return Body{};
}

// Reads at least one more byte of the body, or its end.
net::awaitable<Connection::Read> Connection::read_portion(Parser& parser, std::string& into,
                                                          SteadyClock::time_point began,
                                                          std::uint64_t& received) {
  while (!parser.is_done()) {
    if (buffer_.size() > 0) {
      const Portion portion = take_body(parser, buffer_, into);
      received += portion.got;
      shared_.api.counters().body_bytes += portion.got;
      if (portion.malformed) co_return Read::malformed;
      if (portion.got > 0) co_return Read::ok;
      if (portion.consumed > 0) continue;  // a chunk's header
    }
    arm(pace(began, received));
    if (const Read read = co_await fill(); read != Read::ok) co_return read;
  }
  co_return Read::ok;
}

net::awaitable<bool> Connection::send_continue(const Request& request) {
  if (request.header("expect").empty() || !request.has_body || buffer_.size() > 0) co_return true;
  co_return co_await write_all("HTTP/1.1 100 Continue\r\n\r\n", {});
}

bool Connection::charge(std::uint64_t bytes) {
  shared_.buffered -= charged_;
  charged_ = 0;
  if (shared_.buffered + bytes > kMaxBuffered) return false;
  charged_ = bytes;
  shared_.buffered += bytes;
  return true;
}

}  // namespace ls::http
