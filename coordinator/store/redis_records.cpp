#include "coordinator/store/redis_records.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace ls::coordinator {
namespace {

using nlohmann::json;

// One step for Redis: between asking for the revision and writing nobody else can write.
constexpr const char* kPut = R"(
if tonumber(redis.call('HGET', KEYS[1], 'revision') or '0') > tonumber(ARGV[1]) then return 0 end
redis.call('SADD', KEYS[2], ARGV[2])
redis.call('HSET', KEYS[1], unpack(ARGV, 3))
return 1
)";

std::string dumped(const json& value) { return value.dump(-1, ' ', false, json::error_handler_t::replace); }

std::optional<TrueFigures> truth_of(const json& t) {
  if (t.is_null()) return {};
  TrueFigures truth{t.at(0), t.at(1), {}};
  if (!t.at(2).is_null()) truth.flip = t.at(2).get<double>();
  return truth;
}

json truth_value(const std::optional<TrueFigures>& truth) {
  if (!truth) return nullptr;
  return json::array({truth->rmse, truth->relmse, truth->flip ? json(*truth->flip) : json()});
}

std::vector<ConvergencePoint> parse_points(const std::string& text) {
  std::vector<ConvergencePoint> points;
  for (const json& p : json::parse(text))
    points.push_back({p.at(0), p.at(1), p.at(2), {p.at(3), p.at(4), p.at(5), p.at(6)}, truth_of(p.at(7))});
  return points;
}

std::vector<LogLine> parse_log(const std::string& text) {
  std::vector<LogLine> lines;
  for (const json& line : json::parse(text)) lines.push_back({line.at(0), line.at(1)});
  return lines;
}

}  // namespace

std::string redis_job_key(const JobId& id) { return "lightshaft:job:" + id.value; }

RedisLink::Command put_command(const RedisUpdate& update) {
  RedisLink::Command command{
      "EVAL",         kPut, "2", redis_job_key(update.id), kRedisJobs, std::to_string(update.revision),
      update.id.value};
  const auto add = [&](const char* name, const std::optional<std::string>& value) {
    if (!value) return;
    command.emplace_back(name);
    command.push_back(*value);
  };
  if (update.record) add("revision", std::to_string(update.revision));
  add("record", update.record);
  add("points", update.points);
  add("log", update.log);
  return command;
}

std::vector<RedisLink::Command> remove_commands(const JobId& id) {
  return {{"SREM", kRedisJobs, id.value}, {"DEL", redis_job_key(id)}};
}

std::string points_json(const std::vector<ConvergencePoint>& points) {
  json all = json::array();
  for (const auto& p : points)
    all.push_back({p.seconds, p.core_seconds, p.spp, p.error.rmse, p.error.relmse, p.error.relmse_lo, p.error.relmse_hi,
                   truth_value(p.truth)});
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
  RedisJob read{std::move(*job), {}, {}};
  try {
    if (!values["points"].empty()) read.points = parse_points(values["points"]);
    if (!values["log"].empty()) read.log = parse_log(values["log"]);
  } catch (const json::exception& e) {
    return fail(Errc::internal, fmt::format("the points or log of a job are damaged: {}", e.what()));
  }
  return read;
}

}  // namespace ls::coordinator
