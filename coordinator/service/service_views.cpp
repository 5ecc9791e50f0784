// Makes the views: what clients see of jobs, tiles and workers (views/job_view.h).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/image/error/convergence.h"
#include "common/image/exr/final_image.h"
#include "common/image/exr/maps.h"
#include "coordinator/admission/admission.h"
#include "coordinator/assemble/job_report.h"
#include "coordinator/service/service_impl.h"

namespace ls::coordinator {

Service::EntryPtr Service::find_locked(const JobId& id) const {
  const auto found = entries_.find(id);
  return found == entries_.end() ? nullptr : found->second;
}

Result<Service::EntryPtr> Service::entry_locked(const JobId& id) const {
  if (auto entry = find_locked(id)) return entry;
  const auto frame = frame_of(id);
  const auto sequence = sequences_.find(frame ? frame->sequence : id);
  if (sequence == sequences_.end()) return fail(Errc::not_found, fmt::format("there is no job {}", id.value));
  const std::string frames =
      to_string(sequence_view_locked(sequence->first, sequence->second, false).frames->range);
  if (frame)
    return fail(Errc::not_found, fmt::format("job {} has no frame {}: its frames are {}",
                                             frame->sequence.value, frame->frame, frames));
  return fail(Errc::invalid_argument,
              fmt::format("job {} is a sequence: say which of its frames {} is meant", id.value, frames));
}

Result<std::string> Service::owner(const JobId& id) const {
  const std::lock_guard lock(mutex_);
  const auto sequence = sequences_.find(id);
  if (sequence != sequences_.end()) return sequence->second.frames.front()->stored.owner;
  if (const auto entry = find_locked(id)) return entry->stored.owner;
  // The id may be that of a frame that does not exist, of a sequence that does. Its owner is that of the
  // sequence, who then gets an error that names the frames.
  const auto frame = frame_of(id);
  const auto of = frame ? sequences_.find(frame->sequence) : sequences_.end();
  if (of != sequences_.end()) return of->second.frames.front()->stored.owner;
  return fail(Errc::not_found, fmt::format("there is no job {}", id.value));
}

// Returns the job, or an error if it could not be restored at the start: then only the reason is known, and
// the job can only be removed.
Result<Service::EntryPtr> Service::usable_locked(const JobId& id) const {
  auto entry = entry_locked(id);
  if (entry && !(*entry)->broken.empty()) return fail(Errc::failed_precondition, (*entry)->broken);
  return entry;
}

JobState Service::shown_state(const JobEntry& entry) const {
  return entry.stored.state;  // this stays `running` until finish() has written the final image
}

namespace {

double pixels_of(const TileGrid& grid) { return static_cast<double>(grid.frame.width) * grid.frame.height; }

// Returns the progress of a job with a number of samples, from 0 to 1. It counts samples, not units: units of
// late rounds have many times the samples of the first ones.
double done_of(const StoredJob& job, double spp_done) {
  return job.spp ? std::min(1.0, spp_done / static_cast<double>(even_spp(*job.spp))) : 0;
}

// Sets the convergence status, trend and efficiency of `v` from its curve.
void put_curve(JobView& v, const std::vector<ConvergencePoint>& all, const std::string& doubt) {
  const std::vector<ErrorPoint> points = error_points(all, !v.reference_same_seed);
  v.convergence_status = judge(points, doubt);
  v.trend = trend_of(points);
  const double cost = points.empty() ? 0 : points.back().relmse * points.back().core_seconds;
  if (cost > 0) v.efficiency = 1 / cost;
}

}  // namespace

// Predicts when the job is done. `v` must have its times and its samples so far already.
Eta Service::eta_locked(const JobEntry& entry, const JobFigures& figures, const JobView& v) const {
  const StoredJob& job = entry.stored;
  EtaInputs facts;
  facts.done = done_of(job, v.spp_done);
  facts.core_seconds = v.core_seconds;
  facts.core_left = figures.core_seconds_left;
  facts.core_to_limit = figures.core_seconds_to_limit;
  facts.target = job.spec.target_error;
  facts.time = job.spec.time;
  facts.elapsed = v.elapsed_seconds;
  const double cores = farm_.cores_connected();
  const int workers = farm_.workers_connected();
  facts.cores = figures.cores > 0 ? figures.cores : cores;
  const int room =
      job.spec.max_workers ? std::max(0, static_cast<int>(*job.spec.max_workers) - workers) : kMoreWorkers;
  if (workers > 0)
    facts.cores_with_more = facts.cores + static_cast<double>(std::min(room, kMoreWorkers)) * cores / workers;
  facts.units_at_once = static_cast<double>(entry.grid.count()) * kRoundsAhead;
  if (job.spec.max_units) facts.units_at_once = std::min<double>(facts.units_at_once, *job.spec.max_units);
  if (figures.units_total > figures.units_done)
    facts.unit_seconds =
        figures.core_seconds_to_limit / static_cast<double>(figures.units_total - figures.units_done);
  return eta_of(facts, error_points(entry.points));
}

JobView Service::view_locked(const JobEntry& entry) const {
  const StoredJob& job = entry.stored;
  JobView v;
  v.id = job.id;
  v.name = job.name;
  v.owner = job.owner;
  v.state = shown_state(entry);
  v.stopped = v.state == JobState::done && job.stopped ? std::string(to_string(*job.stopped)) : "";
  if (v.state == JobState::cancelled) v.stopped = to_string(StopReason::user);
  v.target_error = job.spec.target_error;
  v.denoise = job.spec.denoise;
  v.error = job.error.empty() ? entry.trouble : job.error;
  v.warnings = job.warnings;
  v.fake = job.fake;
  v.size = job.settings.size;
  v.tile = job.settings.tile;
  v.priority = job.spec.priority;
  v.max_workers = job.spec.max_workers;
  v.max_units = job.spec.max_units;
  v.memory_bytes = memory_need(job);
  v.elapsed_seconds = elapsed_locked(entry);
  v.core_seconds = job.totals.core_seconds;
  v.time = split_of(job.totals);
  v.submitted_unix = job.submitted_unix;
  v.health = entry.assembly ? entry.assembly->health().total() : job.totals.health;
  v.notes = health_notes(v.health, replay_of(job));
  v.spp = even_spp(job.spp.value_or(kMaxSppWithoutLimit));
  v.spp_asked = job.spp.has_value();
  v.spp_done = job.totals.spp_done;
  v.units_done = job.totals.units;
  v.units_total = std::max(job.totals.units, job.totals.units_planned);
  if (!entry.points.empty()) v.error_now = entry.points.back().error;
  v.reference_error = last_reference_error(entry.points);
  v.reference_same_seed = job.reference_same_seed;
  v.few_hits = job.totals.few_hits;
  if (v.few_hits) put_curve(v, entry.points, job.totals.doubt);
  if (entry.assembly) v.pixels_without_samples = entry.assembly->film().pixels_without_samples();
  if (entry.assembly)
    v.spp_done = static_cast<double>(entry.assembly->film().samples()) / pixels_of(entry.grid);
  v.progress = done_of(job, v.spp_done);
  const auto figures = entry.unloaded ? std::nullopt : farm_.job(job.id);
  if (figures) {
    v.spp = figures->spp;
    v.units_done = figures->units_done;
    v.units_total = figures->units_total;
    v.queued_core_seconds = figures->core_seconds_queued;
    const Eta out = eta_locked(entry, *figures, v);
    v.progress = out.progress;
    const std::string waits = !entry.finishing && figures->units_leased == 0 ? farm_.why_waiting(job.id) : "";
    if (v.error.empty()) v.error = waits;
    if (waits.empty() && (v.state == JobState::running || v.state == JobState::queued)) {
      v.eta_seconds = out.seconds;
      v.eta_ci95 = out.ci95;
      v.eta_with_more = out.with_more;
      v.eta_with_more_ci95 = out.with_more_ci95;
    }
  }
  if (v.state == JobState::done) v.progress = 1;
  return v;
}

std::vector<JobView> Service::jobs() const {
  const std::lock_guard lock(mutex_);
  std::vector<JobView> all;
  for (const JobId& id : order_) {
    const auto sequence = sequences_.find(id);
    all.push_back(sequence == sequences_.end() ? view_locked(*entries_.at(id))
                                               : sequence_view_locked(id, sequence->second, false));
  }
  return all;
}

bool Service::is_sequence(const JobId& id) const {
  const std::lock_guard lock(mutex_);
  return sequences_.contains(id);
}

Result<JobView> Service::job(const JobId& id) const {
  const std::lock_guard lock(mutex_);
  if (const auto sequence = sequences_.find(id); sequence != sequences_.end())
    return sequence_view_locked(id, sequence->second, true);
  const auto entry = entry_locked(id);
  if (!entry) return tl::unexpected(entry.error());
  return view_locked(**entry);
}

// Returns the job's current film (its image) and facts. The film is copied under the lock, or read from disk
// without the lock.
Result<Service::Picture> Service::picture(const JobId& id) const {
  std::unique_lock lock(mutex_);
  const auto entry = usable_locked(id);
  if (!entry) return tl::unexpected(entry.error());
  ReportFacts facts = facts_locked(**entry);
  if ((*entry)->assembly) return Picture{(*entry)->assembly->film(), std::move(facts), false};
  JobEntry copy;
  copy.stored = (*entry)->stored;
  copy.grid = (*entry)->grid;
  lock.unlock();
  load_folded(copy);
  put_film(facts, copy.assembly->film());
  return Picture{copy.assembly->film(), std::move(facts), copy.stored.state == JobState::done};
}

Result<std::vector<std::byte>> Service::image_exr(const JobId& id) const {
  {
    std::unique_lock lock(mutex_);
    const auto entry = usable_locked(id);
    if (!entry) return tl::unexpected(entry.error());
    const bool final_image = on_disk() && (*entry)->stored.state == JobState::done;
    lock.unlock();
    if (final_image) return read_file(folder(id) / "image.exr", std::uint64_t{1} << 33);
  }
  auto shown = picture(id);
  if (!shown) return tl::unexpected(shown.error());
  const auto made = denoised(shown->film, shown->facts);
  auto image = final_exr(shown->film, provenance_of(shown->facts), shown->facts.job.spec.float_output,
                         made ? std::span(made->image.rgb) : std::span<const float>());
  if (!image) return tl::unexpected(image.error());
  return std::move(image->exr);
}

std::filesystem::path Service::final_file(const JobId& id, const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto entry = usable_locked(id);
  if (!entry || !on_disk() || (*entry)->stored.state != JobState::done) return {};
  return folder(id) / name;
}

Result<std::vector<std::byte>> Service::image_png(const JobId& id, double exposure, bool denoise) const {
  auto shown = picture(id);
  if (!shown) return tl::unexpected(shown.error());
  if (!denoise) return preview_png(shown->film, exposure);
  if (!shown->facts.job.spec.denoise)
    return fail(Errc::failed_precondition,
                fmt::format("job {} was submitted without \"denoise\": it has no denoised image", id.value));
  const auto made = denoised(shown->film, shown->facts);
  if (!made) return preview_png(shown->film, exposure);  // without samples there is nothing to denoise
  if (made->image.rgb.empty()) return fail(Errc::unavailable, made->figures.trouble);
  return preview_png(shown->film, exposure, made->image.rgb);
}

Result<std::vector<std::byte>> Service::error_png(const JobId& id) const {
  const auto shown = picture(id);
  if (!shown) return tl::unexpected(shown.error());
  return error_map_png(shown->film);
}

Result<std::vector<std::byte>> Service::samples_png(const JobId& id) const {
  const auto shown = picture(id);
  if (!shown) return tl::unexpected(shown.error());
  return samples_map_png(shown->film);
}

Result<std::string> Service::report_json(const JobId& id) const {
  if (is_sequence(id)) return sequence_report(id);
  std::unique_lock lock(mutex_);
  const auto entry = usable_locked(id);
  if (!entry) return tl::unexpected(entry.error());
  if (on_disk() && (*entry)->stored.state == JobState::done) {
    lock.unlock();
    const auto bytes = read_file(folder(id) / "report.json", std::uint64_t{1} << 28);
    if (!bytes) return tl::unexpected(bytes.error());
    return std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  }
  lock.unlock();
  auto shown = picture(id);
  if (!shown) return tl::unexpected(shown.error());
  ReportFacts& facts = shown->facts;
  facts.pixels = pixels_sha256(shown->film);
  // While a job renders its report is asked for often, and is not to wait for a denoiser.
  if (is_terminal(facts.job.state)) denoised(shown->film, facts);
  if (!facts.job.spec.float_output) facts.clamped_values = values_above_half(shown->film);
  return coordinator::report_json(facts);
}

Result<std::vector<ConvergencePoint>> Service::convergence(const JobId& id) const {
  const std::lock_guard lock(mutex_);
  const auto entry = entry_locked(id);
  if (!entry) return tl::unexpected(entry.error());
  return (*entry)->points;
}

Result<std::vector<TileView>> Service::tiles(const JobId& id) const {
  const auto shown = picture(id);
  if (!shown) return tl::unexpected(shown.error());
  const std::lock_guard lock(mutex_);
  std::vector<TileView> all;
  const TileGrid& grid = shown->film.grid();
  for (TileIndex t = 0; t < grid.count(); ++t) {
    const TileError error = shown->film.error(t);
    const auto relmse = error.samples > 0 ? std::optional(image_error(error).relmse) : std::nullopt;
    all.push_back({t, grid.rect(t), shown->film.rounds_folded(t), shown->film.spp(t), relmse, {}});
  }
  const auto entry = find_locked(id);
  if (!entry) return all;
  for (const auto& [unit, holders] : entry->leased)
    for (const WorkerId& worker : holders) {
      const auto known = workers_.find(worker);
      const std::string& name = known == workers_.end() ? worker.value : known->second.hello.name;
      auto& names = all[unit.first].workers;
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
  return all;
}

Result<std::string> Service::job_log(const JobId& id) const {
  if (is_sequence(id)) return sequence_log(id);
  {
    const std::lock_guard lock(mutex_);
    if (const auto entry = entry_locked(id); !entry) return tl::unexpected(entry.error());
  }
  const auto lines = store_->log(id);
  if (!lines) return tl::unexpected(lines.error());
  return log_text(*lines);
}

WorkerView Service::view_locked(const WorkerId& id, const WorkerEntry& worker) const {
  const auto figures = farm_.worker(id).value_or(WorkerFigures{WorkerState::lost, 1, 0, 0, 0, {}});
  WorkerView v;
  v.id = id;
  v.name = worker.hello.name;
  v.build = worker.hello.build;
  v.numeric_class = worker.hello.numeric_class;
  v.fake = worker.hello.fake;
  v.threads = worker.hello.threads;
  v.tags = worker.hello.tags;
  v.state = to_string(figures.state);
  v.activity = worker.trouble.empty() ? worker.activity : worker.trouble;
  v.job = figures.job.value;
  v.units_done = figures.units_done;
  v.cpu_seconds = worker.cpu_seconds;
  v.rss_bytes = worker.rss_bytes;
  v.memory_bytes = worker.hello.memory_bytes;
  v.last_seen_seconds = std::max(0.0, seconds(now() - worker.last_seen));
  return v;
}

AuditFigures Service::audits() const {
  const std::lock_guard lock(mutex_);
  return farm_.audits();
}

std::vector<WorkerView> Service::workers() const {
  const std::lock_guard lock(mutex_);
  std::vector<WorkerView> all;
  for (const auto& [id, worker] : workers_) all.push_back(view_locked(id, worker));
  return all;
}

}  // namespace ls::coordinator
