#include "coordinator/store/redis/redis_members.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "coordinator/base/work_queue.h"
#include "coordinator/store/redis/redis_pull.h"
#include "core/base/log.h"

namespace ls::coordinator {
namespace {

// Lifetime of the key heir:NODE, which names the coordinator that is taking over the jobs of NODE
// (redis_members.h). The key is renewed with each job that this coordinator takes. But after every
// kTakenAtOnce jobs it stores these jobs locally before it takes the next one, and the key must not expire
// meanwhile.
constexpr const char* kHeirMilliseconds = "15000";
// During a takeover, after every kTakenAtOnce jobs this node stores the jobs that it has taken and sends a
// heartbeat. If it took thousands of jobs without a heartbeat, it would itself count as dead.
constexpr std::size_t kTakenAtOnce = 64;

// Sends a node's heartbeat. ARGV: node; its addresses; lifetime of the heartbeat in ms; the node's number
// from unique_start(); how many entries at the start of its list of lost jobs it has handled. These entries
// are removed. Returns {its list of lost jobs, node, alive, node, alive, ...}, where `alive` is 0 or 1.
constexpr const char* kBeat = R"(
redis.call('SET', 'lightshaft:alive:' .. ARGV[1], ARGV[2], 'PX', ARGV[3])
redis.call('HSET', 'lightshaft:nodes', ARGV[1], ARGV[2])
if tonumber(redis.call('HGET', 'lightshaft:counters', 'shared-starts') or '0') < tonumber(ARGV[4]) then
  redis.call('HSET', 'lightshaft:counters', 'shared-starts', ARGV[4])
end
redis.call('LTRIM', 'lightshaft:lost:' .. ARGV[1], ARGV[5], -1)
local answer = { redis.call('LRANGE', 'lightshaft:lost:' .. ARGV[1], 0, 9999) }
for _, node in ipairs(redis.call('HKEYS', 'lightshaft:nodes')) do
  table.insert(answer, node)
  table.insert(answer, redis.call('EXISTS', 'lightshaft:alive:' .. node))
end
return answer
)";

// Takes over a job and renews the key heir:NODE. ARGV: job; dead node; node that takes the job; the job's
// sequence or '' if it is not a frame; lifetime of the key in ms. Returns the job's fields. Returns nothing
// if the dead node is alive again or no longer owns the job. Returns -1 if the node that takes the job is no
// longer the heir: otherwise two heirs could each get some frames of one sequence.
constexpr const char* kTake = R"(
local key = 'lightshaft:job:' .. ARGV[1]
local heir = 'lightshaft:heir:' .. ARGV[2]
if redis.call('GET', heir) ~= ARGV[3] then return -1 end
redis.call('PEXPIRE', heir, ARGV[5])
if redis.call('EXISTS', 'lightshaft:alive:' .. ARGV[2]) == 1 then return {} end
if redis.call('HGET', key, 'owner') ~= ARGV[2] then
  redis.call('SREM', 'lightshaft:owned:' .. ARGV[2], ARGV[1])
  return {}
end
local fence = redis.call('HINCRBY', key, 'fence', 1)
redis.call('HSET', key, 'owner', ARGV[3], 'from', ARGV[2])
redis.call('SMOVE', 'lightshaft:owned:' .. ARGV[2], 'lightshaft:owned:' .. ARGV[3], ARGV[1])
redis.call('RPUSH', 'lightshaft:lost:' .. ARGV[2], ARGV[1] .. ' ' .. fence)
if ARGV[4] ~= '' then redis.call('HSET', 'lightshaft:sequences', ARGV[4], ARGV[3]) end
return redis.call('HGETALL', key)
)";

// Ends the takeover from a dead node. ARGV: dead node, its heir. A dead node without jobs is removed from the
// list of nodes; its list of lost jobs is kept for a week, in case it comes back and reads it. Returns 0, and
// does nothing, if another node is the heir by now.
constexpr const char* kSettle = R"(
if redis.call('GET', 'lightshaft:heir:' .. ARGV[1]) ~= ARGV[2] then return 0 end
if redis.call('SCARD', 'lightshaft:owned:' .. ARGV[1]) == 0 and redis.call('EXISTS', 'lightshaft:alive:' .. ARGV[1]) == 0 then
  redis.call('HDEL', 'lightshaft:nodes', ARGV[1])
  redis.call('EXPIRE', 'lightshaft:lost:' .. ARGV[1], 604800)
