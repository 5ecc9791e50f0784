// Shares places and memory between callers, so that a caller with many requests, or with large ones, does not
// make the others wait: each has a share of its own, and the caller that has the least is next.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <utility>

namespace ls::coordinator {

// Who is served, and who waits. Without threads and clocks; not thread-safe (gate.h waits for a turn on a
// thread).
class Turns {
 public:
  static constexpr std::uint64_t kAnyBytes = std::numeric_limits<std::uint64_t>::max();

  struct Bounds {
    std::size_t places = 1;            // requests of all callers that are served at the same time
    std::size_t places_each = 1;       // of these, at most so many of one caller
    std::uint64_t bytes = kAnyBytes;   // memory of all requests that are served
    std::uint64_t bytes_each = bytes;  // of this, at most so much of one caller
  };
  using Ticket = std::uint64_t;

  explicit Turns(Bounds bounds) : bounds_(bounds) {}

  // Asks for a place and `bytes` of memory for `caller`. Calls `granted` when it is the request's turn:
  // before ask() returns, or within a later leave() of another request. A request that needs more than the
  // bounds is served when the caller, or for Bounds::bytes everybody, has no other one. A request that needs
  // less than 1/64 of Bounds::bytes counts as needing none, so small requests never wait for memory.
  Ticket ask(std::string caller, std::uint64_t bytes, std::function<void()> granted) {
    const Ticket ticket = next_++;
    if (bytes <= bounds_.bytes / kSmall) bytes = 0;
    ++callers_[caller].requests;
    requests_.emplace(ticket, Request{std::move(caller), bytes, false, std::move(granted)});
    serve();
    return ticket;
  }

  // Ends the request, whether it was served or still waited.
  void leave(Ticket ticket) {
    const auto found = requests_.find(ticket);
    if (found == requests_.end()) return;
    const auto caller = callers_.find(found->second.caller);
    if (found->second.served) {
      --served_;
      --caller->second.served;
      bytes_ -= found->second.bytes;
      caller->second.bytes -= found->second.bytes;
    }
    if (--caller->second.requests == 0) callers_.erase(caller);
    requests_.erase(found);
    serve();
  }

  // Grants nothing more.
  void close() { closed_ = true; }

  std::size_t served() const { return served_; }
  std::size_t waiting() const { return requests_.size() - served_; }

 private:
  static constexpr std::uint64_t kSmall = 64;

  struct Request {
    std::string caller;
    std::uint64_t bytes = 0;
    bool served = false;
    std::function<void()> granted;
  };
  struct Caller {
    std::size_t requests = 0, served = 0;
    std::uint64_t bytes = 0;
    std::uint64_t last = 0;  // number of the latest turn that this caller got
  };
  using Next = std::map<Ticket, Request>::iterator;

  void serve() {
    while (!closed_ && served_ < bounds_.places) {
      auto next = find_next(false);
      // A large request that is next waits until its memory is free, and no other large one overtakes it.
      if (next != requests_.end() && !fits(next->second.bytes, bytes_, bounds_.bytes)) next = find_next(true);
      if (next == requests_.end()) return;
      Request& request = next->second;
      Caller& caller = callers_[request.caller];
      request.served = true;
      ++served_;
      ++caller.served;
      bytes_ += request.bytes;
      caller.bytes += request.bytes;
      caller.last = ++turns_;
      const auto granted = std::move(request.granted);
      granted();
    }
  }

  // The waiting request of the caller that is served least and was served least recently, if its share has
  // room; of requests that need no memory only, if `small`.
  Next find_next(bool small) {
    auto best = requests_.end();
    const auto before = [&](const Request& a, const Request& b) {
      const Caller &x = callers_[a.caller], &y = callers_[b.caller];
      return x.served != y.served ? x.served < y.served : x.last < y.last;
    };
    for (auto it = requests_.begin(); it != requests_.end(); ++it) {
      const Request& request = it->second;
      if (request.served || (small && request.bytes > 0)) continue;
      const Caller& caller = callers_[request.caller];
      if (caller.served >= bounds_.places_each || !fits(request.bytes, caller.bytes, bounds_.bytes_each))
        continue;
      if (best == requests_.end() || before(request, best->second)) best = it;
    }
    return best;
  }

  static bool fits(std::uint64_t bytes, std::uint64_t used, std::uint64_t bound) {
    return bytes == 0 || used == 0 || (used <= bound && bytes <= bound - used);
  }

  const Bounds bounds_;
  bool closed_ = false;
  Ticket next_ = 1;
  std::uint64_t turns_ = 0, bytes_ = 0;
  std::size_t served_ = 0;
  std::map<Ticket, Request> requests_;  // in the order in which they came
  std::map<std::string, Caller> callers_;
};

}  // namespace ls::coordinator
