// The transfers of blobs to workers that are in progress, as a state machine without streams: which of them
// are taken, and which are ended because their worker does not read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/clock.h"

namespace ls::coordinator::rpc {

class FetchTable {
 public:
  using Id = std::uint64_t;

  struct Limits {
    std::size_t all = 512;
    std::size_t of_connection = 32;
    // While at least `crowded` transfers are in progress, one address may have `of_group` of them
    std::size_t crowded = 256, of_group = 128;
    // A worker must take each chunk (256 KiB) within this time
    Duration chunk = std::chrono::seconds(30);
    // A transfer that has waited for its worker for this long makes room if a new one finds no place
    Duration gives_way = std::chrono::seconds(1);
  };

  FetchTable() = default;
  explicit FetchTable(Limits limits) : limits_(limits) {}

  struct Admission {
    bool taken = false;
    std::optional<Id> ended;  // a transfer that has to be ended to make room
  };
  // Asks to add a transfer. `id` must be new; `peer` and `group` name the connection and the address, as in
  // ConnectionTable::Guest.
  Admission arrive(Id id, const std::string& peer, const std::string& group, TimePoint now);
  // From now on the transfer waits until its worker has taken a chunk; taken() ends that.
  void waits(Id id, TimePoint now);
  void taken(Id id);
  // Returns the transfers that have waited for too long.
  std::vector<Id> stalled(TimePoint now) const;
  void gone(Id id);

  std::size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    std::string peer, group;
    std::optional<TimePoint> waits_since;
    bool ended = false;
  };
  const Limits limits_{};
  std::map<Id, Entry> entries_;
};

}  // namespace ls::coordinator::rpc
