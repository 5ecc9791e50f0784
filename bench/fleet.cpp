// Many fake workers in one process, as many as a machine could not hold one by one: each has its own agent,
// connections and thread, and is to the farm what `lightshaft-worker --fake` is. Made for
// tests/chaos/hours.py.
//   fleet COUNT [options of lightshaft-worker]
// Its workers are called NAME-0, NAME-1, ... SIGTERM drains all of them. Exit codes are the worker's.
#include <signal.h>

#include <atomic>
#include <thread>

#include "core/base/log.h"
#include "core/base/parse_number.h"
#include "worker/agent/agent.h"
#include "worker/agent/link_ring.h"
#include "worker/cache/cache.h"
#include "worker/client/client.h"
#include "worker/machine.h"
#include "worker/options.h"

namespace ls::bench {
namespace {

constexpr int kUsage = 2;

std::unique_ptr<worker::CoordinatorLink> link_to(const worker::Options& options, int number) {
  std::vector<std::unique_ptr<worker::CoordinatorLink>> links;
  for (const auto& address : options.coordinators)
    links.push_back(worker::make_grpc_link(address, options.join_token, options.tls));
  return std::make_unique<worker::LinkRing>(std::move(links), static_cast<std::uint64_t>(number));
}

class Member {
 public:
  Member(const worker::Options& options, int number)
      : link_(link_to(options, number)), backend_(worker::make_fake_backend(options.fake_options)) {
    told_.hello.name = options.name + "-" + std::to_string(number);
    told_.hello.build = LIGHTSHAFT_VERSION;
    told_.hello.memory_bytes = options.memory_limit;
    told_.hello.tags = options.tags;
    told_.hello.join_token = options.join_token;
    told_.hello.fake = true;
    told_.backoff_seed = static_cast<std::uint64_t>(number);
  }

  // The folder of the cache is that of all members.
  Result<void> open(const worker::Options& options) {
    auto cache =
        worker::BlobCache::open(options.cache, options.cache_limit,
                                [this](const worker::BlobRequest& wanted, const worker::BlobSink& sink) {
                                  return link_->fetch_blob(wanted, sink);
                                });
    if (!cache) return tl::unexpected(cache.error());
    cache_ = std::move(*cache);
    agent_.emplace(told_, *link_, *backend_, *cache_, clock_);
    return {};
  }
  worker::Agent& agent() { return *agent_; }

 private:
  const SystemClock clock_;
  worker::AgentOptions told_;
  std::unique_ptr<worker::CoordinatorLink> link_;
  std::unique_ptr<worker::RenderBackend> backend_;
  std::unique_ptr<worker::BlobCache> cache_;
  std::optional<worker::Agent> agent_;
};

int failed(const Error& error) {
  log_error("", error.message);
  return 1;
}

int run(const worker::Options& options, int count, const sigset_t& signals) {
  worker::raise_file_limit();
  std::vector<std::unique_ptr<Member>> members;
  for (int n = 0; n < count; ++n) {
    members.push_back(std::make_unique<Member>(options, n));
    if (const auto opened = members.back()->open(options); !opened) return failed(opened.error());
  }
  std::atomic<int> failures = 0;
  std::jthread obey([&] {
    int signal = 0;
    if (sigwait(&signals, &signal) != 0 || signal == SIGUSR1) return;  // all have ended by themselves
    for (auto& member : members) member->agent().drain();
  });
  {
    std::vector<std::jthread> running;
    for (auto& member : members)
      running.emplace_back([&failures, &member] {
        if (const auto ended = member->agent().run(); !ended) failures += failed(ended.error());
      });
  }
  pthread_kill(obey.native_handle(), SIGUSR1);
  return failures == 0 ? 0 : 1;
}

}  // namespace
}  // namespace ls::bench

int main(int argc, char** argv) {
  const auto count = ls::parse_number<int>(argc > 1 ? argv[1] : "");
  if (!count || *count < 1) return ls::bench::kUsage;
  const auto parsed = ls::worker::parse_options(argc - 1, argv + 1);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGTERM, SIGINT, SIGUSR1}) sigaddset(&signals, signal);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  signal(SIGPIPE, SIG_IGN);
  return ls::bench::run(std::get<ls::worker::Options>(parsed), *count, signals);
}
