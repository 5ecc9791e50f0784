// gRPC status to Error, as the coordinator's table has it the other way round.
#pragma once

#include <grpcpp/support/status.h>

#include "common/base/error.h"

namespace ls::worker {
Error to_error(const grpc::Status& status);
}
