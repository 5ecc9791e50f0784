// The HTTP server loop: one network thread, small thread pools for the coordinator's work, and deadlines for
// everything that a client can delay. Boost stays behind this header.
#pragma once

#include <memory>
#include <string>

#include "common/base/error.h"
#include "coordinator/http/api/api.h"

namespace ls::http {

class TlsIdentity;  // tls_identity.h

class Server {
 public:
  // Binds and listens on "host:port" (port 0: any; "[::1]:8080" for IPv6). A port in use is an error: ports
  // are never shared. Connections wait until start().
  static Result<std::unique_ptr<Server>> listen(const std::string& address);
  ~Server();  // stops

  int port() const;  // valid until stop()
  // `api` must outlive stop(). With `tls`, plain text is rejected.
  void start(Api& api, std::shared_ptr<const TlsIdentity> tls = nullptr);
  // Stops listening, ends event streams, gives open requests Limits::stop_seconds, then closes them.
  void stop();

 private:
  struct State;
  explicit Server(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace ls::http