end
return redis.call('DEL', 'lightshaft:heir:' .. ARGV[1])
)";

// Returns a number above ARGV[1] that no other coordinator ever gets.
constexpr const char* kStart = R"(
local last = tonumber(redis.call('HGET', 'lightshaft:counters', 'shared-starts') or '0')
local start = string.format('%.0f', math.max(last, tonumber(ARGV[1])) + 1)
redis.call('HSET', 'lightshaft:counters', 'shared-starts', start)
return start
)";

// Jobs of one group are taken over together. A frame's group is its sequence, because all frames of a
// sequence must belong to one coordinator; any other job is its own group.
JobId group_of(const JobId& job) {
  const auto frame = frame_of(job);
  return frame ? frame->sequence : job;
}

}  // namespace

RedisMembers::RedisMembers(MemberOptions options, Callbacks callbacks)
    : options_(std::move(options)), callbacks_(std::move(callbacks)), absence_(options_.looks) {}

Result<RedisLink*> RedisMembers::link() {
  const auto renewed = RedisLink::renew(link_, options_.address, options_.timeouts);
  if (!renewed) return tl::unexpected(renewed.error());
  if (*renewed) {
    absence_.begin_again();
    // The old connection broke. It is unknown whether Redis has carried out the last commands sent over it,
    // so this node may own jobs without knowing it.
    own_unclear_ = true;
    quarantined_seen_ = 0;  // the new connection may lead to another Redis
  }
  return link_.get();
}

Result<void> RedisMembers::join() {
  auto known = send_heartbeat();
  return known ? Result<void>() : tl::unexpected(known.error());
}

void RedisMembers::announce(const std::string& http, const std::string& grpc) {
  const std::lock_guard lock(mutex_);
  http_ = http;
  grpc_ = grpc;
}

Result<std::uint64_t> RedisMembers::unique_start(std::uint64_t least) {
  auto link = this->link();
  if (!link) return tl::unexpected(link.error());
  auto number = (*link)->run({"EVAL", kStart, "0", std::to_string(least)});
  if (!number) return tl::unexpected(number.error());
  start_ = counter_of(number->text);
  return start_;
}

Result<std::map<std::string, bool>> RedisMembers::send_heartbeat() {
  auto link = this->link();
  if (!link) return tl::unexpected(link.error());
  std::string addresses;
  {
    const std::lock_guard lock(mutex_);
    addresses = nlohmann::json{{"http", http_}, {"grpc", grpc_}}.dump();
  }
  const auto lease = std::chrono::duration_cast<std::chrono::milliseconds>(options_.lease).count();
  auto answer = (*link)->run({"EVAL", kBeat, "0", options_.node, addresses, std::to_string(lease),
                              std::to_string(start_), std::to_string(std::exchange(lost_taken_, 0))});
  if (!answer) return tl::unexpected(answer.error());
  if (answer->items.empty()) return fail(Errc::internal, "Redis gave no list of coordinators");
  std::vector<LostJob> lost;
  for (const RedisReply& item : answer->items.front().items) {
    const std::size_t gap = std::min(item.text.find(' '), item.text.size());
    if (const std::string id = item.text.substr(0, gap); is_job_id(id))
      lost.push_back({{id}, counter_of(item.text.substr(std::min(gap + 1, item.text.size())))});
  }
  std::map<std::string, bool> known;
  for (std::size_t i = 1; i + 1 < answer->items.size(); i += 2)
    if (answer->items[i].text != options_.node)
      known[answer->items[i].text] = answer->items[i + 1].number == 1;
  if (!lost.empty()) callbacks_.lost(lost);
  lost_taken_ = answer->items.front().items.size();
  return known;
}

Result<void> RedisMembers::beat() {
  auto known = send_heartbeat();
  if (!known) return tl::unexpected(known.error());
  if (auto quarantined = look_for_quarantined(); !quarantined) return quarantined;
  if (auto own = look_for_stranded(); !own) return own;
  std::erase_if(settled_, [&](const std::string& node) { return known->contains(node) && known->at(node); });
  for (const std::string& dead : absence_.look(*known)) {
    if (settled_.contains(dead)) continue;
    if (auto taken = take_from(dead); !taken) return taken;
  }
  return {};
}

