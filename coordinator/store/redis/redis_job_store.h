// Jobs in Redis, without waiting for it: every change goes to a durable local store first (SQLite), and from
// there to Redis on a separate thread. So no decision of the farm waits for Redis; while Redis is unavailable
// it only falls behind, and what it has lost (its last second, a failover) is written again.
//
// Each record has a revision that increases with every change. At open() both sides are compared, and the
// higher revision wins: a machine that lost its disk gets its jobs back from Redis, and a Redis that lost its
// memory gets them from the disk. What is stored where: docs/decisions/0023-redis.md.
//
// Keys: lightshaft:jobs (set of ids), lightshaft:job:ID (hash: revision, record, points, log),
// lightshaft:counters (hash), lightshaft:memory (a random word that shows whether Redis has lost its data).
#pragma once

#include <memory>

#include "coordinator/store/jobs/job_store.h"
#include "coordinator/store/redis/redis_members.h"

namespace ls::coordinator {

struct RedisStoreOptions {
  RedisAddress address;
  RedisLink::Timeouts timeouts;
  Duration first_retry = std::chrono::milliseconds(100), longest_retry = std::chrono::seconds(2);
  // Interval of checks, without changes, that Redis is available and has its data
  Duration check_every = std::chrono::seconds(1);
  // If set, other coordinators share this Redis (redis_members.h); the name of this one among them.
  std::string node;
};

// If Redis does not answer now: unavailable if `local` has no job (those in Redis would be missed) or others
// share Redis (this coordinator may no longer own what `local` has); otherwise the store opens, and Redis is
// updated when it answers.
Result<std::unique_ptr<JobStore>> open_redis_job_store(std::unique_ptr<JobStore> local,
                                                       RedisStoreOptions options);

}  // namespace ls::coordinator
