// Opens and closes the service, and runs its threads.
#include "coordinator/service/coordinator.h"

#include <fmt/format.h>

#include <chrono>
#include <random>

#include "common/base/log.h"
#include "common/base/secret.h"
#include "coordinator/base/periodic.h"
#include "coordinator/service/service_impl.h"
#include "coordinator/store/blobs/memory_blobs.h"
#include "coordinator/store/blobs/open_blobs.h"
#include "coordinator/store/redis/redis_job_store.h"

namespace ls::coordinator {

double unix_now() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

Result<void> check_store(const std::string& store) {
  if (store == "sqlite") return {};
  if (!store.starts_with("redis"))
    return fail(Errc::invalid_argument,
                fmt::format("--store '{}' is unknown; use sqlite, or redis://HOST:PORT/DB", store));
  const auto address = parse_redis_url(store);
  return address ? Result<void>() : tl::unexpected(address.error());
}

JoinCheck join_check(std::string token) {
  return [token = std::move(token)](std::string_view shown) {
    return token.empty() || equal_secret(shown, token);
  };
}

namespace {
// Time between two checks whether the blob store answers
constexpr Duration kBlobsLookedAt = std::chrono::seconds(5);

Result<std::unique_ptr<JobStore>> open_store(const Coordinator::Options& options, const std::string& node) {
  if (auto known = check_store(options.store); !known) return tl::unexpected(known.error());
  auto local = open_sqlite_job_store(options.data / "jobs.sqlite");
  if (!local || options.store == "sqlite") return local;
  RedisStoreOptions redis{.address = *parse_redis_url(options.store)};
  if (options.shared) redis.node = node;
  return open_redis_job_store(std::move(*local), std::move(redis));
}

// Returns a random number, used as the seed that decides which results are rendered again: workers must not
// be able to predict it.
std::uint64_t random_number() {
  std::random_device device;
  return std::uint64_t{device()} << 32 | device();
}

}  // namespace

Result<std::unique_ptr<Coordinator>> Coordinator::open(Options options) {
  return Service::open(std::move(options));
}

Result<std::unique_ptr<Coordinator>> Service::open(Options options) {
  if (!options.may_join) options.may_join = join_check(options.join_token);
  if (!options.clock) options.clock = std::make_shared<SystemClock>();
  std::shared_ptr<BlobStore> blobs = options.blobs;
  std::shared_ptr<JobStore> store = options.jobs;
  File lock;
  if (options.data.empty()) {
    if (!blobs) blobs = std::make_shared<MemoryBlobs>();
    if (!store) store = make_memory_job_store();
  } else {
    if (auto made = make_folder(options.data / "jobs"); !made) return tl::unexpected(made.error());
    auto locked = lock_folder(options.data);
    if (!locked) return tl::unexpected(locked.error());
    lock = std::move(*locked);
    const auto node = node_id(options.data);
    if (!node) return tl::unexpected(node.error());
    if (!store) {
      auto opened = open_store(options, *node);
      if (!opened) return tl::unexpected(opened.error());
      store = std::move(*opened);
    }
    if (!blobs) {
      auto kept = open_blobs(options.blobs_at, options.data, *node);
      if (!kept) return tl::unexpected(kept.error());
      blobs = std::move(*kept);
    }
  }
  const auto start = store->reserve("starts", 1);
  if (!start) return tl::unexpected(start.error());
  auto collected = std::make_shared<CollectedBlobs>(std::move(blobs), options.clock, options.keep_unused);
  std::unique_ptr<Service> service(
      new Service(std::move(options), std::move(collected), std::move(store), std::move(lock), *start + 1));
  if (auto restored = service->restore(); !restored) return tl::unexpected(restored.error());
  service->start_threads();
  return service;
}

Service::Service(Options options, std::shared_ptr<CollectedBlobs> blobs, std::shared_ptr<JobStore> store,
                 File lock, std::uint64_t start)
    : options_(std::move(options)),
      blobs_(std::move(blobs)),
      store_(std::move(store)),
      lock_(std::move(lock)),
      start_(start),
      farm_(Farm::Options{lease_prefix(), options_.limits, options_.audit_rate, random_number()}),
      last_epoch_(start << 32),
      denoising_(options_.denoise_threads > 0 ? options_.denoise_threads
                                              : static_cast<int>(std::thread::hardware_concurrency()),
                 options_.denoiser, options_.clock),
      hub_(std::make_unique<EventHub>([this](std::uint64_t n) { return store_->reserve("events", n); })) {}

void Service::start_threads() {
  for (int i = 0; i < limits::kVerifyThreads; ++i)
    threads_.emplace_back([this](const std::stop_token& token) { verify_loop(token); });
  threads_.emplace_back([this](const std::stop_token& token) { commit_loop(token); });
  threads_.emplace_back([this](const std::stop_token& token) {
    while (!token.stop_requested())
      for (auto& write : background_writes_.pop(1, token)) write();
  });
  threads_.emplace_back([this](const std::stop_token& token) {
    while (!token.stop_requested())
      for (auto& comparison : comparisons_.pop(1, token)) comparison();
  });
  threads_.emplace_back([this](const std::stop_token& token) {
    while (!token.stop_requested())
      for (const auto& missing_blobs : looks_.pop(1, token)) look_for(missing_blobs);
  });
  if (!options_.tick) return;
  if (on_disk()) threads_.emplace_back([this](const std::stop_token& token) { collect_loop(token); });
  if (!options_.blobs_at.empty())
    threads_.emplace_back(
        [this](const std::stop_token& token) { every(kBlobsLookedAt, token, [&] { look_at_blobs(); }); });
  threads_.emplace_back(
      [this](const std::stop_token& token) { every(*options_.tick, token, [&] { tick(); }); });
}

// Accepted results are durable already, and workers send those again that were not acknowledged. So nothing
// is flushed here, and after a clean shutdown the state is the same as after a crash.
Service::~Service() {
  *alive_ = false;
  budget_.close();
  for (auto& thread : threads_) thread.request_stop();
  threads_.clear();
  const std::lock_guard lock(mutex_);
  for (auto& [id, worker] : workers_) {
    if (worker.connection && worker.connection->open) {
      worker.connection->open = false;
      worker.connection->sink->close();
    }
  }
}

void Service::tick() {
  look_for_moved_jobs();
  const std::lock_guard lock(mutex_);
  for (const auto& [id, worker] : workers_)
    if (worker.connection && worker.connection->open && worker.connection->held_back)
      run_locked(ResultsWait{id});
  run_locked(Tick{});
  look_for_missing_locked();
  for (const auto& [id, entry] : entries_)
    if (entry->progress_due) publish_progress_locked(*entry);
  for (const auto& [id, sequence] : sequences_)
    if (sequence.progress_due) publish_sequence_locked(id, false);
}

bool Service::ready(std::string* why_not) const {
  const std::lock_guard lock(mutex_);
  const std::string& trouble = store_trouble_.empty() ? blobs_trouble_ : store_trouble_;
  if (why_not) *why_not = trouble;
  return trouble.empty();
}

// Checks whether the blob store is available. It may be that nobody requests a blob for hours, so requests
// alone would not tell.
void Service::look_at_blobs() {
  const auto answer = blobs_->answers();
  const std::string trouble = answer ? "" : "the store of blobs does not answer: " + answer.error().message;
  const std::lock_guard lock(mutex_);
  if (trouble.empty() != blobs_trouble_.empty())
    trouble.empty() ? log_info("", "the store of blobs answers again") : log_warn("", trouble);
  blobs_trouble_ = trouble;
}

std::shared_ptr<void> Service::subscribe(std::uint64_t after_id,
                                         std::function<void(const StreamEvent&)> on_event) {
  return hub_->subscribe(after_id, std::move(on_event));
}

std::uint64_t Service::last_event_id() const { return hub_->last_id(); }

}  // namespace ls::coordinator
