// Encodes the commands that write jobs to Redis, and decodes the replies. This code handles texts only and
// uses no connection.
#pragma once

#include <map>
#include <optional>

#include "coordinator/store/jobs/job_store.h"
#include "coordinator/store/redis/redis_link.h"

namespace ls::coordinator {

inline constexpr const char* kRedisJobs = "lightshaft:jobs";
inline constexpr const char* kRedisMemory = "lightshaft:memory";
inline constexpr const char* kRedisCounters = "lightshaft:counters";
// Hash of the quarantined workers: the key is a worker's id, the value the evidence against it
inline constexpr const char* kRedisQuarantined = "lightshaft:barred";
std::string redis_job_key(const JobId& id);
std::uint64_t counter_of(const std::string& text);  // returns 0 for a text that is not a number
// True if the text has the form of a job's id. Ids become names of folders, so other texts found in Redis
// must not be used as ids.
bool is_job_id(std::string_view id);
std::vector<QuarantinedWorker> quarantined_workers(const RedisReply& fields);  // decodes the reply to HGETALL

// Changes of one job that are to be written to Redis; fields that are not set stay in Redis as they are.
struct RedisUpdate {
  JobId id;
  std::uint64_t revision = 0;  // revision of `record`; if `record` is not set, the latest known revision
  std::optional<std::string> record, points, log;
  // Set if several coordinators share the Redis: the coordinator that writes, its fence (redis_members.h),
  // and the job's state, which is stored as a field beside the record.
  std::string node;
  std::uint64_t fence = 0;
  std::string state;
};
enum class PutAnswer { later_revision = 0, put = 1, lost = -1 };
// Makes the command that writes `update`; Redis answers with a PutAnswer. If Redis has a higher revision of
// the job, it answers later_revision and changes nothing. If the job has another owner or a higher fence in
// Redis, it answers `lost` and changes nothing.
RedisLink::Command put_command(const RedisUpdate& update);
// Makes the commands that remove a job. If coordinators share the Redis, `node` is the one that removes the
// job; then the job stays if another node owns it.
std::vector<RedisLink::Command> remove_commands(const JobId& id, const std::string& node = "");

struct RedisJob {
  StoredJob job;
  std::vector<ConvergencePoint> points;
  std::vector<LogLine> log;
  std::string owner, from;  // the node that owns the job, and the previous owner; empty: unknown
  std::uint64_t fence = 0;  // rises with every new owner (redis_members.h)
};
// Decodes the reply to HGETALL of redis_job_key().
Result<RedisJob> parse_redis_job(const RedisReply& fields);

}  // namespace ls::coordinator
