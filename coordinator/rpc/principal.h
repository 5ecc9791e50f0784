// Tells who answers for a worker that connects: all workers of one principal have one vote on wrong pixels
// and on scenes that cannot be rendered (coordinator/domain/event.h, WorkerJoined::principal).
#pragma once

#include <arpa/inet.h>

#include <array>
#include <string>
#include <string_view>

#include "coordinator/rpc/join_guard.h"
#include "core/base/digest.h"

namespace ls::coordinator {

// Returns the principal of a worker: its address, and its certificate if it has shown one. `peer` is the gRPC
// name of its connection, `certificate` the text of its certificate; empty: none. Of an IPv6 address only the
// first 64 bits count, since a machine may choose the others. On the coordinator's own machine all workers
// have one address: there each connection counts by itself, so that a farm on one machine can decide.
inline std::string principal_of(std::string_view peer, std::string_view certificate) {
  std::string address = address_of_peer(peer);
  std::array<unsigned char, 16> six{};
  if (address.starts_with("127.") || address == "::1") {
    address = std::string(peer);
  } else if (inet_pton(AF_INET6, address.c_str(), six.data()) == 1) {
    six.back() = 0;
    for (std::size_t i = 8; i < six.size(); ++i) six[i] = 0;
    std::array<char, INET6_ADDRSTRLEN> text{};
    inet_ntop(AF_INET6, six.data(), text.data(), text.size());
    address = std::string(text.data()) + "/64";
  }
  return certificate.empty() ? address : address + " " + sha256(certificate).hex();
}

}  // namespace ls::coordinator
