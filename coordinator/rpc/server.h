// The farm protocol (proto/farm.proto) on a port, in front of a Coordinator.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/base/error.h"
#include "coordinator/rpc/join_guard.h"
#include "coordinator/service.h"

namespace ls::coordinator {

class GrpcServer {
 public:
  struct Tls {       // PEM
    std::string ca;  // whose certificates workers must show
    std::string cert, key;
  };
  // `may_join`: what FetchBlob asks (the hello is checked by the Coordinator).
  explicit GrpcServer(Coordinator& coordinator, JoinCheck may_join = join_check({}), JoinGuard guard = {});
  ~GrpcServer();  // stops

  // Listens on "host:port"; port 0 lets the system choose. Gives the port. unavailable: the address is taken
  // or not ours, also by another coordinator: ports are never shared. Block SIGTERM before, since threads
  // start here.
  // With `tls` only workers that show a certificate of its CA are spoken to.
  Result<int> start(const std::string& address, const std::optional<Tls>& tls = {});
  // Ends all streams with UNAVAILABLE, so that workers come back to the next coordinator. Returns when none
  // is left.
  void stop();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ls::coordinator
