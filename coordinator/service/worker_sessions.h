// The streams of workers: how workers join, the messages that they send, and how they leave. A lease is a
// list of units (rounds of tiles) that is assigned to one worker until a deadline.
#pragma once

#include <functional>
#include <memory>

#include "coordinator/service/result_pipeline.h"

namespace ls::coordinator {

class WorkerSessions {
 public:
  struct Options {
    JoinCheck may_join;
    bool allow_fake = false;
    std::string version;       // version of the workers that may begin jobs; empty: any
    std::uint64_t start = 0;   // number of this start of the coordinator
    std::string lease_prefix;  // first part of the farm's lease ids
  };
  WorkerSessions(Guarded<Core>& core, ResultPipeline& results, Options options, const Clock& clock)
      : core_(core),
        results_(results),
        options_(std::move(options)),
        clock_(clock),
        last_epoch_(options_.start << 32) {}

  Result<std::unique_ptr<WorkerSession>> connect(const WorkerHello& hello, std::shared_ptr<WorkerSink> sink);
  // Reports to the farm the workers whose results wait for memory in the coordinator, so that their leases
  // are renewed.
  void report_held_back(Core& core) const;
  // Sessions may outlive this object. After abandon() their functions do nothing; close() closes their
  // streams.
  void abandon() { *alive_ = false; }
  void close();

 private:
  class Session;
  void receive(const std::shared_ptr<Connection>& from, FromWorker message, std::function<void()> next);
  void handle(Core& core, Connection& from, FromWorker message);
  void note_progress(Core& core, Connection& from, WorkerEntry& worker, const WorkerProgress& progress);
  void disconnected(Connection& connection);

  Guarded<Core>& core_;
  ResultPipeline& results_;
  const Options options_;
  const Clock& clock_;
  std::uint64_t last_epoch_;  // guarded by the lock
  std::shared_ptr<std::atomic<bool>> alive_ = std::make_shared<std::atomic<bool>>(true);
};

}  // namespace ls::coordinator
