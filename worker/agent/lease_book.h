// The units that this worker holds and under which lease, in the order in which they came. Plain data: no
// locks, no clock. A unit is held once: a later lease that names it takes it over.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "common/protocol/messages.h"

namespace ls::worker {

class LeaseBook {
 public:
  enum class State {
    waiting,
    running,
    handed_in,  // its result waits for the acknowledgement; rendered again only if that is a refusal
  };
  struct Held {
    UnitKey key;
    LeaseId lease;
    LeaseUnit unit;
    State state = State::waiting;
  };

  // `handed_in(key)`: a result of that unit is in the outbox.
  void add(const Lease& lease, const std::function<bool(const UnitKey&)>& handed_in);
  // The first waiting unit of a job in `ready`; it is running from then on.
  std::optional<Held> take(const std::function<bool(const JobId&)>& ready);
  // A running unit is finished: it is no longer held. Gives the lease it belongs to by now; nothing if it was
  // dropped.
  std::optional<LeaseId> finish(const UnitKey& key);
  // The unit's result was acknowledged, or refused (then it waits again).
  void acknowledged(const UnitKey& key, bool refused);

  // Forgets units that are to be stopped, also running ones.
  void drop_job(const JobId& job);
  void drop_lease(const LeaseId& lease);
  // Gives up all waiting units (of one job, if given): what must be returned.
  std::vector<LeaseReturned> return_waiting(const JobId* job = nullptr);

  std::optional<Held> first_waiting(const JobId& job) const;
  bool is_running(const UnitKey& key) const;
  bool holds(const JobId& job) const;
  std::size_t lease_count() const { return leases_.size(); }
  std::size_t running() const { return running_; }
  // Jobs with waiting units, in the order in which they will be wanted.
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
