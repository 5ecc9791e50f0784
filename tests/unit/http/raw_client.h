// A client that sends exactly the given bytes, so that it can misbehave in ways that HTTP libraries do not
// allow.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string>
#include <string_view>
#include <utility>

namespace ls::http::testing {

class RawClient {
 public:
  explicit RawClient(int port, int receive_buffer = 0) : fd_(::socket(AF_INET, SOCK_STREAM, 0)) {
    if (receive_buffer > 0) ::setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  ~RawClient() { close(); }
  RawClient(const RawClient&) = delete;

  void close() {
    if (fd_ >= 0) ::close(std::exchange(fd_, -1));
  }
  // Returns false once the server has closed the connection.
  bool send(std::string_view text) {
    while (!text.empty()) {
      const ssize_t n = ::send(fd_, text.data(), text.size(), MSG_NOSIGNAL);
      if (n <= 0) return false;
      text.remove_prefix(static_cast<std::size_t>(n));
    }
    return true;
  }
  // Reads until `mark` has arrived or the stream ends; all bytes read so far stay in `received`.
  bool read_until(std::string_view mark) {
    while (received.find(mark) == std::string::npos)
      if (!read_some()) return false;
    return true;
  }
  // Waits until bytes arrive, without reading them; false after 3 minutes.
  bool readable() {
    pollfd p{fd_, POLLIN, 0};
    return ::poll(&p, 1, 180'000) == 1;
  }
  std::string read_all() {
    while (read_some()) {
    }
    return received;
  }
  // Removes the next response from `received` and returns it. Its body has a Content-Length, or it has none.
  std::string response() {
    if (!read_until("\r\n\r\n")) return std::exchange(received, {});
    const std::size_t head = received.find("\r\n\r\n") + 4;
    std::size_t length = 0;
    if (const auto at = received.find("Content-Length: "); at < head)
      length = std::stoul(received.substr(at + 16));
    while (received.size() < head + length && read_some()) {
    }
    std::string one = received.substr(0, head + length);
    received.erase(0, one.size());
    return one;
  }
  static int status(std::string_view response) {
    return response.starts_with("HTTP/1.1 ") ? std::stoi(std::string(response.substr(9, 3))) : 0;
  }

  std::string received;

 private:
  bool read_some() {
    pollfd p{fd_, POLLIN, 0};
    if (::poll(&p, 1, 180'000) != 1) {
      ADD_FAILURE() << "nothing came within 180 s";
      return false;
    }
    char buffer[4096];
    const ssize_t n = ::recv(fd_, buffer, sizeof buffer, 0);
    if (n <= 0) return false;
    received.append(buffer, static_cast<std::size_t>(n));
    return true;
  }
  int fd_;
};

}  // namespace ls::http::testing
