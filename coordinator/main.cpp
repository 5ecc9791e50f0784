// lightshaft-coordinator: opens the coordinator (store, state machine and threads), serves it by gRPC and
// HTTP, and runs until SIGTERM or SIGINT.
#include <fcntl.h>
#include <fmt/format.h>
#include <malloc.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <memory>
#include <new>
#include <optional>
#include <utility>
#include <variant>

#include "coordinator/http/api/api.h"
#include "coordinator/http/auth/throttle.h"
#include "coordinator/http/auth/token_registry.h"
#include "coordinator/http/net/http_server.h"
#include "coordinator/options.h"
#include "coordinator/rpc/rpc_server.h"
#include "coordinator/service/coordinator.h"
#include "coordinator/tls/tls_files.h"
#include "coordinator/webhooks/webhooks.h"
#include "core/base/clock.h"
#include "core/base/digest.h"
#include "core/base/log.h"
#include "util/display/display_views.h"
#include "util/trace/tracer.h"

namespace {

using ls::Errc;
using ls::fail;
using ls::Result;
using ls::coordinator::Flags;
namespace fs = std::filesystem;

enum ExitCode { kOk = 0, kFailed = 1, kUsage = 2 };

// Time to stop in when the workers' port is dead
constexpr unsigned kStopSeconds = 60;

// Locks the folder until the process ends: two coordinators in one folder would destroy each other's data.
Result<int> lock_folder(const fs::path& folder) {
  std::error_code ec;
  fs::create_directories(folder, ec);
  if (ec)
    return fail(Errc::unavailable, fmt::format("cannot make --data '{}': {}", folder.string(), ec.message()));
  const fs::path file = folder / "coordinator.lock";
  const int fd = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (fd < 0)
    return fail(Errc::unavailable, fmt::format("cannot open '{}': {}", file.string(), std::strerror(errno)));
  if (::flock(fd, LOCK_EX | LOCK_NB) != 0) {
    ::close(fd);
    return fail(Errc::already_exists,
                fmt::format("another coordinator runs on --data '{}'; stop it, or choose another "
                            "folder",
                            folder.string()));
  }
  return fd;
}

// Takes from other users of the machine what rights they have on the folder: an older version, or somebody by
// hand, made it with the usual ones.
void shut_to_others(const fs::path& folder) {
  std::error_code ec;
  fs::permissions(folder, fs::perms::others_all, fs::perm_options::remove, ec);
  if (ec)
    ls::log_warn("",
                 fmt::format("other users of this machine may read '{}': {}", folder.string(), ec.message()));
}

// Raises the limit on file descriptors to the highest that the system allows, and returns it. Every
// connection needs a descriptor.
std::size_t raise_file_limit() {
  constexpr std::size_t kUnknown = 1024;
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return kUnknown;
  if (limit.rlim_cur == limit.rlim_max) return limit.rlim_cur;
  const rlim_t before = std::exchange(limit.rlim_cur, limit.rlim_max);
  return ::setrlimit(RLIMIT_NOFILE, &limit) == 0 ? limit.rlim_max : before;
}

// Writes the ports to ports.json, for scripts and tests that let the system choose them (port 0). The file is
// renamed into place, so that readers never see a part of it.
Result<void> write_ports(const fs::path& folder, int http, int grpc) {
  const fs::path aside = folder / "ports.json.new", file = folder / "ports.json";
  std::ofstream out(aside, std::ios::trunc);
  out << fmt::format("{{\"http\":{},\"grpc\":{}}}\n", http, grpc);
  out.close();
  std::error_code ec;
  if (out) fs::rename(aside, file, ec);
  if (!out || ec) return fail(Errc::unavailable, fmt::format("cannot write '{}'", file.string()));
  return {};
}

// Keeps freed memory in the process. Results of units and images, of 100 KB to some MB each, are allocated
// many times a second. By default malloc would return their memory to the system each time, and the next use
// would cost page faults.
void keep_freed_memory() {
  ::mallopt(M_MMAP_THRESHOLD, 32 << 20);
  ::mallopt(M_TRIM_THRESHOLD, 256 << 20);
}

fs::path secrets_of(const Flags& flags) { return flags.secrets.empty() ? flags.data : flags.secrets; }

// Returns the certificates and keys for TLS; nullopt: TLS was not requested.
Result<std::optional<ls::tls::Texts>> tls_of(const Flags& flags) {
  const bool brought = !flags.tls_ca.empty();
  if (!brought && !flags.tls) return std::nullopt;
  auto texts = brought ? ls::tls::read_files(flags.tls_ca, flags.tls_cert, flags.tls_key)
                       : ls::tls::make_files(secrets_of(flags) / "tls", flags.tls_names,
                                             ls::http::system_unix_clock()());
  if (!texts) return tl::unexpected(texts.error());
  return std::move(*texts);
}

// Returns the views of --ocio; without it those of the environment variable OCIO, which is often set for
// other programs: if they cannot be used, the built-in views.
Result<std::shared_ptr<const ls::DisplayViews>> views_of(const Flags& flags) {
  auto views = flags.ocio.empty() ? ls::DisplayViews::of_environment() : ls::DisplayViews::read(flags.ocio);
  if (!views && flags.ocio.empty()) {
    ls::log_warn("", fmt::format("the built-in views are used instead of $OCIO: {}", views.error().message));
    views = ls::DisplayViews::built_in();
  }
  if (!views) return tl::unexpected(views.error());
  for (const auto& [name, why] : views->left_out())
    ls::log_warn("", fmt::format("the view '{}' is left out: {}", name, why));
  return std::make_shared<const ls::DisplayViews>(std::move(*views));
}

// Warns if an address on the network is served without encryption: others could read and change the traffic,
// including the tokens.
void warn_of_open_lines(const std::string& address, std::string_view what) {
  const std::string host = address.substr(0, address.rfind(':'));
  if (host != "127.0.0.1" && host != "localhost" && host != "[::1]")
    ls::log_warn("",
                 fmt::format("{} on {} is not encrypted: use --tls unless you trust everybody on the network",
                             what, address));
}

std::string with_port(const std::string& address, int port) {
  return fmt::format("{}:{}", address.substr(0, address.rfind(':')), port);
}

// Starts to notify the receivers named in `flags`. Only the operator can name receivers. Notifications are
// signed with the secret in the file webhook-secret of the folder `data`.
Result<std::unique_ptr<ls::coordinator::Webhooks>> start_webhooks(
    ls::coordinator::Coordinator& coordinator, const Flags& flags, const fs::path& data,
    const std::shared_ptr<ls::trace::Tracer>& tracer) {
  if (flags.webhooks.empty()) return nullptr;
  auto secret = ls::http::read_or_make_token(data / "webhook-secret");
  if (!secret) return tl::unexpected(secret.error());
  return ls::coordinator::Webhooks::start(coordinator, {flags.webhooks,
                                                        *secret,
                                                        data / "webhooks",
                                                        std::make_shared<ls::SystemClock>(),
                                                        ls::system_unix_seconds,
                                                        {},
                                                        tracer});
}

// Returns a guard that limits how often an address may send a wrong join token (the token with which workers
// join), by the same limits as for wrong tokens over HTTP.
ls::coordinator::JoinGuard guard_of(const ls::http::Limits& limits) {
  const double a_minute = limits.wrong_tokens_per_minute;
  const auto throttle = std::make_shared<ls::http::Throttle>(
      ls::http::Pace{}, ls::http::Pace{a_minute / 60, std::max(1.0, a_minute)});
  const auto name_of = [](std::string_view token) { return ls::sha256(token).hex(); };
  const auto now = ls::http::system_unix_clock();
  return {[=](const std::string& address, std::string_view token) {
            return throttle->may_try(ls::http::Throttle::group_of(address), name_of(token), now());
          },
          [=](const std::string& address, std::string_view token, bool right) {
            const std::string group = ls::http::Throttle::group_of(address);
            right ? throttle->succeeded(group, name_of(token), now()) : throttle->failed(group, now());
          }};
}

// The terminate handler: an exception has reached no handler, because memory or threads have run out where no
// request can be refused, or because of a bug. Prints an error message, and allocates no memory.
[[noreturn]] void end_with_a_sentence() {
  const auto end_for_want = [](const char* what) {
    std::fprintf(
        stderr,
        "lightshaft-coordinator: error: %s; if memory or threads are limited here (RLIMIT_DATA, "
        "RLIMIT_NPROC, the control group), raise the limit. Start it again: what it has acknowledged is "
        "stored\n",
        what);
    std::_Exit(kFailed);
  };
  try {
    if (const auto e = std::current_exception()) std::rethrow_exception(e);
  } catch (const std::bad_alloc&) {
    end_for_want("there is not enough memory");
  } catch (const std::exception& e) {
    // The texts of EAGAIN and ENOMEM: the C++ library and Boost throw these if a thread cannot be started
    if (std::strstr(e.what(), "temporarily unavailable") || std::strstr(e.what(), "Cannot allocate"))
      end_for_want(e.what());
    std::fprintf(stderr, "lightshaft-coordinator: error: a bug: %s\n", e.what());
  } catch (...) {
    std::fprintf(stderr, "lightshaft-coordinator: error: a bug: an exception of an unknown type\n");
  }
  std::abort();
}

sigset_t block_signals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGTERM);
  sigaddset(&set, SIGINT);
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  ::signal(SIGPIPE, SIG_IGN);
  return set;
}