Result<void> RedisMembers::look_for_quarantined() {
  if (!callbacks_.quarantined) return {};
  auto count = link_->run({"HLEN", kRedisQuarantined});
  if (!count) return tl::unexpected(count.error());
  if (count->number == quarantined_seen_) return {};
  auto all = link_->run({"HGETALL", kRedisQuarantined});
  if (!all) return tl::unexpected(all.error());
  callbacks_.quarantined(quarantined_workers(*all));
  quarantined_seen_ = static_cast<std::int64_t>(all->items.size() / 2);
  return {};
}

// Finds jobs that this node owns in Redis but does not have, and takes them over. This is repeated at every
// heartbeat until the node has all of them, because no other node takes the jobs of a living node.
Result<void> RedisMembers::look_for_stranded() {
  if (!own_unclear_ || !callbacks_.unknown) return {};
  auto ids = job_ids(*link_, "lightshaft:owned:" + options_.node);
  if (!ids) return tl::unexpected(ids.error());
  const auto unknown = callbacks_.unknown(std::move(*ids));
  own_unclear_ = !unknown.empty();
  std::vector<TakenJob> taken;
  std::string stranded;
  for (const JobId& id : unknown) {
    auto fields = link_->run({"HGETALL", redis_job_key(id)});
    if (!fields) return tl::unexpected(fields.error());
    auto job = parse_redis_job(*fields);
    if (!readable(id, job, "nobody renders it: repair it, or remove the job's keys")) {
      stranded = fmt::format("the record of job {} cannot be read: nobody renders it", id.value);
      continue;
    }
    if (job->owner != options_.node) continue;
    const std::string from = job->from.empty() ? "of before" : job->from;
    taken.push_back({std::move(*job), from});
  }
  {
    const std::lock_guard lock(mutex_);
    stranded_ = std::move(stranded);
  }
  if (!taken.empty()) callbacks_.taken(std::move(taken));
  return {};
}

bool RedisMembers::readable(const JobId& id, const Result<RedisJob>& job, const char* what_of_it) {
  if (job && job->job.id == id) return true;
  const std::string text = fmt::format("its record in Redis cannot be read; {}", what_of_it);
  if (unreadable_.insert(id).second) log_error(fmt::format("job={} store=redis", id.value), text);
  return false;
}

std::string RedisMembers::stranded() const {
  const std::lock_guard lock(mutex_);
  return stranded_;
}

Result<std::vector<JobId>> RedisMembers::left_unfinished(const std::string& dead) {
  const auto ids = job_ids(*link_, "lightshaft:owned:" + dead);
  if (!ids) return tl::unexpected(ids.error());
  std::vector<RedisLink::Command> commands;
  for (const JobId& id : *ids) commands.push_back({"HGET", redis_job_key(id), "state"});
  const auto states = link_->run_all(commands);
  if (!states) return tl::unexpected(states.error());
  std::map<JobId, std::vector<JobId>> groups;
  std::set<JobId> open;
  for (std::size_t i = 0; i < ids->size(); ++i) {
    const auto& state = (*states)[i];
    if (!state) return tl::unexpected(state.error());
    const JobId& id = (*ids)[i];
    groups[group_of(id)].push_back(id);
    if (state->text != "done" && state->text != "failed" && state->text != "cancelled")
      open.insert(group_of(id));
  }
  std::vector<JobId> unfinished;
  for (const JobId& group : open) {
    auto& jobs = groups[group];
    std::sort(jobs.begin(), jobs.end());
    unfinished.insert(unfinished.end(), jobs.begin(), jobs.end());
  }
  return unfinished;
}

