#include "coordinator/store/redis/redis_job_store.h"

#include <fmt/format.h>

#include "common/base/log.h"
#include "coordinator/store/redis/redis_job_store_impl.h"
#include "coordinator/store/redis/redis_pull.h"

namespace ls::coordinator {
namespace {

// Returns an error if other coordinators share this Redis. Without --shared this coordinator would take over
// all of their jobs.
Result<void> refuse_shared(RedisLink& link) {
  auto nodes = link.run({"HKEYS", "lightshaft:nodes"});
  if (!nodes) return tl::unexpected(nodes.error());
  for (const RedisReply& node : nodes->items) {
    auto alive = link.run({"EXISTS", "lightshaft:alive:" + node.text});
    if (!alive) return tl::unexpected(alive.error());
    if (alive->number == 1)
      return fail(
          Errc::failed_precondition,
          fmt::format(
              "coordinator {} shares this Redis: start with --shared, too, or use another database of it",
              node.text));
  }
  return {};
}

// Opens the store of a coordinator that shares its Redis. It first sends a heartbeat, so that from then on no
// other coordinator takes over its jobs, and then finds out which jobs it still owns.
Result<std::unique_ptr<JobStore>> open_shared(std::unique_ptr<JobStore> local, RedisStoreOptions options) {
  const auto box = std::make_shared<RedisJobStore*>(nullptr);  // filled in before the members' thread starts
  auto members = std::make_unique<RedisMembers>(
      MemberOptions{.address = options.address, .node = options.node},
      RedisMembers::Callbacks{
          [box](std::vector<TakenJob> taken) { (*box)->take_over(std::move(taken)); },
          [box](const std::vector<LostJob>& lost) {
            if (*box) (*box)->lose(lost);
          },
          [box](const std::vector<QuarantinedWorker>& workers) { (*box)->apply(workers); },
          [box](std::vector<JobId> ids) { return (*box)->unknown(std::move(ids)); }});
  if (auto joined = members->join(); !joined)
    return fail(joined.error().code,
                joined.error().message +
                    "; start Redis first: which jobs are still this coordinator's is known there");
  auto link = RedisLink::connect(options.address, options.timeouts);
  if (!link) return tl::unexpected(link.error());
  if (auto pulled = pull_owned(**link, *local, options.node); !pulled) return tl::unexpected(pulled.error());
  const auto starts = local->reserve("starts", 0);
  if (!starts) return tl::unexpected(starts.error());
  const auto unique = members->unique_start(*starts);
  if (!unique) return tl::unexpected(unique.error());
  if (auto set = local->reserve("starts", *unique - *starts); !set) return tl::unexpected(set.error());
  auto jobs = local->jobs();
  if (!jobs) return tl::unexpected(jobs.error());
  auto made = std::make_unique<RedisJobStore>(std::move(local), std::move(options), std::move(*jobs),
                                              std::move(*link), std::move(members));
  *box = made.get();
  made->start_members();
  return made;
}

}  // namespace

Result<std::unique_ptr<JobStore>> open_redis_job_store(std::unique_ptr<JobStore> local,
                                                       RedisStoreOptions options) {
  if (!options.node.empty()) return open_shared(std::move(local), std::move(options));
  auto jobs = local->jobs();
  if (!jobs) return tl::unexpected(jobs.error());
  auto link = RedisLink::connect(options.address, options.timeouts);
  if (!link && (jobs->empty() || link.error().code != Errc::unavailable))
    return fail(link.error().code,
                link.error().message + "; start Redis first: this machine's disk knows no job");
  if (!link) {
    log_warn("store=redis", link.error().message + "; starting from this machine's disk");
  } else {
    if (auto alone = refuse_shared(**link); !alone) return tl::unexpected(alone.error());
    if (auto pulled = pull_from_redis(**link, *local, *jobs); !pulled) return tl::unexpected(pulled.error());
    jobs = local->jobs();
    if (!jobs) return tl::unexpected(jobs.error());
  }
  return std::make_unique<RedisJobStore>(std::move(local), std::move(options), std::move(*jobs),
                                         link ? std::move(*link) : nullptr, nullptr);
}

}  // namespace ls::coordinator
