// The coordinators that share a Redis, also called nodes. Each node renews a heartbeat in Redis every second.
// Each job belongs to one node: the job's hash in Redis names this owner and a fence, a number that increases
// with every new owner. A heartbeat expires after MemberOptions::lease; a node counts as dead if
// MemberOptions::looks consecutive polls find no heartbeat of it. The first node to notice takes over the
// dead node's unfinished jobs (sequences with all their frames) one by one, each in one atomic step of Redis
// that also raises the fence. From then on Redis rejects writes of the old owner (redis_records.h). If the
// old owner was only suspended, it finds the jobs on its list of lost jobs and drops them.
//
// All expiry times are Redis's own (PX), so the clocks of the machines need not agree.
//
// Keys: lightshaft:alive:NODE (its addresses as JSON; expires), lightshaft:nodes (hash: node -> its
// addresses; does not expire), lightshaft:barred (hash: quarantined worker -> evidence),
// lightshaft:owned:NODE (set of the node's jobs), lightshaft:lost:NODE (list of jobs that others took from
// it), lightshaft:heir:NODE (the node that is taking over its jobs), lightshaft:sequences (hash: sequence,
// i.e. a job with several frames -> owner), and `owner`, `from` (the previous owner), `fence` and `state` in
// lightshaft:job:ID.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "coordinator/store/redis/redis_records.h"

namespace ls::coordinator {

// Decides which coordinators count as dead: those without a heartbeat in `looks` consecutive polls. It counts
// polls, not seconds. After a pause of this process or of Redis, the caller must call begin_again();
// otherwise the pause counts against the other coordinators.
class FailureDetector {
 public:
  explicit FailureDetector(int looks) : looks_(looks) {}

  // Adds the result of one poll. `known` contains all other coordinators; a value is true if the coordinator
  // has a heartbeat. Returns the coordinators that count as dead.
  std::vector<std::string> look(const std::map<std::string, bool>& known) {
    std::map<std::string, int> now;
    std::vector<std::string> gone;
    for (const auto& [name, alive] : known) {
      if (alive) continue;
      const auto before = absent_.find(name);
      const int times = (before == absent_.end() ? 0 : before->second) + 1;
      now.emplace(name, times);
      if (times >= looks_) gone.push_back(name);
    }
    absent_ = std::move(now);
    return gone;
  }
  // Forgets all earlier polls.
  void begin_again() { absent_.clear(); }

 private:
  int looks_;
  std::map<std::string, int> absent_;  // by coordinator: how many polls in a row found no heartbeat
};

struct MemberOptions {
  RedisAddress address;
  std::string node;  // this coordinator's permanent name
  RedisLink::Timeouts timeouts{std::chrono::milliseconds(500), std::chrono::seconds(1)};
  Duration beat = std::chrono::seconds(1);   // interval of the heartbeats and of the polls
  Duration lease = std::chrono::seconds(4);  // how long a heartbeat is valid
  int looks = 2;  // number of polls without a heartbeat after which a node counts as dead
};

// How a coordinator describes itself to the others
struct Member {
  std::string node;
  std::string http, grpc;  // http://HOST:PORT and HOST:PORT; empty: not known yet
  bool alive = false;
};

struct TakenJob {
  RedisJob job;
  std::string from;  // the node that owned the job before
};

struct LostJob {
  JobId id;
  // The fence (a number that increases with every new owner) that the job got when this node lost it. If this
  // node's record of the job has a higher fence, this node has become the owner again since.
  std::uint64_t fence = 0;
  bool operator==(const LostJob&) const = default;
};

class RedisMembers {
 public:
  // Functions that are called on the heartbeat thread (and on the thread that calls join())
  struct Callbacks {
    std::function<void(std::vector<TakenJob>)> taken;  // called with jobs that this node has taken over
    // Called with jobs that this node has lost; may be called twice with the same job.
    std::function<void(const std::vector<LostJob>&)> lost;
    // Called with all workers that any coordinator has quarantined, whenever their number has grown, and
    // before `taken` is called.
    std::function<void(const std::vector<QuarantinedWorker>&)> quarantined = {};
    // Gets the jobs that this node owns according to Redis, and must return those that this node does not
    // have. If it is not set, this check is skipped.
    std::function<std::vector<JobId>(std::vector<JobId>)> unknown = {};
  };
  RedisMembers(MemberOptions options, Callbacks callbacks);

  // Sends the first heartbeat, so that from now on no other node takes this node's jobs.
  Result<void> join();
  void announce(const std::string& http, const std::string& grpc);
  // Returns a number above `least` that no other coordinator on this Redis ever gets.
  Result<std::uint64_t> unique_start(std::uint64_t least);
  // Returns the coordinator that owns a job or sequence; nullopt: it has no owner. Waits for Redis, but at
  // most a second.
  Result<std::optional<Member>> owner_of(const JobId& id);

  // Sends a heartbeat, reports lost jobs, polls the other coordinators, and takes over the jobs of dead ones.
  // Also completes earlier takeovers that failed because the answer of Redis was lost or a job could not be
  // stored.
  Result<void> beat();
  // Returns a message about a job that this node owns in Redis but cannot read there; empty: there is no
  // such job.
  std::string stranded() const;
  // Starts the thread that calls beat() regularly.
  void start();

 private:
  Result<RedisLink*> link();
  Result<std::map<std::string, bool>> send_heartbeat();
  Result<void> look_for_quarantined();
  Result<void> look_for_stranded();
  Result<void> take_from(const std::string& dead);
  Result<void> take_some(std::span<const JobId> ids, const std::string& dead);
  Result<std::vector<JobId>> left_unfinished(const std::string& dead);
  Result<std::optional<TakenJob>> take(const JobId& id, const std::string& dead);
  bool readable(const JobId& id, const Result<RedisJob>& job, const char* what_of_it);

  MemberOptions options_;
  Callbacks callbacks_;
  mutable std::mutex mutex_;  // guards http_, grpc_ and stranded_
  std::string http_, grpc_, stranded_;
  // From here to trouble_: used only by the heartbeat thread, and before its start by join() and
  // unique_start()
  std::unique_ptr<RedisLink> link_;
  FailureDetector absence_;
  std::set<std::string> settled_;  // dead nodes that have no jobs left to take over
  // Length of the list of lost jobs that the last heartbeat returned; the next one removes these jobs from it
  std::size_t lost_taken_ = 0;
  std::int64_t quarantined_seen_ = 0;  // number of workers last passed to Callbacks::quarantined
  bool own_unclear_ = true;            // true if this node may own jobs in Redis that it does not have
  std::set<JobId> unreadable_;         // jobs that cannot be read and for which this was logged already
  std::uint64_t start_ = 0;
  std::string trouble_;

  std::mutex asking_;  // guards asking_link_, the connection that owner_of() uses
  std::unique_ptr<RedisLink> asking_link_;
  std::jthread beater_;  // declared last: this thread ends before the variables above are destroyed
};

}  // namespace ls::coordinator
