// A request target, taken apart.
#pragma once

#include <string_view>

#include "common/base/error.h"
#include "coordinator/http/message.h"

namespace ls::http {

struct Target {
  std::vector<std::string> segments;
  Fields query;
};

// "/api/v1/jobs?spp=4" or "http://host/path". Wrong percent codes, control characters, and '/' or NUL hidden
// in a percent code are errors (400), as is more than kMaxQueryParameters.
Result<Target> parse_target(std::string_view target);

// %XX and, in queries, '+' for a space.
Result<std::string> percent_decode(std::string_view text, bool plus_is_space);

}  // namespace ls::http
