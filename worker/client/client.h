// The worker's connection to a coordinator (CoordinatorLink) over gRPC.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "worker/agent/link.h"

namespace ls::worker {

// Certificates for mutual TLS, in PEM.
struct LinkTls {
  std::string ca;         // CA that signed the coordinator's certificate
  std::string cert, key;  // certificate and key of this worker
};

// Makes a link to the coordinator at `address`, "host:port", without connecting yet. `join_token`, with which
// workers join the farm, is sent with each request for a blob; the hello has its own copy
// (WorkerHello::join_token). Without `tls` the connection is not encrypted.
std::unique_ptr<CoordinatorLink> make_grpc_link(const std::string& address, const std::string& join_token,
                                                const std::optional<LinkTls>& tls = {});

}  // namespace ls::worker
