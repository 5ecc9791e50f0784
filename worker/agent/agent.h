// The part of the worker that has no sockets and no renderer. It receives leases from the coordinator through
// a CoordinatorLink. The agent fetches the files (blobs) of their jobs, calls a RenderBackend on its own
// threads to render the units, and keeps every result until the coordinator has acknowledged it.
//
// Threads: run() is the control thread (connection, progress reports, timers). One loader thread fetches
// blobs and prepares worlds (scenes that are built and ready to render) ahead of need. Each of `threads`
// render threads takes the next unit as soon as it has delivered the previous one. One mutex guards the state
// (worker/agent/held_work.h). While a thread holds it, it makes no call that may block: it calls only
// forget() and rss_bytes() of the backend, and no function of the link or of the files.
//
// To drain means to end in an orderly way: the worker finishes the units that are being rendered, delivers
// all results, returns its other units to the coordinator, and ends.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "core/base/clock.h"
#include "core/base/error.h"
#include "util/protocol/briefs.h"
#include "util/protocol/messages.h"
#include "util/trace/tracer.h"
#include "worker/agent/backend.h"
#include "worker/agent/link.h"

namespace ls::worker {

struct AgentOptions {
  // The agent fills in threads, numeric_class, platform, blobs_held, brief_bytes and restarts
  WorkerHello hello;
  int threads = 1;
  std::size_t brief_bytes = kBriefBytes;  // size of its memory for the briefs of jobs (BriefMemory)
  // No further unit is begun while results that are not acknowledged occupy this many bytes or more
  std::size_t outbox_bytes = 64 << 20;
  Duration progress_period = std::chrono::seconds(1);
  Duration backoff_most = std::chrono::seconds(10);  // longest pause before another attempt
  // A worker that has held no units for this long drains, or, if it has never joined the coordinator, ends
  // run() with an error. Zero: no limit
  Duration idle_limit = Duration::zero();
  // Tells whether the caller can restart its program after run(); an error says why not. It is called when
  // the coordinator asks for that, on the control thread, and so delays messages. Empty: never.
  std::function<Result<void>()> may_restart;
  // Longest time that a draining worker may take; if it is exceeded, run() ends with an error or, if the
  // worker is to restart, with a warning
  Duration drain_limit = std::chrono::seconds(60);
  std::shared_ptr<trace::Tracer> tracer;  // records trace spans of units and scenes; null: no tracing
  // Seed of the random pauses between attempts to connect. Each worker of a farm should have a different one.
  std::uint64_t backoff_seed = 0;
};

class Agent {
 public:
  // All references must outlive the agent.
  Agent(AgentOptions options, CoordinatorLink& link, RenderBackend& backend, BlobFiles& files,
        const Clock& clock);
  ~Agent();

  // Runs the worker until its end; call it once. Returns success when the agent has drained, and also after
  // stop(). Otherwise returns an error: the coordinator's error if it rejects this worker permanently, or the
  // backend's error if the backend is broken; in the latter case finished results are delivered first.
  Result<void> run();

  // drain() and stop() may be called from any thread. After drain(), run() finishes the running units,
  // delivers all results and returns the other units to the coordinator. After stop(), run() ends as soon as
  // possible and delivers nothing more.
  void drain();
  void stop();
  // True if the coordinator has asked for a restart and nothing else has ended run(), drain() and stop()
  // included. Call it after run().
  bool to_restart() const;
  // Makes run() check its timers again, after a test has advanced `clock`. For tests only.
  void wake();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ls::worker
