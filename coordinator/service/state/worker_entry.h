// A worker in the coordinator's memory, and its connection. Both are guarded by the service's mutex
// (service/core.h), except for members that are marked otherwise.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "coordinator/domain/event.h"
#include "coordinator/store/jobs/job_store.h"
#include "coordinator/views/worker_session.h"
#include "core/base/clock.h"

namespace ls::coordinator {

struct Connection {
  Connection(WorkerId id, std::uint64_t number, const WorkerHello& hello, std::shared_ptr<WorkerSink> to,
             std::string prefix)
      : worker(std::move(id)),
        epoch(number),
        numeric_class(hello.numeric_class),
        fake(hello.fake),
        sink(std::move(to)),
        lease_prefix_(std::move(prefix)) {}
  void close() {
    if (std::exchange(open, false)) sink->close();
  }
  // Notes that a lease was assigned over this stream.
  void note_lease(const LeaseId& lease) {
    if (!first_lease_) first_lease_ = lease_number(lease, lease_prefix_);
  }
  // True if the lease was assigned over this stream, false if over an earlier stream of the same worker.
  bool assigned(const LeaseId& lease) const {
    const auto n = lease_number(lease, lease_prefix_);
    return n && first_lease_ && *n >= *first_lease_;
  }

  const WorkerId worker;
  const std::uint64_t epoch;
  const Digest numeric_class;
  const bool fake;
  const std::shared_ptr<WorkerSink> sink;
  bool open = true;
  // True while a result of this worker waits for memory; its stream is not read meanwhile. May be used
  // without the mutex.
  std::atomic<bool> held_back{false};

 private:
  const std::string lease_prefix_;
  std::optional<std::uint64_t> first_lease_;  // number of the first lease assigned over this stream
};

struct WorkerEntry {
  // Adds an event to the log. Texts come from workers, so that control characters are removed and long texts
  // cut.
  void note(std::string_view text);

  WorkerHello hello;
  std::shared_ptr<Connection> connection;
  TimePoint last_seen{}, last_event{};
  std::string activity, trouble;
  double cpu_seconds = 0;
  std::uint64_t rss_bytes = 0;
  JobId last_job;
  std::vector<LogLine> log;  // what happened to the worker, the latest last
};
using WorkerTable = std::map<WorkerId, WorkerEntry>;

}  // namespace ls::coordinator
