// The route table: every address, who may use it, how large a body may be and where the work runs.
// openapi.json describes the same routes; a test compares the two.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "coordinator/http/message/message.h"

namespace ls::http {

class Api;

enum class Access {
  open,    // everybody
  token,   // any token except a worker's: submit, read, admin. A submit token sees only its own jobs
  submit,  // submit, admin
  see,     // read, admin: data of all users
  admin,
};
std::string_view to_string(Access access);
bool allows(Access access, Role role);
enum class Executor {
  here,    // on the network thread: must not block
  quick,   // answered from memory
  slow,    // reads scenes, writes images
  remote,  // asks other machines, which may not answer for a while
};
enum class BodyKind {
  none,      // any body is ignored
  buffered,  // whole, at most body_limit bytes
  blob,      // streamed into Api::open_upload
  archive,   // streamed, too, and unpacked at its end, which takes time. Chosen per request, never in a route
};

using Params = std::vector<std::string>;  // values of the {..} in the pattern, in order
using Handler = Response (*)(Api&, const Request&, const Params&);

struct Route {
  Method method = Method::get;
  std::string_view pattern;  // "/api/v1/jobs/{id}"
  Access access = Access::token;
  Executor executor = Executor::quick;
  BodyKind body = BodyKind::none;
  std::uint64_t body_limit = 0;
  Handler handler = nullptr;      // null for BodyKind::blob
  std::string_view accepts = {};  // media types of a buffered body, separated by spaces
  std::string_view unpacks = {};  // media types whose body is an archive instead
};

std::span<const Route> routes();

struct Match {
  const Route* route = nullptr;
  Params params;
};
struct WrongMethod {
  std::string allow;  // value of the Allow header
};
// A GET route answers HEAD as well. nullopt: no such address.
std::optional<std::variant<Match, WrongMethod>> find_route(Method method,
                                                           std::span<const std::string> segments);

}  // namespace ls::http
