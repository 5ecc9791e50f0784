#include "coordinator/store/redis/redis_records.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <nlohmann/json.hpp>

#include "coordinator/store/jobs/json_number.h"

namespace ls::coordinator {
namespace {

using nlohmann::json;

// Writes a job's changes if they are newer than the data in Redis, in one atomic step: no other write can
// come between reading the revision and writing. ARGV: revision, id, fence, node, sequence or '', fields ...
// The fence is a number that increases with every new owner of the job. A higher fence in Redis means that a
// later owner has written the job. A lower one means that Redis has lost data or that an earlier owner wrote
// the job; then the revision in Redis does not count.
constexpr const char* kPut = R"(
local fence = tonumber(redis.call('HGET', KEYS[1], 'fence') or '0')
local mine = tonumber(ARGV[3])
if fence > mine then return -1 end
if ARGV[4] ~= '' and fence == mine then
  local owner = redis.call('HGET', KEYS[1], 'owner')
  if owner and owner ~= ARGV[4] then return -1 end
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

// Removes a job, unless another node owns it. ARGV: id, node, sequence or ''.
constexpr const char* kRemove = R"(
local owner = redis.call('HGET', KEYS[1], 'owner')
redis.call('SREM', 'lightshaft:owned:' .. ARGV[2], ARGV[1])
if owner and owner ~= ARGV[2] then return 0 end
redis.call('SREM', KEYS[2], ARGV[1])
if ARGV[3] ~= '' then redis.call('HDEL', 'lightshaft:sequences', ARGV[3]) end
return redis.call('DEL', KEYS[1])
)";

std::string dumped(const json& value) { return value.dump(-1, ' ', false, json::error_handler_t::replace); }

std::optional<ReferenceError> reference_error_of(const json& t) {
  if (t.is_null()) return {};
  ReferenceError reference_error{t.at(0), t.at(1), {}};
  const auto known = [&](std::size_t i) {
    return t.at(i).is_null() ? std::nullopt : std::optional(t.at(i).get<double>());
  };
  reference_error.flip = known(2), reference_error.mse_stderr = known(3),
  reference_error.relmse_stderr = known(4);
  return reference_error;
}

json reference_error_value(const std::optional<ReferenceError>& reference_error) {
  if (!reference_error) return nullptr;
  const auto or_null = [](const std::optional<double>& v) { return v ? json(*v) : json(); };
  return json::array({reference_error->rmse, reference_error->relmse, or_null(reference_error->flip),
                      or_null(reference_error->mse_stderr), or_null(reference_error->relmse_stderr)});
}

std::vector<ConvergencePoint> parse_points(const std::string& text) {
  std::vector<ConvergencePoint> points;
  for (const json& p : json::parse(text)) {
    const ErrorFigures error{number_of(p.at(3)), number_of(p.at(4)), number_of(p.at(5)),
                             number_of(p.at(6)), number_of(p.at(8)), number_of(p.at(9))};
    points.push_back(
        {number_of(p.at(0)), number_of(p.at(1)), number_of(p.at(2)), error, reference_error_of(p.at(7))});
  }
  return points;
}

std::vector<LogLine> parse_log(const std::string& text) {
  std::vector<LogLine> lines;
  for (const json& line : json::parse(text)) lines.push_back({line.at(0), line.at(1)});
  return lines;
}

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

std::string points_json(const std::vector<ConvergencePoint>& points) {
  json all = json::array();
  for (const auto& p : points)
    all.push_back({finite(p.seconds), finite(p.core_seconds), finite(p.spp), finite(p.error.rmse),
                   finite(p.error.relmse), finite(p.error.relmse_lo), finite(p.error.relmse_hi),
                   reference_error_value(p.reference_error), finite(p.error.rmse_lo),
                   finite(p.error.rmse_hi)});
  return dumped(all);
}

std::string log_json(const std::vector<LogLine>& lines) {
  json all = json::array();
  for (const auto& line : lines) all.push_back({line.unix_time, line.text});
  return dumped(all);
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
  try {
    if (!values["points"].empty()) read.points = parse_points(values["points"]);
    if (!values["log"].empty()) read.log = parse_log(values["log"]);
  } catch (const json::exception& e) {
    return fail(Errc::internal, fmt::format("the points or log of a job are damaged: {}", e.what()));
  }
  return read;
}

}  // namespace ls::coordinator
