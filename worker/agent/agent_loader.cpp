// The agent's loader thread. It prepares jobs ahead of need: it fetches their blobs (files), then lets the
// backend build their worlds (scenes ready to render). It does both without holding the agent's mutex.
#include <fmt/format.h>

#include <exception>
#include <new>

#include "core/base/log.h"
#include "util/protocol/limits.h"
#include "worker/agent/agent_impl.h"

namespace ls::worker {
namespace {
// A job whose world does not fit beside those in memory waits this long for the end of their jobs' units.
// Then units that came after its own wait for it. So no job waits for ever, and worlds are not exchanged all
// the time.
constexpr Duration kRoomWait = std::chrono::seconds(30);
constexpr std::size_t kBlobsTraced = 64;  // at most this many blob transfers of a scene are traced
constexpr Duration kTransferRetry = std::chrono::milliseconds(500);
// After this many transfers of a job's files that were cut, the worker gives the job's units back: others may
// reach the coordinator better. What has arrived stays in the cache.
constexpr int kTransfersCut = 20;
// If this machine could not load a job, progress reports state the reason until this long after
// Job::retry_at, the time at which loading may be tried again. A worker that still has units of the job tries
// again by then, so an older reason concerns a job of which it has no units any more.
constexpr Duration kTroubleShown = std::chrono::seconds(30);

// True if the error is a problem of this machine, such as a full disk. Such an error must not count as a
// failure of the units that were to be rendered.
bool of_this_machine(const Error& error) {
  return error.code == Errc::resource_exhausted || error.code == Errc::internal;
}
}  // namespace

std::string lost_file(const LocalJob& job) {
  std::error_code error;
  for (const auto& [digest, path] : job.assets)
    if (!std::filesystem::exists(path, error))
      return fmt::format("its file {} was removed from the cache while it was in use", path.string());
  return {};
}

void Agent::Impl::load_loop(std::stop_token token) {
  std::unique_lock lock(mutex);
  while (!token.stop_requested()) {
    const std::optional<JobId> next = next_to_load();
    if (next && make_room(*next)) {
      Job& job = jobs.at(*next);
      job.state = Job::State::loading;
      loaded_job = *next;
      stop_loading = token.stop_requested();
      const JobBrief brief = job.brief;
      lock.unlock();
      try_to_load(brief);
      lock.lock();
      loaded_job.reset();
    } else {
      // The timeout is needed because a job becomes loadable again when its retry_at has passed, and nothing
      // notifies this thread of that. It is notified of all other changes.
      work.wait_for(lock, token, kTransferRetry, [&] { return can_load(); });
    }
  }
}

std::optional<JobId> Agent::Impl::next_to_load() {
  for (const JobId& id : table.wanted()) {
    const auto it = jobs.find(id);
    if (it != jobs.end() && it->second.state == Job::State::idle && it->second.lost.empty() &&
        clock.now() >= it->second.retry_at)
      return id;
  }
  return std::nullopt;
}

bool Agent::Impl::can_load() {
  const std::optional<JobId> next = next_to_load();
  return next && make_room(*next);
}

bool Agent::Impl::room_overdue() const {
  return room_wanted && clock.now() - room_wanted->since >= kRoomWait;
}

bool Agent::Impl::make_room(const JobId& job) {
  if (!room_wanted || room_wanted->job != job) room_wanted = {job, clock.now()};
  std::size_t kept = 0;
  auto idlest = jobs.end();
  for (auto it = jobs.begin(); it != jobs.end(); ++it) {
    if (it->second.state != Job::State::ready) continue;
    ++kept;
    const bool needed = room_overdue() ? table.needs_before(it->first, job) : table.holds(it->first);
    if (!needed && (idlest == jobs.end() || it->second.last_use < idlest->second.last_use)) idlest = it;
  }
  if (kept >= limits::kWorldsKept) {
    if (idlest == jobs.end()) return false;
    idlest->second.state = Job::State::idle;
    idlest->second.files.clear();
    idlest->second.local.reset();
    backend.forget(idlest->first);
  }
  room_wanted.reset();
  return true;
}

std::optional<trace::SpanContext> Agent::Impl::trace_of(const JobId& job) const {
  if (!options.tracer) return std::nullopt;
  const std::lock_guard lock(mutex);
  const auto first = table.first_waiting(job);
  return first ? first->trace : std::nullopt;
}

Agent::Impl::LoadSpan::LoadSpan(const Impl& a, const JobId& id, TimePoint at)
    : agent(a),
      job(id),
      begin(at),
      parent(a.trace_of(id)),
      own(parent ? trace::SpanContext{parent->trace, a.options.tracer->new_span_id(), true}
                 : trace::SpanContext{}) {}

Agent::Impl::LoadSpan::~LoadSpan() {
  if (!parent) return;
  const trace::Tracer& tracer = *agent.options.tracer;
  agent.options.tracer->record(
      {.context = own,
       .parent = parent->span,
       .name = "load scene",
       .start_ns = tracer.unix_ns(begin),
       .end_ns = tracer.unix_ns(loaded_at ? *loaded_at : agent.clock.now()),
       .attributes = {{"lightshaft.job", job.value}, {"lightshaft.worker", agent.options.hello.name}},
       .failed = !loaded_at});
}

void Agent::Impl::try_to_load(const JobBrief& brief) {
  try {
    load(brief);
  } catch (const std::bad_alloc&) {
    loading_failed(brief, UnitFailure{.reason = "out of memory while loading the scene"});
  } catch (const std::exception& e) {
    loading_failed(brief, UnitFailure{.reason = std::string("cannot load the scene: ") + e.what()});
  }
}

void Agent::Impl::load(const JobBrief& brief) {
  const JobId& id = brief.job;
  auto local = std::make_shared<LocalJob>();
  std::vector<std::shared_ptr<const BlobFile>> pins;
  const TimePoint begin = clock.now();
  LoadSpan span(*this, id, begin);
  std::vector<BlobRef> blobs = {{brief.scene, 0, "the scene"}};
  blobs.insert(blobs.end(), brief.assets.begin(), brief.assets.end());
  for (const BlobRef& blob : blobs) {
    {
      const std::lock_guard lock(mutex);
      loading = blob.name;
    }
    const TimePoint asked = span.parent ? clock.now() : TimePoint{};
    auto file = files.acquire(blob, stop_loading);
    if (span.parent && pins.size() < kBlobsTraced)
      record("fetch blob", span.own, asked, clock.now(),
             {{"lightshaft.blob", blob.digest.hex()},
              {"lightshaft.bytes", static_cast<std::int64_t>(blob.bytes)}},
             !file);
    if (!file && file.error().code == Errc::unavailable) return hold_off(brief, file.error().message, true);
    if (!file && of_this_machine(file.error()))
      return hold_off(brief, fmt::format("cannot get '{}': {}", blob.name, file.error().message));
    if (!file || stop_loading)
      return loading_failed(brief,
                            UnitFailure{.reason = fmt::format("cannot get '{}': {}", blob.name,
                                                              file ? "told to stop" : file.error().message)});
    if (blob.digest == brief.scene) local->scene = (*file)->path();
    local->assets[blob.digest] = (*file)->path();
    pins.push_back(std::move(*file));
  }
  local->brief = brief;
  const TimePoint start = clock.now();
  auto prepared = backend.prepare(*local, stop_loading);
  if (span.parent) {
    const TimePoint end = clock.now();
    record("build world", span.own, start, end, {{"lightshaft.job", id.value}}, !prepared);
    if (prepared) span.loaded_at = end;
  }
  if (!prepared && backend.broken()) return hold_off(brief, prepared.error().reason);
  if (!prepared)
    if (const std::string lost = lost_file(*local); !lost.empty()) return hold_off(brief, lost);
  if (!prepared) return loading_failed(brief, std::move(prepared.error()));
  const std::lock_guard lock(mutex);
  load_seconds = seconds(clock.now() - start);
  Job* const job = end_loading(brief);
  if (!job) return;
  job->state = Job::State::ready;
  job->local = std::move(local);
  job->files = std::move(pins);
  job->last_use = ++uses;
  job->trouble.clear();
  job->transfers_cut = 0;
  job->unreported.load += seconds(start - begin);
  job->unreported.build += load_seconds;
  trouble_backoff.reset();
  work.notify_all();
}

Agent::Impl::Job* Agent::Impl::end_loading(const JobBrief& brief) {
  loading.clear();
  const auto it = jobs.find(brief.job);
  const bool replaced =
      it == jobs.end() || it->second.state != Job::State::loading || it->second.brief != brief;
  if (replaced) {
    backend.forget(brief.job);  // the world of the job that it was
    return nullptr;
  }
  it->second.state = Job::State::idle;
  return &it->second;
}

// Reports one unit of the job as failed and returns its other units to the coordinator. So a job that this
// worker cannot load costs one failed attempt instead of hundreds.
void Agent::Impl::loading_failed(const JobBrief& brief, UnitFailure failure) {
  const JobId& id = brief.job;
  const std::lock_guard lock(mutex);
  if (!end_loading(brief) || stop_loading) return;
  backend.forget(id);
  const std::string reason = failure.reason;
  log_warn(fmt::format("job={}", id.value), "cannot be loaded: " + reason);
  if (const auto first = table.take([&](const JobId& job) { return job == id; })) {
    failure.unit = first->key;
    failure.lease = first->lease;
    table.finish(first->key);
    outbox.add(std::move(failure));
  }
  for (LeaseReturned& returned : table.return_waiting(id, reason)) outgoing.push_back(std::move(returned));
  inbox->nudge();
}

// Returns the job's units to the coordinator, so that other workers can render them. If units of the job are
// assigned to this worker again, they wait until the next attempt to load the job. If only a transfer was
// cut, the worker keeps the units and soon tries again, unless too many were cut in a row.
void Agent::Impl::hold_off(const JobBrief& brief, std::string trouble, bool transfer_cut) {
  const JobId& id = brief.job;
  const std::lock_guard lock(mutex);
  Job* const job = end_loading(brief);
  if (!job || stop_loading) return;
  if (transfer_cut) {
    // While the stream is down, no transfer can succeed, and the coordinator takes the units back anyway
    if (connection != Connection::up || ++job->transfers_cut < kTransfersCut) {
      job->retry_at = clock.now() + kTransferRetry;
      return log_warn(fmt::format("job={}", id.value), "a transfer was cut, trying again: " + trouble);
    }
    job->transfers_cut = 0;
    trouble = fmt::format("{} transfers of its files were cut; the last: {}", kTransfersCut, trouble);
  }
  const Duration pause = trouble_backoff.next();
  job->retry_at = clock.now() + pause;
  job->trouble = trouble;
  log_warn(fmt::format("job={}", id.value),
           fmt::format("{}; giving its units back, trying again in {:.1f} s", trouble, seconds(pause)));
  for (LeaseReturned& returned : table.return_waiting(id, trouble)) outgoing.push_back(std::move(returned));
  inbox->nudge();
}

std::string Agent::Impl::trouble() const {
  for (const auto& [id, job] : jobs)
    if (!job.trouble.empty() && clock.now() < job.retry_at + kTroubleShown) return job.trouble;
  return {};
}

}  // namespace ls::worker
