// A job store whose jobs are also in Redis. Every change goes to a durable local store first (SQLite), and a
// separate thread copies it from there to Redis. So no decision of the farm waits for Redis. While Redis is
// unavailable, its data are out of date; data that Redis has lost (the writes of its last second, or those
// before a failover) are written again.
//
// The record of each job has a revision that increases with every change. At open() the revisions in the
// local store and in Redis are compared, and the higher one wins: a machine that lost its disk gets its jobs
// back from Redis, and a Redis that lost its memory gets them from the disk. Which data are stored where:
// docs/decisions/0023-redis.md.
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
  // While there are no changes to send, the store asks Redis at this interval for lightshaft:memory, to learn
  // whether Redis answers and still has its data
  Duration check_every = std::chrono::seconds(1);
  Duration share_within = std::chrono::seconds(3);  // JobStore::share() waits no longer
  // This coordinator's name among several that share the Redis (redis_members.h); empty: it shares the Redis
  // with no other.
  std::string node;
};

// Opens a store that keeps its jobs in `local` and copies them to Redis. If Redis does not answer, the store
// still opens and updates Redis later, with two exceptions (error `unavailable`): if `local` has no job,
// since the jobs in Redis would be overlooked; and if other coordinators share the Redis, since this one may
// no longer own the jobs in `local`.
Result<std::unique_ptr<JobStore>> open_redis_job_store(std::unique_ptr<JobStore> local,
                                                       RedisStoreOptions options);

}  // namespace ls::coordinator
