// The connections of the workers' port, as a state machine without sockets: which of them are admitted, and
// which are closed. A connection is met while a call on it has shown the farm's join token; until then, and
// again after its last such call has ended, it is unmet. The limits concern unmet connections, which anybody
// can open: a farm of thousands of workers behind one address joins as fast as its workers say hello.
//
// An address is counted as the text that the caller gives for it: see Guest::group.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/base/clock.h"

namespace ls::coordinator::rpc {

// Why a connection was refused or closed
enum class Closed {
  full,        // too many connections
  many_unmet,  // too many unmet connections, of this address or of all
  made_room,   // unmet, when another connection needed its place
  silent,      // no hello in time
  many_bytes,  // too many bytes before a hello
  many_calls,  // too many calls before a hello
  shut_out,    // its address sent too much before a hello a short time ago
  files        // this process may open no more files
};
inline constexpr int kClosedReasons = 8;
const char* to_string(Closed why);

class ConnectionTable {
 public:
  using Id = std::uint64_t;

  struct Limits {
    std::size_t connections = 17'408;  // met and unmet
    std::size_t unmet = 512;
    std::size_t unmet_of_group = 128;
    std::size_t unmet_calls = 16;  // calls on one connection that have shown no token yet
    Duration hello = std::chrono::seconds(5);
    // An unmet connection of this age makes room if a new one finds no place: a worker says hello sooner
    Duration gives_way = std::chrono::seconds(2);
    // Bytes that an unmet connection may send, TLS handshake included. A hello that lists many files in the
    // worker's cache is longer than `bytes`: a few connections at a time, on which a call has begun, may send
    // up to `long_bytes`.
    std::uint64_t bytes = 64 << 10;
    std::uint64_t long_bytes = 320 << 10;
    std::size_t long_hellos = 8, long_hellos_of_group = 2;
    // Addresses that exceed `unmet_calls` or their bytes, or do not end a long hello in time, get no new
    // connection for this time
    Duration shut_out = std::chrono::seconds(30);
  };

  struct Guest {
    std::string peer;   // names the connection: address and port of the other end
    std::string group;  // an IPv4 address, or the first 64 bits of an IPv6 address, which one person has
  };

  // The limits of a port that takes `connections` in all: strangers have at most a quarter of them.
  static Limits limits_for(std::size_t connections);

  explicit ConnectionTable(Limits limits) : limits_(limits) {}

  struct Admission {
    std::optional<Closed> refused;
    std::optional<Id> closed;  // a connection that has to be closed to make room
  };
  // Asks to add a connection. `id` must be new.
  Admission arrive(Id id, const Guest& guest, TimePoint now);
  // Counts a connection that was closed at once, without asking.
  void refused(Closed why) { count(why); }
  // The connection is gone, whoever closed it.
  void gone(Id id);

  struct CallBegan {
    std::optional<Guest> guest;  // whose call it is; none: the call has to be refused
    std::optional<Id> closed;    // a connection that has to be closed
  };
  // A call has begun on the connection with this peer.
  CallBegan call_began(const std::string& peer, TimePoint now);
  // The call has shown the join token. Returns its connection if that was never met before.
  std::optional<Id> call_met(const std::string& peer);
  // The call has ended; `met`: call_met() was called for it.
  void call_ended(const std::string& peer, bool met, TimePoint now);

  // Notes how many bytes the connection has sent. Returns true if it has to be closed for it.
  bool received(Id id, std::uint64_t bytes, TimePoint now);
  // Returns the connections that have been unmet for too long.
  std::vector<Id> overdue(TimePoint now);
  const std::set<Id>& unmet() const { return unmet_; }

  std::size_t size() const { return entries_.size(); }
  // Number of connections refused or closed, by reason
  std::uint64_t closed(Closed why) const { return closed_[static_cast<int>(why)]; }

 private:
  struct Entry {
    Id id = 0;
    Guest guest;
    TimePoint unmet_since{};
    std::size_t met_calls = 0, unmet_calls = 0;
    bool ever_met = false;
    bool long_hello = false;
    bool doomed = false;  // it is being closed, and takes no place of the unmet
  };
  struct Group {
    std::size_t unmet = 0, long_hellos = 0;
    std::optional<TimePoint> shut_out_until;
  };
  Entry* find(const std::string& peer);
  void begin_unmet(Entry& entry, TimePoint now);
  void end_unmet(Entry& entry);
  void doom(Entry& entry, Closed why);
  void shut_out(const Entry& entry, TimePoint now);
  std::optional<Id> make_room(const Guest& guest, TimePoint now) const;
  std::optional<Id> newest_of(const std::string& group) const;
  void count(Closed why) { ++closed_[static_cast<int>(why)]; }

  const Limits limits_;
  std::map<Id, Entry> entries_;
  std::map<std::string, Id> by_peer_;
  std::map<std::string, Group> groups_;  // of addresses with unmet connections, or that are shut out
  std::set<Id> unmet_;                   // without those that are doomed
  std::size_t long_hellos_ = 0;
  std::uint64_t closed_[kClosedReasons] = {};
};

}  // namespace ls::coordinator::rpc
