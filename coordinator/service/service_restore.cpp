// What happens at a restart: jobs are read from the store, and their images from snapshots. Results that are
// not in the snapshot are folded again from the logs of partials (the encoded results of units).
#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <unordered_set>

#include "common/base/log.h"
#include "coordinator/admission/admission.h"
#include "coordinator/domain/unit_table.h"
#include "coordinator/service/service_impl.h"
#include "coordinator/store/log/audit_file.h"

namespace ls::coordinator {

Service::EntryPtr Service::make_entry(StoredJob stored) const {
  auto entry = std::make_shared<JobEntry>();
  entry->stored = std::move(stored);
  entry->settings_digest = digest_of(entry->stored.settings);
  entry->grid = {entry->stored.settings.size, entry->stored.settings.tile};
  entry->last_snapshot = now();
  entry->fold_seconds = entry->stored.totals.render_seconds;
  return entry;
}

// Restores all jobs. One that cannot be restored is reported and left unchanged on disk; the others continue.
Result<void> Service::restore() {
  const std::lock_guard lock(mutex_);
  remove_leftovers();
  const auto quarantined = store_->quarantined();
  if (!quarantined) return tl::unexpected(quarantined.error());
  apply_quarantine_locked(*quarantined);
  auto jobs = store_->jobs();
  if (!jobs) return tl::unexpected(jobs.error());
  remove_unknown_folders(*jobs);
  restoring_ = true;
  for (const StoredJob& job : *jobs)
    for (const WorkerId& worker : job.distrusted) {  // record of an earlier version
      const QuarantinedWorker known{worker, fmt::format("it rendered wrong pixels of job {}", job.id.value)};
      apply_quarantine_locked({known});
      if (auto kept = store_->quarantine(known); !kept) return kept;
    }
  for (StoredJob& job : *jobs) {
    if (image_is_lost(job)) begin_again(job);
    const JobState state = job.state;
    const bool ended = is_terminal(state);
    const auto entry = make_entry(std::move(job));
    entry->unloaded = ended;
    register_locked(entry);
    if (entry->stored.damaged)
      set_aside_locked(*entry, {Errc::internal, entry->stored.error});
    else if (auto taken = take_up_locked(*entry, state,
                                         ended ? std::vector<BlobRef>() : missing_blobs_of(entry->stored));
             !taken)
      set_aside_locked(*entry, taken.error());
  }
  restoring_ = false;
  return {};
}

Result<void> Service::take_up_locked(JobEntry& entry, JobState state,
                                     const Result<std::vector<BlobRef>>& missing) {
  const JobId& id = entry.stored.id;
  auto points = store_->points(id);
  if (!points) return tl::unexpected(points.error());
  entry.points = std::move(*points);
  if (entry.unloaded) return {};
  if (!missing) return tl::unexpected(missing.error());
  // A job paused by its user stays paused.
  if (state != JobState::paused || !entry.stored.missing_blobs.empty()) {
    for (const BlobRef& file : *missing) await_locked(entry, file, false);
    if (!missing->empty()) state = entry.stored.state = JobState::paused;
  }
  if (auto loaded = load_locked(entry); !loaded) return loaded;
  const bool begins_again =
      entry.assembly->film().samples() == 0 && (!entry.log || entry.log->found().empty());
  if (begins_again || has_quarantined_locked(entry)) forget_curve_locked(entry);
  auto event = restored_locked(entry, state);
  if (!event) return tl::unexpected(event.error());
  if (auto sound = check_plan(event->plan); !sound) return sound;
  log_info(fmt::format("job={} state={} units={}", id.value, to_string(state), event->accepted.size()),
           "restored");
  if (event->elapsed_seconds > 0) {
    entry.clock_zero = now() - from_seconds(event->elapsed_seconds);
    if (entry.stored.totals.began_unix == 0)
      entry.stored.totals.began_unix = unix_now() - event->elapsed_seconds;
  }
  if (state == JobState::paused) entry.still_since = now();
  run_locked(std::move(*event));
  entry.replay_at.clear();
  return {};
}

Result<void> Service::load_locked(JobEntry& entry) {
  if (on_disk()) {
    auto log = PartialLog::open(folder(entry.stored.id));
    if (!log) return tl::unexpected(log.error());
    entry.log = std::move(*log);
  }
  load_folded(entry);
  // The snapshot may be older than the discovery that a worker is faulty. So everything is folded again from
  // the results of the other workers.
  if (has_quarantined_locked(entry))
    entry.assembly.emplace(entry.grid, entry.stored.spec.target_error.has_value(),
                           aovs_of(entry.stored.settings));
  if (entry.stored.spec.reference) entry.reference_tiles.emplace(entry.assembly->film());
  return {};
}

bool Service::has_quarantined_locked(const JobEntry& entry) const {
  if (!entry.log) return false;
  const auto& found = entry.log->found();
  return std::any_of(found.begin(), found.end(),
                     [&](const PartialLog::Entry& e) { return farm_.quarantined(e.record.worker); });
}

// True if a done job's image is gone, which can happen if a record in Redis outlives the disk with the
// pixels.
bool Service::image_is_lost(const StoredJob& job) const {
  std::error_code unknown;  // set if the folder cannot be read: then the image does not count as lost
  return on_disk() && !job.damaged && job.state == JobState::done &&
         !std::filesystem::exists(folder(job.id) / "image.exr", unknown) && !unknown;
}

// Resets a job whose image is lost, so that it is rendered again. The same samples give the same bits, so
// only time is lost.
void Service::begin_again(StoredJob& job) {
  log_warn(fmt::format("job={}", job.id.value), "its image is not in --data any more: it is rendered again");
  job.state = JobState::queued;
  job.stopped.reset();
  job.totals = {};
}

void Service::set_aside_locked(JobEntry& entry, const Error& why) {
  entry.broken =
      entry.stored.damaged
          ? why.message
          : fmt::format(
                "the job could not be taken up: {}; repair this and restart the coordinator, or delete "
                "the job",
                why.message);
  entry.stored.state = JobState::failed;  // this is what is shown; the record in the store stays unchanged
  entry.stored.error = entry.broken;
  entry.unloaded = true;
  entry.assembly.reset();
  entry.reference_tiles.reset();
  entry.log.reset();
  log_error(fmt::format("job={}", entry.stored.id.value), entry.broken);
}

// Removes folders of jobs whose removal was interrupted by a crash.
void Service::remove_leftovers() const {
  if (!on_disk()) return;
  std::error_code error;
  std::vector<std::filesystem::path> left;
  for (std::filesystem::directory_iterator at(options_.data / "jobs", error), end; !error && at != end;
       at.increment(error))
    if (at->path().extension() == kRemovedExtension) left.push_back(at->path());
  for (const auto& path : left) std::filesystem::remove_all(path, error);
}

// If other coordinators share the store, removes what is left here of jobs that they have taken over. A
// finished image stays.
void Service::remove_unknown_folders(const std::vector<StoredJob>& jobs) const {
  if (!on_disk() || !options_.shared) return;
  std::set<std::string> known;
  for (const StoredJob& job : jobs) known.insert(job.id.value);
  std::vector<std::filesystem::path> unknown_folders;
  std::error_code error, none;
  for (std::filesystem::directory_iterator at(options_.data / "jobs", error), end; !error && at != end;
       at.increment(error))
    if (!known.contains(at->path().filename().string()) &&
        !std::filesystem::exists(at->path() / "image.exr", none))
      unknown_folders.push_back(at->path());
  for (const auto& path : unknown_folders) std::filesystem::remove_all(path, error);
}

Result<JobRestored> Service::restored_locked(JobEntry& entry, JobState state) {
  JobRestored event;
  event.plan = plan_of(entry.stored);
  event.state = state;
  event.stopped = entry.stored.stopped;
  event.numeric_class = entry.stored.numeric_class;
  const std::uint64_t spp = entry.stored.spp.value_or(kMaxSppWithoutLimit);
  event.folded = entry.assembly->rounds_for(spp);
  if (entry.stored.spec.target_error) event.rel_error = entry.assembly->errors().relative();
  take_up_records(entry, event);
  if (on_disk()) event.audits = read_audits(folder(entry.stored.id));
  entry.audits = audits_text(event.audits);
  return event;
}

void Service::take_up_records(JobEntry& entry, JobRestored& event) {
  if (!entry.log) return;
  const std::uint64_t spp = entry.stored.spp.value_or(kMaxSppWithoutLimit);
  JobTotals& totals = entry.stored.totals;
  totals.core_seconds = 0;
  // Which units have been seen. Units of full rounds are identified by their code alone, since there may be
  // millions; those of truncated rounds by code and end of their sample range.
  std::unordered_set<UnitCode> seen;
  std::set<std::pair<UnitCode, std::uint64_t>> seen_cut;
  seen.reserve(entry.log->found().size());
  const auto first_of = [&](const PartialRecord& r) {
    const UnitCode code = unit_code(r.round, r.tile);
    return r.samples == round_range(r.round) ? seen.insert(code).second
                                             : seen_cut.emplace(code, r.samples.s1).second;
  };
  const auto not_seen = [&](const PartialRecord& r) {
    seen.erase(unit_code(r.round, r.tile));
    seen_cut.erase({unit_code(r.round, r.tile), r.samples.s1});
  };
  for (const auto& [record, place] : entry.log->found()) {
    if (farm_.quarantined(record.worker)) continue;
    if (record.tile >= entry.grid.count() || !first_of(record)) continue;
    const bool folded = record.round < event.folded[record.tile];
    if (!folded && record.samples == cut_range(record.round, spp)) {
      // A result that cannot be read does not count as accepted: it is rendered again, to the same bits.
      if (const auto readable = entry.log->read(place); !readable) {
        log_warn(fmt::format("job={} tile={} round={}", entry.stored.id.value, record.tile, record.round),
                 readable.error().message);
        not_seen(record);
        continue;
      }
      entry.assembly->hold(record.tile, record.round,
                           {std::nullopt, place, record.samples, record.digest, record.health});
      entry.replay_at[{record.tile, record.round}] = record.at_seconds;
    }
    event.accepted.push_back({record.tile, record.round, record.samples, record.digest, record.worker});
    event.elapsed_seconds = std::max(event.elapsed_seconds, record.at_seconds);
    const double cpu = plausible_seconds(record.cpu_seconds);
    totals.core_seconds += cpu;
    entry.assembly->costs().add(record.tile, record.round, cpu);
    if (folded) entry.fold_seconds = std::max(entry.fold_seconds, record.at_seconds);
  }
  entry.log->forget_found();
}

}  // namespace ls::coordinator
