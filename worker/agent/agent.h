// The worker without sockets and without a renderer: takes leases from a CoordinatorLink, gets their blobs,
// has the units rendered by a RenderBackend on its own threads, and keeps every result until it is
// acknowledged.
//
// Threads: run() is the control thread (connection, progress, timers); one loader fetches blobs and prepares
// worlds ahead of need; each of `threads` render threads takes the next unit as soon as it has delivered the
// last. One mutex guards the state (worker/agent/held_leases.h, result_outbox.h). No call that may block is
// made while it is held: only forget() and rss_bytes() of the backend, and nothing of the link or the files.
#pragma once

#include <cstdint>
#include <memory>

#include "common/base/clock.h"
#include "common/base/error.h"
#include "common/protocol/messages.h"
#include "worker/agent/backend.h"
#include "worker/agent/blob_files.h"
#include "worker/agent/link.h"

namespace ls::worker {

struct AgentOptions {
  WorkerHello hello;  // the agent fills in threads, numeric_class and blobs_held
  int threads = 1;
  std::size_t outbox_bytes = 64 << 20;  // of unacknowledged results; when full, rendering waits
  Duration progress_period = std::chrono::seconds(1);
  Duration backoff_first = std::chrono::milliseconds(100);
  Duration backoff_most = std::chrono::seconds(10);
  // pause after a full disk and the like; grows up to backoff_most
  Duration trouble_first = std::chrono::seconds(1);
  Duration drain_limit =
      std::chrono::seconds(60);    // time to deliver finished results; then run() ends with an error
  std::uint64_t backoff_seed = 0;  // for the jitter; should differ between the workers of a farm
};

class Agent {
 public:
  // All references must outlive the agent.
  Agent(AgentOptions options, CoordinatorLink& link, RenderBackend& backend, BlobFiles& files,
        const Clock& clock);
  ~Agent();

  // Returns when drained (success), rejected for good (the coordinator's error), when the backend is broken
  // (its error, after finished results are delivered) or when stopped. Call once.
  Result<void> run();

  // From any thread. drain(): finish the running units, deliver all results, return the other units. stop():
  // end as soon as possible and deliver nothing more.
  void drain();
  void stop();
  // Re-evaluates the timers after the injected clock was moved. For tests only.
  void wake();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ls::worker
