// Results and failures that the coordinator has not acknowledged yet, oldest first. After a reconnect all of
// them go again. Plain data: no locks.
#pragma once

#include <list>
#include <vector>

#include "common/protocol/messages.h"

namespace ls::worker {

class Outbox {
 public:
  void add(UnitResult result);
  void add(UnitFailure failure);
  // The oldest sent entry of this unit is settled. False: there was none.
  bool acknowledge(const UnitKey& unit);
  void drop_job(const JobId& job);

  // What has not gone out on this connection; they count as sent from then on.
  std::vector<FromWorker> take_unsent();
  void connection_lost();  // nothing counts as sent any more

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
  std::size_t unsent_ = 0;
};

}  // namespace ls::worker
