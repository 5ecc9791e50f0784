// Parsing of request targets.
#pragma once

#include <string_view>

#include "common/base/error.h"
#include "coordinator/http/message/message.h"

namespace ls::http {

struct Target {
  std::vector<std::string> segments;
  Fields query;
};

// Parses "/api/v1/jobs?spp=4" or "http://host/path". Invalid percent codes, control characters, '/' or NUL
// hidden in a percent code, and more than kMaxQueryParameters are errors (400).
Result<Target> parse_target(std::string_view target);

// Decodes %XX and, in queries, '+' as a space.
Result<std::string> percent_decode(std::string_view text, bool plus_is_space);

}  // namespace ls::http
