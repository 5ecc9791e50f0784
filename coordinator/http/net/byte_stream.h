// A client's socket, plain or with TLS, as a stream that the algorithms of Asio and Beast read and write. No
// other part of the server loop uses libssl, and without TLS no libssl code runs. Includes Boost.
#pragma once

#include <boost/asio/async_result.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "coordinator/http/net/http_server.h"

namespace ls::http {

namespace net = boost::asio;
using Tcp = net::ip::tcp;
using boost::system::error_code;

// The completion token for an operation that is awaited with co_await: a failed operation sets `ec` and does
// not throw.
inline auto awaiting(error_code& ec) { return net::redirect_error(net::use_awaitable, ec); }

// A client's connection. Only the network thread may use it; at most one read and one write may be in
// progress.
class Stream {
 public:
  Stream(Tcp::socket socket, std::shared_ptr<const TlsIdentity> identity);  // `identity` null: no TLS

  enum class Opened { ready, plain_text, failed };
  // Does the TLS handshake; without TLS it has nothing to do and returns `ready`. plain_text: the client
  // speaks no TLS; further writes are sent in plain text, so that an error can be reported to the client.
  // cancel() ends the handshake early, with `failed`.
  net::awaitable<Opened> open();

  using executor_type = Tcp::socket::executor_type;
  executor_type get_executor() { return socket_.get_executor(); }

  // The return type of a read or a write with this completion token.
  template <class Token>
  using Started = typename net::async_result<std::decay_t<Token>, void(error_code, std::size_t)>::return_type;
  template <class Buffers, class Token>
  Started<Token> async_read_some(const Buffers& into, Token&& token) {
    if (through_tls_) return tls_->async_read_some(into, std::forward<Token>(token));
    return socket_.async_read_some(into, std::forward<Token>(token));
  }
  template <class Buffers, class Token>
  Started<Token> async_write_some(const Buffers& from, Token&& token) {
    if (through_tls_) return tls_->async_write_some(from, std::forward<Token>(token));
    return socket_.async_write_some(from, std::forward<Token>(token));
  }

  void cancel();  // ends pending operations with an error; the stream stays open
  void close();
  net::awaitable<void> send_goodbye();  // ends writing: closes TLS, then the socket's sending side

  bool peer_has_left();  // true: the client has ended or closed the connection

  std::string peer() const { return peer_; }  // address without port

 private:
  std::string peer_;
  Tcp::socket socket_;
  std::shared_ptr<const TlsIdentity> identity_;
  std::optional<net::ssl::stream<Tcp::socket&>> tls_;
  bool through_tls_ = false;  // true from the end of the TLS handshake until send_goodbye()
};

}  // namespace ls::http
