#include "coordinator/store/redis/redis_job_store.h"

#include <fmt/format.h>

#include <random>

#include "coordinator/store/redis/redis_job_store_impl.h"
#include "coordinator/store/redis/redis_pull.h"
#include "core/base/log.h"

namespace ls::coordinator {
namespace {

// Greatest number of jobs in one batch of commands; such a batch has a few MB at most.
constexpr std::size_t kJobsAtOnce = 64;

// Returns an error if other coordinators share this Redis. A coordinator that was started without --shared
// does not check which coordinator owns a job: it would take over the jobs of all the others.
Result<void> refuse_shared(RedisLink& link) {
  auto nodes = link.run({"HKEYS", "lightshaft:nodes"});
  if (!nodes) return tl::unexpected(nodes.error());
  for (const RedisReply& node : nodes->items) {
    auto alive = link.run({"EXISTS", "lightshaft:alive:" + node.text});
    if (!alive) return tl::unexpected(alive.error());
    if (alive->number == 1)
      return fail(
          Errc::failed_precondition,
          fmt::format(
              "coordinator {} shares this Redis: start with --shared, too, or use another database of it",
              node.text));
  }
  return {};
}

// Opens the store of a coordinator that shares its Redis. It first sends a heartbeat, so that from then on no
// other coordinator takes over its jobs, and then finds out which jobs it still owns.
Result<std::unique_ptr<JobStore>> open_shared(std::unique_ptr<JobStore> local, RedisStoreOptions options) {
  const auto box = std::make_shared<RedisJobStore*>(nullptr);  // set below, before other threads use it
  auto members = std::make_unique<RedisMembers>(
      MemberOptions{.address = options.address, .node = options.node},
      RedisMembers::Callbacks{
          [box](std::vector<TakenJob> taken) { (*box)->take_over(std::move(taken)); },
          [box](const std::vector<LostJob>& lost) {
            if (*box) (*box)->lose(lost);
          },
          [box](const std::vector<QuarantinedWorker>& workers) { (*box)->apply(workers); },
          [box](std::vector<JobId> ids) { return (*box)->unknown(std::move(ids)); }});
  if (auto joined = members->join(); !joined)
    return fail(joined.error().code,
                joined.error().message +
                    "; start Redis first: which jobs are still this coordinator's is known there");
  auto link = RedisLink::connect(options.address, options.timeouts);
  if (!link) return tl::unexpected(link.error());
  if (auto pulled = pull_owned(**link, *local, options.node); !pulled) return tl::unexpected(pulled.error());
  const auto starts = local->reserve("starts", 0);
  if (!starts) return tl::unexpected(starts.error());
  const auto unique = members->unique_start(*starts);
  if (!unique) return tl::unexpected(unique.error());
  if (auto set = local->reserve("starts", *unique - *starts); !set) return tl::unexpected(set.error());
  auto jobs = local->jobs();
  if (!jobs) return tl::unexpected(jobs.error());
  auto made = std::make_unique<RedisJobStore>(std::move(local), std::move(options), std::move(*jobs),
                                              std::move(*link), std::move(members));
  *box = made.get();
  made->start_members();
  return made;
}

}  // namespace

Result<std::unique_ptr<JobStore>> open_redis_job_store(std::unique_ptr<JobStore> local,
                                                       RedisStoreOptions options) {
  if (!options.node.empty()) return open_shared(std::move(local), std::move(options));
  auto jobs = local->jobs();
  if (!jobs) return tl::unexpected(jobs.error());
  auto link = RedisLink::connect(options.address, options.timeouts);
  if (!link && (jobs->empty() || link.error().code != Errc::unavailable))
    return fail(link.error().code,
                link.error().message + "; start Redis first: this machine's disk knows no job");
  if (!link) {
    log_warn("store=redis", link.error().message + "; starting from this machine's disk");
  } else {
    if (auto alone = refuse_shared(**link); !alone) return tl::unexpected(alone.error());
    if (auto pulled = pull_from_redis(**link, *local, *jobs); !pulled) return tl::unexpected(pulled.error());
    jobs = local->jobs();
    if (!jobs) return tl::unexpected(jobs.error());
  }
  return std::make_unique<RedisJobStore>(std::move(local), std::move(options), std::move(*jobs),
                                         link ? std::move(*link) : nullptr, nullptr);
}

// Runs on the thread that updates Redis: sends changes until it is stopped, then sends the rest.
void RedisJobStore::send_loop(const std::stop_token& token) {
  Duration pause = options_.first_retry;
  auto state = state_.lock();
  while (!token.stop_requested()) {
    (void)wake_.wait_for(state, token, options_.check_every, [&] { return !state->idle(); });
    if (token.stop_requested()) break;
    state.unlock();
    const auto sent = send_once();
    state.lock();
    set_trouble(*state, sent);
    if (sent) {
      pause = options_.first_retry;
      continue;
    }
    (void)wake_.wait_for(state, token, pause, [] { return false; });
    pause = std::min(pause * 2, options_.longest_retry);
  }
  state.unlock();
  send_the_rest();
}

// At shutdown, sends the changes that Redis still lacks. It tries twice, because the first attempt fails if
// the connection broke unnoticed. Unsent changes remain on the disk.
void RedisJobStore::send_the_rest() {
  int failed = 0;
  for (bool more = true; more && failed < 2;) {
    const bool sent = send_once().has_value();
    if (!sent) ++failed;
    const auto state = state_.lock();
    more = !sent || !state->idle();
  }
}

void RedisJobStore::set_trouble(State& state, const Result<void>& sent) {
  const std::string before = std::exchange(state.trouble, sent ? "" : sent.error().message);
  if (before.empty() && !sent)
    log_warn(
        "store=redis",
        state.trouble + "; jobs continue, kept on this machine's disk, and Redis gets them when it is back");
  if (!before.empty() && sent) log_info("store=redis", "Redis answers again and gets what it missed");
}

Result<void> RedisJobStore::send_once() {
  const auto renewed = RedisLink::renew(link_, options_.address, options_.timeouts);
  if (!renewed) return tl::unexpected(renewed.error());
  if (*renewed) memory_.clear();
  if (auto same = check_memory(); !same) return same;
  if (auto all = note_all_behind(); !all) return all;
  // Quarantined workers are sent before the jobs, so that a coordinator that takes over the jobs knows these
  // workers.
  if (auto sent = send_quarantined(); !sent) return sent;
  if (auto sent = send_counters(); !sent) return sent;
  return send_jobs();
}

// Reads a random word that stays in Redis as long as the other data there. If the word has changed, Redis has
// lost its data or is another Redis: all jobs are then compared with it again.
Result<void> RedisJobStore::check_memory() {
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
  const auto state = state_.lock();
  state->all_due = true;
  return {};
}

// Finds the jobs that Redis lacks or has in a lower revision than this coordinator, and marks all their data
// as not sent.
Result<void> RedisJobStore::note_all_behind() {
  std::vector<std::pair<JobId, std::uint64_t>> known;
  {
    const auto state = state_.lock();
    if (!state->all_due) return {};
    known.assign(state->revisions.begin(), state->revisions.end());
  }
  auto behind = jobs_behind(*link_, known);
  if (!behind) return tl::unexpected(behind.error());
  auto jobs = behind->empty() ? Result<std::vector<StoredJob>>() : local_->jobs();
  if (!jobs) return tl::unexpected(jobs.error());
  const auto state = state_.lock();
  state->all_due = false;
  for (const auto& [worker, evidence] : state->quarantined) state->quarantined_due.insert(worker);
  for (const StoredJob& job : *jobs) {
    if (job.damaged || !behind->contains(job.id) || !state->revisions.contains(job.id)) continue;
    Due& due = state->due[job.id];
    if (!due.record) due.take(job);
    due.points = due.log = true;
  }
  return {};
}

Result<void> RedisJobStore::send_quarantined() {
  std::vector<RedisLink::Command> commands;
  std::set<WorkerId> due;
  {
    const auto state = state_.lock();
    due.swap(state->quarantined_due);
    for (const WorkerId& worker : due)
      commands.push_back({"HSETNX", kRedisQuarantined, worker.value, state->quarantined.at(worker)});
  }
  if (due.empty()) return {};
  auto replies = link_->run_all(commands);
  std::optional<Error> failed;
  if (!replies) failed = replies.error();
  for (std::size_t i = 0; replies && i < replies->size() && !failed; ++i)
    if (!(*replies)[i]) failed = (*replies)[i].error();
  if (!failed) return {};
  const auto state = state_.lock();
  state->quarantined_due.merge(due);
  return tl::unexpected(*failed);
}

Result<void> RedisJobStore::send_counters() {
  std::map<std::string, std::uint64_t> counters;
  {
    const auto state = state_.lock();
    counters.swap(state->counters);
  }
  if (counters.empty() || shared()) return {};  // if Redis is shared, counters stay local
  RedisLink::Command command{"HSET", kRedisCounters};
  for (const auto& [name, value] : counters) {
    command.push_back(name);
    command.push_back(std::to_string(value));
  }
  auto sent = link_->run(command);
  if (sent) return {};
  const auto state = state_.lock();
  for (const auto& [name, value] : counters) state->counters[name] = std::max(state->counters[name], value);
  return tl::unexpected(sent.error());
}

Result<void> RedisJobStore::send_jobs() {
  std::map<JobId, Due> taken;
  std::vector<RedisLink::Command> commands;
  std::vector<JobId> owner;               // the job that each command belongs to
  std::map<JobId, std::uint64_t> fences;  // the fence that each command carries (redis_members.h)
  {
    const auto state = state_.lock();
    // Each batch begins after the job that was sent last. So a job that Redis always rejects does not delay
    // the others.
    while (!state->due.empty() && taken.size() < kJobsAtOnce) {
      auto next = state->due.upper_bound(state->sent_last);
      if (next == state->due.end()) next = state->due.begin();
      state->sent_last = next->first;
      taken.insert(state->due.extract(next));
      state->sending.insert(state->sent_last);
    }
    for (const auto& [id, due] : taken)
      if (const auto fence = state->fences.find(id); fence != state->fences.end()) fences.insert(*fence);
  }
  for (const auto& [id, due] : taken)
    for (auto& command : commands_of(id, due)) {
      commands.push_back(std::move(command));
      owner.push_back(id);
    }
  auto replies = link_->run_all(commands);
  std::optional<Error> failed;
  std::set<JobId> refused;
  if (!replies) failed = replies.error();
  for (std::size_t i = 0; replies && i < replies->size(); ++i) {
    const auto& reply = (*replies)[i];
    if (!reply && !failed) failed = reply.error();
    if (!reply) refused.insert(owner[i]);
    if (reply && taken.at(owner[i]).removed) continue;
    if (reply && shared() && reply->number == static_cast<int>(PutAnswer::lost)) {
      const auto state = state_.lock();
      const auto now = state->fences.find(owner[i]), then = fences.find(owner[i]);
      if (now != state->fences.end() && then != fences.end() && now->second == then->second)
        lose(*state, owner[i]);
    }
    if (reply && !shared() && commands[i].front() == "EVAL" &&
        reply->number != static_cast<int>(PutAnswer::put))
      log_error(fmt::format("job={}", owner[i].value),
                "Redis has a later revision of this job: another coordinator writes it; what this one "
                "knows is kept "
                "on its disk only");
  }
  if (replies) std::erase_if(taken, [&](const auto& job) { return !refused.contains(job.first); });
  give_back(std::move(taken));
  return failed ? tl::unexpected(*failed) : Result<void>();
}

std::vector<RedisLink::Command> RedisJobStore::commands_of(const JobId& id, const Due& due) const {
  if (due.removed) return remove_commands(id, options_.node);
  RedisUpdate update{.id = id, .revision = due.revision, .record = due.record, .node = options_.node};
  update.state = due.state;
  {
    const auto state = state_.lock();
    const auto known = state->revisions.find(id);
    if (known == state->revisions.end())
      return {};  // the job was removed meanwhile; its removal will be sent
    if (!due.record) update.revision = known->second;
    if (const auto fence = state->fences.find(id); fence != state->fences.end()) update.fence = fence->second;
  }
  if (due.points)
    if (auto points = local_->points(id)) update.points = points_json(*points);
  if (due.log)
    if (auto log = local_->log(id)) update.log = log_json(*log);
  return {put_command(update)};
}

// Puts changes that could not be sent back into the list of changes to send.
void RedisJobStore::give_back(std::map<JobId, Due> taken) {
  const auto state = state_.lock();
  state->sending.clear();
  for (auto& [id, old] : taken) {
    const auto [now, fresh] = state->due.try_emplace(id, old);
    if (fresh || now->second.removed) continue;
    if (!now->second.record) {
      now->second.record = std::move(old.record);
      now->second.revision = old.revision;
      now->second.state = old.state;
    }
    now->second.points |= old.points;
    now->second.log |= old.log;
  }
  sent_.notify_all();
}

}  // namespace ls::coordinator
