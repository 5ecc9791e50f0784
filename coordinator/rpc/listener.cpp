#include "coordinator/rpc/listener.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <linux/tcp.h>
#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <map>
#include <thread>
#include <utility>
#include <vector>

#include "coordinator/rpc/join_guard.h"
#include "coordinator/rpc/port_watch.h"
#include "core/base/guarded.h"
#include "core/base/log.h"
#include "core/base/parse_number.h"
#include "util/protocol/limits.h"

namespace ls::coordinator::rpc {

// An open file, closed by its destructor.
class File {
 public:
  explicit File(int fd = -1) : fd_(fd) {}
  File(File&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  File& operator=(File&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~File() { close(); }
  int get() const { return fd_; }
  int release() { return std::exchange(fd_, -1); }
  void close() {
    if (fd_ >= 0) ::close(std::exchange(fd_, -1));
  }
  explicit operator bool() const { return fd_ >= 0; }

 private:
  int fd_;
};

namespace {

// How often the bytes and the age of unmet connections are looked at
constexpr std::chrono::milliseconds kLook{20};
// How long nothing is accepted after accept() failed for want of something else than files
constexpr Duration kPause = std::chrono::milliseconds(100);
// Connections accepted in a row before others are looked at
constexpr int kAcceptedAtOnce = 64;
// Least time between two lines of the log about connections that were refused or closed
constexpr Duration kReportEvery = std::chrono::seconds(10);
constexpr int kReportWaitMs = 1'000;
// gRPC parses what it has read at once to its end, even if the connection is closed meanwhile, and an endless
// header takes it a time that grows as the square of its length. So an unmet connection may send little
// ahead. A met one may send as much as the system allows.
constexpr int kUnmetWindow = 16 << 10, kMetWindow = 1 << 30;
constexpr int kBacklog = 1024;
// Files kept open only to be closed when the process may open no more: then connections can still be accepted
// and closed, instead of waiting for ever.
constexpr std::size_t kReserve = 4;
// Ids of epoll events that are no connection's
constexpr std::uint64_t kWake = 0, kFirstPort = 1, kFirstConnection = 1024;

struct Address {
  sockaddr_storage storage{};
  socklen_t length = sizeof(sockaddr_storage);
  sockaddr* get() { return reinterpret_cast<sockaddr*>(&storage); }
  const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&storage); }
  int port() const {
    return ntohs(storage.ss_family == AF_INET6 ? reinterpret_cast<const sockaddr_in6&>(storage).sin6_port
                                               : reinterpret_cast<const sockaddr_in&>(storage).sin_port);
  }
  void set_port(int port) {
    if (storage.ss_family == AF_INET6)
      reinterpret_cast<sockaddr_in6&>(storage).sin6_port = htons(static_cast<std::uint16_t>(port));
    else
      reinterpret_cast<sockaddr_in&>(storage).sin_port = htons(static_cast<std::uint16_t>(port));
  }
};

std::string key_of(std::string_view address, std::string_view port) {
  return fmt::format("{} {}", address.substr(0, address.find('%')), port);  // without the IPv6 scope
}

// Returns the name of a connection as key_of_peer() makes it of gRPC's name for the same connection.
ConnectionTable::Guest guest_of(const Address& from) {
  char text[INET6_ADDRSTRLEN] = "?";
  const std::string port = std::to_string(from.port());
  if (from.storage.ss_family != AF_INET6) {
    ::inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in&>(from.storage).sin_addr, text, sizeof text);
    return {key_of(text, port), text};
  }
  in6_addr six = reinterpret_cast<const sockaddr_in6&>(from.storage).sin6_addr;
  if (IN6_IS_ADDR_V4MAPPED(&six)) {
    ::inet_ntop(AF_INET, six.s6_addr + 12, text, sizeof text);
    return {key_of(text, port), text};
  }
  ::inet_ntop(AF_INET6, &six, text, sizeof text);
  const std::string key = key_of(text, port);
  std::fill(six.s6_addr + 8, six.s6_addr + 16, 0);
  ::inet_ntop(AF_INET6, &six, text, sizeof text);
  return {key, fmt::format("{}/64", text)};
}

std::string key_of_peer(std::string_view grpc_peer) {
  const std::string address = address_of_peer(grpc_peer);
  return key_of(address, grpc_peer.substr(grpc_peer.rfind(':') + 1));
}

bool is_any(const Address& address) {
  if (address.storage.ss_family == AF_INET6)
    return IN6_IS_ADDR_UNSPECIFIED(&reinterpret_cast<const sockaddr_in6&>(address.storage).sin6_addr);
  return reinterpret_cast<const sockaddr_in&>(address.storage).sin_addr.s_addr == INADDR_ANY;
}

Result<std::vector<Address>> resolve(const std::string& text) {
  const auto wrong = [&](std::string_view why) {
    return fail(Errc::invalid_argument,
                fmt::format("--grpc '{}' is no address: write ADDR:PORT, e.g. 127.0.0.1:50051{}", text, why));
  };
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) return wrong("");
  std::string host = text.substr(0, colon);
  const std::string port = text.substr(colon + 1);
  if (!parse_number<std::uint16_t>(port)) return wrong("");
  if (host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  addrinfo hints{}, *found = nullptr;
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  if (const int code = ::getaddrinfo(host.c_str(), port.c_str(), &hints, &found); code != 0)
    return wrong(fmt::format(" ({})", ::gai_strerror(code)));
  std::vector<Address> addresses;
  for (const addrinfo* each = found; each != nullptr; each = each->ai_next) {
    Address address;
    std::memcpy(&address.storage, each->ai_addr, each->ai_addrlen);
    address.length = each->ai_addrlen;
    const auto same = [&](const Address& other) {
      return other.length == address.length && std::memcmp(other.get(), address.get(), address.length) == 0;
    };
    if (std::ranges::none_of(addresses, same)) addresses.push_back(address);
  }
  ::freeaddrinfo(found);
  return addresses;
}

// Returns a listening socket; none, with errno, if the address cannot be had. `both`: an IPv6 socket also
// takes IPv4.
File listen_on(const Address& address, bool both) {
  File file(::socket(address.storage.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!file) return file;
  const int on = 1, only = both ? 0 : 1;
  // Allows a port that an earlier process has just released; a second listener still fails
  ::setsockopt(file.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (address.storage.ss_family == AF_INET6)
    ::setsockopt(file.get(), IPPROTO_IPV6, IPV6_V6ONLY, &only, sizeof only);
  // Accepted sockets inherit these, which gRPC sets where it listens itself: small messages are sent at once,
  // and a peer that acknowledges nothing is given up.
  ::setsockopt(file.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  ::setsockopt(file.get(), IPPROTO_TCP, TCP_USER_TIMEOUT, &ls::limits::kKeepaliveTimeoutMs,
               sizeof ls::limits::kKeepaliveTimeoutMs);
  if (::bind(file.get(), address.get(), address.length) == 0 && ::listen(file.get(), kBacklog) == 0)
    return file;
  const int why = errno;
  file.close();
  errno = why;
  return file;
}

Address local_address(const File& socket) {
  Address address;
  ::getsockname(socket.get(), address.get(), &address.length);
  return address;
}

// Ends the connection, also for gRPC, which has its socket under another number. What has arrived and was not
// read is dropped: gRPC would read it first. The peer gets a reset: without one, a peer that waits to
// send more would not notice.
void cut(const File& socket) {
  const linger reset{1, 0};
  ::setsockopt(socket.get(), SOL_SOCKET, SO_LINGER, &reset, sizeof reset);
  ::shutdown(socket.get(), SHUT_RDWR);
  while (::recv(socket.get(), nullptr, 1 << 30, MSG_TRUNC | MSG_DONTWAIT) > 0) {
  }
}

// Limits how many bytes the peer may send that gRPC has not read yet.
void limit_window(const File& socket, int bytes) {
  ::setsockopt(socket.get(), IPPROTO_TCP, TCP_WINDOW_CLAMP, &bytes, sizeof bytes);
}

std::uint64_t bytes_received(const File& socket) {
  tcp_info info{};
  socklen_t length = sizeof info;
  return ::getsockopt(socket.get(), IPPROTO_TCP, TCP_INFO, &info, &length) == 0 ? info.tcpi_bytes_received
                                                                                : 0;
}

}  // namespace

std::size_t connections_for(std::uint64_t files) {
  const std::uint64_t ours = std::max(files / 2, files > 1024 ? files - 1024 : 0);
  return static_cast<std::size_t>(std::max<std::uint64_t>(1, ours / 2));
}

struct Listener::State {
  struct Open {
    explicit Open(const ConnectionTable::Limits& limits) : table(limits) {}
    ConnectionTable table;
    std::map<ConnectionTable::Id, File> files;  // a second descriptor of each connection
  };

  explicit State(const ConnectionTable::Limits& limits) : open(limits) {}

  bool watch(int fd, std::uint64_t id, std::uint32_t events) const {
    epoll_event event{};
    event.events = events;
    event.data.u64 = id;
    return ::epoll_ctl(poll.get(), EPOLL_CTL_ADD, fd, &event) == 0;
  }
  void run(const std::stop_token& token);
  void accept_some(const File& port);
  bool accept_one(const File& port);  // false: there is nothing to accept, or that is impossible now
  int refuse_one(const File& port);   // 0: one was refused; else why not, as in errno
  void pause(int why);
  void rouse() const;  // wakes the thread
  void refill_reserve();
  void admit(File socket, const Address& from);
  void look();
  bool report();  // true: there is something to report, but not yet

  const SystemClock clock;
  std::vector<File> ports;
  File poll, wake;
  std::vector<File> reserve;
  TakeSocket take;
  Guarded<Open> open;
  ConnectionTable::Id next_id = kFirstConnection;  // this and the following: used by the thread alone
  std::optional<TimePoint> paused_until;
  TimePoint reported{};
  std::array<std::uint64_t, kClosedReasons> reported_counts{};
  std::jthread thread;
};

Listener::Listener(std::shared_ptr<State> state) : state_(std::move(state)) {}
Listener::~Listener() { stop(); }

Result<std::unique_ptr<Listener>> Listener::open(const std::string& address, ConnectionTable::Limits limits) {
  auto addresses = resolve(address);
  if (!addresses) return tl::unexpected(addresses.error());
  auto state = std::make_shared<State>(limits);
  int why = 0;
  // 0.0.0.0 and :: are one wish: all addresses. An IPv6 socket takes both kinds, where the machine has IPv6.
  if (is_any(addresses->front())) {
    Address any;
    any.storage.ss_family = AF_INET6;
    any.length = sizeof(sockaddr_in6);
    any.set_port(addresses->front().port());
    if (File both = listen_on(any, true)) {
      state->ports.push_back(std::move(both));
      addresses->clear();
    } else if (errno == EADDRINUSE) {
      why = errno;
      addresses->clear();
    }
  }
  for (Address& each : *addresses) {
    // Where the system chooses the port, the other addresses get the same one if it is free there
    const bool chosen = each.port() == 0 && !state->ports.empty();
    if (chosen) each.set_port(local_address(state->ports.front()).port());
    if (File port = listen_on(each, false)) {
      state->ports.push_back(std::move(port));
    } else if (why = errno; why == EADDRINUSE && !chosen) {
      state->ports.clear();
      break;
    }
  }
  if (state->ports.empty())
    return fail(Errc::unavailable,
                fmt::format("cannot listen for workers on {}: {}: the port is taken (another coordinator?) "
                            "or the address is not this machine's; choose another with --grpc",
                            address, std::strerror(why)));
  state->poll = File(::epoll_create1(EPOLL_CLOEXEC));
  state->wake = File(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  bool ready = state->poll && state->wake && state->watch(state->wake.get(), kWake, EPOLLIN);
  for (std::size_t i = 0; i < state->ports.size(); ++i)
    ready = ready && state->watch(state->ports[i].get(), kFirstPort + i, EPOLLIN);
  state->refill_reserve();
  if (!ready || state->reserve.size() < kReserve)
    return fail(Errc::unavailable,
                fmt::format("cannot listen for workers on {}: {}", address, std::strerror(errno)));
  return std::unique_ptr<Listener>(new Listener(std::move(state)));
}

int Listener::port() const { return state_->ports.empty() ? 0 : local_address(state_->ports.front()).port(); }

void Listener::start(TakeSocket take) {
  state_->take = std::move(take);
  state_->thread = std::jthread([state = state_.get()](const std::stop_token& token) { state->run(token); });
}

void Listener::stop() {
  if (!state_->thread.joinable()) return;
  state_->thread.request_stop();
  state_->rouse();
  state_->thread.join();
  state_->ports.clear();
}

void Listener::State::run(const std::stop_token& token) {
  std::array<epoll_event, 128> events;
  bool unreported = false;
  while (!token.stop_requested()) {
    const bool soon = !open.lock()->table.unmet().empty() || paused_until;
    const auto wait = soon ? static_cast<int>(kLook.count()) : unreported ? kReportWaitMs : -1;
    const int many = ::epoll_wait(poll.get(), events.data(), static_cast<int>(events.size()), wait);
    if (token.stop_requested()) return;
    if (paused_until && clock.now() >= *paused_until) {
      paused_until.reset();
      for (std::size_t i = 0; i < ports.size(); ++i) watch(ports[i].get(), kFirstPort + i, EPOLLIN);
      refill_reserve();
    }
    for (int i = 0; i < many; ++i) {
      const std::uint64_t id = events[static_cast<std::size_t>(i)].data.u64;
      if (id == kWake) {
        std::uint64_t times = 0;
        [[maybe_unused]] const auto read = ::read(wake.get(), &times, sizeof times);
        continue;
      }
      if (id < kFirstConnection) {
        if (!paused_until) accept_some(ports[id - kFirstPort]);
        continue;
      }
      const auto now_open = open.lock();
      now_open->table.gone(id);
      const auto file = now_open->files.find(id);
      if (file == now_open->files.end()) continue;
      // Closing it would not end its events while gRPC has the socket open under its own number
      ::epoll_ctl(poll.get(), EPOLL_CTL_DEL, file->second.get(), nullptr);
      now_open->files.erase(file);
    }
    look();
    unreported = report();
  }
}

void Listener::State::accept_some(const File& port) {
  for (int i = 0; i < kAcceptedAtOnce; ++i)
    if (!accept_one(port)) return;
}

bool Listener::State::accept_one(const File& port) {
  Address from;
  File socket(::accept4(port.get(), from.get(), &from.length, SOCK_NONBLOCK | SOCK_CLOEXEC));
  int why = socket ? 0 : errno;
  if (socket)
    admit(std::move(socket), from);
  else if (why == EMFILE || why == ENFILE)
    why = refuse_one(port);
  if (why == EMFILE || why == ENFILE || why == ENOBUFS || why == ENOMEM) pause(why);
  // All other errors are of the one connection, which broke while it waited
  return why != EAGAIN && !paused_until;
}

int Listener::State::refuse_one(const File& port) {
  if (reserve.empty()) refill_reserve();
  if (reserve.empty()) return EMFILE;
  reserve.pop_back();
  File socket(::accept4(port.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
  const int why = socket ? 0 : errno;
  socket.close();
  refill_reserve();
  if (why == 0) open.lock()->table.refused(Closed::files);
  return why;
}

void Listener::State::pause(int why) {
  log_warn("", fmt::format("cannot accept connections of workers for a moment: {}", std::strerror(why)));
  paused_until = clock.now() + kPause;
  for (const File& each : ports) ::epoll_ctl(poll.get(), EPOLL_CTL_DEL, each.get(), nullptr);
}

void Listener::State::rouse() const {
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto woken = ::write(wake.get(), &one, sizeof one);
}

void Listener::State::refill_reserve() {
  while (reserve.size() < kReserve) {
    File file(::open("/dev/null", O_RDONLY | O_CLOEXEC));
    if (!file) return;
    reserve.push_back(std::move(file));
  }
}

void Listener::State::admit(File socket, const Address& from) {
  const ConnectionTable::Id id = next_id++;
  {
    const auto now_open = open.lock();
    File second(::fcntl(socket.get(), F_DUPFD_CLOEXEC, 0));
    if (!second) return now_open->table.refused(Closed::files);
    const auto admission = now_open->table.arrive(id, guest_of(from), clock.now());
    if (admission.closed) cut(now_open->files.at(*admission.closed));
    if (admission.refused) return;
    limit_window(second, kUnmetWindow);
    // No events are asked for: epoll tells in any case when a connection has ended on both sides
    watch(second.get(), id, 0);
    now_open->files.emplace(id, std::move(second));
  }
  take(socket.release());
}

void Listener::State::look() {
  const auto now_open = open.lock();
  ConnectionTable& table = now_open->table;
  const TimePoint now = clock.now();
  const std::vector<ConnectionTable::Id> unmet(table.unmet().begin(), table.unmet().end());
  for (const ConnectionTable::Id id : unmet) {
    const File& file = now_open->files.at(id);
    if (table.received(id, bytes_received(file), now)) cut(file);
  }
  for (const ConnectionTable::Id id : table.overdue(now)) cut(now_open->files.at(id));
}

bool Listener::State::report() {
  std::array<std::uint64_t, kClosedReasons> closed{};
  {
    const auto now_open = open.lock();
    for (int i = 0; i < kClosedReasons; ++i)
      closed[static_cast<std::size_t>(i)] = now_open->table.closed(static_cast<Closed>(i));
  }
  if (closed == reported_counts) return false;
  const TimePoint now = clock.now();
  if (now - reported < kReportEvery) return true;
  std::string text;
  for (std::size_t i = 0; i < closed.size(); ++i) {
    if (closed[i] == reported_counts[i]) continue;
    text += fmt::format("{}{} ({})", text.empty() ? "" : ", ", closed[i] - reported_counts[i],
                        to_string(static_cast<Closed>(i)));
  }
  log_warn("", "the workers' port refused or closed connections: " + text);
  reported = now;
  reported_counts = closed;
  return false;
}

Listener::Call::~Call() {
  state_->open.lock()->table.call_ended(guest_.peer, met_, state_->clock.now());
  if (met_) state_->rouse();  // while all connections are met, the thread waits without a limit
}

void Listener::Call::met() {
  const auto now_open = state_->open.lock();
  const auto first = now_open->table.call_met(guest_.peer);
  if (first) limit_window(now_open->files.at(*first), kMetWindow);
  met_ = true;
}

std::unique_ptr<Listener::Call> Listener::call(std::string_view grpc_peer) {
  const std::string peer = key_of_peer(grpc_peer);
  const auto now_open = state_->open.lock();
  const auto began = now_open->table.call_began(peer, state_->clock.now());
  if (began.closed) cut(now_open->files.at(*began.closed));
  if (!began.guest) return nullptr;
  return std::make_unique<Call>(state_, *began.guest);
}

std::optional<bool> Listener::answers(std::chrono::milliseconds time_limit) const {
  if (state_->ports.empty()) return std::nullopt;
  Address to = local_address(state_->ports.front());
  if (is_any(to)) {
    if (to.storage.ss_family == AF_INET6)
      reinterpret_cast<sockaddr_in6&>(to.storage).sin6_addr = in6addr_loopback;
    else
      reinterpret_cast<sockaddr_in&>(to.storage).sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  }
  return port_answers(to.get(), to.length, time_limit);
}

}  // namespace ls::coordinator::rpc
