#include "coordinator/http/net/http_server.h"

#include <fmt/format.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "common/base/log.h"
#include "common/base/parse_number.h"
#include "coordinator/http/net/connection.h"

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
  std::unique_ptr<net::thread_pool> quick, slow, bundles, remote;
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

void refuse(Tcp::socket& socket) {
  error_code ignored;
  socket.non_blocking(true, ignored);
  // The whole answer fits into the send buffer, which is empty: write_some() sends all of it.
  socket.write_some(net::buffer(kFull.data(), kFull.size()), ignored);
}

// Closes an idle connection to make room for a new one.
bool make_room(Shared& shared) {
  for (Connection* connection : shared.open) {
    if (!connection->idle()) continue;
    connection->cut();
    return true;
  }
  return false;
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
    if (shared->open.size() >= shared->api.limits().connections && !make_room(*shared)) {
      refuse(socket);
      continue;
    }
    socket.set_option(Tcp::no_delay(true), ec);
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
  s.quick = std::make_unique<net::thread_pool>(static_cast<std::size_t>(api.limits().quick_threads));
  s.slow = std::make_unique<net::thread_pool>(static_cast<std::size_t>(api.limits().slow_threads));
  s.bundles = std::make_unique<net::thread_pool>(static_cast<std::size_t>(api.limits().bundle_threads));
  s.remote = std::make_unique<net::thread_pool>(static_cast<std::size_t>(api.limits().remote_threads));
  s.shared = std::make_unique<Shared>(
      Shared{s.io, *s.quick, *s.slow, *s.bundles, *s.remote, api, {}, 0, 0, 0, false});
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
  for (const auto* pool : {&s.quick, &s.slow, &s.bundles, &s.remote}) (*pool)->join();
  state_.reset();  // destroys the coroutine frames of closed connections, which use the Api
}

}  // namespace ls::http
