// One HTTP POST to a receiver. Redirects are not followed, proxies of the environment not used, and only http
// and https spoken: a receiver cannot send the coordinator anywhere else.
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

// The status of the answer, whose body is not kept. Errors: no answer within kAnswerSeconds, no connection.
inline constexpr long kAnswerSeconds = 15;
Result<int> send(const Post& post);

// invalid_argument if this is no address of a receiver.
Result<void> check_url(const std::string& url);

}  // namespace ls::coordinator::webhooks
