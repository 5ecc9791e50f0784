#include "util/sandbox/channel.h"

#include <poll.h>
#include <sys/socket.h>

#include <cerrno>

namespace ls {
namespace {

constexpr int kPollMs = 50;

// Sends or receives all bytes by calls of `move(p, bytes)`, a send or receive that does not block. When
// `move` can transfer nothing, waits with poll(2) for the event `ready`, and calls `watch` meanwhile. Returns
// false if the other side has closed the channel.
template <class Move, class Byte>
bool move_all(int fd, short ready, Byte* p, std::size_t bytes, const Watch& watch, Move move) {
  while (bytes > 0) {
    const ssize_t n = move(p, bytes);
    if (n > 0) {
      p += n;
      bytes -= static_cast<std::size_t>(n);
      if (watch) watch();  // the other side may go on without end, byte by byte
      continue;
    }
    if (n < 0 && errno == EINTR) continue;
    if (n == 0 || (errno != EAGAIN && errno != EWOULDBLOCK)) return false;
    pollfd waiting{fd, ready, 0};
    if (::poll(&waiting, 1, watch ? kPollMs : -1) == 0) watch();
  }
  return true;
}

}  // namespace

bool send_all(int fd, const void* data, std::size_t bytes, const Watch& watch) {
  return move_all(
      fd, POLLOUT, static_cast<const char*>(data), bytes, watch,
      [fd](const char* p, std::size_t n) { return ::send(fd, p, n, MSG_NOSIGNAL | MSG_DONTWAIT); });
}

bool receive_all(int fd, void* data, std::size_t bytes, const Watch& watch) {
  return move_all(fd, POLLIN, static_cast<char*>(data), bytes, watch,
                  [fd](char* p, std::size_t n) { return ::recv(fd, p, n, MSG_DONTWAIT); });
}

}  // namespace ls
