#include "worker/agent/link_ring.h"

#include <atomic>
#include <utility>

namespace ls::worker {

// Forwards a stream's messages to the agent's observer. Updates the ring's State from the messages
// (Welcome, leases and acknowledgements), and reports the end of the stream only once.
class LinkRing::Watch final : public LinkObserver {
 public:
  Watch(std::shared_ptr<State> state, std::shared_ptr<LinkObserver> agent)
      : state_(std::move(state)), agent_(std::move(agent)) {}

  void received(ToWorker message) override {
    {
      const std::lock_guard lock(state_->mutex);
      if (std::holds_alternative<Welcome>(message)) state_->welcomed = true;
      if (std::holds_alternative<AssignLease>(message)) state_->idle_reports = 0;
      if (std::holds_alternative<ResultAck>(message)) --state_->unacknowledged;
    }
    agent_->received(std::move(message));
  }
  void lost(Error why) override {
    if (!reported_.exchange(true)) agent_->lost(std::move(why));
  }

 private:
  std::shared_ptr<State> state_;
  std::shared_ptr<LinkObserver> agent_;
  std::atomic<bool> reported_{false};
};

LinkRing::LinkRing(std::vector<std::unique_ptr<CoordinatorLink>> links, std::size_t first)
    : links_(std::move(links)), current_(first % links_.size()) {}
LinkRing::~LinkRing() = default;

CoordinatorLink& LinkRing::current() {
  const std::lock_guard lock(mutex_);
  return *links_[current_];
}

Result<void> LinkRing::connect(const WorkerHello& hello, std::shared_ptr<LinkObserver> observer) {
  std::shared_ptr<Watch> watch;
  {
    const std::lock_guard lock(mutex_);
    const std::lock_guard state_lock(state_->mutex);
    // If the coordinator had accepted this worker before the connection ended, it is tried again before the
    // next one: it may only have restarted.
    if (go_on_ || (tried_ && !state_->welcomed)) current_ = (current_ + 1) % links_.size();
    tried_ = true;
    go_on_ = state_->welcomed = false;
    state_->idle_reports = state_->unacknowledged = 0;
    watch = watch_ = std::make_shared<Watch>(state_, std::move(observer));
  }
  return current().connect(hello, std::move(watch));
}

bool LinkRing::idle_for_long(const FromWorker& message) {
  const std::lock_guard lock(mutex_);
  const std::lock_guard state_lock(state_->mutex);
  if (const auto* drain = std::get_if<WorkerDraining>(&message)) draining_ = !drain->withdrawn;
  if (std::holds_alternative<UnitResult>(message) || std::holds_alternative<UnitFailure>(message))
    ++state_->unacknowledged;
  const auto* report = std::get_if<WorkerProgress>(&message);
  if (!report) return false;
  if (!report->leases.empty()) state_->idle_reports = 0;
  if (!report->leases.empty() || state_->unacknowledged > 0 || draining_ || links_.size() == 1) return false;
  go_on_ = ++state_->idle_reports >= kIdleReports;
  return go_on_;
}

void LinkRing::send(FromWorker message) {
  const bool leave = idle_for_long(message);
  current().send(std::move(message));
  if (!leave) return;
  current().close();
  std::shared_ptr<Watch> watch;
  {
    const std::lock_guard lock(mutex_);
    watch = watch_;
  }
  if (watch) watch->lost({Errc::unavailable, "it has had nothing to do; another coordinator is asked"});
}

void LinkRing::close() { current().close(); }

Result<void> LinkRing::fetch_blob(const BlobRequest& wanted, const BlobSink& sink) {
  return current().fetch_blob(wanted, sink);
}

}  // namespace ls::worker
