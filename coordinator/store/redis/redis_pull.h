// Copies jobs from Redis to a coordinator's local store, when the coordinator starts or takes over a job.
#pragma once

#include <set>
#include <span>
#include <utility>

#include "coordinator/store/jobs/job_store.h"
#include "coordinator/store/redis/redis_link.h"
#include "coordinator/store/redis/redis_records.h"

namespace ls::coordinator {

// Returns those members of a Redis set that have the form of a job's id.
Result<std::vector<JobId>> job_ids(RedisLink& link, const std::string& set_key);

// Returns the name of the counter in the local store that marks a job as removed.
std::string removal_mark(const JobId& job);

// Copies jobs from Redis to `local`, with their points (of the convergence curve) and logs, and also the
// counters. It copies jobs that `local` never had, and jobs whose revision in Redis is higher than in
// `known`, the jobs of `local`. Records that cannot be read are logged and stay in Redis.
Result<void> pull_from_redis(RedisLink& link, JobStore& local, std::span<const StoredJob> known);

// The same for several coordinators that share the Redis, but without the counters: copies the jobs that
// `node` still owns, and removes from `local` those that another coordinator has taken over.
Result<void> pull_owned(RedisLink& link, JobStore& local, const std::string& node);

// Stores a job, its points and its log in `local`, the job last. Points in `local` are kept and only later
// ones added; a log in `local` is kept unless it is empty.
Result<void> keep_from_redis(JobStore& local, const RedisJob& job);
// Stores a job that another coordinator owned until now. It replaces everything that `local` has of the job.
Result<void> keep_inherited(JobStore& local, const RedisJob& job);

// Returns those jobs of `known` (pairs of id and revision) that Redis lacks or has in a lower revision.
Result<std::set<JobId>> jobs_behind(RedisLink& link, std::span<const std::pair<JobId, std::uint64_t>> known);

}  // namespace ls::coordinator
