// Sends one HTTP POST to a receiver of notifications. It follows no redirects, ignores proxies named in the
// environment and speaks only http and https, so that a receiver cannot make the coordinator ask other
// addresses.
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

inline constexpr long kAnswerSeconds = 15;

// Returns the status of the receiver's answer; the answer's body is thrown away. Error: no connection, or no
// answer within kAnswerSeconds.
Result<int> send(const Post& post);

// invalid_argument if this is not a usable receiver URL.
Result<void> check_url(const std::string& url);

}  // namespace ls::coordinator::webhooks
