// The units that this worker holds and their leases, in order of arrival. Plain data: no locks, no clock. A
// unit is held once: a later lease that contains it takes it over.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "common/protocol/messages.h"

namespace ls::worker {

class HeldLeases {
 public:
  enum class State {
    waiting,
    running,
    handed_in,  // its result awaits acknowledgement; rendered again only if it is rejected
  };
  struct Held {
    UnitKey key;
    LeaseId lease;
    LeaseUnit unit;
    State state = State::waiting;
  };

  // `handed_in(key)`: true if the outbox has a result of that unit.
  void add(const Lease& lease, const std::function<bool(const UnitKey&)>& handed_in);
  // Takes the first waiting unit of a job in `ready` and marks it running.
  std::optional<Held> take(const std::function<bool(const JobId&)>& ready);
  // Removes a finished unit. Returns the lease that it now belongs to; nullopt if it was dropped.
  std::optional<LeaseId> finish(const UnitKey& key);
  // The unit's result was acknowledged, or rejected (then the unit waits again).
  void acknowledged(const UnitKey& key, bool refused);

  // Removes units that are to be stopped, including running ones.
  void drop_job(const JobId& job);
  void drop_lease(const LeaseId& lease);
  // Removes the units that have not been started (only those of *job, if given). Returns the messages by
  // which the agent gives their leases back to the coordinator.
  std::vector<LeaseReturned> return_waiting(const JobId* job = nullptr);

  std::optional<Held> first_waiting(const JobId& job) const;
  bool is_running(const UnitKey& key) const;
  bool holds(const JobId& job) const;
  std::size_t lease_count() const { return leases_.size(); }
  std::size_t running() const { return running_; }
  // Jobs with waiting units, in the order in which they will be rendered.
  std::vector<JobId> wanted() const;
  std::vector<WorkerProgress::Entry> progress() const;

 private:
  struct Entry {
    Held held;
    std::uint64_t order = 0;
  };
  struct LeaseState {
    std::uint32_t open = 0, done = 0;
  };
  void enqueue(Entry& entry);
  void leave(const LeaseId& lease, bool done);
  void drop_if(const std::function<bool(const Held&)>& goes);

  std::map<UnitKey, Entry> units_;
  std::map<std::uint64_t, UnitKey> queue_;  // waiting units by order
  std::map<LeaseId, LeaseState> leases_;    // those with open units
  std::uint64_t next_order_ = 0;
  std::size_t running_ = 0;
};

}  // namespace ls::worker
