// Finds out when the workers' port does not answer any more, whatever the reason: then no worker can join or
// come back, and only a new start of the coordinator helps.
#pragma once

#include <sys/socket.h>

#include <chrono>
#include <optional>
#include <string>

#include "core/base/clock.h"

namespace ls::coordinator::rpc {

// Connects to the address, says nothing, and returns true if the other end sends something or closes within
// `time_limit`, as a gRPC server does with and without TLS. nullopt: that cannot be tried, since this process
// may open no more files.
std::optional<bool> port_answers(const sockaddr* address, socklen_t length,
                                 std::chrono::milliseconds time_limit);

// Time between two looks at the port, and how long each may take
inline constexpr Duration kPortLook = std::chrono::seconds(10);
inline constexpr std::chrono::milliseconds kPortTimeLimit{5'000};

class PortWatch {
 public:
  // So many looks in a row without an answer are reported; with so many the port counts as dead. A machine
  // that is very busy may miss some.
  static constexpr int kReported = 2, kDead = 12;

  void looked(std::optional<bool> answered) {
    if (answered) silent_ = *answered ? 0 : silent_ + 1;
  }
  bool dead() const { return silent_ >= kDead; }
  // What is wrong, as a text for a person; empty: nothing.
  std::string trouble() const;

 private:
  int silent_ = 0;
};

}  // namespace ls::coordinator::rpc
