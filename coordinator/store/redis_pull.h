// At the start of a coordinator: what Redis knows better than this machine's disk, and the reverse.
#pragma once

#include <set>
#include <span>
#include <utility>

#include "coordinator/store/job_store.h"
#include "coordinator/store/redis_link.h"

namespace ls::coordinator {

// Name of the counter in the local store that says that a job was removed.
std::string removal_mark(const JobId& job);

// Takes jobs, points, logs and counters into `local` where Redis has a higher revision, or a job that `local`
// never had. Records that cannot be read are told of and left where they are.
Result<void> pull_from_redis(RedisLink& link, JobStore& local, std::span<const StoredJob> known);

// Those of `known` (id, revision) that Redis has in a lower revision, or not at all.
Result<std::set<JobId>> jobs_behind(RedisLink& link, std::span<const std::pair<JobId, std::uint64_t>> known);

}  // namespace ls::coordinator
