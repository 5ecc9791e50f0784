// Combines links to several coordinators into one, for farms in which several coordinators, each with its own
// jobs, share the workers. The worker has a stream to one coordinator at a time. It moves to the next
// coordinator if the current one does not accept it or has had no work for it for a while. So idle workers
// find any coordinator that has work, including one that has taken over the jobs of another.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

#include "worker/agent/link.h"

namespace ls::worker {

// A worker moves to the next coordinator after this many progress reports in which it has no lease (no work
// assigned to it) and waits for no acknowledgement of a result. An idle worker sends a report every few
// seconds.
inline constexpr int kIdleReports = 3;

class LinkRing final : public CoordinatorLink {
 public:
  // `first`, which may be any number, decides which coordinator is tried first. With a different number in
  // each worker the workers spread over the coordinators.
  LinkRing(std::vector<std::unique_ptr<CoordinatorLink>> links, std::size_t first);
  ~LinkRing() override;

  Result<void> connect(const WorkerHello& hello, std::shared_ptr<LinkObserver> observer) override;
  void send(FromWorker message) override;
  void close() override;
  Result<void> fetch_blob(const BlobRequest& wanted, const BlobSink& sink) override;

 private:
  class Watch;
  struct State {
    std::mutex mutex;
    bool welcomed = false;
    int idle_reports = 0;
    int unacknowledged = 0;  // number of results that are not acknowledged
  };
  CoordinatorLink& current();
  bool idle_for_long(const FromWorker& message);

  const std::vector<std::unique_ptr<CoordinatorLink>> links_;
  const std::shared_ptr<State> state_ = std::make_shared<State>();
  std::mutex mutex_;
  std::size_t current_;
  bool tried_ = false, draining_ = false, go_on_ = false;
  std::shared_ptr<Watch> watch_;
};

}  // namespace ls::worker
