#include "coordinator/rpc/connection_table.h"

#include <algorithm>
#include <utility>

namespace ls::coordinator::rpc {
namespace {

// At most this many addresses are remembered. Beyond it, the one that is shut out for the shortest time is
// forgotten.
constexpr std::size_t kGroupsKept = 4096;

}  // namespace

const char* to_string(Closed why) {
  switch (why) {
    case Closed::full:
      return "too many connections are open";
    case Closed::many_unmet:
      return "too many connections wait to say hello";
    case Closed::made_room:
      return "no hello, when another one needed the place";
    case Closed::silent:
      return "no hello in time";
    case Closed::many_bytes:
      return "too many bytes before a hello";
    case Closed::many_calls:
      return "too many calls before a hello";
    case Closed::shut_out:
      return "their address sent too much before a hello";
    case Closed::files:
      return "this process may open no more files";
  }
  return "";
}

ConnectionTable::Limits ConnectionTable::limits_for(std::size_t connections) {
  Limits limits;
  limits.connections = std::min(limits.connections, connections);
  limits.unmet = std::clamp<std::size_t>(limits.connections / 4, 1, limits.unmet);
  limits.unmet_of_group = std::clamp<std::size_t>(limits.unmet / 2, 1, limits.unmet_of_group);
  return limits;
}

ConnectionTable::Admission ConnectionTable::arrive(Id id, const Guest& guest, TimePoint now) {
  // The system gives a port to a new connection only if the old one is gone, even if gone() comes later
  if (const auto old = by_peer_.find(guest.peer); old != by_peer_.end()) gone(old->second);
  const auto refuse = [&](Closed why) {
    count(why);
    return Admission{why, std::nullopt};
  };
  const auto group = groups_.find(guest.group);
  const std::size_t of_group = group == groups_.end() ? 0 : group->second.unmet;
  if (group != groups_.end() && group->second.shut_out_until && now < *group->second.shut_out_until)
    return refuse(Closed::shut_out);
  if (entries_.size() >= limits_.connections) return refuse(Closed::full);
  Admission admission;
  if (of_group >= limits_.unmet_of_group || unmet_.size() >= limits_.unmet) {
    admission.closed = make_room(guest, now);
    if (!admission.closed) return refuse(Closed::many_unmet);
    doom(entries_.at(*admission.closed), Closed::made_room);
  }
  Entry& entry = entries_[id];
  entry.id = id;
  entry.guest = guest;
  by_peer_[guest.peer] = id;
  begin_unmet(entry, now);
  return admission;
}

// Returns the connection that makes room for a new one of this guest. If its address has all of its places
// taken, or no fewer than any other address, that is the one that has waited longest, if it has waited so
// long that it is hardly a worker: of many workers that join at once those that came first must not be
// closed, or none would ever get in. Otherwise it is the newest one of the address that has the most.
std::optional<ConnectionTable::Id> ConnectionTable::make_room(const Guest& guest, TimePoint now) const {
  const auto own = groups_.find(guest.group);
  const std::size_t has = own == groups_.end() ? 0 : own->second.unmet;
  const bool own_full = has >= limits_.unmet_of_group;
  const auto most =
      std::ranges::max_element(groups_, {}, [](const auto& group) { return group.second.unmet; });
  if (!own_full && most != groups_.end() && most->second.unmet > has + 1) return newest_of(most->first);
  const Entry* oldest = nullptr;
  for (const Id id : unmet_) {
    const Entry& entry = entries_.at(id);
    if (own_full && entry.guest.group != guest.group) continue;
    if (oldest == nullptr || entry.unmet_since < oldest->unmet_since) oldest = &entry;
  }
  if (oldest == nullptr || now - oldest->unmet_since < limits_.gives_way) return std::nullopt;
  return oldest->id;
}

std::optional<ConnectionTable::Id> ConnectionTable::newest_of(const std::string& group) const {
  const auto newest = std::find_if(unmet_.rbegin(), unmet_.rend(),
                                   [&](Id id) { return entries_.at(id).guest.group == group; });
  return newest == unmet_.rend() ? std::nullopt : std::optional(*newest);
}

ConnectionTable::Entry* ConnectionTable::find(const std::string& peer) {
  const auto id = by_peer_.find(peer);
  return id == by_peer_.end() ? nullptr : &entries_.at(id->second);
}

void ConnectionTable::begin_unmet(Entry& entry, TimePoint now) {
  if (entry.doomed) return;
  entry.unmet_since = now;
  unmet_.insert(entry.id);
  ++groups_[entry.guest.group].unmet;
}

void ConnectionTable::end_unmet(Entry& entry) {
  if (unmet_.erase(entry.id) == 0) return;
  const auto group = groups_.find(entry.guest.group);
  --group->second.unmet;
  if (std::exchange(entry.long_hello, false)) {
    --long_hellos_;
    --group->second.long_hellos;
  }
  if (group->second.unmet == 0 && !group->second.shut_out_until) groups_.erase(group);
}

void ConnectionTable::doom(Entry& entry, Closed why) {
  count(why);
  end_unmet(entry);
  entry.doomed = true;
}

void ConnectionTable::gone(Id id) {
  const auto found = entries_.find(id);
  if (found == entries_.end()) return;
  end_unmet(found->second);
  if (const auto peer = by_peer_.find(found->second.guest.peer); peer != by_peer_.end() && peer->second == id)
    by_peer_.erase(peer);
  entries_.erase(found);
}

ConnectionTable::CallBegan ConnectionTable::call_began(const std::string& peer, TimePoint now) {
  Entry* entry = find(peer);
  if (entry == nullptr || entry->doomed) return {};
  if (entry->unmet_calls < limits_.unmet_calls) {
    ++entry->unmet_calls;
    return {entry->guest, std::nullopt};
  }
  // A worker that is met may begin more calls at once than are checked yet; a stranger has no reason to.
  if (entry->met_calls > 0) return {};
  shut_out(*entry, now);
  doom(*entry, Closed::many_calls);
  return {std::nullopt, entry->id};
}

std::optional<ConnectionTable::Id> ConnectionTable::call_met(const std::string& peer) {
  Entry* entry = find(peer);
  if (entry == nullptr || entry->unmet_calls == 0) return std::nullopt;
  --entry->unmet_calls;
  ++entry->met_calls;
  end_unmet(*entry);
  return std::exchange(entry->ever_met, true) ? std::nullopt : std::optional(entry->id);
}

void ConnectionTable::call_ended(const std::string& peer, bool met, TimePoint now) {
  Entry* entry = find(peer);
  if (entry == nullptr) return;
  std::size_t& calls = met ? entry->met_calls : entry->unmet_calls;
  if (calls == 0) return;  // the call was of an earlier connection with this peer
  --calls;
  if (met && calls == 0) begin_unmet(*entry, now);
}

bool ConnectionTable::received(Id id, std::uint64_t bytes, TimePoint now) {
  if (!unmet_.contains(id) || bytes <= limits_.bytes) return false;
  Entry& entry = entries_.at(id);
  if (entry.ever_met) return false;  // most of its bytes came while it was met
  if (bytes <= limits_.long_bytes && entry.unmet_calls > 0) {
    if (entry.long_hello) return false;
    Group& group = groups_[entry.guest.group];
    if (long_hellos_ < limits_.long_hellos && group.long_hellos < limits_.long_hellos_of_group) {
      entry.long_hello = true;
      ++long_hellos_;
      ++group.long_hellos;
      return false;
    }
  } else {
    shut_out(entry, now);
  }
  doom(entry, Closed::many_bytes);
  return true;
}

void ConnectionTable::shut_out(const Entry& entry, TimePoint now) {
  if (groups_.size() >= kGroupsKept) {
    auto first = groups_.end();
    for (auto it = groups_.begin(); it != groups_.end(); ++it)
      if (it->second.unmet == 0 &&
          (first == groups_.end() || it->second.shut_out_until < first->second.shut_out_until))
        first = it;
    if (first != groups_.end()) groups_.erase(first);
  }
  groups_[entry.guest.group].shut_out_until = now + limits_.shut_out;
}

std::vector<ConnectionTable::Id> ConnectionTable::overdue(TimePoint now) {
  std::vector<Id> late;
  for (const Id id : unmet_)
    if (now - entries_.at(id).unmet_since >= limits_.hello) late.push_back(id);
  for (const Id id : late) {
    Entry& entry = entries_.at(id);
    if (entry.long_hello) shut_out(entry, now);
    doom(entry, Closed::silent);
  }
  std::erase_if(groups_, [&](const auto& group) {
    return group.second.unmet == 0 && (!group.second.shut_out_until || now >= *group.second.shut_out_until);
  });
  return late;
}

}  // namespace ls::coordinator::rpc
