// lightshaft-worker: runs the agent, and a render child process of this same executable.
// Exit codes: 0 drained cleanly, 1 failed, 2 bad usage. Where the coordinator asks for it, the process starts
// its program again instead of ending.
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <optional>
#include <random>
#include <thread>

#include "core/base/log.h"
#include "util/sandbox/sandbox.h"
#include "util/trace/tracer.h"
#include "worker/agent/agent.h"
#include "worker/agent/link_ring.h"
#include "worker/cache/cache.h"
#include "worker/child/child.h"
#include "worker/child/serve.h"
#include "worker/client/client.h"
#include "worker/machine.h"
#include "worker/options.h"
#include "worker/own_program.h"
#ifdef LIGHTSHAFT_RENDERER
#include "worker/inprocess.h"
#include "worker/render/render.h"
#endif

namespace {

using namespace ls;

constexpr int kUsage = 2;

std::unique_ptr<worker::LocalBackend> local_backend(const worker::Options& options) {
#ifdef LIGHTSHAFT_RENDERER
  if (!options.fake) return worker::make_inprocess_backend(options.threads);
#endif
  return worker::make_fake_backend(options.fake_options);
}

int run_child(const worker::Options& options) {
  worker::child::confine(options.memory_limit);
  const auto sandboxed = enter_sandbox({options.cache});
  if (!sandboxed.calls || !sandboxed.files)
    log_warn("",
             fmt::format("this kernel cannot keep the renderer from {}: take care whose scenes it renders",
                         sandboxed.files ? "opening sockets" : "files that are not a scene's"));
  // The agent of root may read folders of all users, and the renderer has lost the right to.
  if (::access(options.cache.c_str(), R_OK | X_OK) != 0 && errno == EACCES) {
    log_error("", fmt::format("the renderer gives up all rights of root, and without them it cannot read the "
                              "cache {}: change the owner of the folder, or run the worker as its owner",
                              options.cache.string()));
    return 1;
  }
#ifdef LIGHTSHAFT_RENDERER
  const auto limit = render::limit_threads(options.threads);
#endif
  const auto backend = local_backend(options);
  return worker::child::serve(*backend, options.threads);
}

int failed(const Error& error) {
  log_error("", error.message);
  return 1;
}

// Handles signals. The first SIGTERM or SIGINT makes the agent drain (finish its running units and end), the
// second stops it immediately.
void obey_signals(worker::Agent& agent, const sigset_t& signals) {
  int signal = 0;
  for (int count = 0; sigwait(&signals, &signal) == 0; ++count) {
    if (signal == SIGUSR1) return;  // this process sends SIGUSR1 to itself when the agent has ended
    count == 0 ? agent.drain() : agent.stop();
  }
}

std::unique_ptr<worker::CoordinatorLink> link_to(const worker::Options& options) {
  std::vector<std::unique_ptr<worker::CoordinatorLink>> links;
  for (const auto& address : options.coordinators)
    links.push_back(worker::make_grpc_link(address, options.join_token, options.tls));
  if (links.size() == 1) return std::move(links.front());
  return std::make_unique<worker::LinkRing>(std::move(links), std::hash<std::string>()(options.name));
}

// Returns the exit code; nullopt: the program is to be restarted, and nothing of this run is left.
std::optional<int> run_worker(const worker::Options& options, const worker::OwnProgram& program,
                              const sigset_t& signals) {
  const auto tracer = trace::tracer_from_environment("lightshaft-worker", LIGHTSHAFT_VERSION, options.name);
  if (!tracer) {
    failed(tracer.error());
    return kUsage;
  }
  worker::raise_file_limit();
  const auto link = link_to(options);
  auto cache =
      worker::BlobCache::open(options.cache, options.cache_limit,
                              [&link](const worker::BlobRequest& wanted, const worker::BlobSink& sink) {
                                return link->fetch_blob(wanted, sink);
                              });
  if (!cache) return failed(cache.error());
  // The child is started after BlobCache::open() has created the cache's folder: the child's sandbox permits
  // reading that folder, and a sandbox can permit only folders that exist.
  worker::ChildOptions child_options{.arguments = child_arguments(options),
                                     .slots = options.threads,
                                     .hang_limit = from_seconds(options.hang_seconds),
                                     .prepare_limit = from_seconds(options.build_seconds)};
  auto backend = worker::make_child_backend(std::move(child_options));
  if (!backend) return failed(backend.error());

  worker::AgentOptions agent_options;
  agent_options.threads = options.threads;
  agent_options.idle_limit = from_seconds(options.idle_seconds);
  agent_options.may_restart = [&program] { return program.check(); };
  agent_options.hello.name = options.name;
  agent_options.hello.build = LIGHTSHAFT_VERSION;
  agent_options.hello.memory_bytes = options.memory_limit;
  agent_options.hello.tags = options.tags;
  agent_options.hello.join_token = options.join_token;
  agent_options.hello.fake = options.fake;
  agent_options.tracer = *tracer;
  agent_options.backoff_seed = std::random_device{}();
  const SystemClock clock;
  worker::Agent agent(std::move(agent_options), *link, **backend, **cache, clock);
  std::jthread signal_thread([&] { obey_signals(agent, signals); });
  const auto ended = agent.run();
  pthread_kill(signal_thread.native_handle(), SIGUSR1);
  signal_thread.join();  // a SIGTERM that it still took asks for the end
  if (!ended) return failed(ended.error());
  return agent.to_restart() ? std::nullopt : std::optional(0);
}

}  // namespace

int main(int argc, char** argv) {
  const ls::worker::OwnProgram program(argc, argv);
  const auto parsed = ls::worker::parse_options(argc, argv);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& options = std::get<ls::worker::Options>(parsed);
  log_format(options.log_format);
  if (options.render_child) return run_child(options);
  // The signals are blocked before any thread starts (including gRPC's), so that only obey_signals receives
  // them.
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGTERM, SIGINT, SIGUSR1}) sigaddset(&signals, signal);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  signal(SIGPIPE, SIG_IGN);
  if (const auto code = run_worker(options, program, signals)) return *code;
  log_info("", "starting the program again: " + program.path().string());
  return failed(program.restart());
}
