// A job store that reports changes by other coordinators, as the test sets them, and fails when the test asks
// for it.
#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <utility>

#include "coordinator/store/jobs/job_store.h"

namespace ls::coordinator {

class MovingStore : public JobStore {
 public:
  explicit MovingStore(std::shared_ptr<JobStore> inner = make_memory_job_store())
      : inner_(std::move(inner)) {}

  void will_tell(Moved moved) {
    const std::lock_guard lock(mutex_);
    next_ = std::move(moved);
  }
  std::atomic<bool> refuses_to_bar{false};
  std::function<void()> on_refusal = [] {};  // called under the coordinator's lock

  Result<void> put_jobs(std::span<const StoredJob> jobs) override { return inner_->put_jobs(jobs); }
  Result<std::vector<StoredJob>> jobs() const override { return inner_->jobs(); }
  Result<void> remove_jobs(std::span<const JobId> jobs) override { return inner_->remove_jobs(jobs); }
  Result<void> add_point(const JobId& job, const ConvergencePoint& point) override {
    return inner_->add_point(job, point);
  }
  Result<void> set_reference_error(const JobId& job, double spp,
                                   const ReferenceError& reference_error) override {
    return inner_->set_reference_error(job, spp, reference_error);
  }
  Result<std::vector<ConvergencePoint>> points(const JobId& job) const override {
    return inner_->points(job);
  }
  Result<void> remove_points(const JobId& job) override { return inner_->remove_points(job); }
  Result<void> add_log(const JobId& job, const LogLine& line) override { return inner_->add_log(job, line); }
  Result<std::vector<LogLine>> log(const JobId& job) const override { return inner_->log(job); }
  Result<void> quarantine(const QuarantinedWorker& worker) override {
    if (refuses_to_bar) {
      on_refusal();
      return fail(Errc::resource_exhausted, "the disk is full");
    }
    return inner_->quarantine(worker);
  }
  Result<std::vector<QuarantinedWorker>> quarantined() const override { return inner_->quarantined(); }
  Result<std::uint64_t> reserve(const std::string& counter, std::uint64_t amount) override {
    return inner_->reserve(counter, amount);
  }
  Moved moved() override {
    const std::lock_guard lock(mutex_);
    for (const QuarantinedWorker& worker : next_.quarantined)
      (void)inner_->quarantine(worker);  // a real store also stores the worker before it reports it
    return std::exchange(next_, {});
  }

 private:
  std::shared_ptr<JobStore> inner_;
  std::mutex mutex_;
  Moved next_;
};

}  // namespace ls::coordinator
