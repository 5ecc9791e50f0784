// Serves the farm protocol (proto/farm.proto) on a port, in front of a Coordinator.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/base/error.h"
#include "coordinator/rpc/join_guard.h"
#include "coordinator/service/coordinator.h"

namespace ls::coordinator {

class GrpcServer {
 public:
  struct Tls {       // PEM
    std::string ca;  // CA that must have signed the workers' certificates
    std::string cert, key;
  };
  // `may_join` checks the tokens of FetchBlob (the Coordinator checks those of hellos).
  explicit GrpcServer(Coordinator& coordinator, JoinCheck may_join = join_check({}), JoinGuard guard = {});
  ~GrpcServer();  // stops

  // Listens on "host:port" and returns the port; port 0 lets the system choose. unavailable: the address is
  // in use (also by another coordinator: ports are never shared) or not ours. Block SIGTERM before, since
  // this starts threads. With `tls` workers must present a certificate signed by its CA.
  Result<int> start(const std::string& address, const std::optional<Tls>& tls = {});
  // Ends all streams with UNAVAILABLE, so that workers reconnect to the next coordinator. Returns when none
  // is left.
  void stop();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ls::coordinator
