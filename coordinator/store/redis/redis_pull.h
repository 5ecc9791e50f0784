// At the start of a coordinator: reconciles Redis with the local store.
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

// Copies jobs, points, logs and counters into `local` if Redis has a higher revision, or a job that `local`
// never had. Unreadable records are reported and left where they are.
Result<void> pull_from_redis(RedisLink& link, JobStore& local, std::span<const StoredJob> known);

// The same if several coordinators share the Redis: copies what `node` still owns, and removes jobs from
// `local` that another one has taken over.
Result<void> pull_owned(RedisLink& link, JobStore& local, const std::string& node);

// Stores a job, its points and its log in `local`; if `local` has more points or log lines, they stay.
Result<void> keep_from_redis(JobStore& local, const RedisJob& job);
// The same for a job that another coordinator had until now: replaces everything that `local` has of it.
Result<void> keep_inherited(JobStore& local, const RedisJob& job);

// Returns those of `known` (id, revision) that Redis lacks or has in a lower revision.
Result<std::set<JobId>> jobs_behind(RedisLink& link, std::span<const std::pair<JobId, std::uint64_t>> known);

}  // namespace ls::coordinator
