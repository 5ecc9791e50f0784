// Jobs in Redis, without waiting for it: every change goes to a durable store on this machine first (SQLite),
// and from there to Redis by a thread of its own. So nothing that the farm decides waits for Redis, a Redis
// that is away costs nothing but being behind, and what it lost (its last second, a failover) is written to
// it again.
//
// Each record has a revision, one more with every change. At open() both sides are compared, and the higher
// revision wins: a machine that lost its disk gets its jobs back from Redis, a Redis that lost its memory
// gets them from the disk. Rules of what is kept where: docs/decisions/0023-redis.md.
//
// Keys: lightshaft:jobs (set of ids), lightshaft:job:ID (hash: revision, record, points, log),
// lightshaft:counters (hash), lightshaft:memory (a random word, to notice that Redis forgot).
#pragma once

#include <memory>

#include "coordinator/store/job_store.h"
#include "coordinator/store/redis_members.h"

namespace ls::coordinator {

struct RedisStoreOptions {
  RedisAddress address;
  RedisLink::Timeouts timeouts;
  Duration first_retry = std::chrono::milliseconds(100), longest_retry = std::chrono::seconds(2);
  Duration check_every =
      std::chrono::seconds(1);  // whether Redis is there and remembers, while there is no news
  // Given: other coordinators share this Redis (redis_members.h), and this one has this name among them.
  std::string node;
};

// Where Redis does not answer now: unavailable if `local` knows no job (what Redis knows would be missed), or
// others share it (what of `local` is still this coordinator's would not be known); else the store opens, and
// Redis is told when it answers.
Result<std::unique_ptr<JobStore>> open_redis_job_store(std::unique_ptr<JobStore> local,
                                                       RedisStoreOptions options);

}  // namespace ls::coordinator
