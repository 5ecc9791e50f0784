// The units that this worker holds, each one tile and one range of samples to render, and the leases by which
// the coordinator assigned them, in order of arrival. It has no locks and no clock. A unit is held only once:
// if a later lease contains it again, it belongs to that lease from then on.
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
    // Its result waits to be acknowledged; the unit is rendered again only if the result is rejected.
    handed_in,
  };
  struct Held {
    UnitKey key;
    LeaseId lease;
    LeaseUnit unit;
    State state = State::waiting;
  };

  // Adds the units of a lease. `handed_in(key)` must say whether the outbox has a result of that unit
  // already.
  void add(const Lease& lease, const std::function<bool(const UnitKey&)>& handed_in);
  // Takes the first waiting unit of a job in `ready` and marks it running.
  std::optional<Held> take(const std::function<bool(const JobId&)>& ready);
  // Removes a unit that was running and has been rendered. Returns the lease to which it belongs now;
  // nullopt: it was dropped meanwhile.
  std::optional<LeaseId> finish(const UnitKey& key);
  // Removes a unit whose result the coordinator has acknowledged. If the coordinator rejected the result
  // (`refused`), the unit waits to be rendered again.
  void acknowledged(const UnitKey& key, bool refused);

  // Remove all units of a job or a lease, also those that are running.
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
  // The waiting units by Entry::order, the first to be rendered first.
  std::map<std::uint64_t, UnitKey> queue_;
  std::map<LeaseId, LeaseState> leases_;  // leases with units that are not finished
  std::uint64_t next_order_ = 0;
  std::size_t running_ = 0;
};

}  // namespace ls::worker
