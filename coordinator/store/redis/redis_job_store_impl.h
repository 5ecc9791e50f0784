// The class behind redis_job_store.h. This header contains the functions that the coordinator's threads call;
// redis_job_store.cpp contains the function that opens the store and the thread that updates Redis. A node is
// one of several coordinators that share the Redis; the members' thread is the one that RedisMembers starts
// (redis_members.h).
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <condition_variable>
#include <map>
#include <set>
#include <thread>
#include <utility>

#include "coordinator/store/redis/redis_job_store.h"
#include "coordinator/store/redis/redis_pull.h"
#include "core/base/guarded.h"
#include "core/base/log.h"

namespace ls::coordinator {

inline tl::unexpected<Error> owned_by_another(const JobId& job) {
  return fail(Errc::unavailable,
              fmt::format("another coordinator has taken over job {}: ask again", job.value));
}
inline tl::unexpected<Error> not_shared(const std::string& trouble) {
  return fail(Errc::unavailable,
              trouble +
                  "; until it answers, another coordinator could take the job over without the change: "
                  "try again later");
}

class RedisJobStore final : public JobStore {
 public:
  RedisJobStore(std::unique_ptr<JobStore> local, RedisStoreOptions options, std::vector<StoredJob> jobs,
                std::unique_ptr<RedisLink> link, std::unique_ptr<RedisMembers> members)
      : local_(std::move(local)),
        options_(std::move(options)),
        link_(std::move(link)),
        members_(std::move(members)) {
    const auto state = state_.lock();
    for (const StoredJob& job : jobs) {
      state->revisions[job.id] = job.revision;
      state->fences[job.id] = std::max(job.fence, first_fence());
    }
    if (const auto quarantined = local_->quarantined())
      for (const QuarantinedWorker& worker : *quarantined)
        state->quarantined[worker.worker] = worker.evidence;
    sender_ = std::jthread([this](const std::stop_token& token) { send_loop(token); });
  }

  Result<void> put_jobs(std::span<const StoredJob> jobs) override {
    const auto state = state_.lock();
    std::vector<StoredJob> revised;
    for (const StoredJob& job : jobs)
      if (state->lost.contains(job.id)) return owned_by_another(job.id);
    for (const StoredJob& job : jobs) {
      const auto known = state->revisions.find(job.id);
      revised.push_back(job);
      revised.back().revision = (known == state->revisions.end() ? 0 : known->second) + 1;
      revised.back().fence = state->fences.try_emplace(job.id, first_fence()).first->second;
    }
    if (auto put = local_->put_jobs(revised); !put) return put;
    for (const StoredJob& job : revised) {
      state->revisions[job.id] = job.revision;
      state->due[job.id].take(job);
    }
    wake_.notify_one();
    return {};
  }

  Result<std::vector<StoredJob>> jobs() const override { return local_->jobs(); }

