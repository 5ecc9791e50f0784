#include "coordinator/store/redis/redis_records.h"

#include <algorithm>
#include <cctype>
#include <charconv>

namespace ls::coordinator {
namespace {

// Writes a job's changes if they are newer than the data in Redis, in one atomic step: no other write can
// come between reading the revision and writing. ARGV: revision, id, fence, node, sequence or '', fields ...
// The fence is a number that increases with every new owner of the job. A higher fence in Redis means that a
// later owner has written the job. A lower one means that Redis has lost data or that an earlier owner wrote
// the job; then the revision in Redis does not count, and the earlier owner is told that it has lost the job.
constexpr const char* kPut = R"(
local fence = tonumber(redis.call('HGET', KEYS[1], 'fence') or '0')
local mine = tonumber(ARGV[3])
if fence > mine then return -1 end
local owner = redis.call('HGET', KEYS[1], 'owner')
if ARGV[4] ~= '' and owner and owner ~= ARGV[4] then
  if fence == mine then return -1 end
  redis.call('SREM', 'lightshaft:owned:' .. owner, ARGV[2])
  redis.call('RPUSH', 'lightshaft:lost:' .. owner, ARGV[2] .. ' ' .. ARGV[3])
end
if fence == mine and tonumber(redis.call('HGET', KEYS[1], 'revision') or '0') > tonumber(ARGV[1]) then return 0 end
redis.call('SADD', KEYS[2], ARGV[2])
redis.call('HSET', KEYS[1], unpack(ARGV, 6))
if ARGV[4] ~= '' then
  redis.call('HSET', KEYS[1], 'fence', ARGV[3], 'owner', ARGV[4])
  redis.call('SADD', 'lightshaft:owned:' .. ARGV[4], ARGV[2])
  if ARGV[5] ~= '' then redis.call('HSET', 'lightshaft:sequences', ARGV[5], ARGV[4]) end
end
return 1
)";

// Removes a job, unless another node owns it. ARGV: the job's id; this node; the job's sequence, or '' if the
// job is not a frame.
constexpr const char* kRemove = R"(
local owner = redis.call('HGET', KEYS[1], 'owner')
redis.call('SREM', 'lightshaft:owned:' .. ARGV[2], ARGV[1])
if owner and owner ~= ARGV[2] then return 0 end
redis.call('SREM', KEYS[2], ARGV[1])
if ARGV[3] ~= '' then redis.call('HDEL', 'lightshaft:sequences', ARGV[3]) end
return redis.call('DEL', KEYS[1])
)";

}  // namespace

bool is_job_id(std::string_view id) {
  constexpr std::size_t kLongest = 100;
  return !id.empty() && id.size() <= kLongest && std::all_of(id.begin(), id.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '_';
  });
}

std::vector<QuarantinedWorker> quarantined_workers(const RedisReply& fields) {
  std::vector<QuarantinedWorker> all;
  for (std::size_t i = 0; i + 1 < fields.items.size(); i += 2)
    all.push_back({{fields.items[i].text}, fields.items[i + 1].text});
  return all;
}

std::uint64_t counter_of(const std::string& text) {
  std::uint64_t value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

std::string redis_job_key(const JobId& id) { return "lightshaft:job:" + id.value; }

RedisLink::Command put_command(const RedisUpdate& update) {
  const auto frame = frame_of(update.id);
  RedisLink::Command command{"EVAL",
                             kPut,
                             "2",
                             redis_job_key(update.id),
                             kRedisJobs,
                             std::to_string(update.revision),
                             update.id.value,
                             std::to_string(update.fence),
                             update.node,
                             frame ? frame->sequence.value : ""};
  const auto add = [&](const char* name, const std::optional<std::string>& value) {
    if (!value) return;
    command.emplace_back(name);
    command.push_back(*value);
  };
  if (update.record) add("revision", std::to_string(update.revision));
  add("record", update.record);
  if (update.record && !update.node.empty()) add("state", update.state);
  add("points", update.points);
  add("log", update.log);
  return command;
}

std::vector<RedisLink::Command> remove_commands(const JobId& id, const std::string& node) {
  if (!node.empty()) {
    const auto frame = frame_of(id);
    return {{"EVAL", kRemove, "2", redis_job_key(id), kRedisJobs, id.value, node,
             frame ? frame->sequence.value : ""}};
  }
  return {{"SREM", kRedisJobs, id.value}, {"DEL", redis_job_key(id)}};
}

Result<RedisJob> parse_redis_job(const RedisReply& fields) {
  std::map<std::string, std::string> values;
  for (std::size_t i = 0; i + 1 < fields.items.size(); i += 2)
    values[fields.items[i].text] = fields.items[i + 1].text;
  auto job = parse_stored_job(values["record"]);
  if (!job) return tl::unexpected(job.error());
  RedisJob read{std::move(*job), {}, {}, values["owner"], values["from"], 0};
  // The record contains the fence (a number that increases with every new owner) of its last write; the hash
  // contains the fence of the current owner.
  std::from_chars(values["fence"].data(), values["fence"].data() + values["fence"].size(), read.fence);
  read.job.fence = std::max(read.job.fence, read.fence);
  if (!values["points"].empty()) {
    auto points = parse_points(values["points"]);
    if (!points) return tl::unexpected(points.error());
    read.points = std::move(*points);
  }
  if (!values["log"].empty()) {
    auto log = parse_log(values["log"]);
    if (!log) return tl::unexpected(log.error());
    read.log = std::move(*log);
  }
  return read;
}

}  // namespace ls::coordinator
