// Several coordinators as one link, for farms that share workers between coordinators with jobs of their own.
// The worker has a stream to one coordinator at a time, and moves to the next when that one does not welcome
// it or has no work for a while. So workers reach a coordinator that has taken over another's jobs, and idle
// workers find those that have work.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

#include "worker/agent/link.h"

namespace ls::worker {

// Progress reports without a lease (one every few seconds) after which an idle worker moves on.
inline constexpr int kIdleReports = 3;

class LinkRing final : public CoordinatorLink {
 public:
  // `first`: any number; decides which coordinator is tried first. Different numbers spread the workers.
  LinkRing(std::vector<std::unique_ptr<CoordinatorLink>> links, std::size_t first);
  ~LinkRing() override;

  Result<void> connect(const WorkerHello& hello, std::shared_ptr<LinkObserver> observer) override;
  void send(FromWorker message) override;
  void close() override;
  Result<void> fetch_blob(const BlobRequest& wanted,
                          const std::function<Result<void>(std::span<const std::byte>)>& sink) override;

 private:
  class Watch;
  struct State {
    std::mutex mutex;
    bool welcomed = false;
    int idle_reports = 0;
    int unacknowledged = 0;  // number of results
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
