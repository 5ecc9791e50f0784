#include "coordinator/http/net/http_server.h"

#include <fmt/format.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>

#include "coordinator/http/net/connection.h"
#include "core/base/log.h"
#include "core/base/parse_number.h"

namespace ls::http {
namespace {

constexpr std::string_view kFull =
    "HTTP/1.1 503 Service Unavailable\r\nContent-Type: application/problem+json\r\nContent-Length: 106\r\n"
    "Retry-After: 2\r\nConnection: close\r\n\r\n"
    R"({"type":"about:blank","title":"Service Unavailable","status":503,"detail":"too many connections are open"})";

struct Address {
  std::string host, port;
};

Result<Address> parse_address(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  const auto wrong = [&] {
    return fail(Errc::invalid_argument,
                fmt::format("'{}' is no address: write ADDR:PORT, e.g. 127.0.0.1:8080", text));
  };
  if (colon == std::string::npos || colon == 0) return wrong();
  Address address{text.substr(0, colon), text.substr(colon + 1)};
  if (address.host.front() == '[' && address.host.back() == ']')
    address.host = address.host.substr(1, address.host.size() - 2);
  if (!parse_number<std::uint16_t>(address.port)) return wrong();
  return address;
}

}  // namespace

struct Server::State {
  // The order of these members matters: destroying `io` destroys the coroutines' frames, which may use the
  // members declared before `io`. Those are destroyed after `io`.
  std::unique_ptr<Shared> shared;
  net::io_context io{1};
  net::executor_work_guard<net::io_context::executor_type> work{io.get_executor()};
  Tcp::acceptor acceptor{io};
  std::shared_ptr<const TlsIdentity> tls;
  std::thread thread;

  std::mutex mutex;
  std::condition_variable all_closed;
  bool stopping = false, none_open = false;  // guarded by the mutex

  net::awaitable<void> accept_loop();
  net::awaitable<void> run(std::unique_ptr<Connection> connection);
  void report_if_empty();
};

namespace {

// Tells the client that there is no room. On a port with TLS the connection is closed without a word, since
// the client would take plain text for a broken handshake.
void refuse(Tcp::socket& socket, bool tls) {
  if (tls) return;
  error_code ignored;
  socket.non_blocking(true, ignored);
  // The whole answer fits into the send buffer, which is empty: write_some() sends all of it.
  socket.write_some(net::buffer(kFull.data(), kFull.size()), ignored);
}

// How long a new connection may take to send its first request before it yields to others from its address.
constexpr double kNewcomerSeconds = 1;

// Closes the oldest of the connections that may yield, of the client that has most of these.
bool make_room(Shared& shared) {
  std::map<std::string, std::size_t> many;
  for (const Connection* connection : shared.open)
    if (connection->may_yield()) ++many[connection->client()];
  Connection* oldest = nullptr;
  for (Connection* connection : shared.open) {
    if (!connection->may_yield()) continue;
    const auto better = [&] {
      const std::size_t a = many[connection->client()], b = many[oldest->client()];
      return a != b ? a > b : connection->opened() < oldest->opened();
    };
    if (oldest == nullptr || better()) oldest = connection;
  }
  if (oldest != nullptr) oldest->cut();
  return oldest != nullptr;
}

// True if a connection from this address may come. One address may have connections_of_address connections on
// which nobody has shown a token; the oldest of them yields to a new one, unless it is new itself.
bool make_room_for(Shared& shared, const std::string& address) {
  std::size_t strangers = 0;
  Connection* oldest = nullptr;
  for (Connection* connection : shared.open) {
    if (connection->known() || connection->client() != address) continue;
    ++strangers;
    if (connection->may_yield() && (oldest == nullptr || connection->opened() < oldest->opened()))
      oldest = connection;
  }
  if (strangers >= shared.api.limits().connections_of_address) {
    if (oldest == nullptr) return false;
    if (oldest->older_than(kNewcomerSeconds)) {
      oldest->cut();
      return true;
    }
  }
  return shared.open.size() < shared.api.limits().connections || make_room(shared);
}

std::string address_of(const Tcp::socket& socket) {
  error_code ec;
  const auto remote = socket.remote_endpoint(ec);
  return ec ? std::string() : Throttle::group_of(remote.address().to_string());
}

// Without this limit the send buffer of a loopback connection (ssh -L, a reverse proxy) takes bytes in steps
// of nearly 1 MB, between which a client of less than 60 KB/s shows no progress for longer than the grace
// time.
void show_progress_in_small_steps(Tcp::socket& socket) {
  const int unsent_bytes = 128 << 10;
  ::setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &unsent_bytes, sizeof unsent_bytes);
}

}  // namespace

