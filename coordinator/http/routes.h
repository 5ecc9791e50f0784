// The route table: every address that is answered, who may ask, how large a body may be and where the work
// runs. openapi.json describes the same routes; a test compares the two.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "coordinator/http/message.h"

namespace ls::http {

class Api;

enum class Access {
  open,    // anybody
  token,   // any token but a worker's: submit, read, admin. What a submit token sees is its own
  submit,  // submit, admin
  see,     // read, admin: what is of all users together
  admin,
};
std::string_view to_string(Access access);
bool allows(Access access, Role role);
enum class Lane {
  here,   // answered by the network thread: touches nothing that may wait
  quick,  // out of memory
  slow,   // reads scenes, writes images
  away,   // asks other machines, which may not answer for a while
};
enum class BodyKind {
  none,      // anything that comes is thrown away
  buffered,  // whole, at most body_limit bytes
  blob,      // streamed into Api::open_upload
  archive,   // the same; what comes is unpacked at its end, which takes its time. Of a request, never of a
             // route
};

using Params = std::vector<std::string>;  // what stands for {..} in the pattern, in order
using Handler = Response (*)(Api&, const Request&, const Params&);

struct Route {
  Method method = Method::get;
  std::string_view pattern;  // "/api/v1/jobs/{id}"
  Access access = Access::token;
  Lane lane = Lane::quick;
  BodyKind body = BodyKind::none;
  std::uint64_t body_limit = 0;
  Handler handler = nullptr;      // none for BodyKind::blob
  std::string_view accepts = {};  // media types of a buffered body, separated by spaces
  std::string_view unpacks = {};  // those whose body is an archive instead
};

std::span<const Route> routes();

struct Match {
  const Route* route = nullptr;
  Params params;
};
struct WrongMethod {
  std::string allow;  // for the Allow header
};
// A GET route answers HEAD as well. Nothing: no such address.
std::optional<std::variant<Match, WrongMethod>> find_route(Method method,
                                                           std::span<const std::string> segments);

}  // namespace ls::http
