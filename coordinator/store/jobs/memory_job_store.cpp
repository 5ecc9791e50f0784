#include <algorithm>
#include <deque>
#include <map>
#include <mutex>

#include "coordinator/base/limits.h"
#include "coordinator/store/jobs/job_store.h"

namespace ls::coordinator {
namespace {

class MemoryJobStore final : public JobStore {
 public:
  Result<void> put_jobs(std::span<const StoredJob> jobs) override {
    const std::lock_guard lock(mutex_);
    for (const StoredJob& job : jobs) {
      const auto known =
          std::find_if(jobs_.begin(), jobs_.end(), [&](const StoredJob& one) { return one.id == job.id; });
      if (known != jobs_.end())
        *known = job;
      else
        jobs_.push_back(job);
    }
    return {};
  }
  Result<std::vector<StoredJob>> jobs() const override {
    const std::lock_guard lock(mutex_);
    return jobs_;
  }
  Result<void> remove_jobs(std::span<const JobId> jobs) override {
    const std::lock_guard lock(mutex_);
    for (const JobId& job : jobs) {
      std::erase_if(jobs_, [&](const StoredJob& known) { return known.id == job; });
      points_.erase(job);
      log_.erase(job);
    }
    return {};
  }
  Result<void> add_point(const JobId& job, const ConvergencePoint& point) override {
    const std::lock_guard lock(mutex_);
    points_[job].push_back(point);
    return {};
  }
  Result<void> set_reference_error(const JobId& job, double spp,
                                   const ReferenceError& reference_error) override {
    const std::lock_guard lock(mutex_);
    for (ConvergencePoint& point : points_[job])
      if (point.spp == spp) point.reference_error = reference_error;
    return {};
  }
  Result<std::vector<ConvergencePoint>> points(const JobId& job) const override {
    const std::lock_guard lock(mutex_);
    const auto found = points_.find(job);
    return found == points_.end() ? std::vector<ConvergencePoint>{} : found->second;
  }
  Result<void> remove_points(const JobId& job) override {
    const std::lock_guard lock(mutex_);
    points_.erase(job);
    return {};
  }
  Result<void> add_log(const JobId& job, const LogLine& line) override {
    const std::lock_guard lock(mutex_);
    auto& lines = log_[job];
    lines.push_back(line);
    if (lines.size() > limits::kLogLinesKept) lines.pop_front();
    return {};
  }
  Result<std::vector<LogLine>> log(const JobId& job) const override {
    const std::lock_guard lock(mutex_);
    const auto found = log_.find(job);
    if (found == log_.end()) return std::vector<LogLine>{};
    return std::vector<LogLine>(found->second.begin(), found->second.end());
  }
  Result<void> quarantine(const QuarantinedWorker& worker) override {
    const std::lock_guard lock(mutex_);
    quarantined_.try_emplace(worker.worker, worker.evidence);
    return {};
  }
  Result<std::vector<QuarantinedWorker>> quarantined() const override {
    const std::lock_guard lock(mutex_);
    std::vector<QuarantinedWorker> all;
    for (const auto& [worker, evidence] : quarantined_) all.push_back({worker, evidence});
    return all;
  }
  Result<std::uint64_t> reserve(const std::string& counter, std::uint64_t amount) override {
    const std::lock_guard lock(mutex_);
    auto& value = counters_[counter];
    value += amount;
    return value - amount;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<StoredJob> jobs_;
  std::map<JobId, std::vector<ConvergencePoint>> points_;
  std::map<JobId, std::deque<LogLine>> log_;
  std::map<WorkerId, std::string> quarantined_;
  std::map<std::string, std::uint64_t> counters_;
};

}  // namespace

std::unique_ptr<JobStore> make_memory_job_store() { return std::make_unique<MemoryJobStore>(); }

}  // namespace ls::coordinator
