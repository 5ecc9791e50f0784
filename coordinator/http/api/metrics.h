// The metrics of this process and of its HTTP server, which /metrics shows.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <mutex>
#include <utility>

#include "coordinator/http/message/message.h"

namespace ls::http {

// Resources used by this process, as Linux reports them.
struct ProcessFigures {  // a value that could not be read is 0
  std::uint64_t resident_bytes = 0;
  std::uint64_t open_files = 0;
  std::uint64_t threads = 0;
  double cpu_seconds = 0;
};
ProcessFigures process_figures();

// Counters that the HTTP server loop increments and /metrics shows. Thread-safe.
class Counters {
 public:
  void answered(Method method, int status);
  std::map<std::pair<Method, int>, std::uint64_t> requests() const;

  std::atomic<std::uint64_t> connections{0};    // connections that are open now
  std::atomic<std::uint64_t> event_streams{0};  // event streams that are open now
  // Number of event streams that were closed because their clients read too slowly
  std::atomic<std::uint64_t> events_dropped{0};
  std::atomic<std::uint64_t> body_bytes{0};  // bytes received in request bodies

 private:
  mutable std::mutex mutex_;
  std::map<std::pair<Method, int>, std::uint64_t> requests_;
};

}  // namespace ls::http
