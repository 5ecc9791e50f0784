// What lies in Redis, as commands and back. No connection: texts in, texts out.
#pragma once

#include <map>
#include <optional>

#include "coordinator/store/job_store.h"
#include "coordinator/store/redis_link.h"

namespace ls::coordinator {

inline constexpr const char* kRedisJobs = "lightshaft:jobs";
inline constexpr const char* kRedisMemory = "lightshaft:memory";
inline constexpr const char* kRedisCounters = "lightshaft:counters";
std::string redis_job_key(const JobId& id);

// What of one job Redis is to be told; what is not given stays there as it is.
struct RedisUpdate {
  JobId id;
  std::uint64_t revision = 0;  // of the record; without one: the latest known
  std::optional<std::string> record, points, log;
};
// Changes nothing, and answers 0, where Redis has a higher revision of the job; else answers 1.
RedisLink::Command put_command(const RedisUpdate& update);
std::vector<RedisLink::Command> remove_commands(const JobId& id);

std::string points_json(const std::vector<ConvergencePoint>& points);
std::string log_json(const std::vector<LogLine>& lines);

struct RedisJob {
  StoredJob job;
  std::vector<ConvergencePoint> points;
  std::vector<LogLine> log;
};
// Of the answer to HGETALL.
Result<RedisJob> parse_redis_job(const RedisReply& fields);

}  // namespace ls::coordinator
