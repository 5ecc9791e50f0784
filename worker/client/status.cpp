#include "worker/client/status.h"

namespace ls::worker {
namespace {
Errc code_of(grpc::StatusCode code) {
  switch (code) {
    case grpc::StatusCode::INVALID_ARGUMENT:
    case grpc::StatusCode::OUT_OF_RANGE:
      return Errc::invalid_argument;
    case grpc::StatusCode::NOT_FOUND:
      return Errc::not_found;
    case grpc::StatusCode::ALREADY_EXISTS:
      return Errc::already_exists;
    case grpc::StatusCode::FAILED_PRECONDITION:
      return Errc::failed_precondition;
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
      return Errc::resource_exhausted;
    case grpc::StatusCode::PERMISSION_DENIED:
      return Errc::permission_denied;
    case grpc::StatusCode::UNAUTHENTICATED:
      return Errc::unauthenticated;
    // The coordinator vanished, was unreachable or shut down: the caller should try again later.
    case grpc::StatusCode::UNAVAILABLE:
    case grpc::StatusCode::CANCELLED:
    case grpc::StatusCode::ABORTED:
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      return Errc::unavailable;
    default:
      return Errc::internal;
  }
}
}  // namespace

Error to_error(const grpc::Status& status) {
  return {code_of(status.error_code()), std::string(status.error_message())};
}

}  // namespace ls::worker
