// The TLS certificate of the HTTP server.
#pragma once

#include <memory>
#include <string>

#include "common/base/error.h"

namespace ls::http {

// Certificate and key of the server; read once.
class TlsIdentity {
 public:
  // `cert` is the server's certificate with its chain up to the CA, `key` its private key, both in PEM.
  // invalid_argument: one is malformed, or they do not belong together.
  static Result<std::shared_ptr<const TlsIdentity>> make(const std::string& cert, const std::string& key);
  ~TlsIdentity();

 private:
  friend class Stream;
  struct Context;
  explicit TlsIdentity(std::unique_ptr<Context> context);
  std::unique_ptr<Context> context_;
};

}  // namespace ls::http
