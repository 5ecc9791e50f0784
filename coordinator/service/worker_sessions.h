// The streams of workers: how workers join, the messages that they send, and how they leave.
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
    // Only workers of this version get units of jobs that are not yet pinned to a numeric class; empty:
    // workers of all versions do
    std::string version;
    std::uint64_t start = 0;   // number of this start of the coordinator
    std::string lease_prefix;  // the ids of the farm's leases begin with this text
    // A secret from which the secrets of workers are made. Worker ids are shown to users, so whoever shows
    // one must also show its secret to get it.
    std::string id_key;
  };
  WorkerSessions(Guarded<Core>& core, ResultPipeline& results, Options options, const Clock& clock)
      : core_(core),
        results_(results),
        options_(std::move(options)),
        clock_(clock),
        last_epoch_(options_.start << 32) {}

  // `principal`: who answers for the worker (WorkerJoined::principal)
  Result<std::unique_ptr<WorkerSession>> connect(const WorkerHello& hello, std::shared_ptr<WorkerSink> sink,
                                                 const std::string& principal = {});
  // Asks a worker to finish the units that it renders and then to end or to restart, or to stay after all.
  // not_found: there is no such worker. failed_precondition: it is not connected, or is to stay but does not
  // drain, or is to restart but is quarantined or of a version that cannot.
  Result<void> drain(const WorkerId& id, DrainNow how);
  // Reports to the farm the workers whose results wait for memory in the coordinator, so that their leases
  // are renewed.
  void report_held_back(Core& core) const;
  // Sessions may outlive this object. After abandon() the functions of all sessions do nothing; close()
  // closes the streams of all workers.
  void abandon() { *alive_ = false; }
  void close();

 private:
  class Session;
  void receive(const std::shared_ptr<Connection>& from, FromWorker message, std::function<void()> next);
  void handle(Core& core, Connection& from, FromWorker message);
  void note_progress(Core& core, Connection& from, WorkerEntry& worker, const WorkerProgress& progress);
  void disconnected(Connection& connection);
  std::string secret_of(const WorkerId& id) const;

  Guarded<Core>& core_;
  ResultPipeline& results_;
  const Options options_;
  const Clock& clock_;
  std::uint64_t last_epoch_;  // number of the latest stream of any worker; guarded by the lock of core_
  std::shared_ptr<std::atomic<bool>> alive_ = std::make_shared<std::atomic<bool>>(true);
};

}  // namespace ls::coordinator
