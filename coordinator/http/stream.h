// A client's socket, as it is or under TLS: the one door to libssl on the HTTP side. Without TLS nothing of
// it runs. Includes Boost.
#pragma once

#include <array>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <functional>
#include <memory>
#include <string>

#include "coordinator/http/tls_identity.h"

namespace ls::http {

// Used by the network thread only. Read and write may each have one call under way at a time.
class Stream {
 public:
  using Tcp = boost::asio::ip::tcp;
  using Code = boost::system::error_code;
  template <class T>
  using Awaitable = boost::asio::awaitable<T>;

  Stream(Tcp::socket socket, std::shared_ptr<const TlsIdentity> identity);  // null: no TLS
  ~Stream();

  enum class Opened { ready, plain_text, failed };
  // The handshake; at once without TLS. plain_text: the client speaks no TLS; what is written then goes out
  // as it is, so that it can be told. Ends early when cancelled.
  Awaitable<Opened> open();

  Awaitable<std::size_t> read_some(boost::asio::mutable_buffer into, Code& ec);
  Awaitable<std::size_t> write_some(const std::array<boost::asio::const_buffer, 2>& from, Code& ec);
  void read_in_background(boost::asio::mutable_buffer into, std::function<void()> came);

  void cancel();  // what waits ends with an error; the stream stays open
  void close();
  Awaitable<void> say_goodbye();  // nothing more is written: TLS's own goodbye, then the socket's

  std::string peer() const { return peer_; }  // address without port

 private:
  struct Tls;
  Tcp::socket& socket();
  std::string peer_;
  std::unique_ptr<Tcp::socket> plain_;  // one of the two
  std::shared_ptr<Tls> tls_;            // shared with a read in the background, which touches it when it ends
  bool through_tls_ = false;            // after the handshake, until the goodbye
};

}  // namespace ls::http
