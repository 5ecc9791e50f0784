// The coordinators that share a Redis. Each says every second that it lives, and owns whole jobs: a job's
// hash names its owner and a fence, a number that is one more with every owner. Who does not say so for
// `lease` is taken for dead by the others after `looks` looks; the first of them to come takes its unfinished
// jobs over, job by job, each in one step of Redis that also raises the fence. From then on Redis refuses
// what the old owner writes (redis_records.h), and the old owner, should it wake, finds the jobs on a list of
// what it lost and drops them.
//
// All times of life and death are Redis's own (PX), so that clocks of machines need not agree.
//
// Keys: lightshaft:alive:NODE (its addresses as JSON; expires), lightshaft:nodes (hash, the same for good),
// lightshaft:barred (hash: worker -> evidence), lightshaft:owned:NODE (set of jobs), lightshaft:lost:NODE
// (list of jobs), lightshaft:heir:NODE (who takes its jobs), lightshaft:sequences (hash: sequence -> owner),
// and `owner`, `from` (who had it before), `fence` and `state` in lightshaft:job:ID.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "coordinator/store/absence_book.h"
#include "coordinator/store/redis_records.h"

namespace ls::coordinator {

struct MemberOptions {
  RedisAddress address;
  std::string node;  // this one's name, for good
  RedisLink::Timeouts timeouts{std::chrono::milliseconds(500), std::chrono::seconds(1)};
  Duration beat = std::chrono::seconds(1);
  Duration lease = std::chrono::seconds(4);
  int looks = 2;
};

// What a coordinator tells of itself.
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
  std::uint64_t fence = 0;  // of its next owner: one who has a higher one since has not lost it
  bool operator==(const LostJob&) const = default;
};

class RedisMembers {
 public:
  struct Told {  // on the members' own thread; the same loss may be told twice
    std::function<void(std::vector<TakenJob>)> taken;
    std::function<void(const std::vector<LostJob>&)> lost;
    // Workers that one of the coordinators has found to lie: all of them, whenever there are more. Before
    // what is taken.
    std::function<void(const std::vector<BarredWorker>&)> barred = {};
    // Of jobs that Redis says are this node's, those that it does not have. Without it nobody looks.
    std::function<std::vector<JobId>(std::vector<JobId>)> unknown = {};
  };
  RedisMembers(MemberOptions options, Told told);

  // Says the first time that it lives, so that nobody takes its jobs from now on.
  Result<void> join();
  void announce(const std::string& http, const std::string& grpc);
  // A number that no other coordinator on this Redis has, above `least`.
  Result<std::uint64_t> unique_start(std::uint64_t least);
  // Who has a job, or a sequence; nothing: nobody. Waits for Redis, a second at most.
  Result<std::optional<Member>> owner_of(const JobId& id);

  // Says that it lives, drops what was lost, looks at the others, and takes over what the dead left; also
  // what it took before without learning of it, since Redis's answer was lost, and what it could not keep
  // then.
  Result<void> beat();
  // A job that is this node's and cannot be read; empty: there is none.
  std::string stranded() const;
  // Beats by itself from now on.
  void start();

  const std::string& node() const { return options_.node; }

 private:
  Result<RedisLink*> link();
  Result<std::map<std::string, bool>> say_alive();
  Result<void> look_for_barred();
  Result<void> look_for_stranded();
  Result<void> take_from(const std::string& dead);
  Result<std::vector<JobId>> left_unfinished(const std::string& dead);
  Result<std::optional<TakenJob>> take(const JobId& id, const std::string& dead);
  bool readable(const JobId& id, const Result<RedisJob>& job, const char* what_of_it);

  MemberOptions options_;
  Told told_;
  mutable std::mutex mutex_;  // around what announce() sets, and what stranded() tells
  std::string http_, grpc_, stranded_;
  std::unique_ptr<RedisLink> link_;  // this and the next ones are the beating thread's
  AbsenceBook absence_;
  std::set<std::string> settled_;  // dead ones that left nothing to take
  std::size_t lost_taken_ = 0;     // of the list of lost jobs, dealt with
  std::int64_t barred_seen_ = 0;   // told of so many
  bool own_unclear_ = true;        // something may be this node's that it does not know of
  std::set<JobId> unreadable_;     // told of
  std::uint64_t start_ = 0;
  std::string trouble_;

  std::mutex asking_;  // around the link that owner_of() asks by
  std::unique_ptr<RedisLink> asking_link_;
  std::jthread beater_;  // last
};

}  // namespace ls::coordinator
