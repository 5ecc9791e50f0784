#include "coordinator/store/redis/redis_pull.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "coordinator/store/redis/redis_records.h"
#include "core/base/log.h"

namespace ls::coordinator {
namespace {

// Number that is added to every counter of ids that is read from Redis, because Redis may have lost the last
// writes to it. Ids stay unique as long as the lost writes reserved at most this many ids.
constexpr std::uint64_t kCountsLost = 1'000'000;

// Runs several commands and returns their replies. Returns an error if any of the commands fails.
Result<std::vector<RedisReply>> ask(RedisLink& link, std::span<const RedisLink::Command> commands) {
  auto replies = link.run_all(commands);
  if (!replies) return tl::unexpected(replies.error());
  std::vector<RedisReply> all;
  for (auto& reply : *replies) {
    if (!reply) return tl::unexpected(reply.error());
    all.push_back(std::move(*reply));
  }
  return all;
}

Result<std::vector<std::uint64_t>> revisions_of(RedisLink& link, std::span<const JobId> ids) {
  std::vector<RedisLink::Command> commands;
  for (const JobId& id : ids) commands.push_back({"HGET", redis_job_key(id), "revision"});
  auto replies = link.run_all(commands);
  if (!replies) return tl::unexpected(replies.error());
  std::vector<std::uint64_t> revisions;
  // A job whose revision cannot be read gets revision 0, so that one bad job does not fail the call for all.
  for (const auto& reply : *replies) revisions.push_back(reply ? counter_of(reply->text) : 0);
  return revisions;
}

Result<void> pull_counters(RedisLink& link, JobStore& local) {
  auto all = link.run({"HGETALL", kRedisCounters});
  if (!all) return tl::unexpected(all.error());
  for (std::size_t i = 0; i + 1 < all->items.size(); i += 2) {
    const std::string& name = all->items[i].text;
    const std::uint64_t there = counter_of(all->items[i + 1].text);
    auto here = local.reserve(name, 0);
    if (!here) return tl::unexpected(here.error());
    if (*here >= there) continue;
    if (auto ahead = local.reserve(name, there - *here + kCountsLost); !ahead)
      return tl::unexpected(ahead.error());
  }
  return {};
}

// Returns the jobs of `ids` that must be copied: those that `here` (the revisions of local jobs, by id) lacks
// or has in a lower revision than Redis. A job that was removed from `local` is not returned, but is removed
// from Redis as well.
Result<std::vector<JobId>> wanted_of(RedisLink& link, JobStore& local,
                                     const std::map<JobId, std::uint64_t>& here,
                                     const std::vector<JobId>& ids, const std::string& node) {
  auto there = revisions_of(link, ids);
  if (!there) return tl::unexpected(there.error());
  std::vector<JobId> wanted;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (const auto mine = here.find(ids[i]); mine != here.end()) {
      if (mine->second < (*there)[i]) wanted.push_back(ids[i]);
      continue;
    }
    auto removed = local.reserve(removal_mark(ids[i]), 0);
    if (!removed) return tl::unexpected(removed.error());
    if (*removed == 0) {
      wanted.push_back(ids[i]);
      continue;
    }
    for (const auto& command : remove_commands(ids[i], node))
      if (auto gone = link.run(command); !gone) return tl::unexpected(gone.error());
  }
  return wanted;
}

// Copies the jobs `wanted` from Redis to `local`. `here` contains the jobs that have a record in `local`. If
// the process was killed while it copied a job, `local` has points and a part of the log of the job but no
// record; these data are replaced.
Result<void> take_jobs(RedisLink& link, JobStore& local, const std::map<JobId, std::uint64_t>& here,
                       const std::vector<JobId>& wanted) {
  std::vector<RedisLink::Command> commands;
  for (const JobId& id : wanted) commands.push_back({"HGETALL", redis_job_key(id)});
  auto replies = ask(link, commands);
  if (!replies) return tl::unexpected(replies.error());

  std::vector<RedisJob> jobs;
  for (std::size_t i = 0; i < replies->size(); ++i) {
    auto job = parse_redis_job((*replies)[i]);
    if (job && job->job.id != wanted[i]) job = fail(Errc::internal, "the record is of another job");
    if (job)
      jobs.push_back(std::move(*job));
    else
      log_error(fmt::format("job={} store=redis", wanted[i].value),
                job.error().message + "; it is left in Redis as it is");
  }
  std::stable_sort(jobs.begin(), jobs.end(), [](const RedisJob& a, const RedisJob& b) {
    return a.job.submitted_unix < b.job.submitted_unix;
  });
  for (const RedisJob& job : jobs)
    if (auto taken = here.contains(job.job.id) ? keep_from_redis(local, job) : keep_inherited(local, job);
        !taken)
      return taken;
  if (!jobs.empty()) log_info("store=redis", fmt::format("{} jobs taken from Redis", jobs.size()));
  return {};
}

// Copies to `local` those jobs in the Redis set `set_key` that `here` (the revisions of local jobs, by id)
// lacks or has in a lower revision.
Result<void> pull_jobs(RedisLink& link, JobStore& local, const std::map<JobId, std::uint64_t>& here,
                       const std::string& set_key, const std::string& node) {
  const auto ids = job_ids(link, set_key);
  if (!ids) return tl::unexpected(ids.error());
  auto wanted = wanted_of(link, local, here, *ids, node);
  if (!wanted) return tl::unexpected(wanted.error());
  return take_jobs(link, local, here, *wanted);
}

}  // namespace

