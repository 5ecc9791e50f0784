#include "cli/local/local_farm.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "coordinator/store/files.h"
#include "core/base/machine_memory.h"
#include "core/base/parse_number.h"
#include "formats/read.h"
#include "util/protocol/limits.h"
#include "util/sandbox/call_filter.h"
#include "worker/child/child.h"
#include "worker/child/serve.h"
#include "worker/inprocess.h"
#include "worker/machine.h"
#include "worker/render/render.h"

namespace ls::cli {
namespace {

class ObserverSink final : public coordinator::WorkerSink {
 public:
  explicit ObserverSink(std::shared_ptr<worker::LinkObserver> observer) : observer_(std::move(observer)) {}
  void send(ToWorker message) override { observer_->received(std::move(message)); }
  void close() override { observer_->lost({Errc::unavailable, "the coordinator has closed the stream"}); }

 private:
  std::shared_ptr<worker::LinkObserver> observer_;
};

}  // namespace

Result<void> LocalLink::connect(const WorkerHello& hello, std::shared_ptr<worker::LinkObserver> observer) {
  auto session = coordinator_.connect(hello, std::make_shared<ObserverSink>(std::move(observer)));
  if (!session) return tl::unexpected(session.error());
  session_ = std::move(*session);
  return {};
}

void LocalLink::send(FromWorker message) {
  if (!session_) return;
  if (const auto* result = std::get_if<UnitResult>(&message); result && on_result_) on_result_(*result);
  session_->receive(std::move(message));
}

void LocalLink::close() {
  if (!session_) return;
  session_->disconnected();
  session_.reset();
}

Result<void> LocalLink::fetch_blob(const worker::BlobRequest& wanted,
                                   const std::function<Result<void>(std::span<const std::byte>)>& sink) {
  const auto size = coordinator_.blobs().size(wanted.digest);
  if (!size) return tl::unexpected(size.error());
  for (std::uint64_t offset = wanted.offset; offset < *size;) {
    const auto length = std::min<std::uint64_t>(limits::kBlobChunkBytes, *size - offset);
    const auto bytes = coordinator_.blobs().read(wanted.digest, offset, length);
    if (!bytes) return tl::unexpected(bytes.error());
    if (auto taken = sink(*bytes); !taken) return taken;
    offset += length;
  }
  return {};
}

namespace {

struct HereFile final : worker::BlobFile {
  explicit HereFile(std::filesystem::path p) : file(std::move(p)) {}
  const std::filesystem::path& path() const override { return file; }
  std::filesystem::path file;
};

// A file in memory. Its path leads through this process's /proc entry, so that a render child can open it
// too.
struct MemoryFile final : worker::BlobFile {
  explicit MemoryFile(coordinator::File f)
      : file(std::move(f)), name(fmt::format("/proc/{}/fd/{}", ::getpid(), file.fd())) {}
  const std::filesystem::path& path() const override { return name; }
  coordinator::File file;
  std::filesystem::path name;
};

}  // namespace

Result<std::shared_ptr<const worker::BlobFile>> LocalBlobFiles::acquire(const BlobRef& blob,
                                                                        const std::atomic<bool>& /*stop*/) {
  if (auto path = blobs_->adopted(blob.digest)) return std::make_shared<const HereFile>(std::move(*path));
  const auto size = blobs_->size(blob.digest);
  if (!size) return tl::unexpected(size.error());
  const auto bytes = blobs_->read(blob.digest, 0, *size);
  if (!bytes) return fail(Errc::failed_precondition, bytes.error().message);
  coordinator::File file(::memfd_create("lightshaft-blob", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (!file)
    return fail(Errc::failed_precondition,
                fmt::format("no file in memory can be made: {}", std::strerror(errno)));
  auto memory = std::make_shared<const MemoryFile>(std::move(file));
  if (auto written = coordinator::write_all(memory->file, *bytes, memory->path()); !written)
    return fail(Errc::failed_precondition, written.error().message);
  // Nobody changes the file through its path any more, such as a render child of a malicious scene.
  ::fcntl(memory->file.fd(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE | F_SEAL_SEAL);
  return memory;
}

// Forwards all calls to a backend, and records how long loading took and, if it failed because of the scene,
// the reason.
struct LocalFarm::Watched final : worker::RenderBackend {
  Watched(std::unique_ptr<worker::RenderBackend> b, const Clock& c) : backend(std::move(b)), clock(c) {}

  Digest numeric_class() const override { return backend->numeric_class(); }
  std::string platform() const override { return backend->platform(); }
  tl::expected<void, UnitFailure> prepare(const worker::LocalJob& job,
                                          const std::atomic<bool>& stop) override {
    const TimePoint start = clock.now();
    auto ready = backend->prepare(job, stop);
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
  o.scenes = scenes_in_this_process;
  o.tick = std::chrono::milliseconds(100);
  o.views = options.views;
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
      return coordinator::rejected(adopted.error());
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
  agent.hello.memory_bytes = usable_memory_bytes();
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
  const int count = parse_number<int>(threads).value_or(0);
  if (count < 1) return 2;
  worker::child::confine(usable_memory_bytes());
  limit_calls();  // files are not restricted: those of a scene may be anywhere
  const auto limit = render::limit_threads(count);
  const auto backend = worker::make_inprocess_backend(count);
  return worker::child::serve(*backend, count);
}

}  // namespace ls::cli
