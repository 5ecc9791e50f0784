#include "coordinator/rpc/port_watch.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>

namespace ls::coordinator::rpc {
namespace {

bool wait_for(int socket, short events, std::chrono::milliseconds time_limit) {
  pollfd waiting{socket, events, 0};
  return ::poll(&waiting, 1, static_cast<int>(time_limit.count())) > 0;
}

bool answered(int socket, const sockaddr* address, socklen_t length, std::chrono::milliseconds time_limit) {
  if (::connect(socket, address, length) != 0 &&
      (errno != EINPROGRESS || !wait_for(socket, POLLOUT, time_limit)))
    return false;
  int why = 0;
  socklen_t size = sizeof why;
  if (::getsockopt(socket, SOL_SOCKET, SO_ERROR, &why, &size) != 0 || why != 0) return false;
  // A server with TLS waits for the client; it closes when nothing comes
  ::shutdown(socket, SHUT_WR);
  return wait_for(socket, POLLIN, time_limit);
}

}  // namespace

std::optional<bool> port_answers(const sockaddr* address, socklen_t length,
                                 std::chrono::milliseconds time_limit) {
  const int socket = ::socket(address->sa_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (socket < 0) return std::nullopt;
  const bool yes = answered(socket, address, length, time_limit);
  ::close(socket);
  return yes;
}

std::string PortWatch::trouble() const {
  if (silent_ < kReported) return {};
  return fmt::format(
      "the workers' port has not answered for {} s: no worker can join or come back. If that lasts, the "
      "coordinator ends, so that it is restarted",
      static_cast<int>(seconds(kPortLook)) * silent_);
}

}  // namespace ls::coordinator::rpc
