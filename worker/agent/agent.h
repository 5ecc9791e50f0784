// The part of the worker that has no sockets and no renderer. It takes leases from the coordinator through a
// CoordinatorLink; a lease is a list of units, each one tile and one range of samples, that the worker shall
// render. It fetches the files (blobs) of their jobs, has the units rendered by a RenderBackend on its own
// threads, and keeps every result until the coordinator has acknowledged it.
//
// Threads: run() is the control thread (connection, progress reports, timers). One loader thread fetches
// blobs and prepares worlds (scenes that are built and ready to render) ahead of need. Each of `threads`
// render threads takes the next unit as soon as it has delivered the last. One mutex guards the state
// (worker/agent/held_leases.h, result_outbox.h). While it is held no call is made that may block: of the
// backend only forget() and rss_bytes() are called, of the link and the files nothing.
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
  std::size_t outbox_bytes = 64 << 20;  // no unit is begun while unacknowledged results have this many bytes
  Duration progress_period = std::chrono::seconds(1);
  Duration backoff_first = std::chrono::milliseconds(100);
  Duration backoff_most = std::chrono::seconds(10);
  // Pause after a problem of this machine, such as a full disk; grows up to backoff_most
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

  // Does the worker's work; call it once. Returns success when the agent has drained, the coordinator's error
  // if the coordinator rejects this worker for good, the backend's error if the backend is broken (after
  // finished results were delivered), and also after stop().
  Result<void> run();

  // Both may be called from any thread. drain() lets run() finish the running units, deliver all results and
  // give the other units back to the coordinator. stop() lets run() end as soon as possible and deliver
  // nothing more.
  void drain();
  void stop();
  // Makes run() look at its timers again, after a test has moved `clock`. For tests only.
  void wake();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ls::worker
