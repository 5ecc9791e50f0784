#include "coordinator/rpc/fetch_table.h"

#include <algorithm>

namespace ls::coordinator::rpc {

FetchTable::Admission FetchTable::arrive(Id id, const std::string& peer, const std::string& group,
                                         TimePoint now) {
  std::size_t all = 0, of_connection = 0, of_group = 0;
  for (const auto& [other, entry] : entries_) {
    if (entry.ended) continue;
    ++all;
    of_connection += entry.peer == peer ? 1 : 0;
    of_group += entry.group == group ? 1 : 0;
  }
  if (of_connection >= limits_.of_connection) return {};
  const bool own_full = all >= limits_.crowded && of_group >= limits_.of_group;
  Admission admission{true, std::nullopt};
  if (own_full || all >= limits_.all) {
    Entry* longest = nullptr;
    for (auto& [other, entry] : entries_) {
      if (entry.ended || !entry.waits_since || (own_full && entry.group != group)) continue;
      if (longest != nullptr && longest->waits_since <= entry.waits_since) continue;
      longest = &entry;
      admission.ended = other;
    }
    if (longest == nullptr || now - *longest->waits_since < limits_.gives_way) return {};
    longest->ended = true;
  }
  entries_.emplace(id, Entry{peer, group, std::nullopt});
  return admission;
}

void FetchTable::waits(Id id, TimePoint now) {
  if (const auto found = entries_.find(id); found != entries_.end()) found->second.waits_since = now;
}

void FetchTable::taken(Id id) {
  if (const auto found = entries_.find(id); found != entries_.end()) found->second.waits_since.reset();
}

std::vector<FetchTable::Id> FetchTable::stalled(TimePoint now) const {
  std::vector<Id> ids;
  for (const auto& [id, entry] : entries_)
    if (entry.waits_since && now - *entry.waits_since >= limits_.chunk) ids.push_back(id);
  return ids;
}

void FetchTable::gone(Id id) { entries_.erase(id); }

}  // namespace ls::coordinator::rpc