Result<std::vector<JobId>> job_ids(RedisLink& link, const std::string& set_key) {
  auto members = link.run({"SMEMBERS", set_key});
  if (!members) return tl::unexpected(members.error());
  std::vector<JobId> ids;
  for (const RedisReply& member : members->items)
    if (is_job_id(member.text)) ids.push_back({member.text});
  return ids;
}

Result<void> keep_from_redis(JobStore& local, const RedisJob& job) {
  auto points = local.points(job.job.id);
  if (!points) return tl::unexpected(points.error());
  auto log = local.log(job.job.id);
  if (!log) return tl::unexpected(log.error());
  for (std::size_t i = points->size(); i < job.points.size(); ++i) {
    const ConvergencePoint& point = job.points[i];
    if (auto added = local.add_point(job.job.id, point); !added) return added;
    if (!point.reference_error) continue;
    if (auto set = local.set_reference_error(job.job.id, point.spp, *point.reference_error); !set) return set;
  }
  if (log->empty())
    for (const LogLine& line : job.log)
      if (auto added = local.add_log(job.job.id, line); !added) return added;
  // The record is stored last, since a job with a record counts as copied. If it were stored first and the
  // process were killed, the next start would not copy the points and the log, and a later change would
  // overwrite them in Redis.
  return local.put_job(job.job);
}

std::string removal_mark(const JobId& job) { return "removed:" + job.value; }

Result<void> keep_inherited(JobStore& local, const RedisJob& job) {
  // The local data are from an earlier ownership of the job, or from a copy that was not finished.
  if (auto removed = local.remove_job(job.job.id); !removed) return removed;
  return keep_from_redis(local, job);
}

Result<void> pull_quarantined(RedisLink& link, JobStore& local) {
  auto all = link.run({"HGETALL", kRedisQuarantined});
  if (!all) return tl::unexpected(all.error());
  for (const QuarantinedWorker& worker : quarantined_workers(*all))
    if (auto kept = local.quarantine(worker); !kept) return kept;
  return {};
}

Result<void> pull_from_redis(RedisLink& link, JobStore& local, std::span<const StoredJob> known) {
  if (auto quarantined = pull_quarantined(link, local); !quarantined) return quarantined;
  if (auto counters = pull_counters(link, local); !counters) return counters;
  std::map<JobId, std::uint64_t> here;
  for (const StoredJob& job : known) here[job.id] = job.revision;
  return pull_jobs(link, local, here, kRedisJobs, "");
}

Result<void> pull_owned(RedisLink& link, JobStore& local, const std::string& node) {
  if (auto quarantined = pull_quarantined(link, local); !quarantined) return quarantined;
  auto known = local.jobs();
  if (!known) return tl::unexpected(known.error());
  std::vector<RedisLink::Command> commands;
  for (const StoredJob& job : *known) commands.push_back({"HGET", redis_job_key(job.id), "owner"});
  auto owners = ask(link, commands);
  if (!owners) return tl::unexpected(owners.error());
  std::vector<JobId> gone;
  std::map<JobId, std::uint64_t> here;
  for (std::size_t i = 0; i < known->size(); ++i) {
    const StoredJob& job = (*known)[i];
    if ((*owners)[i].nil || (*owners)[i].text == node)
      here[job.id] = job.revision;
    else
      gone.push_back(job.id);
  }
  for (const JobId& id : gone)
    log_warn(fmt::format("job={} store=redis", id.value),
             "another coordinator has taken it over while this one was away: dropped");
  if (auto removed = local.remove_jobs(gone); !removed) return removed;
  return pull_jobs(link, local, here, "lightshaft:owned:" + node, node);
}

Result<std::set<JobId>> jobs_behind(RedisLink& link, std::span<const std::pair<JobId, std::uint64_t>> known) {
  std::vector<JobId> ids;
  for (const auto& [id, revision] : known) ids.push_back(id);
  auto there = revisions_of(link, ids);
  if (!there) return tl::unexpected(there.error());
  std::set<JobId> behind;
  for (std::size_t i = 0; i < ids.size(); ++i)
    if ((*there)[i] < known[i].second) behind.insert(ids[i]);
  return behind;
}

}  // namespace ls::coordinator
