// The TLS certificate of the HTTP server.
#pragma once

#include <memory>
#include <string>

#include "common/base/error.h"

namespace ls::http {

// Certificate and key of the server; read once.
class TlsIdentity {
 public:
  // PEM texts: the certificate with its chain up to the CA, and its key. invalid_argument: they are
  // malformed, or do not belong together.
  static Result<std::shared_ptr<const TlsIdentity>> make(const std::string& cert, const std::string& key);
  ~TlsIdentity();

 private:
  friend class Stream;
  struct Context;
  explicit TlsIdentity(std::unique_ptr<Context> context);
  std::unique_ptr<Context> context_;
};

}  // namespace ls::http
