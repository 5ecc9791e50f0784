#include "coordinator/rpc/join_guard.h"

#include <fmt/format.h>

namespace ls::coordinator {

std::string address_of_peer(std::string_view peer) {
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

std::string too_many_wrong_tokens(int seconds) {
  return fmt::format(
      "too many wrong join tokens came from this address; try again in {} s, with the one that the "
      "coordinator keeps in the file `join-token` of its data folder",
      seconds);
}

}  // namespace ls::coordinator
