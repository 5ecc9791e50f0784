#include "cli/farm/tcp.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/base/parse_number.h"

namespace ls::cli {
namespace {

constexpr int kConnectMilliseconds = 5000;
constexpr int kSendSeconds = 30;

// Returns 0, or the error's number.
int connect_within(int socket, const addrinfo& address, int milliseconds) {
  if (::connect(socket, address.ai_addr, address.ai_addrlen) == 0) return 0;
  if (errno != EINPROGRESS) return errno;
  pollfd waiting{socket, POLLOUT, 0};
  const int ready = ::poll(&waiting, 1, milliseconds);
  if (ready <= 0) return ready == 0 ? ETIMEDOUT : errno;
  int why = 0;
  socklen_t size = sizeof why;
  return ::getsockopt(socket, SOL_SOCKET, SO_ERROR, &why, &size) == 0 ? why : errno;
}

}  // namespace

Result<HostPort> parse_host_port(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  HostPort out{text.substr(0, std::min(colon, text.size())),
               colon == std::string::npos ? "" : text.substr(colon + 1)};
  const bool bracketed = out.host.size() > 2 && out.host.front() == '[' && out.host.back() == ']';
  if (bracketed) out.host = out.host.substr(1, out.host.size() - 2);
  const auto port = parse_number<std::uint16_t>(out.port);
  if (out.host.empty() || !port || *port == 0 ||
      (!bracketed && out.host.find_first_of(":/[]") != std::string::npos))
    return bad_argument(fmt::format("'{}' is no HOST:PORT, such as 127.0.0.1:14158", text));
  return out;
}

std::string host_port_text(const HostPort& peer) {
  const bool six = peer.host.find(':') != std::string::npos;
  return six ? fmt::format("[{}]:{}", peer.host, peer.port) : fmt::format("{}:{}", peer.host, peer.port);
}

std::string host_of(const std::string& url) {
  const std::size_t scheme = url.find("://");
  const std::size_t host = scheme == std::string::npos ? 0 : scheme + 3;
  if (url.compare(host, 1, "[") == 0) return url.substr(host + 1, url.find(']', host) - host - 1);
  return url.substr(host, url.find_first_of(":/", host) - host);
}

bool is_loopback(const std::string& host) {
  return host == "localhost" || host == "::1" || host.starts_with("127.");
}

Result<TcpConnection> TcpConnection::open(const HostPort& peer) {
  addrinfo hints{}, *found = nullptr;
  hints.ai_socktype = SOCK_STREAM;
  if (const int code = ::getaddrinfo(peer.host.c_str(), peer.port.c_str(), &hints, &found); code != 0)
    return fail(Errc::unavailable, ::gai_strerror(code));
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> addresses(found, &::freeaddrinfo);
  int why = 0;
  for (const addrinfo* address = found; address; address = address->ai_next) {
    auto socket = std::make_unique<Descriptor>(
        ::socket(address->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    why = socket->fd < 0 ? errno : connect_within(socket->fd, *address, kConnectMilliseconds);
    if (why != 0) continue;
    ::fcntl(socket->fd, F_SETFL, ::fcntl(socket->fd, F_GETFL) & ~O_NONBLOCK);
    const timeval most{kSendSeconds, 0};
    ::setsockopt(socket->fd, SOL_SOCKET, SO_SNDTIMEO, &most, sizeof most);
    return TcpConnection(std::move(socket));
  }
  return fail(Errc::unavailable, std::strerror(why));
}

Result<void> TcpConnection::send(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket_->fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0)
      return fail(Errc::unavailable, errno == EAGAIN
                                         ? fmt::format("it has taken nothing for {} s", kSendSeconds)
                                         : std::string(std::strerror(errno)));
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
  return {};
}

}  // namespace ls::cli
