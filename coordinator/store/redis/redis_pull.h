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

// Returns the name of a counter in the local store; the job is marked as removed if this counter is not 0.
std::string removal_mark(const JobId& job);

// Copies jobs from Redis to `local`, with their logs and the points of their convergence curves, and also the
// counters and the quarantined workers. `known` contains all jobs of `local`. It copies the jobs that `local`
// never had, and those whose revision in Redis is higher than in `known`. A record that cannot be read stays
// in Redis, and the error is logged.
Result<void> pull_from_redis(RedisLink& link, JobStore& local, std::span<const StoredJob> known);

// Like pull_from_redis(), for a Redis that several coordinators share. Copies only jobs that `node` (this
// coordinator) owns, and no counters; removes from `local` the jobs that another coordinator has taken over.
Result<void> pull_owned(RedisLink& link, JobStore& local, const std::string& node);

// Stores a job's points and log in `local`, and then its record. Points that `local` has are kept, and only
// the later ones are added. A log that `local` has is kept unless it is empty.
Result<void> keep_from_redis(JobStore& local, const RedisJob& job);
// Stores a job that another coordinator owned until now. It replaces everything that `local` has of the job.
Result<void> keep_inherited(JobStore& local, const RedisJob& job);

// Returns those jobs of `known` (pairs of id and revision) that Redis lacks or has in a lower revision.
Result<std::set<JobId>> jobs_behind(RedisLink& link, std::span<const std::pair<JobId, std::uint64_t>> known);

}  // namespace ls::coordinator
