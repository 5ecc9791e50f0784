#include "coordinator/service/coordinator.h"

#include <fmt/format.h>

#include <algorithm>
#include <random>
#include <thread>

#include "coordinator/base/work_queue.h"
#include "coordinator/service/blob_watch.h"
#include "coordinator/service/core.h"
#include "coordinator/service/open_stores.h"
#include "coordinator/service/pictures.h"
#include "coordinator/service/state/job_views.h"
#include "coordinator/service/submission.h"
#include "coordinator/service/videos.h"
#include "coordinator/service/worker_sessions.h"
#include "coordinator/store/blobs/memory_blobs.h"
#include "coordinator/store/files.h"
#include "core/base/log.h"
#include "core/base/secret.h"

namespace ls::coordinator {

JoinCheck join_check(std::string token) {
  return [token = std::move(token)](std::string_view shown) {
    return token.empty() || equal_secret(shown, token);
  };
}

namespace {
// Time between two checks whether the blob store is available
constexpr Duration kBlobsLookedAt = std::chrono::seconds(5);

// Returns a random seed, which decides which results are audited (rendered again by another worker). Workers
// must not be able to predict it.
std::uint64_t random_number() {
  std::random_device device;
  return std::uint64_t{device()} << 32 | device();
}

// Returns the number of this start, which no other start has. If it cannot be stored, as on a full disk,
// takes a random one that is larger than any that is counted: a coordinator must run so that somebody can
// remove jobs.
std::uint64_t next_start(JobStore& store) {
  const auto before = store.reserve("starts", 1);
  if (before) return *before + 1;
  log_error("", fmt::format("{}; the coordinator runs nevertheless, so that jobs can be removed",
                            before.error().message));
  constexpr std::uint64_t kUncounted = std::uint64_t{1} << 30;
  return kUncounted + (random_number() & (kUncounted - 1));
}

}  // namespace

// The parts of the coordinator, each with its own state. Most parts use only parts that are declared above
// them.
struct Coordinator::Parts {
  Parts(Options o, std::shared_ptr<BlobStore> inner, std::shared_ptr<JobStore> s, File l, std::uint64_t n)
      : options(std::move(o)),
        store(std::move(s)),
        lock(std::move(l)),
        start(n),
        blobs(std::move(inner), options.clock, options.keep_unused) {}
  void start_threads();
  void stop();  // returns when no thread runs any more
  void tick();

  const Options options;
  const std::shared_ptr<JobStore> store;
  const File lock;
  const std::uint64_t start;  // how many times this job store was opened, this time included
  const std::string lease_prefix = fmt::format("l{}", start);
  const Tracing tracing{options.tracer, lease_prefix};
  const Clock& clock = *options.clock;
  CollectedBlobs blobs;
  const JobFiles files{options.data, options.shared};
  Denoising denoising{options.denoise_threads > 0 ? options.denoise_threads
                                                  : static_cast<int>(std::thread::hardware_concurrency()),
                      options.denoiser, clock, blobs};
  BackgroundWrites writes;
  std::atomic<std::uint64_t> blob_bytes{0};

