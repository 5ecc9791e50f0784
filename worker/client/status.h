// Converts a gRPC status to an Error; the inverse of the coordinator's table.
#pragma once

#include <grpcpp/support/status.h>

#include "common/base/error.h"

namespace ls::worker {
Error to_error(const grpc::Status& status);
}
