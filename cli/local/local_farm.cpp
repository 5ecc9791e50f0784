#include "cli/local/local_farm.h"

#include <charconv>
#include <cstring>
#include <utility>

#include "worker/child/child.h"
#include "worker/child/serve.h"
#include "worker/inprocess.h"
#include "worker/machine.h"
#include "worker/render/base/thread_limit.h"

namespace ls::cli {

// Forwards all calls; records how long loading took and whether the scene was at fault.
struct LocalFarm::Watched final : worker::RenderBackend {
  Watched(std::unique_ptr<worker::RenderBackend> b, const Clock& c) : backend(std::move(b)), clock(c) {}

  Digest numeric_class() const override { return backend->numeric_class(); }
  tl::expected<void, UnitFailure> prepare(const worker::LocalJob& job) override {
    const TimePoint start = clock.now();
    auto ready = backend->prepare(job);
    const std::lock_guard lock(mutex);
    load_seconds = std::max(load_seconds, seconds(clock.now() - start));
    if (!ready && ready.error().scene_at_fault) fault = ready.error().reason;
    return ready;
  }
  tl::expected<worker::RenderedUnit, UnitFailure> render(const worker::LocalJob& job, const LeaseUnit& unit,
                                                         const std::atomic<bool>& stop) override {
    return backend->render(job, unit, stop);
  }
  void forget(const JobId& job) override { backend->forget(job); }
  std::uint64_t rss_bytes() const override { return backend->rss_bytes(); }
  std::optional<Error> broken() const override { return backend->broken(); }
  void shutdown() override { backend->shutdown(); }

  std::unique_ptr<worker::RenderBackend> backend;
  const Clock& clock;
  mutable std::mutex mutex;
  double load_seconds = 0;
  std::optional<std::string> fault;
};

LocalFarm::LocalFarm(Options options) : options_(options) {}

LocalFarm::~LocalFarm() { stop(); }

Result<std::unique_ptr<LocalFarm>> LocalFarm::open(Options options) {
  std::unique_ptr<LocalFarm> farm(new LocalFarm(options));
  coordinator::Coordinator::Options o;
  o.blobs = farm->blobs_;
  o.clock = std::make_shared<SystemClock>();
  o.denoise_threads = options.threads;
  o.tick = std::chrono::milliseconds(100);
  auto opened = coordinator::Coordinator::open(std::move(o));
  if (!opened) return tl::unexpected(opened.error());
  farm->coordinator_ = std::move(*opened);
  return farm;
}

Result<Digest> LocalFarm::adopt(const std::filesystem::path& file) {
  auto digest = sha256_file(file);
  if (!digest) return digest;
  if (const auto adopted = blobs_->adopt(*digest, file); !adopted) return tl::unexpected(adopted.error());
  return digest;
}

tl::expected<JobId, coordinator::Rejected> LocalFarm::submit(const LocalScene& scene, const JobSpec& spec) {
  for (const auto& [name, file] : scene.files)
    if (const auto adopted = blobs_->adopt(file.digest, file.path); !adopted)
      return tl::unexpected(coordinator::Rejected{adopted.error(), {}});
  return coordinator_->submit(submit_request(scene, spec));
}

Result<std::unique_ptr<worker::RenderBackend>> LocalFarm::make_backend() const {
  if (!options_.isolate) return worker::make_inprocess_backend(options_.threads);
  worker::ChildOptions child;
  child.arguments = {kRenderChildFlag, std::to_string(options_.threads)};
  child.slots = options_.threads;
  return worker::make_child_backend(std::move(child));
}

Result<void> LocalFarm::start(std::function<void(const UnitResult&)> on_result) {
  auto backend = make_backend();
  if (!backend) return tl::unexpected(backend.error());
  backend_ = std::make_unique<Watched>(std::move(*backend), clock_);
  link_ = std::make_unique<LocalLink>(*coordinator_, std::move(on_result));
  worker::AgentOptions agent;
  agent.threads = options_.threads;
  agent.hello.name = "this machine";
  agent.hello.build = LIGHTSHAFT_VERSION;
  agent.hello.memory_bytes = worker::usable_memory_bytes();
  agent_ = std::make_unique<worker::Agent>(std::move(agent), *link_, *backend_, files_, clock_);
  thread_ = std::jthread([this] {
    const auto ended = agent_->run();
    if (ended) return;
    {
      const std::lock_guard lock(mutex_);
      agent_error_ = ended.error();
    }
    for (const auto& job : coordinator_->jobs()) (void)coordinator_->cancel(job.id);
  });
  return {};
}

void LocalFarm::stop() {
  if (agent_) agent_->stop();
  if (thread_.joinable()) thread_.join();
}

double LocalFarm::load_seconds() const {
  if (!backend_) return 0;
  const std::lock_guard lock(backend_->mutex);
  return backend_->load_seconds;
}

std::optional<std::string> LocalFarm::scene_fault() const {
  if (!backend_) return std::nullopt;
  const std::lock_guard lock(backend_->mutex);
  return backend_->fault;
}

std::optional<Error> LocalFarm::agent_error() const {
  const std::lock_guard lock(mutex_);
  return agent_error_;
}

int run_render_child(const char* threads) {
  int count = 0;
  const char* end = threads + std::strlen(threads);
  if (std::from_chars(threads, end, count).ptr != end || count < 1) return 2;
  worker::child::confine(worker::usable_memory_bytes());
  const auto limit = render::limit_threads(count);
  const auto backend = worker::make_inprocess_backend(count);
  return worker::child::serve(*backend, count);
}

}  // namespace ls::cli