  Result<void> remove_jobs(std::span<const JobId> jobs) override {
    const auto state = state_.lock();
    // The jobs are marked as removed first. Redis still has them until it is updated; the marks prevent
    // copying them back from there.
    for (const JobId& job : jobs)
      if (state->revisions.contains(job))
        if (auto marked = local_->reserve(removal_mark(job), 1); !marked)
          return tl::unexpected(marked.error());
    if (auto removed = local_->remove_jobs(jobs); !removed) return removed;
    for (const JobId& job : jobs) {
      state->fences.erase(job);
      state->lost.erase(job);
      if (state->revisions.erase(job) == 0) continue;
      state->due[job] = Due{};
      state->due[job].removed = true;
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
    const auto state = state_.lock();
    if (state->quarantined.try_emplace(worker.worker, worker.evidence).second)
      state->quarantined_due.insert(worker.worker);
    wake_.notify_one();
    return {};
  }
  Result<std::vector<QuarantinedWorker>> quarantined() const override { return local_->quarantined(); }

  Result<std::uint64_t> reserve(const std::string& counter, std::uint64_t amount) override {
    auto before = local_->reserve(counter, amount);
    if (!before) return before;
    const auto state = state_.lock();
    auto& recorded = state->counters[counter];
    recorded = std::max(recorded, *before + amount);
    wake_.notify_one();
    return before;
  }

  StoreStatus status() const override {
    const auto state = state_.lock();
    std::string trouble = state->trouble.empty() ? state->not_kept : state->trouble;
    if (trouble.empty() && members_) trouble = members_->stranded();
    return {options_.address.shown(), std::move(trouble),
            state->due.size() + state->sending.size() + (state->all_due ? state->revisions.size() : 0)};
  }

  Moved moved() override {
    const auto state = state_.lock();
    return std::exchange(state->moved, {});
  }
  Result<void> can_share() const override {
    const auto state = state_.lock();
    if (!shared() || state->trouble.empty()) return {};
    return not_shared(state->trouble);
  }
  Result<void> share(std::span<const JobId> jobs) override {
    if (!shared()) return {};
    auto state = state_.lock();
    const auto is_sent = [&](const JobId& id) {
      const auto due = state->due.find(id);
      return !state->sending.contains(id) && (due == state->due.end() || !due->second.reports());
    };
    const auto all_sent = [&] { return std::all_of(jobs.begin(), jobs.end(), is_sent); };
    const bool sent = sent_.wait_for(state, options_.share_within, all_sent);
    for (const JobId& id : jobs)
      if (state->lost.contains(id)) return owned_by_another(id);
    if (sent) return {};
    return not_shared(state->trouble.empty() ? options_.address.shown() + " does not answer"
                                             : state->trouble);
  }
  void announce(const std::string& http, const std::string& grpc) override {
    if (members_) members_->announce(http, grpc);
  }
  Result<std::optional<JobLocation>> locate_job(const JobId& id) override {
    if (!members_) return std::nullopt;
    auto owner = members_->owner_of(id);
    if (!owner) return tl::unexpected(owner.error());
    if (!*owner) return std::nullopt;
    // This node owns the job in Redis but does not have it: it is still taking the job over, or has removed
    // it.
    if ((*owner)->node == options_.node) {
      const auto state = state_.lock();
      const auto due = state->due.find(id);
      return due != state->due.end() && due->second.removed ? std::nullopt
                                                            : std::optional<JobLocation>(JobLocation{});
    }
    return JobLocation{(*owner)->http, (*owner)->alive};
  }

  // The functions below are called by the members' thread.

  void take_over(std::vector<TakenJob> taken) {
    for (TakenJob& one : taken) {
      StoredJob& job = one.job.job;
      job.fence = one.job.fence;
      auto kept = keep_inherited(*local_, one.job);
      const auto state = state_.lock();
      // In Redis this node owns the job now. If the job could not be stored here, the members' thread will
      // call this function again with the same job.
      if (!kept) {
        if (state->not_kept.empty())
          log_error(fmt::format("job={}", job.id.value),
                    "cannot be taken over now, and is tried again: " + kept.error().message);
        state->not_kept = fmt::format("job {} cannot be taken over: {}", job.id.value, kept.error().message);
        continue;
      }
      state->not_kept.clear();
      state->revisions[job.id] = job.revision;
      state->fences[job.id] = job.fence;
      state->lost.erase(job.id);
      state->moved.inherited.push_back({std::move(job), std::move(one.from)});
    }
  }

  void apply(const std::vector<QuarantinedWorker>& workers) {
    for (const QuarantinedWorker& worker : workers) {
      const auto state = state_.lock();
      if (state->quarantined.contains(worker.worker)) continue;
      // The worker counts as quarantined even if that cannot be stored locally: after a restart it is read
      // from Redis again.
      if (auto kept = local_->quarantine(worker); !kept) {
        log_error(fmt::format("worker={}", worker.worker.value), kept.error().message);
      }
      state->quarantined[worker.worker] = worker.evidence;
      state->moved.quarantined.push_back(worker);
    }
  }

  // `ids` are the jobs that this node owns according to Redis. Returns those of `ids` that this node does not
  // have.
  std::vector<JobId> unknown(std::vector<JobId> ids) {
    const auto state = state_.lock();
    std::erase_if(ids, [&](const JobId& id) {
      if (state->revisions.contains(id)) return true;
      const auto due = state->due.find(id);
      if (due != state->due.end() && due->second.removed) return true;
      const auto removed = local_->reserve(removal_mark(id), 0);
      if (!removed || *removed == 0) return !removed.has_value();
      state->due[id] = Due{};
      state->due[id].removed = true;  // this node has removed the job, but Redis still has it
      wake_.notify_one();
      return true;
    });
    return ids;
  }

  void lose(const std::vector<LostJob>& jobs) {
    const auto state = state_.lock();
    for (const LostJob& job : jobs)
      if (const auto mine = state->fences.find(job.id);
          mine != state->fences.end() && mine->second < job.fence)
        lose(*state, job.id);
  }

  void start_members() {
    if (members_) members_->start();
  }

 private:
  // The changes of one job that have not been sent to Redis yet
  struct Due {
    std::optional<std::string> record;
    std::string state;           // state of the job in the record
    std::uint64_t revision = 0;  // revision of the record
    bool points = false, log = false, removed = false;

    // True if a coordinator that takes the job over would not know its latest record, or its removal
    bool reports() const { return record || removed; }
    void take(const StoredJob& job) {
      record = to_json(job);
      revision = job.revision;
      removed = false;
      state = to_string(job.state);
    }
  };

  // Revisions and fences of the jobs, and the changes that must still be sent to Redis
  struct State {
    bool idle() const { return due.empty() && counters.empty() && quarantined_due.empty() && !all_due; }

    std::map<JobId, std::uint64_t> revisions;  // latest revision of every job
    // Fence of every job, a number that increases with every new owner (redis_members.h); 0: the job was
    // never shared
    std::map<JobId, std::uint64_t> fences;
    std::set<JobId> lost;  // jobs that other coordinators own now: their updates are not stored
    Moved moved;           // the result of the next call of moved()
    std::map<JobId, Due> due;
    // Jobs that are being sent to Redis: they have left `due` but are not in Redis yet.
    std::set<JobId> sending;
    JobId sent_last;  // the last job of the last batch; the next batch begins with the job after it
    std::map<std::string, std::uint64_t> counters;
    std::map<WorkerId, std::string> quarantined;  // all known quarantined workers
    std::set<WorkerId> quarantined_due;
    std::string not_kept;  // why a job that was taken over could not be stored here yet
    bool all_due = true;   // true until all jobs have been compared with Redis to find those that it lacks
    std::string trouble;
  };

  bool shared() const { return !options_.node.empty(); }
  std::uint64_t first_fence() const { return shared() ? 1 : 0; }

  // Forgets a job that another coordinator owns now: its later updates are ignored, and moved() reports it,
  // so that the coordinator drops it.
  void lose(State& state, const JobId& job) {
    if (!state.revisions.contains(job)) return;
    state.revisions.erase(job);
    state.fences.erase(job);
    state.due.erase(job);
    std::erase_if(state.moved.inherited, [&](const Inherited& one) { return one.job.id == job; });
    state.lost.insert(job);
    state.moved.lost.push_back(job);
    if (auto gone = local_->remove_job(job); !gone)
      log_error(fmt::format("job={}", job.value),
                "another coordinator has it, and its record stays here: " + gone.error().message);
  }

  // Stores an update of a job by calling keep(), and marks by edit() which data of the job must be sent to
  // Redis. Updates of a job that another coordinator owns now are ignored: if the job comes back, they must
  // not be in the local store.
  template <class Keep, class Edit>
  Result<void> note(const JobId& job, Keep keep, Edit edit) {
    const auto state = state_.lock();
    if (state->lost.contains(job)) return {};
    if (auto kept = keep(); !kept) return kept;
    if (state->revisions.contains(job)) edit(state->due[job]);
    wake_.notify_one();
    return {};
  }

  // These functions run on the thread that updates Redis.
  void send_loop(const std::stop_token& token);
  void send_the_rest();
  static void set_trouble(State& state, const Result<void>& sent);
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
  mutable Guarded<State> state_;
  std::condition_variable_any wake_;
  std::condition_variable_any sent_;  // notified when changes were sent to Redis
  std::unique_ptr<RedisLink> link_;   // link_ and memory_ are used only by send_loop()'s thread
  std::string memory_;                // the last known value of lightshaft:memory; empty: unknown
  std::unique_ptr<RedisMembers> members_;
  // Declared last: both threads, this one and that of members_, must end before the variables above are
  // destroyed.
  std::jthread sender_;
};

}  // namespace ls::coordinator
