// The header of a response as it goes on the wire.
#pragma once

#include <optional>
#include <string>

#include "coordinator/http/message.h"

namespace ls::http {

struct HeadOptions {
  bool keep_alive = false;
  bool streamed = false;  // no Content-Length: the body ends with the connection
  Method method = Method::get;
};

// Status line, fields and the empty line. Adds Date, length, and the security headers that every response
// carries.
std::string head_text(const Response& response, const HeadOptions& options, std::int64_t unix_seconds);

}  // namespace ls::http
