// The CoordinatorLink over gRPC.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "worker/link.h"

namespace ls::worker {

// What both sides show each other. PEM.
struct LinkTls {
  std::string ca;         // whose certificate the coordinator must show
  std::string cert, key;  // ours
};

// `address` is "host:port". `join_token` goes with blob fetches (the hello has its own). Without `tls`
// nothing is encrypted. Nothing is connected yet.
std::unique_ptr<CoordinatorLink> make_grpc_link(const std::string& address, const std::string& join_token,
                                                const std::optional<LinkTls>& tls = {});

}  // namespace ls::worker
