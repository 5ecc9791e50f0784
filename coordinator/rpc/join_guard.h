// Protects join tokens (with which workers prove that they belong to the farm) against guessing: after too
// many wrong tokens an address has to wait. The gRPC server calls the two functions; the default functions
// allow everything.
#pragma once

#include <fmt/format.h>

#include <functional>
#include <string>
#include <string_view>

namespace ls::coordinator {

struct JoinGuard {
  // Seconds that this address has to wait before its token is checked; 0: allowed.
  std::function<int(const std::string& address, std::string_view token)> wait = [](const auto&, auto) {
    return 0;
  };
  // Called after a token from this address was checked; `right`: the token is valid.
  std::function<void(const std::string& address, std::string_view token, bool right)> tried =
      [](const auto&, auto, bool) {};
};

// Returns the address without port from a gRPC peer name ("ipv4:10.0.0.7:4711", "ipv6:%5Bfd00::7%5D:4711",
// "unix:..."); a name of any other form is returned unchanged.
inline std::string address_of_peer(std::string_view peer) {
  constexpr std::string_view kFour = "ipv4:", kSix = "ipv6:";
  std::string_view rest = peer;
  if (rest.starts_with(kFour)) {
    rest.remove_prefix(kFour.size());
    return std::string(rest.substr(0, rest.rfind(':')));
  }
  if (!rest.starts_with(kSix)) return std::string(peer);
  rest.remove_prefix(kSix.size());
  for (const std::string_view open : {"[", "%5B", "%5b"})
    if (rest.starts_with(open)) rest.remove_prefix(open.size());
  for (const std::string_view close : {"]", "%5D", "%5d"})
    if (const auto end = rest.find(close); end != std::string_view::npos)
      return std::string(rest.substr(0, end));
  return std::string(rest.substr(0, rest.rfind(':')));
}

// Returns the message for a worker that has to wait.
inline std::string too_many_wrong_tokens(int seconds) {
  return fmt::format(
      "too many wrong join tokens came from this address; try again in {} s, with the one that the "
      "coordinator keeps in the file `join-token` of its data folder",
      seconds);
}

}  // namespace ls::coordinator
