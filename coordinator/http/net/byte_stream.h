// Reads and writes a client's socket, plain or with TLS; the only user of libssl in the HTTP server. Without
// TLS no libssl code runs. Includes Boost.
#pragma once

#include <array>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <functional>
#include <memory>
#include <string>

#include "coordinator/http/net/tls_identity.h"

namespace ls::http {

// Used by the network thread only. One read and one write may be in progress at a time.
class Stream {
 public:
  using Tcp = boost::asio::ip::tcp;
  using Code = boost::system::error_code;
  template <class T>
  using Awaitable = boost::asio::awaitable<T>;

  Stream(Tcp::socket socket, std::shared_ptr<const TlsIdentity> identity);  // null: no TLS
  ~Stream();

  enum class Opened { ready, plain_text, failed };
  // Does the TLS handshake; without TLS it has nothing to do and returns `ready`. plain_text: the client
  // speaks no TLS; further writes are sent in plain text, so that an error can be reported to the client.
  // After cancel() it ends early.
  Awaitable<Opened> open();

  Awaitable<std::size_t> read_some(boost::asio::mutable_buffer into, Code& ec);
  Awaitable<std::size_t> write_some(const std::array<boost::asio::const_buffer, 2>& from, Code& ec);
  void read_in_background(boost::asio::mutable_buffer into, std::function<void()> came);

  void cancel();  // pending operations end with an error; the stream stays open
  void close();
  Awaitable<void> send_goodbye();  // ends writing: closes TLS, then the socket's sending side

  std::string peer() const { return peer_; }  // address without port

 private:
  struct Tls;
  Tcp::socket& socket();
  std::string peer_;
  std::unique_ptr<Tcp::socket> plain_;  // exactly one of plain_ and tls_ is set
  std::shared_ptr<Tls> tls_;            // shared with a background read, which uses it when it ends
  bool through_tls_ = false;            // between handshake and goodbye
};

}  // namespace ls::http