net::awaitable<void> Server::State::accept_loop() {
  net::steady_timer pause(io);
  while (!shared->stopping) {
    error_code ec;
    Tcp::socket socket = co_await acceptor.async_accept(awaiting(ec));
    if (shared->stopping) co_return;
    if (ec) {  // probably there are no file descriptors left: wait until some are closed
      log_warn("", fmt::format("cannot accept an HTTP connection: {}", ec.message()));
      pause.expires_after(std::chrono::milliseconds(100));
      co_await pause.async_wait(awaiting(ec));
      continue;
    }
    if (!make_room_for(*shared, address_of(socket))) {
      refuse(socket, tls != nullptr);
      continue;
    }
    socket.set_option(Tcp::no_delay(true), ec);
    show_progress_in_small_steps(socket);
    net::co_spawn(io, run(std::make_unique<Connection>(std::move(socket), tls, *shared)), net::detached);
  }
}

net::awaitable<void> Server::State::run(std::unique_ptr<Connection> connection) {
  co_await connection->serve();
  connection.reset();
  report_if_empty();
}

void Server::State::report_if_empty() {
  const std::lock_guard lock(mutex);
  none_open = shared->open.empty();
  if (none_open) all_closed.notify_all();
}

Server::Server(std::unique_ptr<State> state) : state_(std::move(state)) {}
Server::~Server() { stop(); }

Result<std::unique_ptr<Server>> Server::listen(const std::string& address) {
  const auto parsed = parse_address(address);
  if (!parsed) return tl::unexpected(parsed.error());
  auto state = std::make_unique<State>();
  error_code ec;
  Tcp::resolver resolver(state->io);
  const auto found = resolver.resolve(parsed->host, parsed->port, Tcp::resolver::passive, ec);
  if (ec || found.empty())
    return fail(Errc::invalid_argument,
                fmt::format("'{}' is no address of this machine: {}", address, ec.message()));
  const Tcp::endpoint endpoint = found.begin()->endpoint();
  auto& acceptor = state->acceptor;
  acceptor.open(endpoint.protocol(), ec);
  // SO_REUSEADDR allows binding to a port that an earlier process has just released; a second listener still
  // fails.
  if (!ec) acceptor.set_option(Tcp::acceptor::reuse_address(true), ec);
  if (!ec) acceptor.bind(endpoint, ec);
  if (!ec) acceptor.listen(net::socket_base::max_listen_connections, ec);
  if (ec == net::error::address_in_use)
    return fail(
        Errc::already_exists,
        fmt::format(
            "cannot listen for HTTP on {}: another program uses this port. Stop it, or choose another "
            "with --http ADDR:PORT (port 0: any)",
            address));
  if (ec)
    return fail(Errc::unavailable, fmt::format("cannot listen for HTTP on {}: {}", address, ec.message()));
  return std::unique_ptr<Server>(new Server(std::move(state)));
}

int Server::port() const {
  error_code ignored;
  return state_->acceptor.local_endpoint(ignored).port();
}

void Server::start(Api& api, std::shared_ptr<const TlsIdentity> tls) {
  State& s = *state_;
  s.tls = std::move(tls);
  s.shared = std::make_unique<Shared>(s.io, api);
  net::co_spawn(s.io, s.accept_loop(), net::detached);
  s.thread = std::thread([&s] { s.io.run(); });
}

void Server::stop() {
  if (state_ == nullptr || !state_->thread.joinable()) return;
  State& s = *state_;
  net::post(s.io, [&s] {
    s.shared->stopping = true;
    error_code ignored;
    s.acceptor.close(ignored);
    for (Connection* connection : std::set<Connection*>(s.shared->open)) connection->wind_down();
    s.report_if_empty();
  });
  {
    std::unique_lock lock(s.mutex);
    const auto limit = steady_seconds(s.shared->api.limits().stop_seconds);
    s.all_closed.wait_for(lock, limit, [&s] { return s.none_open; });
  }
  s.shared->api.ask_to_stop();
  s.io.stop();
  s.thread.join();
  for (Pool* pool : {&s.shared->quick, &s.shared->slow, &s.shared->bundles, &s.shared->remote}) {
    pool->threads.join();
    pool->turns.close();
  }
  state_.reset();  // destroys the coroutine frames of closed connections, which use the Api
}

}  // namespace ls::http
