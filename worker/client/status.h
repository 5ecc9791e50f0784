// Converts a gRPC status to an Error: the inverse of status_code() in coordinator/rpc/grpc_status.h.
#pragma once

#include <grpcpp/support/status.h>

#include "common/base/error.h"

namespace ls::worker {
Error to_error(const grpc::Status& status);
}
