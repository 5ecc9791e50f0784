// The class behind redis_job_store.h. redis_job_store.cpp opens it, redis_job_store_send.cpp has the thread
// that updates Redis, this header what the coordinator's other threads call.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <condition_variable>
#include <map>
#include <mutex>
#include <set>
#include <thread>
#include <utility>

#include "common/base/log.h"
#include "coordinator/store/redis/redis_job_store.h"
#include "coordinator/store/redis/redis_pull.h"

namespace ls::coordinator {

class RedisJobStore final : public JobStore {
 public:
  RedisJobStore(std::unique_ptr<JobStore> local, RedisStoreOptions options, std::vector<StoredJob> jobs,
                std::unique_ptr<RedisLink> link, std::unique_ptr<RedisMembers> members)
      : local_(std::move(local)),
        options_(std::move(options)),
        link_(std::move(link)),
        members_(std::move(members)) {
    for (const StoredJob& job : jobs) {
      revisions_[job.id] = job.revision;
      fences_[job.id] = std::max(job.fence, first_fence());
    }
    if (const auto quarantined = local_->quarantined())
      for (const QuarantinedWorker& worker : *quarantined) quarantined_[worker.worker] = worker.evidence;
    sender_ = std::jthread([this](const std::stop_token& token) { send_loop(token); });
  }

  Result<void> put_job(const StoredJob& job) override { return put_jobs({&job, 1}); }

  Result<void> put_jobs(std::span<const StoredJob> jobs) override {
    const std::lock_guard lock(mutex_);
    std::vector<StoredJob> revised;
    for (const StoredJob& job : jobs) {
      if (lost_.contains(job.id)) continue;  // another coordinator owns the record
      const auto known = revisions_.find(job.id);
      revised.push_back(job);
      revised.back().revision = (known == revisions_.end() ? 0 : known->second) + 1;
      revised.back().fence = fences_.try_emplace(job.id, first_fence()).first->second;
    }
    if (auto put = local_->put_jobs(revised); !put) return put;
    for (const StoredJob& job : revised) {
      revisions_[job.id] = job.revision;
      due_[job.id].take(job);
    }
    wake_.notify_one();
    return {};
  }

  Result<std::vector<StoredJob>> jobs() const override { return local_->jobs(); }

  Result<void> remove_jobs(std::span<const JobId> jobs) override {
    const std::lock_guard lock(mutex_);
    // The jobs are marked as removed before anything else: Redis still has them until it can be updated, and
    // they must not be copied back from there.
    for (const JobId& job : jobs)
      if (revisions_.contains(job))
        if (auto marked = local_->reserve(removal_mark(job), 1); !marked)
          return tl::unexpected(marked.error());
    if (auto removed = local_->remove_jobs(jobs); !removed) return removed;
    for (const JobId& job : jobs) {
      fences_.erase(job);
      lost_.erase(job);
      if (revisions_.erase(job) == 0) continue;
      due_[job] = Due{};
      due_[job].removed = true;
    }
    wake_.notify_one();
    return {};
  }

  Result<void> add_point(const JobId& job, const ConvergencePoint& point) override {
    return note(
        job, [&] { return local_->add_point(job, point); }, [](Due& due) { due.points = true; });
  }
  Result<void> set_reference_error(const JobId& job, double spp,
                                   const ReferenceError& reference_error) override {
    return note(
        job, [&] { return local_->set_reference_error(job, spp, reference_error); },
        [](Due& due) { due.points = true; });
  }
  Result<std::vector<ConvergencePoint>> points(const JobId& job) const override {
    return local_->points(job);
  }
  Result<void> remove_points(const JobId& job) override {
    return note(
        job, [&] { return local_->remove_points(job); }, [](Due& due) { due.points = true; });
  }

  Result<void> add_log(const JobId& job, const LogLine& line) override {
    return note(
        job, [&] { return local_->add_log(job, line); }, [](Due& due) { due.log = true; });
  }
  Result<std::vector<LogLine>> log(const JobId& job) const override { return local_->log(job); }

