// The coordinators that share a Redis. Each renews a heartbeat every second, and owns whole jobs: a job's
// hash names its owner and a fence, a number that increases with every owner. A coordinator without a
// heartbeat for `lease` is dead to the others after `looks` polls; the first of them to notice takes over its
// unfinished jobs one by one, each in one atomic step of Redis that also raises the fence. From then on Redis
// rejects writes of the old owner (redis_records.h); if that wakes up, it finds the jobs on its list of lost
// jobs and drops them.
//
// All expiry times are Redis's own (PX), so the clocks of the machines need not agree.
//
// Keys: lightshaft:alive:NODE (its addresses as JSON; expires), lightshaft:nodes (hash, the same for good),
// lightshaft:barred (hash: worker -> evidence), lightshaft:owned:NODE (set of jobs), lightshaft:lost:NODE
// (list of jobs), lightshaft:heir:NODE (who takes its jobs), lightshaft:sequences (hash: sequence -> owner),
// and `owner`, `from` (the previous owner), `fence` and `state` in lightshaft:job:ID.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "coordinator/store/redis/failure_detector.h"
#include "coordinator/store/redis/redis_records.h"

namespace ls::coordinator {

struct MemberOptions {
  RedisAddress address;
  std::string node;  // this coordinator's permanent name
  RedisLink::Timeouts timeouts{std::chrono::milliseconds(500), std::chrono::seconds(1)};
  Duration beat = std::chrono::seconds(1);
  Duration lease = std::chrono::seconds(4);
  int looks = 2;
};

// A coordinator's own description
struct Member {
  std::string node;
  std::string http, grpc;  // http://HOST:PORT and HOST:PORT; empty: not known yet
  bool alive = false;
};

struct TakenJob {
  RedisJob job;
  std::uint64_t fence = 0;
  std::string from;  // the node that had it
};

struct LostJob {
  JobId id;
  std::uint64_t fence = 0;  // of the next owner: a node with a higher fence has got the job back since
  bool operator==(const LostJob&) const = default;
};

class RedisMembers {
 public:
  struct Callbacks {  // called on the members' thread; the same loss may be reported twice
    std::function<void(std::vector<TakenJob>)> taken;
    std::function<void(const std::vector<LostJob>&)> lost;
    // All workers that any coordinator has quarantined, whenever there are more. Called before `taken`.
    std::function<void(const std::vector<QuarantinedWorker>&)> quarantined = {};
    // Returns which of these jobs, which this node owns according to Redis, it does not have. If not set,
    // this is not checked.
    std::function<std::vector<JobId>(std::vector<JobId>)> unknown = {};
  };
  RedisMembers(MemberOptions options, Callbacks callbacks);

  // Sends the first heartbeat, so that from now on nobody takes this node's jobs.
  Result<void> join();
  void announce(const std::string& http, const std::string& grpc);
  // A number above `least` that no other coordinator on this Redis has.
  Result<std::uint64_t> unique_start(std::uint64_t least);
  // The owner of a job or sequence; nullopt: nobody. Waits for Redis, at most a second.
  Result<std::optional<Member>> owner_of(const JobId& id);

  // Sends a heartbeat, drops lost jobs, polls the others, and takes over the jobs of dead ones; also jobs
  // taken before whose answer from Redis was lost, or that could not be stored then.
  Result<void> beat();
  // A job that this node owns and cannot read; empty: none.
  std::string stranded() const;
  // Starts the thread that calls beat() regularly.
  void start();

  const std::string& node() const { return options_.node; }

 private:
  Result<RedisLink*> link();
  Result<std::map<std::string, bool>> send_heartbeat();
  Result<void> look_for_quarantined();
  Result<void> look_for_stranded();
  Result<void> take_from(const std::string& dead);
  Result<std::vector<JobId>> left_unfinished(const std::string& dead);
  Result<std::optional<TakenJob>> take(const JobId& id, const std::string& dead);
  bool readable(const JobId& id, const Result<RedisJob>& job, const char* what_of_it);

  MemberOptions options_;
  Callbacks callbacks_;
  mutable std::mutex mutex_;  // guards what announce() sets and stranded() returns
  std::string http_, grpc_, stranded_;
  std::unique_ptr<RedisLink> link_;  // this and the following members are used by the heartbeat thread only
  FailureDetector absence_;
  std::set<std::string> settled_;      // dead nodes that left nothing to take
  std::size_t lost_taken_ = 0;         // entries of the list of lost jobs handled so far
  std::int64_t quarantined_seen_ = 0;  // number reported so far
  bool own_unclear_ = true;            // this node may own jobs that it does not know of
  std::set<JobId> unreadable_;         // reported already
  std::uint64_t start_ = 0;
  std::string trouble_;

  std::mutex asking_;  // guards the link of owner_of()
  std::unique_ptr<RedisLink> asking_link_;
  std::jthread beater_;  // last member
};

}  // namespace ls::coordinator
