// The worker without sockets and without a renderer: takes leases from a CoordinatorLink, gets their blobs,
// has the units rendered by a RenderBackend on its own threads, and keeps every result until it is
// acknowledged.
//
// Threads: run() is the control thread (connection, progress, timers); one loader fetches blobs and prepares
// worlds ahead of need; `threads` render threads each take the next unit as soon as they have handed in the
// last. One mutex guards the state (worker/agent/lease_book.h, outbox.h); while it is held nothing is called
// that may block: of the backend only forget() and rss_bytes(), of the link and the files nothing.
#pragma once

#include <cstdint>
#include <memory>

#include "common/base/clock.h"
#include "common/base/error.h"
#include "common/protocol/messages.h"
#include "worker/agent/blob_files.h"
#include "worker/backend.h"
#include "worker/link.h"

namespace ls::worker {

struct AgentOptions {
  WorkerHello hello;  // threads, numeric_class and blobs_held are filled in by the agent
  int threads = 1;
  std::size_t outbox_bytes = 64 << 20;  // unacknowledged results; when full, rendering waits
  Duration progress_period = std::chrono::seconds(1);
  Duration backoff_first = std::chrono::milliseconds(100);
  Duration backoff_most = std::chrono::seconds(10);
  Duration trouble_first = std::chrono::seconds(1);  // after a full disk and the like; up to backoff_most
  Duration drain_limit =
      std::chrono::seconds(60);    // to hand in what is finished; then run() ends with an error
  std::uint64_t backoff_seed = 0;  // of the jitter; workers of a farm should differ
};

class Agent {
 public:
  // All references must outlive the agent.
  Agent(AgentOptions options, CoordinatorLink& link, RenderBackend& backend, BlobFiles& files,
        const Clock& clock);
  ~Agent();

  // Until drained (success), refused for good (the coordinator's error), its backend is broken (that's error;
  // what is finished is handed in first) or stopped. Once.
  Result<void> run();

  // From any thread. drain(): finish the units in hand, hand in every result, return the rest. stop(): as
  // soon as possible, handing in nothing more.
  void drain();
  void stop();
  // The injected clock has moved: look at the timers again. Only needed by tests.
  void wake();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ls::worker