Result<std::optional<TakenJob>> RedisMembers::take(const JobId& id, const std::string& dead) {
  // Checks first that the job can be read. Otherwise this node would own a job that it cannot use, and no
  // other node could take it.
  auto before = link_->run({"HGETALL", redis_job_key(id)});
  if (!before) return tl::unexpected(before.error());
  if (!readable(id, parse_redis_job(*before), "it stays with the coordinator that is gone"))
    return std::nullopt;
  const auto frame = frame_of(id);
  own_unclear_ = true;
  auto fields = link_->run({"EVAL", kTake, "0", id.value, dead, options_.node,
                            frame ? frame->sequence.value : std::string(), kHeirMilliseconds});
  if (!fields) return tl::unexpected(fields.error());
  if (fields->number == -1)
    return fail(Errc::failed_precondition,
                fmt::format("another coordinator is still taking over the jobs of coordinator {}", dead));
  if (fields->items.empty()) return std::nullopt;
  auto job = parse_redis_job(*fields);
  // Redis has made this node the owner, but the job cannot be read. look_for_stranded() will try it again.
  if (!job || job->job.id != id) return std::nullopt;
  return TakenJob{std::move(*job), dead};
}

Result<void> RedisMembers::take_from(const std::string& dead) {
  const std::string heir_key = "lightshaft:heir:" + dead;
  auto first = link_->run({"SET", heir_key, options_.node, "NX", "PX", kHeirMilliseconds});
  if (!first) return tl::unexpected(first.error());
  if (first->nil) {
    const auto heir = link_->run({"GET", heir_key});
    if (!heir || heir->text != options_.node) return {};  // another node is taking over these jobs
  }
  auto unfinished = left_unfinished(dead);
  if (!unfinished) return tl::unexpected(unfinished.error());
  for (std::span<const JobId> left(*unfinished); !left.empty();) {
    const auto now = left.first(std::min(left.size(), kTakenAtOnce));
    left = left.subspan(now.size());
    if (auto taken = take_some(now, dead); !taken) return taken;
    if (left.empty()) break;
    if (auto known = send_heartbeat(); !known) return tl::unexpected(known.error());
  }
  auto done = link_->run({"EVAL", kSettle, "0", dead, options_.node});
  if (!done) return tl::unexpected(done.error());
  if (done->number != 0) settled_.insert(dead);
  return {};
}

// Takes over these jobs one by one until one fails. Passes the jobs taken before that to callbacks_.taken,
// which stores them.
Result<void> RedisMembers::take_some(std::span<const JobId> ids, const std::string& dead) {
  std::vector<TakenJob> taken;
  std::optional<Error> cut;
  for (const JobId& id : ids) {
    auto job = take(id, dead);
    if (!job) {
      cut = job.error();
      break;
    }
    if (*job) taken.push_back(std::move(**job));
  }
  if (!taken.empty()) {
    log_warn("store=redis",
             fmt::format("coordinator {} is gone: {} of its jobs are taken over", dead, taken.size()));
    callbacks_.taken(std::move(taken));
  }
  return cut ? Result<void>(tl::unexpected(*cut)) : Result<void>();
}

Result<std::optional<Member>> RedisMembers::owner_of(const JobId& id) {
  const std::lock_guard lock(asking_);
  if (auto renewed = RedisLink::renew(asking_link_, options_.address, options_.timeouts); !renewed)
    return tl::unexpected(renewed.error());
  auto owner = asking_link_->run({"HGET", redis_job_key(id), "owner"});
  if (owner && owner->nil) owner = asking_link_->run({"HGET", "lightshaft:sequences", id.value});
  if (!owner) return tl::unexpected(owner.error());
  if (owner->nil) return std::nullopt;
  auto addresses = asking_link_->run({"HGET", "lightshaft:nodes", owner->text});
  if (!addresses) return tl::unexpected(addresses.error());
  auto alive = asking_link_->run({"EXISTS", "lightshaft:alive:" + owner->text});
  if (!alive) return tl::unexpected(alive.error());
  Member member{owner->text, "", "", alive->number == 1};
  const auto json = nlohmann::json::parse(addresses->text, nullptr, false);
  if (json.is_object()) {
    member.http = json.value("http", "");
    member.grpc = json.value("grpc", "");
  }
  return member;
}

void RedisMembers::start() {
  beater_ = std::jthread([this](const std::stop_token& token) {
    const auto act = [this] {
      const auto done = beat();
      const std::string before = std::exchange(trouble_, done ? "" : done.error().message);
      if (before.empty() && !done)
        log_warn(
            "store=redis",
            trouble_ +
                "; this coordinator's jobs continue, but no other coordinator can be seen or taken over");
    };
    act();
    every(options_.beat, token, act);
  });
}

}  // namespace ls::coordinator
