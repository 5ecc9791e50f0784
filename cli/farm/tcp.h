// TCP connections to other programs than a coordinator, such as an image viewer.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "core/base/error.h"
#include "core/base/spawn.h"

namespace ls::cli {

struct HostPort {
  std::string host, port;  // the host is a name or an address, without brackets
};
// Parses "HOST:PORT", of an IPv6 address "[ADDRESS]:PORT". invalid_argument: the text is something else.
Result<HostPort> parse_host_port(const std::string& text);

std::string host_port_text(const HostPort& peer);  // the inverse of parse_host_port()
// Returns the host of a URL, without brackets.
std::string host_of(const std::string& url);
bool is_loopback(const std::string& host);

class TcpConnection {
 public:
  // unavailable: nobody answered within some seconds; the message is the system's reason.
  static Result<TcpConnection> open(const HostPort& peer);
  // Sends all bytes. unavailable: the connection is closed, or the peer takes nothing for half a minute.
  Result<void> send(std::span<const std::byte> bytes);

 private:
  explicit TcpConnection(std::unique_ptr<Descriptor> socket) : socket_(std::move(socket)) {}
  std::unique_ptr<Descriptor> socket_;
};

}  // namespace ls::cli
