// Serialises the header of a response.
#pragma once

#include <optional>
#include <string>

#include "coordinator/http/message/message.h"

namespace ls::http {

struct HeadOptions {
  bool keep_alive = false;
  bool streamed = false;  // no Content-Length: the body ends with the connection
  Method method = Method::get;
};

// Returns status line, fields and the empty line. Adds Date, length, and the security headers of every
// response.
std::string head_text(const Response& response, const HeadOptions& options, std::int64_t unix_seconds);

}  // namespace ls::http
