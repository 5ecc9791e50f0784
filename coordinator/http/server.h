// The HTTP server loop: one network thread, two small pools for the coordinator's work, deadlines on
// everything a stranger may be slow at. Boost stays behind this header.
#pragma once

#include <memory>
#include <string>

#include "common/base/error.h"
#include "coordinator/http/api.h"

namespace ls::http {

class TlsIdentity;  // tls_identity.h

class Server {
 public:
  // Binds and listens on "host:port" (port 0: any; "[::1]:8080" for IPv6). A port in use is an error: it is
  // never shared. Until start() connections wait.
  static Result<std::unique_ptr<Server>> listen(const std::string& address);
  ~Server();  // stops

  int port() const;  // until stop()
  // `api` lives until stop() has returned. With `tls` only that is spoken.
  void start(Api& api, std::shared_ptr<const TlsIdentity> tls = nullptr);
  // Ends listening and event streams, gives requests under way Limits::stop_seconds, then cuts them.
  void stop();

 private:
  struct State;
  explicit Server(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace ls::http
