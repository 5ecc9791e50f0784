#include "coordinator/http/net/byte_stream.h"

#include <fmt/format.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <poll.h>

#include <boost/asio/ssl/context.hpp>

namespace ls::http {
namespace {

namespace ssl = net::ssl;

constexpr unsigned char kHandshakeRecord = 22;  // the first byte that every TLS client sends

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

TlsIdentity::TlsIdentity(std::unique_ptr<Context> context) : context_(std::move(context)) {}
TlsIdentity::~TlsIdentity() = default;

Result<std::shared_ptr<const TlsIdentity>> TlsIdentity::make(const std::string& cert,
                                                             const std::string& key) {
  auto context = std::make_unique<Context>();
  SSL_CTX* raw = context->ssl.native_handle();
  error_code ec;
  SSL_CTX_set_min_proto_version(raw, TLS1_2_VERSION);
  // Renegotiation is disabled: with it a client could occupy the network thread with endless key exchanges.
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

Stream::Stream(Tcp::socket socket, std::shared_ptr<const TlsIdentity> identity)
    : socket_(std::move(socket)), identity_(std::move(identity)) {
  error_code ec;
  const auto remote = socket_.remote_endpoint(ec);
  if (!ec) peer_ = remote.address().to_string();
  if (identity_) tls_.emplace(socket_, identity_->context_->ssl);
}

net::awaitable<Stream::Opened> Stream::open() {
  if (!tls_) co_return Opened::ready;
  error_code ec;
  unsigned char first = 0;
  co_await socket_.async_receive(net::buffer(&first, 1), Tcp::socket::message_peek, awaiting(ec));
  if (ec) co_return Opened::failed;
  if (first != kHandshakeRecord) co_return Opened::plain_text;
  co_await tls_->async_handshake(ssl::stream_base::server, awaiting(ec));
  through_tls_ = !ec;
  co_return ec ? Opened::failed : Opened::ready;
}

void Stream::cancel() {
  error_code ignored;
  socket_.cancel(ignored);
}

bool Stream::peer_has_left() {
  // This way the end of the connection is also seen behind bytes that nobody has read yet.
  pollfd asked{socket_.native_handle(), POLLRDHUP, 0};
  return ::poll(&asked, 1, 0) == 1;
}

void Stream::close() {
  error_code ignored;
  socket_.close(ignored);
}

net::awaitable<void> Stream::send_goodbye() {
  error_code ec;
  if (through_tls_) {
    // Does not wait for the client's close_notify (the end of the stream in TLS), since the end of the TCP
    // connection is sufficient. Bytes that still arrive are read without TLS and discarded.
    SSL* raw = tls_->native_handle();
    SSL_set_shutdown(raw, SSL_get_shutdown(raw) | SSL_RECEIVED_SHUTDOWN);
    co_await tls_->async_shutdown(awaiting(ec));
    through_tls_ = false;
  }
  socket_.shutdown(Tcp::socket::shutdown_send, ec);
}

}  // namespace ls::http
