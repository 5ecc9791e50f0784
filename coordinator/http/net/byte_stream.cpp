#include "coordinator/http/net/byte_stream.h"

#include <fmt/format.h>
#include <openssl/err.h>
#include <openssl/ssl.h>

#include <boost/asio/redirect_error.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace ls::http {
namespace {

namespace net = boost::asio;
namespace ssl = boost::asio::ssl;

constexpr unsigned char kHandshakeRecord = 22;  // the first byte of any TLS client

std::string last_error() {
  const unsigned long code = ERR_get_error();
  const char* reason = code == 0 ? nullptr : ERR_reason_error_string(code);
  ERR_clear_error();
  return reason == nullptr ? "unknown reason" : reason;
}

}  // namespace

struct TlsIdentity::Context {
  mutable ssl::context ssl{ssl::context::tls_server};
};

struct Stream::Tls {
  Tls(Tcp::socket socket, std::shared_ptr<const TlsIdentity> id)
      : identity(std::move(id)), stream(std::move(socket), identity->context_->ssl) {}
  std::shared_ptr<const TlsIdentity> identity;
  ssl::stream<Tcp::socket> stream;
};

TlsIdentity::TlsIdentity(std::unique_ptr<Context> context) : context_(std::move(context)) {}
TlsIdentity::~TlsIdentity() = default;

Result<std::shared_ptr<const TlsIdentity>> TlsIdentity::make(const std::string& cert,
                                                             const std::string& key) {
  auto context = std::make_unique<Context>();
  SSL_CTX* raw = context->ssl.native_handle();
  boost::system::error_code ec;
  SSL_CTX_set_min_proto_version(raw, TLS1_2_VERSION);
  // No renegotiation: a client could make the network thread do endless key exchanges.
  SSL_CTX_set_options(raw, SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION | SSL_OP_CIPHER_SERVER_PREFERENCE);
  SSL_CTX_set_mode(raw, SSL_MODE_RELEASE_BUFFERS);  // saves 34 KB per idle connection
  // A key with a password is rejected; otherwise OpenSSL would ask for it on the terminal.
  context->ssl.set_password_callback(
      [](std::size_t, ssl::context::password_purpose) { return std::string(); }, ec);
  context->ssl.use_certificate_chain(net::buffer(cert), ec);
  if (ec)
    return fail(Errc::invalid_argument, fmt::format("the TLS certificate cannot be used: {}", ec.message()));
  context->ssl.use_private_key(net::buffer(key), ssl::context::pem, ec);
  if (!ec && SSL_CTX_check_private_key(raw) == 1)
    return std::shared_ptr<const TlsIdentity>(new TlsIdentity(std::move(context)));
  return fail(Errc::invalid_argument, fmt::format("the TLS key cannot be used with the certificate: {}",
                                                  ec ? ec.message() : last_error()));
}

Stream::Stream(Tcp::socket socket, std::shared_ptr<const TlsIdentity> identity) {
  Code ec;
  const auto remote = socket.remote_endpoint(ec);
  if (!ec) peer_ = remote.address().to_string();
  if (identity)
    tls_ = std::make_shared<Tls>(std::move(socket), std::move(identity));
  else
    plain_ = std::make_unique<Tcp::socket>(std::move(socket));
}
Stream::~Stream() { close(); }

Stream::Tcp::socket& Stream::socket() { return tls_ ? tls_->stream.next_layer() : *plain_; }

Stream::Awaitable<Stream::Opened> Stream::open() {
  if (!tls_) co_return Opened::ready;
  Code ec;
  unsigned char first = 0;
  co_await socket().async_receive(net::buffer(&first, 1), Tcp::socket::message_peek,
                                  net::redirect_error(net::use_awaitable, ec));
  if (ec) co_return Opened::failed;
  if (first != kHandshakeRecord) co_return Opened::plain_text;
  co_await tls_->stream.async_handshake(ssl::stream_base::server,
                                        net::redirect_error(net::use_awaitable, ec));
  through_tls_ = !ec;
  co_return ec ? Opened::failed : Opened::ready;
}

Stream::Awaitable<std::size_t> Stream::read_some(net::mutable_buffer into, Code& ec) {
  if (through_tls_)
    co_return co_await tls_->stream.async_read_some(into, net::redirect_error(net::use_awaitable, ec));
  co_return co_await socket().async_read_some(into, net::redirect_error(net::use_awaitable, ec));
}

Stream::Awaitable<std::size_t> Stream::write_some(const std::array<net::const_buffer, 2>& from, Code& ec) {
  if (through_tls_)
    co_return co_await tls_->stream.async_write_some(from, net::redirect_error(net::use_awaitable, ec));
  co_return co_await socket().async_write_some(from, net::redirect_error(net::use_awaitable, ec));
}

void Stream::read_in_background(net::mutable_buffer into, std::function<void()> came) {
  auto done = [came = std::move(came), keep = tls_](Code, std::size_t) { came(); };
  if (through_tls_)
    tls_->stream.async_read_some(into, std::move(done));
  else
    socket().async_read_some(into, std::move(done));
}

void Stream::cancel() {
  Code ignored;
  socket().cancel(ignored);
}

void Stream::close() {
  Code ignored;
  socket().close(ignored);
}

Stream::Awaitable<void> Stream::send_goodbye() {
  Code ec;
  if (through_tls_) {
    // Do not wait for the client's close_notify (TLS's own end of the stream): the end of the socket shows
    // the same. Bytes that still arrive are read without TLS and thrown away.
    SSL* raw = tls_->stream.native_handle();
    SSL_set_shutdown(raw, SSL_get_shutdown(raw) | SSL_RECEIVED_SHUTDOWN);
    co_await tls_->stream.async_shutdown(net::redirect_error(net::use_awaitable, ec));
    through_tls_ = false;
  }
  socket().shutdown(Tcp::socket::shutdown_send, ec);
}

}  // namespace ls::http
