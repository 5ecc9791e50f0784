// One HTTP POST to a receiver. Does not follow redirects, ignores proxies of the environment and uses only
// http and https: a receiver cannot redirect the coordinator anywhere.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "common/base/error.h"

namespace ls::coordinator::webhooks {

struct Post {
  std::string url;
  std::vector<std::pair<std::string, std::string>> headers;
  std::string body;
};

// Returns the status of the answer; its body is dropped. Errors: no connection, no answer within
// kAnswerSeconds.
inline constexpr long kAnswerSeconds = 15;
Result<int> send(const Post& post);

// invalid_argument if this is not a usable receiver URL.
Result<void> check_url(const std::string& url);

}  // namespace ls::coordinator::webhooks