  Result<void> quarantine(const QuarantinedWorker& worker) override {
    if (auto kept = local_->quarantine(worker); !kept) return kept;
    const std::lock_guard lock(mutex_);
    if (quarantined_.try_emplace(worker.worker, worker.evidence).second)
      quarantined_due_.insert(worker.worker);
    wake_.notify_one();
    return {};
  }
  Result<std::vector<QuarantinedWorker>> quarantined() const override { return local_->quarantined(); }

  Result<std::uint64_t> reserve(const std::string& counter, std::uint64_t amount) override {
    auto before = local_->reserve(counter, amount);
    if (!before) return before;
    const std::lock_guard lock(mutex_);
    auto& recorded = counters_[counter];
    recorded = std::max(recorded, *before + amount);
    wake_.notify_one();
    return before;
  }

  StoreStatus status() const override {
    const std::lock_guard lock(mutex_);
    std::string trouble = trouble_.empty() ? not_kept_ : trouble_;
    if (trouble.empty() && members_) trouble = members_->stranded();
    return {options_.address.shown(), std::move(trouble),
            due_.size() + sending_ + (all_due_ ? revisions_.size() : 0)};
  }

  Moved moved() override {
    const std::lock_guard lock(mutex_);
    return std::exchange(moved_, {});
  }
  void announce(const std::string& http, const std::string& grpc) override {
    if (members_) members_->announce(http, grpc);
  }
  Result<std::optional<JobLocation>> locate_job(const JobId& id) override {
    if (!members_) return std::nullopt;
    auto owner = members_->owner_of(id);
    if (!owner) return tl::unexpected(owner.error());
    if (!*owner) return std::nullopt;
    // This node owns the job in Redis but does not have it: it is still taking the job over, or removing it.
    if ((*owner)->node == options_.node) {
      const std::lock_guard lock(mutex_);
      const auto due = due_.find(id);
      return due != due_.end() && due->second.removed ? std::nullopt
                                                      : std::optional<JobLocation>(JobLocation{});
    }
    return JobLocation{(*owner)->http, (*owner)->alive};
  }

  // Called by the members' thread

  void take_over(std::vector<TakenJob> taken) {
    for (TakenJob& one : taken) {
      StoredJob& job = one.job.job;
      job.fence = one.fence;
      auto kept = keep_inherited(*local_, one.job);
      const std::lock_guard lock(mutex_);
      // Redis says that this node owns the job, so the members' thread will try to store it again.
      if (!kept) {
        if (not_kept_.empty())
          log_error(fmt::format("job={}", job.id.value),
                    "cannot be taken over now, and is tried again: " + kept.error().message);
        not_kept_ = fmt::format("job {} cannot be taken over: {}", job.id.value, kept.error().message);
        continue;
      }
      not_kept_.clear();
      revisions_[job.id] = job.revision;
      fences_[job.id] = job.fence;
      lost_.erase(job.id);
      moved_.inherited.push_back({std::move(job), std::move(one.from)});
    }
  }

  void apply(const std::vector<QuarantinedWorker>& workers) {
    for (const QuarantinedWorker& worker : workers) {
      const std::lock_guard lock(mutex_);
      if (quarantined_.contains(worker.worker)) continue;
      // A quarantine that cannot be stored here is applied anyway; after a restart it is read from Redis
      // again.
      if (auto kept = local_->quarantine(worker); !kept) {
        log_error(fmt::format("worker={}", worker.worker.value), kept.error().message);
      }
      quarantined_[worker.worker] = worker.evidence;
      moved_.quarantined.push_back(worker);
    }
  }

  // Gets the jobs that this node owns according to Redis and returns those of them that it does not have.
  std::vector<JobId> unknown(std::vector<JobId> ids) {
    const std::lock_guard lock(mutex_);
    std::erase_if(ids, [&](const JobId& id) {
      if (revisions_.contains(id)) return true;
      const auto due = due_.find(id);
      if (due != due_.end() && due->second.removed) return true;
      const auto removed = local_->reserve(removal_mark(id), 0);
      if (!removed || *removed == 0) return !removed.has_value();
      due_[id] = Due{};
      due_[id].removed = true;  // the removal has not reached Redis
      wake_.notify_one();
      return true;
    });
    return ids;
  }