Result<void> serve(const Flags& flags, const sigset_t& signals) {
  const fs::path data = flags.data;
  const auto tracer = ls::trace::tracer_from_environment("lightshaft-coordinator", LIGHTSHAFT_VERSION, "");
  if (!tracer) return tl::unexpected(tracer.error());
  // The port is opened first, so that a port in use is reported before any file is changed. Connections wait
  // until the coordinator is ready.
  auto http = ls::http::Server::listen(flags.http);
  if (!http) return tl::unexpected(http.error());
  if (auto lock = lock_folder(data); !lock) return tl::unexpected(lock.error());
  shut_to_others(data);
  std::error_code ignored;
  fs::remove(data / "ports.json", ignored);
  const fs::path secrets = secrets_of(flags);
  fs::create_directories(secrets, ignored);
  // Other coordinators that start with the same folder of secrets wait for this lock
  std::optional<ls::http::FolderLock> others(secrets);
  auto tokens = ls::http::TokenRegistry::open(secrets);
  if (!tokens) return tl::unexpected(tokens.error());
  const auto tls = tls_of(flags);
  if (!tls) return tl::unexpected(tls.error());
  const auto worker_key = ls::http::read_or_make_token(secrets / "worker-key");
  others.reset();
  if (flags.shared && flags.secrets.empty())
    ls::log_warn("",
                 "only this coordinator knows the tokens that are made here: give all coordinators of this "
                 "store the same --secrets folder");
  std::shared_ptr<const ls::http::TlsIdentity> identity;
  if (*tls) {
    auto made = ls::http::TlsIdentity::make((*tls)->cert, (*tls)->key);
    if (!made) return tl::unexpected(made.error());
    identity = std::move(*made);
  } else {
    warn_of_open_lines(flags.http, "HTTP");
    warn_of_open_lines(flags.grpc, "the workers' port");
  }
  const auto may_join = [registry = tokens->get()](std::string_view token) {
    return registry->may_join(token);
  };

  ls::coordinator::Coordinator::Options options;
  options.data = data;
  options.store = flags.store;
  options.may_join = may_join;
  if (worker_key)
    options.worker_key = *worker_key;
  else  // the folder of secrets may be one that cannot be written
    ls::log_info("", "workers get new ids when the coordinator restarts: " + worker_key.error().message);
  options.blobs_at = flags.blobs;
  options.shared = flags.shared;
  if (flags.keep_unused_hours)
    options.keep_unused = ls::from_seconds(*flags.keep_unused_hours * 3600);
  else if (!flags.blobs.empty())
    options.keep_unused.reset();
  options.limits = flags.shares;
  options.audit_rate = flags.audit_percent / 100;
  options.allow_fake = flags.allow_fake;
  options.version = LIGHTSHAFT_VERSION;
  options.film_bytes = flags.film_memory;
  options.clock = std::make_shared<ls::SystemClock>();
  options.tick = std::chrono::milliseconds(100);
  options.tracer = *tracer;
  auto views = views_of(flags);
  if (!views) return tl::unexpected(views.error());
  options.views = *views;
  const auto stopping = std::make_shared<std::atomic<bool>>(false);
  const fs::path reader = ls::program_beside_us("lightshaft-scene");
  if (!fs::exists(reader, ignored))
    return fail(Errc::failed_precondition,
                fmt::format("there is no {}, which reads scenes: install it, too", reader.string()));
  options.scenes = ls::scenes_by_processes(reader, {.stop = stopping});
  auto coordinator = ls::coordinator::Coordinator::open(std::move(options));
  if (!coordinator) return tl::unexpected(coordinator.error());

  auto webhooks = start_webhooks(**coordinator, flags, data, *tracer);
  if (!webhooks) return tl::unexpected(webhooks.error());
  std::atomic<bool> port_dead{false};
  ls::coordinator::GrpcServer grpc(**coordinator, may_join, guard_of(flags.limits));
  std::optional<ls::coordinator::GrpcServer::Tls> grpc_tls;
  if (*tls) grpc_tls = {(*tls)->ca, (*tls)->cert, (*tls)->key};
  const auto grpc_port = grpc.start(flags.grpc, grpc_tls, [&port_dead] {
    port_dead = true;
    // If what has broken the port also keeps the coordinator from stopping, SIGALRM ends it
    ::alarm(kStopSeconds);
    ::kill(::getpid(), SIGTERM);
  });
  if (!grpc_port) return tl::unexpected(grpc_port.error());
  ls::http::Limits limits = flags.limits;
  limits.spool = data / "spool";
  ls::http::Api api(**coordinator, **tokens, limits, ls::http::StaticFiles(ls::http::embedded_files()),
                    identity != nullptr);
  if (*webhooks) api.webhooks([&hooks = **webhooks] { return hooks.figures(); });
  if (!flags.usd_python.empty()) {
    auto stages =
        ls::http::StageReader::open({.python = fs::absolute(flags.usd_python), .folder = data / "stages"});
    if (!stages) return tl::unexpected(stages.error());
    api.stages(std::move(*stages));
  }
  api.workers_port([&grpc] { return grpc.trouble(); });
  api.joining({flags.public_grpc.empty() ? with_port(flags.grpc, *grpc_port) : flags.public_grpc,
               grpc_tls.has_value(), (secrets / "join-token").string()});
  if (*tracer) api.traces([tracer = *tracer] { return tracer->figures(); });
  (*coordinator)
      ->announce(flags.public_http.empty()
                     ? (identity ? "https://" : "http://") + with_port(flags.http, (*http)->port())
                     : flags.public_http,
                 flags.public_grpc.empty() ? with_port(flags.grpc, *grpc_port) : flags.public_grpc);
  (*http)->start(api, identity);
  // On a full disk the coordinator runs nevertheless, so that jobs can be removed.
  if (auto written = write_ports(data, (*http)->port(), *grpc_port); !written)
    ls::log_error("", written.error().message);

  const std::string host = flags.http.substr(0, flags.http.rfind(':'));
  ls::log_info("", fmt::format("dashboard: {}://{}:{}/ (token: {}); workers: port {} (token: {})",
                               identity ? "https" : "http",
                               host == "0.0.0.0" || host == "[::]" ? "localhost" : host, (*http)->port(),
                               (secrets / "token").string(), *grpc_port, (secrets / "join-token").string()));
  int signal = 0;
  sigwait(&signals, &signal);
  ls::log_info("", fmt::format("{}: stopping", signal == SIGINT ? "SIGINT" : "SIGTERM"));
  fs::remove(data / "ports.json", ignored);
  *stopping = true;
  (*http)->stop();
  grpc.stop();
  webhooks->reset();
  coordinator->reset();
  if (port_dead)
    return fail(Errc::unavailable, "the workers' port stopped responding; start the coordinator again");
  ls::log_info("", "stopped");
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  std::set_terminate(end_with_a_sentence);
  const auto parsed = ls::coordinator::parse_flags(argc, argv);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  auto flags = std::get<Flags>(parsed);
  ls::log_format(flags.log_format);
  // A quarter of the files is for HTTP, half of them at least for workers (connections_for in rpc/listener.h)
  flags.limits.connections =
      std::min(flags.limits.connections, std::max<std::size_t>(1, raise_file_limit() / 4));
  keep_freed_memory();
  ::umask(027);  // no file that the coordinator makes is for other users of the machine
  // Signals are blocked before any thread starts, since threads inherit the mask
  const sigset_t signals = block_signals();
  if (const auto served = serve(flags, signals); !served) {
    fmt::print(stderr, "lightshaft-coordinator: error: {}\n", served.error().message);
    return served.error().code == Errc::invalid_argument ? kUsage : kFailed;
  }
  return kOk;
}
