// The work that a worker holds: the units of its leases, and the results on their way to the coordinator. The
// classes have no locks and no clock.
#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <optional>
#include <vector>

#include "util/protocol/messages.h"

namespace ls::worker {

// The leases by which the coordinator has assigned work to this worker, in order of arrival, and their units.
// A unit is held only once: if a later lease contains it again, it belongs to that lease from then on.
class HeldLeases {
 public:
  enum class State {
    waiting,
    running,
    // The unit's result is in the outbox, not acknowledged yet. The unit is rendered again only if the
    // coordinator rejects the result.
    handed_in,
  };
  struct Held {
    UnitKey key;
    LeaseId lease;
    LeaseUnit unit;
    State state = State::waiting;
    // The trace span of the unit's present lease; nullopt: the lease is not traced
    std::optional<trace::SpanContext> trace = std::nullopt;
    std::int64_t since_unix_ns = 0;  // when the unit arrived, in ns since 1970; 0: not recorded
  };

  // Adds the units of a lease. `handed_in(key)` returns whether the outbox already has a result of that unit.
  // `trace` is the lease's trace span; nullopt: the lease is not traced. `unix_ns` is the current time in
  // nanoseconds since 1970; 0: not recorded.
  void add(const Lease& lease, const std::function<bool(const UnitKey&)>& handed_in,
           const std::optional<trace::SpanContext>& trace = std::nullopt, std::int64_t unix_ns = 0);
  // Returns the first waiting unit for whose job `ready` returns true, and marks the unit as running;
  // nullopt: there is none. If `before` is given, only units that wait before the first one of that job
  // count.
  std::optional<Held> take(const std::function<bool(const JobId&)>& ready, const JobId* before = nullptr);
  // Removes a unit that was running and has been rendered. Returns its present lease; nullopt: the unit was
  // dropped meanwhile.
  std::optional<LeaseId> finish(const UnitKey& key);
  // Call when the coordinator has acknowledged the result of this unit. Removes the unit if the result was
  // accepted. If it was rejected (`refused`), the unit waits to be rendered again.
  void acknowledged(const UnitKey& key, bool refused);

  // Remove all units of a job or a lease, including running ones.
  void drop_job(const JobId& job);
  void drop_lease(const LeaseId& lease);
  // Remove the waiting units (without argument: all; else those of this job or lease). Return the messages
  // that give these units back to the coordinator, for this reason, one message per lease.
  std::vector<LeaseReturned> return_waiting();
  std::vector<LeaseReturned> return_waiting(const JobId& job, const std::string& reason);
  std::vector<LeaseReturned> return_waiting(const LeaseId& lease);

  std::optional<Held> first_waiting(const JobId& job) const;
  const Held* find(const UnitKey& key) const;  // null: the unit is not held
  bool is_running(const UnitKey& key) const;
  bool holds(const JobId& job) const;
  // True if a unit of `job` is running, or waits before the first waiting unit of `other`.
  bool needs_before(const JobId& job, const JobId& other) const;
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
  std::vector<LeaseReturned> return_if(const std::string& reason,
                                       const std::function<bool(const Held&)>& goes);

  std::map<UnitKey, Entry> units_;
  // The waiting units by Entry::order, that is, in the order in which they will be rendered.
  std::map<std::uint64_t, UnitKey> queue_;
  // How many units of each lease are unfinished, and how many are finished. Leases without unfinished units
  // are not in the map.
  std::map<LeaseId, LeaseState> leases_;
  std::uint64_t next_order_ = 0;
  std::size_t running_ = 0;
};

// Results and failures of units that the coordinator has not acknowledged, oldest first. After a reconnect
// all of them are sent again.
class Outbox {
 public:
  void add(UnitResult result);
  void add(UnitFailure failure);
  // Removes the oldest entry of this unit among those that were sent. Returns false if there is none.
  bool acknowledge(const UnitKey& unit);
  void drop_job(const JobId& job);

  // Returns the entries not yet sent on this connection and marks them as sent.
  std::vector<FromWorker> take_unsent();
  void connection_lost();  // marks all entries as not sent

  bool has_result(const UnitKey& unit) const;
  std::size_t bytes() const { return bytes_; }
  std::size_t size() const { return entries_.size(); }
  bool empty() const { return entries_.empty(); }

 private:
  struct Entry {
    UnitKey unit;
    FromWorker message;
    std::size_t bytes = 0;
    bool sent = false;
  };
  std::list<Entry> entries_;
  std::size_t bytes_ = 0;
};

}  // namespace ls::worker
