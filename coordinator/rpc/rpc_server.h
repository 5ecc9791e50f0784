// Serves the protocol between coordinator and workers (proto/farm.proto) on a port and passes the messages of
// workers to a Coordinator.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "coordinator/rpc/join_guard.h"
#include "coordinator/service/coordinator.h"
#include "core/base/error.h"

namespace ls::coordinator {

class GrpcServer {
 public:
  struct Tls {       // certificates and the server's private key, as texts in PEM format
    std::string ca;  // CA that must have signed the workers' certificates
    std::string cert, key;
  };
  // `may_join` checks the join token that a worker sends with a FetchBlob call; the token in a worker's hello
  // is checked by the Coordinator. `guard` limits how many wrong tokens an address may try.
  explicit GrpcServer(Coordinator& coordinator, JoinCheck may_join = join_check({}), JoinGuard guard = {});
  ~GrpcServer();  // calls stop()

  // Listens on `address`, "host:port", and returns the port; with port 0 the system chooses one. With `tls`
  // workers must present a certificate signed by Tls::ca. unavailable: the address is in use (also by another
  // coordinator, because ports are never shared) or does not belong to this machine. Starts threads, which
  // inherit the signal mask: block SIGTERM before the call.
  // The port is looked at from time to time; `on_dead` is called once, on a thread of the server, when it has
  // not answered for minutes.
  Result<int> start(const std::string& address, const std::optional<Tls>& tls = {},
                    const std::function<void()>& on_dead = {});
  // What is wrong with the port, as a text for a person; empty: nothing.
  std::string trouble() const;
  // Ends all streams with UNAVAILABLE, so that the workers try to reconnect. Returns when all streams have
  // ended.
  void stop();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ls::coordinator
