// Copies jobs from Redis to a coordinator's local store, when the coordinator starts or takes over a job.
#pragma once

#include <set>
#include <span>
#include <utility>

#include "coordinator/store/jobs/job_store.h"
#include "coordinator/store/redis/redis_link.h"
#include "coordinator/store/redis/redis_records.h"

namespace ls::coordinator {

// Name of the counter in the local store that marks a job as removed.
std::string removal_mark(const JobId& job);

// Copies from Redis to `local` the jobs, with their points (of the convergence curve) and logs, of which
// Redis has a higher revision than `known`, the jobs of `local`, or which `local` never had; also the
// counters. Unreadable records are reported and left where they are.
Result<void> pull_from_redis(RedisLink& link, JobStore& local, std::span<const StoredJob> known);

// Does the same if several coordinators share the Redis: copies the jobs that `node` still owns, and removes
// from `local` those that another coordinator has taken over.
Result<void> pull_owned(RedisLink& link, JobStore& local, const std::string& node);

// Stores a job, its points and its log in `local`; if `local` has more points or log lines, they stay.
Result<void> keep_from_redis(JobStore& local, const RedisJob& job);
// Does the same for a job that another coordinator owned until now: replaces everything that `local` has of
// the job.
Result<void> keep_inherited(JobStore& local, const RedisJob& job);

// Returns those jobs of `known` (pairs of id and revision) that Redis lacks or has in a lower revision.
Result<std::set<JobId>> jobs_behind(RedisLink& link, std::span<const std::pair<JobId, std::uint64_t>> known);

}  // namespace ls::coordinator
