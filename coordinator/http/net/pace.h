// How fast a body must move: a client that falls behind is cut off. Pure arithmetic, without sockets.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>

namespace ls::http {

using SteadyClock = std::chrono::steady_clock;

inline SteadyClock::duration steady_seconds(double seconds) {
  return std::chrono::duration_cast<SteadyClock::duration>(std::chrono::duration<double>(seconds));
}

// A transfer may be `grace` seconds behind `rate` bytes per second, at any time: bytes that moved fast
// earlier do not allow a longer stall later.
class TransferPace {
 public:
  TransferPace(SteadyClock::time_point began, double grace, double rate)
      : grace_(steady_seconds(grace)), rate_(rate), deadline_(began + grace_) {}

  // When the transfer is cut off unless more bytes move before.
  SteadyClock::time_point deadline() const { return deadline_; }
  void moved(std::uint64_t bytes, SteadyClock::time_point now) {
    const double most = std::chrono::duration<double>(grace_).count();
    const double earned = std::min(static_cast<double>(bytes) / rate_, 2 * most);
    deadline_ = std::min(deadline_ + steady_seconds(earned), now + grace_);
  }
  // Time that the server itself took, on its disk, does not count against the client.
  void waited(SteadyClock::duration time) { deadline_ += time; }

 private:
  SteadyClock::duration grace_;
  double rate_;
  SteadyClock::time_point deadline_;
};

}  // namespace ls::http