  Guarded<Core> core{Farm::Options{lease_prefix, options.limits, options.audit_rate, random_number()},
                     options.shared,
                     clock,
                     *store,
                     files,
                     hub,
                     writes,
                     images,
                     comparer,
                     tracing};
  ReferenceComparer comparer{core, blobs};
  ImageWriter images{core, files, blobs, denoising, comparer, writes, clock};
  Pictures pictures{core, *store, files, blobs, denoising, options.views.get(), clock};
  Videos videos{core, files, pictures, clock};
  Submission submission{core, *store, files, blobs, options.scenes, denoising, clock, options.film_bytes};
  const Restore restore{*store, files, blobs, clock};
  JobCommands commands{core, *store, files, restore, images, writes, clock};
  BlobWatch blob_watch{core, blobs, commands, options.keep_unused, clock};
  Takeover takeover{core, *store, files, blobs, restore, writes, clock};
  ResultPipeline results{core, writes, clock};
  WorkerSessions sessions{
      core,
      results,
      {options.may_join, options.allow_fake, options.version, start, lease_prefix,
       options.worker_key.empty() ? fmt::format("{:x}{:x}{:x}{:x}", random_number(), random_number(),
                                                random_number(), random_number())
                                  : options.worker_key},
      clock};
  EventHub hub{[this](std::uint64_t count) { return store->reserve("events", count); }};
  std::vector<std::jthread> threads;
};

void Coordinator::Parts::start_threads() {
  using Stop = const std::stop_token&;
  const auto run = [this](auto loop) { threads.emplace_back(std::move(loop)); };
  for (int i = 0; i < limits::kVerifyThreads; ++i) run([this](Stop stop) { results.verify_loop(stop); });
  run([this](Stop stop) { results.commit_loop(stop); });
  run([this](Stop stop) {
    while (!stop.stop_requested())
      for (auto& write : writes.pop(1, stop)) write();
  });
  run([this](Stop stop) { comparer.loop(stop); });
  if (files.on_disk()) run([this](Stop stop) { videos.loop(stop); });
  run([this](Stop stop) { blob_watch.look_loop(stop); });
  if (!options.tick) return;
  if (files.on_disk()) run([this](Stop stop) { blob_watch.collect_loop(stop); });
  if (!options.blobs_at.empty())
    run([this](Stop stop) { every(kBlobsLookedAt, stop, [&] { blob_watch.check_store(); }); });
  run([this](Stop stop) { every(*options.tick, stop, [&] { tick(); }); });
}

// Accepted results are durable already, and workers send unacknowledged results again. So after a clean
// shutdown the state is the same as after a crash, but for records that a full disk had refused.
void Coordinator::Parts::stop() {
  core.lock()->records.retry();
  sessions.abandon();
  results.close();
  for (auto& thread : threads) thread.request_stop();
  threads.clear();
  sessions.close();
  hub.close();
}

void Coordinator::Parts::tick() {
  if (options.shared) takeover.look_for_moved_jobs();
  const auto locked = core.lock();
  sessions.report_held_back(*locked);
  locked->records.retry();
  locked->driver.run(Tick{});
  blob_watch.look_if_due(*locked);
  images.write_again_if_due(*locked);
  locked->publisher.publish_due();
}

Result<std::unique_ptr<Coordinator>> Coordinator::open(Options options) {
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
      auto opened = open_jobs(options.store, options.data, options.shared, *node);
      if (!opened) return tl::unexpected(opened.error());
      store = std::move(*opened);
    }
    if (!blobs) {
      auto kept = open_blobs(options.blobs_at, options.data, *node);
      if (!kept) return tl::unexpected(kept.error());
      blobs = std::move(*kept);
    }
  }
  const std::uint64_t start = next_start(*store);
  auto parts =
      std::make_unique<Parts>(std::move(options), std::move(blobs), std::move(store), std::move(lock), start);
  if (auto restored = parts->restore.restart(*parts->core.lock()); !restored)
    return tl::unexpected(restored.error());
  parts->start_threads();
  return std::unique_ptr<Coordinator>(new Coordinator(std::move(parts)));
}

