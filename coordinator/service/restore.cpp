// Restore and Takeover: add stored jobs to the farm again. A job's image so far comes from its snapshot file
// and from its log of accepted results.
#include "coordinator/service/restore.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <unordered_set>

#include "coordinator/admission/admission.h"
#include "coordinator/domain/limits.h"
#include "coordinator/domain/unit_table.h"
#include "coordinator/service/blob_watch.h"
#include "coordinator/service/core.h"
#include "coordinator/store/log/audit_file.h"
#include "core/base/clock.h"
#include "core/base/log.h"

namespace ls::coordinator {
namespace {

// Time until the next attempt to take over a job if the blob store did not answer
constexpr Duration kTakeOverPause = std::chrono::seconds(5);

bool has_quarantined(const Farm& farm, const JobEntry& entry) {
  if (!entry.log) return false;
  const auto& found = entry.log->found();
  return std::any_of(found.begin(), found.end(),
                     [&](const PartialLog::Entry& e) { return farm.quarantined(e.record.worker); });
}

void set_aside(JobEntry& entry, const Error& why) {
  entry.broken =
      entry.stored.damaged
          ? why.message
          : fmt::format(
                "the job could not be taken up: {}; repair this and restart the coordinator, or delete "
                "the job",
                why.message);
  // Only the copy in memory, which users see, is changed; the record in the store stays as it is
  entry.stored.state = JobState::failed;
  entry.stored.error = entry.broken;
  entry.free_image();
  // The job's trace span is not ended here: it continues after a restart with the job repaired.
  entry.trace.reset();
  log_error(fmt::format("job={}", entry.stored.id.value), entry.broken);
}

}  // namespace

Result<void> Restore::restart(Core& core) const {
  files_.remove_discarded();
  const auto quarantined = store_.quarantined();
  if (!quarantined) return tl::unexpected(quarantined.error());
  core.driver.quarantine(*quarantined);
  auto jobs = store_.jobs();
  if (!jobs) return tl::unexpected(jobs.error());
  files_.remove_unknown(*jobs);
  for (StoredJob& job : *jobs) {
    reopen_if_image_is_lost(job);
    const bool needs_files = !job.damaged && !is_terminal(job.state);
    const auto missing = needs_files ? missing_blobs_of(job, blobs_) : std::vector<BlobRef>();
    add(core, std::move(job), missing);
  }
  const std::vector<JobId> all = core.jobs.order();
  for (const JobId& id : all)
    if (const auto entries = core.jobs.job_or_frames(id))
      for (const EntryPtr& entry : *entries) core.driver.forget_done_prerequisites(entry);
  return {};
}

void Restore::reopen_if_image_is_lost(StoredJob& job) const {
  if (!files_.image_is_lost(job)) return;
  // Rendering the same samples again gives the same bits, so the loss of the image costs only time.
  log_warn(fmt::format("job={}", job.id.value), "its image is not in --data any more: it is rendered again");
  job.state = JobState::queued;
  job.stopped.reset();
  job.totals = {};
}

EntryPtr Restore::add(Core& core, StoredJob job, const Result<std::vector<BlobRef>>& missing) const {
  const auto entry = std::make_shared<JobEntry>(std::move(job), clock_.now());
  entry->unloaded = is_terminal(entry->stored.state);
  if (!entry->unloaded) entry->trace = JobTrace::begin(core.tracing, entry->stored);
  if (entry->trace) entry->trace->event("restored", clock_.now());
  core.jobs.add(entry);
  if (entry->stored.damaged)
    set_aside(*entry, {Errc::internal, entry->stored.error});
  else if (auto taken = take_up(core, *entry, missing); !taken)
    set_aside(*entry, taken.error());
  core.jobs.count_state(*entry);
  return entry;
}

Result<void> Restore::take_up(Core& core, JobEntry& entry,
                              const Result<std::vector<BlobRef>>& missing) const {
  const JobId& id = entry.stored.id;
  auto points = store_.points(id);
  if (!points) return tl::unexpected(points.error());
  entry.points = std::move(*points);
  if (entry.unloaded) return {};
  if (!missing) return tl::unexpected(missing.error());
  // A job that is paused by its user stays paused and does not wait for blobs.
  if (entry.stored.state != JobState::paused || !entry.stored.missing_blobs.empty()) {
    for (const BlobRef& file : *missing) await_blob(core, entry, file, false);
    if (!missing->empty()) entry.stored.state = JobState::paused;
  }
  if (auto loaded = load(core, entry); !loaded) return loaded;
  const bool begins_again =
      entry.assembly->film().samples() == 0 && (!entry.log || entry.log->found().empty());
  // If the log has results of a quarantined worker, the points of the convergence curve and the checks of the
  // denoised layers may describe wrong pixels: both are dropped. If instead the image and the log have no
  // results (they were lost), the curve is dropped, since it will be made again; the checks are kept, since
  // rendering again gives the same pixels.
  if (has_quarantined(core.driver.farm(), entry))
    core.records.forget_wrong_pixels(entry);
  else if (begins_again)
    core.records.forget_curve(entry);
  const JobState state = entry.stored.state;
  JobRestored event = restored(core, entry, state);
  if (auto sound = check_plan(event.plan); !sound) return sound;
  log_info(fmt::format("job={} state={} units={}", id.value, to_string(state), event.accepted.size()),
           "restored");
  if (event.elapsed_seconds > 0) {
    entry.clock.start(clock_.now() - from_seconds(event.elapsed_seconds));
    if (entry.stored.totals.began_unix == 0)
      entry.stored.totals.began_unix = system_unix_seconds() - event.elapsed_seconds;
  }
  if (state == JobState::paused) entry.clock.stand_still(clock_.now());
  core.driver.replay(entry, std::move(event));
  return {};
}

Result<void> Restore::wake(Core& core, JobEntry& entry) const {
  if (!entry.unloaded) return {};
  if (auto loaded = load(core, entry); !loaded) return loaded;
  entry.unloaded = false;
  entry.trace = JobTrace::begin(core.tracing, entry.stored);
  if (entry.trace) entry.trace->begin_again(entry.stored, clock_.now());
  if (has_quarantined(core.driver.farm(), entry)) core.records.forget_wrong_pixels(entry);
  core.driver.replay(entry, restored(core, entry, JobState::done));
  return {};
}

Result<void> Restore::load(Core& core, JobEntry& entry) const {
  if (files_.on_disk()) {
    auto log = PartialLog::open(files_.folder(entry.stored.id));
    if (!log) return tl::unexpected(log.error());
    entry.log = std::move(*log);
  }
  // If the job has results of a worker that was quarantined later, the snapshot may contain them. So it is
  // not used: the image begins without samples, and the results of the other workers are added again from the
  // log.
  if (has_quarantined(core.driver.farm(), entry))
    entry.begin_image();
  else
    entry.assembly = files_.load_image(entry.stored, entry.grid);
  entry.begin_comparison();
  return {};
}

JobRestored Restore::restored(Core& core, JobEntry& entry, JobState state) const {
  JobRestored event;
  event.plan = plan_of(entry.stored);
  event.state = state;
  event.stopped = entry.stored.stopped;
  event.numeric_class = entry.stored.numeric_class;
  const std::uint64_t spp = entry.stored.spp.value_or(kMaxSppWithoutLimit);
  event.folded = entry.assembly->rounds_for(spp);
  if (entry.stored.spec.target_error) event.rel_error = entry.assembly->errors().relative();
  event.denoised_checks = entry.stored.denoised_checks;
  take_up_records(core, entry, event);
  if (files_.on_disk()) event.audits = read_audits(files_.folder(entry.stored.id));
  entry.audits = audits_text(event.audits);
  return event;
}

void Restore::take_up_records(Core& core, JobEntry& entry, JobRestored& event) const {
  if (!entry.log) return;
  const std::uint64_t spp = entry.stored.spp.value_or(kMaxSppWithoutLimit);
  JobTotals& totals = entry.stored.totals;
  totals.core_seconds = 0;
  // The units of which the loop below has counted a result. The log may have several results of a unit, and
  // only one is counted. `seen` has the units of full rounds, identified by their codes alone, which saves
  // memory for millions of units. `seen_cut` has the units of truncated rounds, identified by the code and
  // the end of the sample range.
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
    if (core.driver.farm().quarantined(record.worker)) continue;
    if (record.tile >= entry.grid.count() || !first_of(record)) continue;
    const bool folded = record.round < event.folded[record.tile];
    if (!folded && record.samples == cut_range(record.round, spp)) {
      // A result that cannot be read does not count as accepted. Its unit is rendered again and gives the
      // same bits.
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

void Takeover::look_for_moved_jobs() {
  JobStore::Moved moved = store_.moved();
  std::vector<Inheritance> inherited;
  {
    const auto core = core_.lock();
    core->driver.quarantine(moved.quarantined);
    std::erase_if(later_, [&](Inheritance& one) {
      if (clock_.now() < one.again) return false;
      inherited.push_back(std::move(one));
      return true;
    });
  }
  for (const JobId& id : moved.lost) writes_.push([this, id] { let_go(id); });
  for (JobStore::Inherited& one : moved.inherited) inherited.push_back({std::move(one)});
  for (Inheritance& one : inherited) writes_.push([this, one = std::move(one)] { take_over(one); });
}

// Drops a job that another coordinator owns now. The job's record in the store belongs to the new owner and
// must not be touched.
void Takeover::let_go(const JobId& id) {
  {
    const auto core = core_.lock();
    std::erase_if(later_, [&](const Inheritance& one) { return one.job.job.id == id; });
    const auto entry = core->jobs.find(id);
    if (!entry) return;
    log_warn(fmt::format("job={}", id.value),
             "this coordinator's lease on it has passed and another one has taken it over: dropped here");
    entry->removed = true;
    entry->finishing = 0;
    if (!entry->unloaded) core->driver.run(JobCancelled{id});
    if (!entry->unloaded) core->driver.run(JobForgotten{id});
    if (const auto shown = core->jobs.remove(entry)) core->publisher.job_moved(*shown, entry->stored.owner);
    core->ended.notify_all();
  }
  files_.remove_folder(id);
}

void Takeover::take_over(Inheritance inheritance) {
  StoredJob job = inheritance.job.job;
  // The lock is not held here, since the blob store may need the network.
  const auto missing = missing_blobs_of(job, blobs_);
  const auto core = core_.lock();
  const JobId id = job.id;
  if (!missing) {
    log_warn(fmt::format("job={}", id.value),
             "cannot be taken over now, and is tried again: " + missing.error().message);
    inheritance.again = clock_.now() + kTakeOverPause;
    later_.push_back(std::move(inheritance));
    return;
  }
  if (core->jobs.find(id)) return;
  // If there is a folder of the job here, it is outdated: this coordinator owned the job at an earlier time.
  files_.remove_folder(id);
  restore_.reopen_if_image_is_lost(job);
  const auto entry = restore_.add(*core, std::move(job), missing);
  core->records.log(
      id, fmt::format("taken over from coordinator {}, which is gone; what it had rendered since and not "
                      "written to a shared place is rendered again, to the same bits",
                      inheritance.job.from));
  if (!entry->broken.empty()) core->records.log(id, entry->broken);
  core->publisher.job(*entry);
  core->driver.forget_done_prerequisites(entry);
  core->driver.notify_jobs_after(id);
  core->driver.run(Tick{});
}

}  // namespace ls::coordinator
