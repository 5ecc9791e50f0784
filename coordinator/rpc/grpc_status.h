// The only mapping from Errc to gRPC status.
#pragma once

#include <grpcpp/support/status.h>

#include "common/base/error.h"

namespace ls::coordinator::rpc {

inline grpc::StatusCode status_code(Errc code) {
  switch (code) {
    case Errc::invalid_argument:
      return grpc::StatusCode::INVALID_ARGUMENT;
    case Errc::not_found:
      return grpc::StatusCode::NOT_FOUND;
    case Errc::already_exists:
      return grpc::StatusCode::ALREADY_EXISTS;
    case Errc::failed_precondition:
      return grpc::StatusCode::FAILED_PRECONDITION;
    case Errc::resource_exhausted:
      return grpc::StatusCode::RESOURCE_EXHAUSTED;
    case Errc::permission_denied:
      return grpc::StatusCode::PERMISSION_DENIED;
    case Errc::unauthenticated:
      return grpc::StatusCode::UNAUTHENTICATED;
    case Errc::unavailable:
      return grpc::StatusCode::UNAVAILABLE;
    case Errc::internal:
      return grpc::StatusCode::INTERNAL;
  }
  return grpc::StatusCode::INTERNAL;
}

inline grpc::Status to_status(const Error& error) { return {status_code(error.code), error.message}; }

}  // namespace ls::coordinator::rpc
