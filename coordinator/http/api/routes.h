// The route table. For every address it gives the callers that may use it, the limit on the request's body
// and the threads that run the handler. openapi.json describes the same routes; a test compares the two.
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

// The callers that may use a route, by the role of their token (Role in message/message.h).
enum class Access {
  open,  // everybody, even without a token
  // The roles submit, read and admin: any token except a worker's. A submit token sees only its own jobs
  token,
  submit,  // the roles submit and admin
  see,     // the roles read and admin, because the route shows data of all users
  admin,   // the role admin
};
std::string_view to_string(Access access);
bool allows(Access access, Role role);
// The threads that run a route's handler: the network thread or one of three thread pools. The pools are
// separate, so that slow work never delays quick answers.
enum class Executor {
  here,    // the network thread; the handler must not block
  quick,   // the pool for handlers that answer from memory
  slow,    // the pool for handlers that read scenes or write images
  remote,  // the pool for handlers that send requests to other machines, whose answers may take a while
};
enum class BodyKind {
  none,      // a body is ignored
  buffered,  // the body is read into memory as a whole, at most Route::body_limit bytes
  blob,      // the body is streamed into the sink that Api::open_upload returns
  // Like blob, but the sink's finish() unpacks an archive, which takes time. No route in the table has this
  // kind; Api::body_kind() chooses it for a request whose media type is in Route::unpacks
  archive,
};

using Params = std::vector<std::string>;  // the path segments that match the {..} in the pattern, in order
using Handler = Response (*)(Api&, const Request&, const Params&);

struct Route {
  Method method = Method::get;
  std::string_view pattern;  // path of the address, such as "/api/v1/jobs/{id}"; {..} matches one segment
  Access access = Access::token;
  Executor executor = Executor::quick;
  BodyKind body = BodyKind::none;
  std::uint64_t body_limit = 0;
  Handler handler = nullptr;      // null for BodyKind::blob
  std::string_view accepts = {};  // allowed media types of a buffered body, separated by spaces
  std::string_view unpacks = {};  // media types of bodies that are archives (BodyKind::archive)
  // True: the handler needs memory for each pixel of the job's image (kMemoryPerPixel)
  bool of_pixels = false;
};

std::span<const Route> routes();

struct Match {
  const Route* route = nullptr;
  Params params;
};
struct WrongMethod {
  std::string allow;  // value of the Allow header
};
// Finds the route of a request. A GET route answers HEAD as well. nullopt: there is no such address.
std::optional<std::variant<Match, WrongMethod>> find_route(Method method,
                                                           std::span<const std::string> segments);

}  // namespace ls::http
