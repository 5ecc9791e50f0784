// Against guessing join tokens: who was wrong too often has to wait, by address.
#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace ls::coordinator {

struct JoinGuard {
  // Seconds that a token from this address has to wait before it is looked at; 0: go on.
  std::function<int(const std::string& address, std::string_view token)> wait = [](const auto&, auto) {
    return 0;
  };
  std::function<void(const std::string& address, std::string_view token, bool right)> tried =
      [](const auto&, auto, bool) {};
};

// The address in what gRPC calls a peer: "ipv4:10.0.0.7:4711", "ipv6:%5Bfd00::7%5D:4711", "unix:..."; of
// anything else all of it.
std::string address_of_peer(std::string_view peer);

std::string too_many_wrong_tokens(int seconds);  // for whoever has to wait

}  // namespace ls::coordinator
