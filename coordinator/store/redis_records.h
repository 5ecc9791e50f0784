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
inline constexpr const char* kRedisBarred = "lightshaft:barred";  // hash: worker -> evidence
inline constexpr std::size_t kAskedAtOnce = 256;  // commands that are sent without waiting for an answer
std::string redis_job_key(const JobId& id);
std::uint64_t counter_of(const std::string& text);  // 0: no number
// An id becomes the name of a folder: what else stands in Redis under our keys is none.
bool is_job_id(std::string_view id);
std::vector<BarredWorker> barred_workers(const RedisReply& fields);  // of the answer to HGETALL

// What of one job Redis is to be told; what is not given stays there as it is.
struct RedisUpdate {
  JobId id;
  std::uint64_t revision = 0;  // of the record; without one: the latest known
  std::optional<std::string> record, points, log;
  // Where several coordinators share the Redis: who writes, and under which fence. Then the state goes with
  // the record.
  std::string node;
  std::uint64_t fence = 0;
  std::string state;
};
enum class PutAnswer { later_revision = 0, put = 1, lost = -1 };
// Changes nothing, and answers later_revision, where Redis has a higher one of the job; and lost, where
// another coordinator owns it by now: it has a higher fence.
RedisLink::Command put_command(const RedisUpdate& update);
// Of a node that shares the Redis: nothing is removed of a job that another one owns.
std::vector<RedisLink::Command> remove_commands(const JobId& id, const std::string& node = "");

std::string points_json(const std::vector<ConvergencePoint>& points);
std::string log_json(const std::vector<LogLine>& lines);

struct RedisJob {
  StoredJob job;
  std::vector<ConvergencePoint> points;
  std::vector<LogLine> log;
  std::string owner, from;  // the node that has it, and the one that had it before; empty: not known
  std::uint64_t fence = 0;  // of the owner
};
// Of the answer to HGETALL.
Result<RedisJob> parse_redis_job(const RedisReply& fields);

}  // namespace ls::coordinator
