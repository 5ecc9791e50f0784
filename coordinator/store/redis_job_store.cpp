#include "coordinator/store/redis_job_store.h"

#include <fmt/format.h>

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <random>
#include <thread>

#include "common/base/log.h"
#include "coordinator/store/redis_pull.h"
#include "coordinator/store/redis_records.h"

namespace ls::coordinator {
namespace {

// Jobs told in one go: some MB at most.
constexpr std::size_t kJobsAtOnce = 64;

class RedisJobStore final : public JobStore {
 public:
  RedisJobStore(std::unique_ptr<JobStore> local, RedisStoreOptions options,
                std::map<JobId, std::uint64_t> revisions, std::unique_ptr<RedisLink> link)
      : local_(std::move(local)),
        options_(std::move(options)),
        revisions_(std::move(revisions)),
        link_(std::move(link)),
        teller_([this](const std::stop_token& token) { tell(token); }) {}

  Result<void> put_job(const StoredJob& job) override { return put_jobs({&job, 1}); }

  Result<void> put_jobs(std::span<const StoredJob> jobs) override {
    const std::lock_guard lock(mutex_);
    std::vector<StoredJob> revised(jobs.begin(), jobs.end());
    for (StoredJob& job : revised) {
      const auto known = revisions_.find(job.id);
      job.revision = (known == revisions_.end() ? 0 : known->second) + 1;
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
    // First the mark: Redis may have the job until it answers again, and must not bring it back.
    for (const JobId& job : jobs)
      if (revisions_.contains(job))
        if (auto marked = local_->reserve(removal_mark(job), 1); !marked)
          return tl::unexpected(marked.error());
    if (auto removed = local_->remove_jobs(jobs); !removed) return removed;
    for (const JobId& job : jobs) {
      if (revisions_.erase(job) == 0) continue;
      due_[job] = Due{};
      due_[job].removed = true;
    }
    wake_.notify_one();
    return {};
  }

  Result<void> add_point(const JobId& job, const ConvergencePoint& point) override {
    if (auto added = local_->add_point(job, point); !added) return added;
    return note(job, [](Due& due) { due.points = true; });
  }
  Result<void> set_truth(const JobId& job, double spp, const TrueFigures& truth) override {
    if (auto set = local_->set_truth(job, spp, truth); !set) return set;
    return note(job, [](Due& due) { due.points = true; });
  }
  Result<std::vector<ConvergencePoint>> points(const JobId& job) const override {
    return local_->points(job);
  }

  Result<void> add_log(const JobId& job, const LogLine& line) override {
    if (auto added = local_->add_log(job, line); !added) return added;
    return note(job, [](Due& due) { due.log = true; });
  }
  Result<std::vector<LogLine>> log(const JobId& job) const override { return local_->log(job); }

  Result<std::uint64_t> reserve(const std::string& counter, std::uint64_t amount) override {
    auto before = local_->reserve(counter, amount);
    if (!before) return before;
    const std::lock_guard lock(mutex_);
    auto& told = counters_[counter];
    told = std::max(told, *before + amount);
    wake_.notify_one();
    return before;
  }

  StoreStatus status() const override {
    const std::lock_guard lock(mutex_);
    return {options_.address.shown(), trouble_, due_.size() + (all_due_ ? revisions_.size() : 0)};
  }

 private:
  // What Redis is behind with, of one job.
  struct Due {
    std::optional<std::string> record;
    std::uint64_t revision = 0;  // of the record
    bool points = false, log = false, removed = false;

    void take(const StoredJob& job) {
      record = to_json(job);
      revision = job.revision;
      removed = false;
    }
  };

  template <class Edit>
  Result<void> note(const JobId& job, Edit edit) {
    const std::lock_guard lock(mutex_);
    if (revisions_.contains(job)) edit(due_[job]);
    wake_.notify_one();
    return {};
  }

  bool idle() const { return due_.empty() && counters_.empty() && !all_due_; }

  // ---- the thread that tells Redis ----

  void tell(const std::stop_token& token) {
    Duration pause = options_.first_retry;
    std::unique_lock lock(mutex_);
    while (!token.stop_requested()) {
      (void)wake_.wait_for(lock, token, options_.check_every, [&] { return !idle(); });
      if (token.stop_requested()) break;
      lock.unlock();
      const auto told = tell_once();
      lock.lock();
      set_trouble(told);
      if (told) {
        pause = options_.first_retry;
        continue;
      }
      (void)wake_.wait_for(lock, token, pause, [] { return false; });
      pause = std::min(pause * 2, options_.longest_retry);
    }
    lock.unlock();
    tell_the_rest();
  }

  // At the end; what stays untold is on the disk. Tried twice: a connection that broke unnoticed fails the first.
  void tell_the_rest() {
    int failed = 0;
    for (bool more = true; more && failed < 2;) {
      const bool told = tell_once().has_value();
      if (!told) ++failed;
      const std::lock_guard lock(mutex_);
      more = !told || !idle();
    }
  }

  void set_trouble(const Result<void>& told) {
    const std::string before = std::exchange(trouble_, told ? "" : told.error().message);
    if (before.empty() && !told)
      log_warn("store=redis",
               trouble_ + "; jobs go on, kept on this machine's disk, and Redis is told when it is back");
    if (!before.empty() && told)
      log_info("store=redis", "Redis answers again and is being told what it missed");
  }

  Result<void> tell_once() {
    if (!link_ || link_->broken()) {
      link_.reset();
      auto link = RedisLink::connect(options_.address, options_.timeouts);
      if (!link) return tl::unexpected(link.error());
      link_ = std::move(*link);
      memory_.clear();
    }
    if (auto same = check_memory(); !same) return same;
    if (auto all = note_all_behind(); !all) return all;
    if (auto told = tell_counters(); !told) return told;
    return tell_jobs();
  }

  // A word that lives in Redis as long as what else it knows: where it is another than before, Redis has
  // forgotten, or it is another Redis.
  Result<void> check_memory() {
    auto word = link_->run({"GET", kRedisMemory});
    if (!word) return tl::unexpected(word.error());
    if (!memory_.empty() && word->text == memory_) return {};
    if (word->nil) {
      if (auto set = link_->run({"SET", kRedisMemory, std::to_string(std::random_device()()), "NX"}); !set)
        return tl::unexpected(set.error());
      word = link_->run({"GET", kRedisMemory});
      if (!word) return tl::unexpected(word.error());
    }
    memory_ = word->text;
    const std::lock_guard lock(mutex_);
    all_due_ = true;
    return {};
  }

  // After that: every job of which Redis has a lower revision, or none, is due whole.
  Result<void> note_all_behind() {
    std::vector<std::pair<JobId, std::uint64_t>> known;
    {
      const std::lock_guard lock(mutex_);
      if (!all_due_) return {};
      known.assign(revisions_.begin(), revisions_.end());
    }
    auto behind = jobs_behind(*link_, known);
    if (!behind) return tl::unexpected(behind.error());
    auto jobs = behind->empty() ? Result<std::vector<StoredJob>>() : local_->jobs();
    if (!jobs) return tl::unexpected(jobs.error());
    const std::lock_guard lock(mutex_);
    all_due_ = false;
    for (const StoredJob& job : *jobs) {
      if (job.damaged || !behind->contains(job.id) || !revisions_.contains(job.id)) continue;
      Due& due = due_[job.id];
      if (!due.record) due.take(job);
      due.points = due.log = true;
    }
    return {};
  }

  Result<void> tell_counters() {
    std::map<std::string, std::uint64_t> counters;
    {
      const std::lock_guard lock(mutex_);
      counters.swap(counters_);
    }
    if (counters.empty()) return {};
    RedisLink::Command command{"HSET", kRedisCounters};
    for (const auto& [name, value] : counters) {
      command.push_back(name);
      command.push_back(std::to_string(value));
    }
    auto told = link_->run(command);
    if (told) return {};
    const std::lock_guard lock(mutex_);
    for (const auto& [name, value] : counters) counters_[name] = std::max(counters_[name], value);
    return tl::unexpected(told.error());
  }

  Result<void> tell_jobs() {
    std::map<JobId, Due> taken;
    std::vector<RedisLink::Command> commands;
    std::vector<JobId> owner;  // of each command
    {
      const std::lock_guard lock(mutex_);
      while (!due_.empty() && taken.size() < kJobsAtOnce) taken.insert(due_.extract(due_.begin()));
    }
    for (const auto& [id, due] : taken)
      for (auto& command : commands_of(id, due)) {
        commands.push_back(std::move(command));
        owner.push_back(id);
      }
    auto replies = link_->run_all(commands);
    std::optional<Error> failed;
    if (!replies) failed = replies.error();
    for (std::size_t i = 0; replies && i < replies->size(); ++i) {
      const auto& reply = (*replies)[i];
      if (!reply && !failed) failed = reply.error();
      if (reply && commands[i].front() == "EVAL" && reply->number == 0)
        log_error(fmt::format("job={}", owner[i].value),
                  "Redis has a later revision of this job: another coordinator writes it; what this one "
                  "knows is kept "
                  "on its disk only");
    }
    if (!failed) return {};
    give_back(std::move(taken));
    return tl::unexpected(*failed);
  }

  std::vector<RedisLink::Command> commands_of(const JobId& id, const Due& due) const {
    if (due.removed) return remove_commands(id);
    RedisUpdate update{id, due.revision, due.record, {}, {}};
    {
      const std::lock_guard lock(mutex_);
      const auto known = revisions_.find(id);
      if (known == revisions_.end()) return {};  // removed after it was taken; its removal is due
      if (!due.record) update.revision = known->second;
    }
    if (due.points)
      if (auto points = local_->points(id)) update.points = points_json(*points);
    if (due.log)
      if (auto log = local_->log(id)) update.log = log_json(*log);
    return {put_command(update)};
  }

  void give_back(std::map<JobId, Due> taken) {
    const std::lock_guard lock(mutex_);
    for (auto& [id, old] : taken) {
      const auto [now, fresh] = due_.try_emplace(id, old);
      if (fresh || now->second.removed) continue;
      if (!now->second.record) {
        now->second.record = std::move(old.record);
        now->second.revision = old.revision;
      }
      now->second.points |= old.points;
      now->second.log |= old.log;
    }
  }

  std::unique_ptr<JobStore> local_;
  RedisStoreOptions options_;
  mutable std::mutex mutex_;
  std::condition_variable_any wake_;
  std::map<JobId, std::uint64_t> revisions_;  // of every job there is
  std::map<JobId, Due> due_;
  std::map<std::string, std::uint64_t> counters_;
  std::unique_ptr<RedisLink> link_;  // this and the next one are the teller's
  std::string memory_;               // empty: not known yet
  bool all_due_ = true;
  std::string trouble_;
  std::jthread teller_;  // last: ends before what it uses goes
};

}  // namespace

Result<std::unique_ptr<JobStore>> open_redis_job_store(std::unique_ptr<JobStore> local,
                                                       RedisStoreOptions options) {
  auto jobs = local->jobs();
  if (!jobs) return tl::unexpected(jobs.error());
  auto link = RedisLink::connect(options.address, options.timeouts);
  if (!link && (jobs->empty() || link.error().code != Errc::unavailable))
    return fail(link.error().code,
                link.error().message + "; start Redis first: this machine's disk knows no job");
  if (!link) {
    log_warn("store=redis", link.error().message + "; starting from this machine's disk");
  } else {
    if (auto pulled = pull_from_redis(**link, *local, *jobs); !pulled) return tl::unexpected(pulled.error());
    jobs = local->jobs();
    if (!jobs) return tl::unexpected(jobs.error());
  }
  std::map<JobId, std::uint64_t> revisions;
  for (const StoredJob& job : *jobs) revisions[job.id] = job.revision;
  return std::make_unique<RedisJobStore>(std::move(local), std::move(options), std::move(revisions),
                                         link ? std::move(*link) : nullptr);
}

}  // namespace ls::coordinator