  void lose(const std::vector<LostJob>& jobs) {
    const std::lock_guard lock(mutex_);
    for (const LostJob& job : jobs)
      if (const auto mine = fences_.find(job.id); mine != fences_.end() && mine->second < job.fence)
        lose_locked(job.id);
  }

  void start_members() {
    if (members_) members_->start();
  }

 private:
  // Which changes of one job have not been sent to Redis yet
  struct Due {
    std::optional<std::string> record;
    std::string state;           // of the record
    std::uint64_t revision = 0;  // of the record
    bool points = false, log = false, removed = false;

    void take(const StoredJob& job) {
      record = to_json(job);
      revision = job.revision;
      removed = false;
      state = to_string(job.state);
    }
  };

  bool shared() const { return !options_.node.empty(); }
  std::uint64_t first_fence() const { return shared() ? 1 : 0; }

  // Forgets a job that another coordinator owns now: its later updates are ignored, and moved() reports it,
  // so that the coordinator drops it.
  void lose_locked(const JobId& job) {
    if (!revisions_.contains(job)) return;
    revisions_.erase(job);
    fences_.erase(job);
    due_.erase(job);
    std::erase_if(moved_.inherited, [&](const Inherited& one) { return one.job.id == job; });
    lost_.insert(job);
    moved_.lost.push_back(job);
    if (auto gone = local_->remove_job(job); !gone)
      log_error(fmt::format("job={}", job.value),
                "another coordinator has it, and its record stays here: " + gone.error().message);
  }

  // Stores an update by keep() and marks by edit() what of the job must be sent to Redis. Updates of a job
  // that another coordinator owns now are ignored: if the job comes back, they must not be in the local
  // store.
  template <class Keep, class Edit>
  Result<void> note(const JobId& job, Keep keep, Edit edit) {
    const std::lock_guard lock(mutex_);
    if (lost_.contains(job)) return {};
    if (auto kept = keep(); !kept) return kept;
    if (revisions_.contains(job)) edit(due_[job]);
    wake_.notify_one();
    return {};
  }

  bool idle() const { return due_.empty() && counters_.empty() && quarantined_due_.empty() && !all_due_; }

  // The thread that updates Redis
  void send_loop(const std::stop_token& token);
  void send_the_rest();
  void set_trouble(const Result<void>& recorded);
  Result<void> send_once();
  Result<void> check_memory();
  Result<void> note_all_behind();
  Result<void> send_counters();
  Result<void> send_quarantined();
  Result<void> send_jobs();
  std::vector<RedisLink::Command> commands_of(const JobId& id, const Due& due) const;
  void give_back(std::map<JobId, Due> taken);

  std::unique_ptr<JobStore> local_;
  RedisStoreOptions options_;
  mutable std::mutex mutex_;
  std::condition_variable_any wake_;
  std::map<JobId, std::uint64_t> revisions_;  // of every job
  std::map<JobId, std::uint64_t> fences_;     // of every job (see redis_members.h); 0: never shared
  std::set<JobId> lost_;                      // jobs that others own now: their updates are not stored
  Moved moved_;                               // what the next call of moved() returns
  std::map<JobId, Due> due_;
  // Number of jobs being sent to Redis: they are no longer in due_, nor in Redis yet.
  std::size_t sending_ = 0;
  JobId sent_last_;  // last due job sent; the next ones follow it in order
  std::map<std::string, std::uint64_t> counters_;
  std::map<WorkerId, std::string> quarantined_;  // all known
  std::set<WorkerId> quarantined_due_;
  std::string not_kept_;             // why a job taken over could not be stored here yet
  std::unique_ptr<RedisLink> link_;  // this and memory_ are used by the sending thread only
  std::string memory_;               // the word of lightshaft:memory when last read; empty: unknown
  bool all_due_ = true;              // it must still be found out which jobs Redis lacks
  std::string trouble_;
  std::unique_ptr<RedisMembers> members_;
  std::jthread sender_;  // last member: this and the members' thread end before what they use
};

}  // namespace ls::coordinator
