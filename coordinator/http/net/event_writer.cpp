// The functions of Connection that serve an event stream (Server-Sent Events) to one client.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/post.hpp>

#include "coordinator/http/auth/auth.h"
#include "coordinator/http/message/message.h"
#include "coordinator/http/net/connection.h"

namespace ls::http {
namespace {

// Its destructor closes the queue of an event stream and no longer counts the stream as open. A destructor
// does this, since it also runs if the server is destroyed while the stream waits.
struct Undo {
  Shared& shared;
  bool& streaming;
  net::steady_timer*& events_wait;
  std::shared_ptr<EventQueue> queue;
  ~Undo() {
    streaming = false;
    events_wait = nullptr;
    queue->close();
    --shared.event_streams;
    --shared.api.counters().event_streams;
  }
};

struct Start {
  std::uint64_t after = 0;
  // True if the event id in the request is higher than the ids of all events of this coordinator. It then
  // comes from a coordinator with another data folder, and the client must load its state again.
  bool reset = false;
};

}  // namespace

net::awaitable<void> Connection::stream_events(const Request& request, const Response& response) {
  const auto same = [this](const Connection* other) {
    return other->streams_events() && other->client() == client_;
  };
  const auto own = std::count_if(shared_.open.begin(), shared_.open.end(), same);
  const bool crowded = 2 * shared_.event_streams >= limits_.event_streams;
  if (shared_.event_streams >= limits_.event_streams ||
      (crowded && static_cast<std::size_t>(own) >= limits_.event_streams_each)) {
    co_await answer(request, problem(503, "too many event streams are open; close one or try again later"),
                    false);
    co_return;
  }
  const EventStream& wanted = *response.events;
  auto& coordinator = shared_.api.coordinator();
  auto find_start = [&coordinator, &wanted] {
    const std::uint64_t last = coordinator.last_event_id();
    const std::uint64_t after = wanted.after_id.value_or(last);
    return after > last ? Start{last, true} : Start{after, false};
  };
  net::steady_timer wait(shared_.io);
  streaming_ = true;
  ++shared_.event_streams;
  ++shared_.api.counters().event_streams;
  auto wake = [this, &io = shared_.io, alive = std::weak_ptr(alive_)] {
    net::post(io, [this, alive] {
      if (!alive.expired() && events_wait_ != nullptr) events_wait_->cancel();
    });
  };
  const Start start = co_await work_on(shared_.quick, std::move(find_start));
  const EventQueue::Bounds bounds{limits_.event_queue, limits_.event_queue_bytes};
  auto queue = std::make_shared<EventQueue>(bounds, wanted.job, start.after, std::move(wake));
  events_wait_ = &wait;
  const Undo undo{shared_, streaming_, events_wait_, queue};

  shared_.api.counters().answered(request.method, response.status);
  std::string head = head_text(response, {.streamed = true, .method = request.method}, system_unix_clock()());
  if (request.method == Method::head) {
    co_await write_all(head, {});
    co_return;
  }
  // A message with an id but without data is not an event for the browser; it only sets the id that the
  // browser sends when it connects again.
  head += fmt::format("retry: 1000\nid: {}\n\n", start.after);
  if (start.reset)
    head += fmt::format("event: reset\ndata: {{\"missed_from\":0,\"missed_to\":{}}}\n\n", start.after);
  if (!co_await write_all(head, {})) co_return;

  auto subscribe = [&coordinator, after = start.after, queue, reader = wanted.reader] {
    return coordinator.subscribe(after, [queue, reader](const coordinator::StreamEvent& event) {
      if (reader.role != Role::submit) return queue->push(event);
      const auto shown = visible(event, reader);
      queue->push(event, shown ? &*shown : nullptr);
    });
  };
  auto subscription = co_await work_on(shared_.quick, std::move(subscribe));
  using namespace net::experimental::awaitable_operators;
  co_await (write_events(*queue, wanted.reader) || reader_leaves());
  queue->close();
  auto unsubscribe = [handle = std::move(subscription)]() mutable {
    handle.reset();  // on a thread of the pool, since reset() waits for a callback that is in progress
    return true;
  };
  co_await work_on(shared_.quick, std::move(unsubscribe));
}

net::awaitable<void> Connection::write_events(EventQueue& queue, const Caller& reader) {
  while (!shared_.stopping && shared_.api.auth().still_valid(reader)) {
    const bool last = queue.overflowed();
    const std::string text = queue.take();
    if (!text.empty()) {
      if (!co_await write_all(text, {})) co_return;
      continue;
    }
    if (last) {
      ++shared_.api.counters().events_dropped;
      co_return;
    }
    error_code ec;
    events_wait_->expires_after(steady_seconds(limits_.heartbeat_seconds));
    co_await events_wait_->async_wait(awaiting(ec));
    if (!ec && !co_await write_all(":\n\n", {})) co_return;
  }
}

// Waits until the client of an event stream leaves. The client sends nothing after its request, so anything
// that arrives (most likely the end of the connection) ends the stream.
net::awaitable<void> Connection::reader_leaves() {
  std::array<char, 64> ignored{};
  error_code ec;
  co_await stream_.async_read_some(net::buffer(ignored), awaiting(ec));
}

}  // namespace ls::http