Coordinator::Coordinator(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
// stop() returns when all threads have ended. Only then are the parts destroyed, because listeners may call
// this object until then.
Coordinator::~Coordinator() { parts_->stop(); }

// Jobs

tl::expected<JobId, Rejected> Coordinator::submit(SubmitRequest request) {
  return parts_->submission.submit(request);
}

Result<JobId> Coordinator::submit_again(const JobId& before, const JobSpec& changes, const std::string& owner,
                                        const std::string& traceparent) {
  return parts_->submission.submit_again(before, changes, owner, traceparent);
}

JobsPage Coordinator::list(const JobsAsked& asked) const { return list_jobs(parts_->core, asked); }

std::vector<JobView> Coordinator::jobs() const {
  const auto core = parts_->core.lock();
  std::vector<JobView> all;
  for (const JobId& id : core->jobs.order()) {
    const Sequence* sequence = core->jobs.sequence(id);
    all.push_back(sequence ? core->views.sequence(id, *sequence, false)
                           : core->views.job(*core->jobs.find(id)));
  }
  return all;
}

Result<JobView> Coordinator::job(const JobId& id) const {
  const auto core = parts_->core.lock();
  if (const Sequence* sequence = core->jobs.sequence(id)) return core->views.sequence(id, *sequence, true);
  const auto entry = core->jobs.job(id);
  if (!entry) return tl::unexpected(entry.error());
  return core->views.job(**entry);
}

Result<std::string> Coordinator::owner(const JobId& id) const { return parts_->core.lock()->jobs.owner(id); }

std::uint64_t Coordinator::picture_bytes(const JobId& id, std::uint64_t more_per_pixel) const {
  const auto core = parts_->core.lock();
  const auto jobs = core->jobs.job_or_frames(id);
  std::uint64_t most = 0;
  if (jobs)
    for (const EntryPtr& entry : *jobs)
      most = std::max(most, entry->film_bytes + more_per_pixel * entry->stored.settings.size.pixels());
  return most;
}

Result<void> Coordinator::change(const JobId& id, const JobChange& change) {
  return parts_->commands.change(id, change);
}

Result<void> Coordinator::remove(const JobId& id) { return parts_->commands.remove(id); }

Result<void> Coordinator::cancel(const JobId& id) { return change(id, {JobState::cancelled, {}, {}, {}}); }

Result<void> Coordinator::wait(const JobId& id) const {
  auto core = parts_->core.lock();
  const auto jobs = core->jobs.job_or_frames(id);
  if (!jobs) return tl::unexpected(jobs.error());
  core.wait(core->ended, [&] {
    return std::all_of(jobs->begin(), jobs->end(), [&](const EntryPtr& entry) {
      const bool in_trouble = entry->stored.state == JobState::paused && !entry->trouble.empty();
      return entry->removed || is_terminal(entry->stored.state) || in_trouble;
    });
  });
  return {};
}

std::optional<trace::SpanContext> Coordinator::trace_of(const JobId& id) const {
  if (!parts_->tracing.tracer) return std::nullopt;
  const auto core = parts_->core.lock();
  const auto entry = core->jobs.find(id);
  return entry ? JobTrace::context_of(parts_->tracing, entry->stored) : std::nullopt;
}

// Images and reports

Result<std::vector<std::byte>> Coordinator::image_exr(const JobId& id,
                                                      const std::optional<LightMix>& mix) const {
  return parts_->pictures.image_exr(id, mix);
}

Result<std::vector<std::byte>> Coordinator::deep_exr(const JobId& id, bool while_rendering) const {
  return parts_->pictures.deep_exr(id, while_rendering);
}

Result<std::string> Coordinator::mix_json(const JobId& id, const LightMix& mix) const {
  return parts_->pictures.mix_json(id, mix);
}

Result<std::vector<std::byte>> Coordinator::image_png(const JobId& id, const Look& look,
                                                      const std::optional<LightMix>& mix) const {
  return parts_->pictures.image_png(id, look, mix);
}
const DisplayViews* Coordinator::display_views() const { return parts_->options.views.get(); }
Result<std::vector<std::uint16_t>> Coordinator::view_cube(const std::string& view) const {
  return parts_->pictures.cube_of(view);
}

Result<std::vector<std::byte>> Coordinator::thumbnail_png(const JobId& id) const {
  return parts_->pictures.thumbnail_png(id);
}

Result<VideoView> Coordinator::make_video(const JobId& id, const VideoAsked& asked) {
  return parts_->videos.make(id, asked);
}

Result<VideoView> Coordinator::video(const JobId& id) const { return parts_->videos.view(id); }

Result<std::filesystem::path> Coordinator::video_file(const JobId& id) const {
  return parts_->videos.file(id);
}

Result<std::vector<std::byte>> Coordinator::error_png(const JobId& id) const {
  return parts_->pictures.error_png(id);
}

Result<std::vector<std::byte>> Coordinator::samples_png(const JobId& id) const {
  return parts_->pictures.samples_png(id);
}

Result<std::string> Coordinator::report_json(const JobId& id) const {
  return parts_->pictures.report_json(id);
}

Result<std::string> Coordinator::meters_json(const JobId& id) const {
  return parts_->pictures.meters_json(id);
}

Result<std::vector<ConvergencePoint>> Coordinator::convergence(const JobId& id) const {
  const auto core = parts_->core.lock();
  const auto entry = core->jobs.job(id);
  if (!entry) return tl::unexpected(entry.error());
  return (*entry)->points;
}

Result<std::string> Coordinator::layers_json(const JobId& id) const {
  return parts_->pictures.layers_json(id);
}

Result<std::vector<std::byte>> Coordinator::pixels(const JobId& id, const PixelsAsked& asked) const {
  return parts_->pictures.pixels(id, asked);
}

std::filesystem::path Coordinator::final_file(const JobId& id, const std::string& name) const {
  return parts_->pictures.final_file(id, name);
}

Result<std::vector<TileView>> Coordinator::tiles(const JobId& id) const { return parts_->pictures.tiles(id); }

Result<std::string> Coordinator::job_log(const JobId& id) const { return parts_->pictures.log(id); }

// Workers

std::vector<WorkerView> Coordinator::workers() const {
  const auto core = parts_->core.lock();
  std::vector<WorkerView> all;
  for (const auto& [id, worker] : core->workers) all.push_back(core->views.worker(id, worker));
  return all;
}

Result<std::string> Coordinator::worker_log(const WorkerId& id) const {
  const auto core = parts_->core.lock();
  const auto worker = core->workers.find(id);
  if (worker == core->workers.end())
    return fail(Errc::not_found, fmt::format("there is no worker \"{}\"", id.value));
  return log_text(worker->second.log);
}

Result<void> Coordinator::drain_worker(const WorkerId& id, DrainNow how) {
  return parts_->sessions.drain(id, how);
}

Result<std::unique_ptr<WorkerSession>> Coordinator::connect(const WorkerHello& hello,
                                                            std::shared_ptr<WorkerSink> sink,
                                                            const std::string& principal) {
  return parts_->sessions.connect(hello, std::move(sink), principal);
}

// Events

std::shared_ptr<void> Coordinator::subscribe(std::uint64_t after_id,
                                             std::function<void(const StreamEvent&)> on_event) {
  return parts_->hub.subscribe(after_id, std::move(on_event));
}

std::uint64_t Coordinator::last_event_id() const { return parts_->hub.last_id(); }

// Stores, other coordinators, figures

BlobStore& Coordinator::blobs() { return parts_->blobs; }

void Coordinator::blob_missing(const Digest& digest, const Error& why) {
  parts_->blob_watch.missing(digest, why);
}

void Coordinator::blob_sent(std::uint64_t bytes) { parts_->blob_bytes += bytes; }

void Coordinator::collect() { parts_->blob_watch.collect(); }

bool Coordinator::ready(std::string* why_not) const {
  bool store_failed = false;
  {
    const auto core = parts_->core.lock();
    store_failed = !core->records.store_trouble().empty();
  }
  // Nothing else may be written for a long time, so whether the store takes records again is tried out.
  if (store_failed) {
    const auto taken = parts_->store->put_jobs({});
    parts_->core.lock()->records.note(taken);
  }
  const auto core = parts_->core.lock();
  const std::string& trouble =
      core->records.trouble().empty() ? parts_->blob_watch.trouble(*core) : core->records.trouble();
  if (why_not) *why_not = trouble;
  return trouble.empty();
}

StoreStatus Coordinator::store_status() const { return parts_->store->status(); }

void Coordinator::announce(const std::string& http, const std::string& grpc) {
  parts_->store->announce(http, grpc);
}

Result<std::optional<JobLocation>> Coordinator::locate_job(const JobId& id) {
  return parts_->store->locate_job(id);
}

AuditFigures Coordinator::audits() const { return parts_->core.lock()->driver.farm().audits(); }

FarmFigures Coordinator::figures() const {
  const auto core = parts_->core.lock();
  FarmFigures f = core->figures;
  f.blob_bytes = parts_->blob_bytes;
  f.background_writes_now = parts_->writes.size();
  parts_->results.put_figures(f);
  for (const auto& [id, worker] : core->workers)
    if (const auto figures = core->driver.farm().worker(id)) {
      f.leases_now += figures->leases;
      f.units_leased_now += figures->units_out;
    }
  for (const auto& [id, entry] : core->jobs.all())
    if (entry->assembly) f.waiting_now += entry->assembly->waiting();
  return f;
}

void Coordinator::tick() { parts_->tick(); }

}  // namespace ls::coordinator
