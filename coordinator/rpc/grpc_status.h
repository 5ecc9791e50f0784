// The only mapping from Errc to gRPC status.
#pragma once

#include <grpcpp/support/status.h>

#include "common/base/error.h"

namespace ls::coordinator::rpc {

grpc::StatusCode status_code(Errc code);
grpc::Status to_status(const Error& error);

}  // namespace ls::coordinator::rpc
