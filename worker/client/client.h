// The CoordinatorLink over gRPC.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "worker/agent/link.h"

namespace ls::worker {

// Certificates for mutual TLS, in PEM.
struct LinkTls {
  std::string ca;         // CA of the coordinator's certificate
  std::string cert, key;  // our own
};

// `address` is "host:port". `join_token` is sent with blob fetches (the hello has its own). Without `tls` the
// connection is not encrypted. Does not connect yet.
std::unique_ptr<CoordinatorLink> make_grpc_link(const std::string& address, const std::string& join_token,
                                                const std::optional<LinkTls>& tls = {});

}  // namespace ls::worker
