// Protects join tokens (with which workers prove that they belong to the farm) against guessing: after too
// many wrong tokens an address has to wait. The gRPC server calls the two functions; the default ones allow
// everything.
#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace ls::coordinator {

struct JoinGuard {
  // Seconds that this address has to wait before its token is checked; 0: allowed.
  std::function<int(const std::string& address, std::string_view token)> wait = [](const auto&, auto) {
    return 0;
  };
  // Called after a token from this address was checked; `right` is the outcome.
  std::function<void(const std::string& address, std::string_view token, bool right)> tried =
      [](const auto&, auto, bool) {};
};

// Returns the address without port from a gRPC peer name ("ipv4:10.0.0.7:4711", "ipv6:%5Bfd00::7%5D:4711",
// "unix:..."); for any other form the whole name.
std::string address_of_peer(std::string_view peer);

std::string too_many_wrong_tokens(int seconds);  // message for the worker that has to wait

}  // namespace ls::coordinator
