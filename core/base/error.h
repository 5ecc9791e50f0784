// Errors as values. Every function that can fail returns Result<T>; no exception leaves the source folder in
// which it is thrown. The message is for the person who must act: what happened, where, and what to do.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>

namespace ls {

// The gRPC status codes that this project uses. One table maps them to gRPC's numbers, another one to HTTP
// status codes.
enum class Errc {
  invalid_argument,  // the input is wrong; sending it again will not help
  not_found,         // there is no such job, blob, worker or file
  already_exists,
  failed_precondition,  // valid input, but the state is wrong (job cancelled, worker's arithmetic differs)
  resource_exhausted,   // a limit is exceeded, or a disk is full
  permission_denied,
  unauthenticated,
  unavailable,  // temporary: try again later
  internal,     // a bug of this program
};

struct Error {
  Errc code = Errc::internal;
  std::string message;
  bool operator==(const Error&) const = default;
};

template <class T>
using Result = tl::expected<T, Error>;

inline tl::unexpected<Error> fail(Errc code, std::string message) {
  return tl::unexpected<Error>(Error{code, std::move(message)});
}
inline tl::unexpected<Error> bad_argument(std::string message) {
  return fail(Errc::invalid_argument, std::move(message));
}

// The names of the codes, in the order of Errc.
inline constexpr std::array<std::string_view, 9> kErrcNames = {
    "invalid_argument",    "not_found",          "already_exists",
    "failed_precondition", "resource_exhausted", "permission_denied",
    "unauthenticated",     "unavailable",        "internal"};
static_assert(kErrcNames.size() == static_cast<std::size_t>(Errc::internal) + 1);
constexpr std::string_view to_string(Errc code) { return kErrcNames[static_cast<std::size_t>(code)]; }

}  // namespace ls
