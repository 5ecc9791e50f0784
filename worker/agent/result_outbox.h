// Results and failures of units (one tile and one range of samples each) that the coordinator has not
// acknowledged, oldest first. After a reconnect all of them are sent again. The class has no locks.
#pragma once

#include <list>
#include <vector>

#include "common/protocol/messages.h"

namespace ls::worker {

class Outbox {
 public:
  void add(UnitResult result);
  void add(UnitFailure failure);
  // Removes the oldest entry of this unit that was sent. False: there is no such entry.
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
  std::size_t unsent_ = 0;
};

}  // namespace ls::worker
