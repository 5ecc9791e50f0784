// The HTTP server loop: one network thread, small thread pools for the coordinator's work, and deadlines for
// everything that a client can delay. This header does not include Boost.
#pragma once

#include <memory>
#include <string>

#include "coordinator/http/api/api.h"
#include "core/base/error.h"

namespace ls::http {

// Certificate and key of the server. Read once, at the start.
class TlsIdentity {
 public:
  // `cert` is the server's certificate with its chain up to the CA, `key` its private key, both in PEM.
  // invalid_argument: one of them is malformed, or they do not belong together.
  static Result<std::shared_ptr<const TlsIdentity>> make(const std::string& cert, const std::string& key);
  ~TlsIdentity();

 private:
  friend class Stream;
  struct Context;
  explicit TlsIdentity(std::unique_ptr<Context> context);
  std::unique_ptr<Context> context_;
};

class Server {
 public:
  // Listens on `address`, "host:port" ("[::1]:8080" for IPv6); with port 0 the system chooses the port. A
  // port in use is an error, because ports are never shared. Clients that connect wait until start().
  static Result<std::unique_ptr<Server>> listen(const std::string& address);
  ~Server();  // calls stop()

  int port() const;  // valid until stop()
  // Starts to serve requests by calling `api`, which must exist until stop() has returned. With `tls` clients
  // must use TLS; others get an error.
  void start(Api& api, std::shared_ptr<const TlsIdentity> tls = nullptr);
  // Stops listening, ends event streams, waits up to Limits::stop_seconds for open requests and then closes
  // their connections.
  void stop();

 private:
  struct State;
  explicit Server(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace ls::http
