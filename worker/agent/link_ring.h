// Several coordinators as one link: those that share a farm, each with jobs of its own. The worker has a
// stream to one of them at a time, and goes on to the next when that one has not welcomed it, or has had
// nothing for it to do for a while. So workers come to a coordinator that has taken over another one's jobs,
// and idle ones find those that have work.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

#include "worker/link.h"

namespace ls::worker {

// Progress reports without a lease, one every few seconds, after which an idle worker goes on.
inline constexpr int kIdleReports = 3;

class LinkRing final : public CoordinatorLink {
 public:
  // `first`: any number; which of them is asked first. Workers that begin at different ones spread.
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
    int unacknowledged = 0;  // results
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
