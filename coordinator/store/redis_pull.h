// At the start of a coordinator: what Redis knows better than this machine's disk, and the reverse.
#pragma once

#include <set>
#include <span>
#include <utility>

#include "coordinator/store/job_store.h"
#include "coordinator/store/redis_link.h"
#include "coordinator/store/redis_records.h"

namespace ls::coordinator {

// Name of the counter in the local store that says that a job was removed.
std::string removal_mark(const JobId& job);

// Takes jobs, points, logs and counters into `local` where Redis has a higher revision, or a job that `local`
// never had. Records that cannot be read are told of and left where they are.
Result<void> pull_from_redis(RedisLink& link, JobStore& local, std::span<const StoredJob> known);

// The same where several coordinators share the Redis, for `node`: what it still owns. Jobs that another one
// has taken over since go from `local`.
Result<void> pull_owned(RedisLink& link, JobStore& local, const std::string& node);

// Puts a job, its points and its log into `local`; of those that has more, they stay.
Result<void> keep_from_redis(JobStore& local, const RedisJob& job);
// The same of a job that another one had until now: nothing that `local` has of it stays.
Result<void> keep_inherited(JobStore& local, const RedisJob& job);

// Those of `known` (id, revision) that Redis has in a lower revision, or not at all.
Result<std::set<JobId>> jobs_behind(RedisLink& link, std::span<const std::pair<JobId, std::uint64_t>> known);

}  // namespace ls::coordinator
