// Writes the header of a response as text.
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

// Returns the status line, the header fields and the empty line behind them. The fields are those of
// `response`, and Date (from `unix_seconds`), the length, and the security headers of every response.
std::string head_text(const Response& response, const HeadOptions& options, std::int64_t unix_seconds);

}  // namespace ls::http
