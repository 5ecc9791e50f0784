// The farm protocol (proto/farm.proto) on a port, in front of a Coordinator.
#pragma once

#include <memory>
#include <string>

#include "common/base/error.h"
#include "coordinator/service.h"

namespace ls::coordinator {

class GrpcServer {
 public:
  // `join_token`: what FetchBlob asks for (the hello's is checked by the Coordinator); empty: open to all.
  explicit GrpcServer(Coordinator& coordinator, std::string join_token = {});
  ~GrpcServer();  // stops

  // Listens on "host:port"; port 0 lets the system choose. Gives the port. unavailable: the address is taken
  // or not ours, also by another coordinator: ports are never shared. Block SIGTERM before, since threads
  // start here.
  Result<int> start(const std::string& address);
  // Ends all streams with UNAVAILABLE, so that workers come back to the next coordinator. Returns when none
  // is left.
  void stop();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ls::coordinator
