// lightshaft-coordinator: wires store, state machine, gRPC and HTTP together and runs until SIGTERM or
// SIGINT.
#include <fcntl.h>
#include <fmt/format.h>
#include <malloc.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "coordinator/http/api.h"
#include "coordinator/http/server.h"
#include "coordinator/http/token_file.h"
#include "coordinator/rpc/server.h"
#include "coordinator/service.h"

namespace {

using ls::Errc;
using ls::fail;
using ls::Result;
namespace fs = std::filesystem;

enum ExitCode { kOk = 0, kFailed = 1, kUsage = 2 };

struct Flags {
  std::string http = "127.0.0.1:8080";
  std::string grpc = "127.0.0.1:50051";
  std::string data = "lightshaft-data";
  std::string store = "sqlite";
  ls::http::Limits limits;
};

// How the HTTP door treats slow and greedy clients: for the config file, where an operator may need it and
// tests do.
void add_limits(CLI::App& app, ls::http::Limits& limits) {
  const auto hidden = [&app](const char* name, auto& value, double least) {
    app.add_option(name, value)->check(CLI::Range(least, 1e15))->group("");
  };
  hidden("--http-header-seconds", limits.header_seconds, 0.01);
  hidden("--http-idle-seconds", limits.idle_seconds, 0.01);
  hidden("--http-body-grace-seconds", limits.body_grace_seconds, 0.01);
  hidden("--http-min-rate", limits.min_rate, 1);
  hidden("--http-heartbeat-seconds", limits.heartbeat_seconds, 0.01);
  hidden("--http-linger-seconds", limits.linger_seconds, 0);
  hidden("--http-stop-seconds", limits.stop_seconds, 0);
  hidden("--http-connections", limits.connections, 1);
  hidden("--http-event-streams", limits.event_streams, 1);
  hidden("--http-event-queue", limits.event_queue, 1);
  hidden("--http-blob-bytes", limits.blob_bytes, 1);
  hidden("--http-bundle-bytes", limits.bundle_bytes, 1);
}

// Held for the life of the process: two coordinators on one folder would destroy each other's work.
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

// A connection or a worker each needs a file: take what the system allows.
void raise_file_limit() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == limit.rlim_max) return;
  limit.rlim_cur = limit.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

// For scripts and tests that asked for port 0. Renamed into place: whoever sees the file sees all of it.
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

// Partials and films of 100 KB to some MB come and go many times a second: given back to the system each
// time, every one of them would be paid for with page faults again.
void keep_freed_memory() {
  ::mallopt(M_MMAP_THRESHOLD, 32 << 20);
  ::mallopt(M_TRIM_THRESHOLD, 256 << 20);
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
  // The port first: one that is taken is told before anything is touched. Connections wait until all is
  // ready.
  auto http = ls::http::Server::listen(flags.http);
  if (!http) return tl::unexpected(http.error());
  if (auto lock = lock_folder(data); !lock) return tl::unexpected(lock.error());
  std::error_code ignored;
  fs::remove(data / "ports.json", ignored);
  auto token = ls::http::read_or_make_token(data / "token");
  if (!token) return tl::unexpected(token.error());
  auto join_token = ls::http::read_or_make_token(data / "join-token");
  if (!join_token) return tl::unexpected(join_token.error());

  ls::coordinator::Coordinator::Options options;
  options.data = data;
  options.store = flags.store;
  options.join_token = *join_token;
  options.clock = std::make_shared<ls::SystemClock>();
  options.tick = std::chrono::milliseconds(100);
  auto coordinator = ls::coordinator::Coordinator::open(std::move(options));
  if (!coordinator) return tl::unexpected(coordinator.error());

  ls::coordinator::GrpcServer grpc(**coordinator, *join_token);
  const auto grpc_port = grpc.start(flags.grpc);
  if (!grpc_port) return tl::unexpected(grpc_port.error());
  ls::http::Limits limits = flags.limits;
  limits.spool = data / "spool";
  ls::http::Api api(**coordinator, *token, limits, ls::http::StaticFiles(ls::http::embedded_files()));
  (*http)->start(api);
  if (auto written = write_ports(data, (*http)->port(), *grpc_port); !written) return written;

  const std::string host = flags.http.substr(0, flags.http.rfind(':'));
  ls::log_info("", fmt::format("dashboard: http://{}:{}/ (token: {}); workers: port {} (token: {})",
                               host == "0.0.0.0" || host == "[::]" ? "localhost" : host, (*http)->port(),
                               (data / "token").string(), *grpc_port, (data / "join-token").string()));
  int signal = 0;
  sigwait(&signals, &signal);
  ls::log_info("", fmt::format("{}: stopping", signal == SIGINT ? "SIGINT" : "SIGTERM"));
  fs::remove(data / "ports.json", ignored);
  (*http)->stop();
  grpc.stop();
  coordinator->reset();
  ls::log_info("", "stopped");
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  Flags flags;
  CLI::App app("Cuts jobs into units, hands them to workers, and folds what they send into one exact image.",
               "lightshaft-coordinator");
  app.add_option("--http", flags.http, "ADDR:PORT of the HTTP interface and the dashboard; port 0: any")
      ->capture_default_str();
  app.add_option("--grpc", flags.grpc, "ADDR:PORT that workers connect to; port 0: any")
      ->capture_default_str();
  app.add_option("--data", flags.data, "folder for jobs, blobs, images and tokens")->capture_default_str();
  app.add_option("--store", flags.store, "where jobs are kept: sqlite, or redis://[USER:PASSWORD@]HOST[:PORT][/DB]")
      ->capture_default_str();
  app.set_config("--config", "", "file with these options, one 'name = value' a line");
  app.allow_config_extras(false);
  add_limits(app, flags.limits);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kOk : kUsage;
  }
  if (const auto known = ls::coordinator::check_store(flags.store); !known) {
    fmt::print(stderr, "lightshaft-coordinator: error: {}\n", known.error().message);
    return kUsage;
  }
  raise_file_limit();
  keep_freed_memory();
  const sigset_t signals = block_signals();  // before any thread starts
  if (const auto served = serve(flags, signals); !served) {
    fmt::print(stderr, "lightshaft-coordinator: error: {}\n", served.error().message);
    return served.error().code == Errc::invalid_argument ? kUsage : kFailed;
  }
  return kOk;
}
