// The CoordinatorLink over gRPC.
#pragma once

#include <memory>
#include <string>

#include "worker/link.h"

namespace ls::worker {

// `address` is "host:port". `join_token` goes with blob fetches (the hello has its own). Nothing is connected
// yet.
std::unique_ptr<CoordinatorLink> make_grpc_link(const std::string& address, const std::string& join_token);

}  // namespace ls::worker
