// FarmDriver: carries out the effects of the farm. To fold a unit is to add its pixel sums (a partial) to the
// job's image; an audit is a second rendering of a unit by another worker, for comparison. Terms:
// docs/reference/glossary.md.
#include <fmt/format.h>

#include <algorithm>

#include "coordinator/service/core.h"
#include "coordinator/service/image_writer.h"
#include "coordinator/service/reference_comparer.h"
#include "coordinator/service/state/prerequisites.h"
#include "core/base/clock.h"
#include "core/base/failpoint.h"
#include "core/base/log.h"

namespace ls::coordinator {

FarmDriver::FarmDriver(Core& core, Farm::Options options, const Clock& clock, const JobFiles& files,
                       ImageWriter& images, ReferenceComparer& comparer)
    : core_(core),
      farm_(std::move(options)),
      clock_(clock),
      files_(files),
      images_(images),
      comparer_(comparer) {}

void FarmDriver::run(Event first) {
  todo_.push_back(std::move(first));
  while (!todo_.empty()) {
    const Event event = std::move(todo_.front());
    todo_.pop_front();
    for (const Effect& effect : farm_.handle(event, clock_.now()))
      std::visit([&](const auto& e) { on(e); }, effect);
  }
  // Snapshots (the image so far, for a restart) are taken after all events are handled: the points of the
  // convergence curve up to a snapshot must be queued for writing before the snapshot itself.
  for (const EntryPtr& entry : std::exchange(folded_, {})) images_.snapshot_if_due(core_, entry);
  for (const JobId& id : farm_.take_changed_audits())
    if (const auto entry = core_.jobs.find(id)) images_.keep_audits(core_, entry, farm_.open_audits(id));
}

void FarmDriver::replay(JobEntry& entry, JobRestored event) {
  core_.publisher.set_quiet(true);
  run(std::move(event));
  core_.publisher.set_quiet(false);
  entry.replay_at.clear();
}

void FarmDriver::quarantine(const std::vector<QuarantinedWorker>& workers) {
  for (const QuarantinedWorker& one : workers) run(WorkerQuarantined{one.worker, one.evidence});
}

void FarmDriver::unload(JobEntry& entry) {
  const auto figures = farm_.job(entry.stored.id);
  if (!files_.on_disk() || !figures || entry.unloaded || !is_terminal(figures->state)) return;
  entry.free_image();
  entry.trace.reset();
  run(JobForgotten{entry.stored.id});
}

void FarmDriver::set_after(const EntryPtr& entry, std::vector<std::string> after) {
  const bool held = !after.empty();
  core_.jobs.set_after(*entry, std::move(after));
  if (!entry->unloaded) run(JobHeld{entry->stored.id, held});
  core_.publisher.job(*entry);
}

void FarmDriver::forget_done_prerequisites(const EntryPtr& entry) {
  std::vector<std::string> left = entry->stored.spec.after;
  const auto done = [&](const std::string& name) {
    return prerequisite_state(core_.jobs, {name}) == JobState::done;
  };
  if (std::erase_if(left, done) == 0) return;
  if (left.empty()) core_.records.log(entry->stored.id, "the jobs for which it waited are done");
  set_after(entry, std::move(left));
  core_.records.put(entry);
}

void FarmDriver::notify_jobs_after(const JobId& ended) {
  notify_waiting_for(ended);
  const auto frame = frame_of(ended);
  Sequence* sequence = frame ? core_.jobs.sequence(frame->sequence) : nullptr;
  if (!sequence) return;
  const JobState state = sequence->for_others();
  if (std::exchange(sequence->notified, state) != state) notify_waiting_for(frame->sequence);
}

void FarmDriver::notify_waiting_for(const JobId& id) {
  const std::vector<EntryPtr> waiting = core_.jobs.waiting_for(id);
  if (waiting.empty()) return;
  if (prerequisite_state(core_.jobs, id) != JobState::done) {
    for (const EntryPtr& entry : waiting) core_.publisher.job(*entry);
    return;
  }
  const auto release = [&] {
    for (const EntryPtr& entry : waiting) forget_done_prerequisites(entry);
  };
  // One transaction stores them all, unless one that is under way already does
  core_.records.puts_together() ? release() : core_.records.put_together(release);
}

// Effects that concern leases

void FarmDriver::on(const Send& e) {
  const auto found = core_.workers.find(e.worker);
  if (found == core_.workers.end() || !found->second.connection || !found->second.connection->open) return;
  Connection& connection = *found->second.connection;
  if (const auto* assign = std::get_if<AssignLease>(&e.message)) {
    ++core_.figures.leases_granted;
    core_.figures.units_leased += assign->lease.units.size();
    connection.note_lease(assign->lease.id);
    found->second.last_job = assign->lease.job;
    note_leased(assign->lease, e.worker);
    if (const auto entry = core_.jobs.find(assign->lease.job); entry && entry->trace) {
      AssignLease traced = *assign;
      traced.trace =
          entry->trace->lease_begins(assign->lease, e.worker, found->second.hello.name, clock_.now());
      connection.sink->send(std::move(traced));
      return failpoint("lease-sent");
    }
  }
  connection.sink->send(e.message);
  if (std::holds_alternative<AssignLease>(e.message)) failpoint("lease-sent");
}

void FarmDriver::note_leased(const Lease& lease, const WorkerId& worker) {
  const auto entry = core_.jobs.find(lease.job);
  if (!entry) return;
  for (const LeaseUnit& unit : lease.units) {
    auto& holders = entry->leased[{unit.tile, unit.round}];
    if (std::find(holders.begin(), holders.end(), worker) == holders.end()) holders.push_back(worker);
    core_.publisher.tile(*entry, unit.tile, unit.rect, "leased", unit.samples.s0, worker);
  }
}

void FarmDriver::on(const UnitsFreed& e) {
  const auto entry = core_.jobs.find(e.job);
  if (!entry) return;
  if (entry->trace) entry->trace->units_freed(e, clock_.now());
  if (!e.audit) core_.figures.units_freed[e.cause] += e.units.size();
  for (const UnitKey& unit : e.units) {
    const auto held = entry->leased.find({unit.tile, unit.round});
    if (held != entry->leased.end() && std::erase(held->second, e.worker) > 0 && held->second.empty())
      entry->leased.erase(held);
    if (e.audit) continue;  // an audited unit has a result already: its tile is not shown as free
    core_.publisher.tile(*entry, unit.tile, entry->grid.rect(unit.tile), "free", round_range(unit.round).s0,
                         e.worker);
  }
}

// Effects that concern results

// Handles an accepted result. It is in the job's log already, so nothing is stored here. The first result
// starts the job's clock.
void FarmDriver::on(const RecordUnit& e) {
  const auto entry = core_.jobs.find(e.unit.job);
  if (!entry) return;
  entry->leased.erase({e.unit.tile, e.unit.round});
  if (entry->clock.started()) return;
  const auto figures = farm_.job(e.unit.job);
  if (figures && figures->clock.started())
    entry->clock = figures->clock;
  else
    entry->clock.start(clock_.now());
  if (entry->stored.totals.began_unix == 0)
    entry->stored.totals.began_unix = system_unix_seconds() - entry->elapsed(clock_.now());
}

// Returns the accepted partial (the pixel sums of one unit) that is to be added to the image. If it is not in
// memory, because it arrived before a restart or because too many partials wait, reads it from the job's log.
Result<WaitingPartial> FarmDriver::partial_for(JobEntry& entry, const Fold& e) const {
  auto waiting = entry.assembly->take(e.unit.tile, e.unit.round, e.samples);
  if (!waiting) return fail(Errc::internal, "an accepted partial is not at hand");
  if (waiting->partial) return std::move(*waiting);
  if (!waiting->place || !entry.log) return fail(Errc::internal, "an accepted partial has no place");
  const auto exr = entry.log->read(*waiting->place);
  if (!exr) return tl::unexpected(exr.error());
  const UnitHeader expected{entry.stored.scene, entry.settings_digest,
                            entry.stored.numeric_class.value_or(Digest{}), entry.grid.rect(e.unit.tile),
                            e.samples};
  auto partial = decode_partial(*exr, expected, entry.grid.frame, aovs_of(entry.stored.settings));
  if (!partial) return tl::unexpected(partial.error());
  waiting->partial = std::move(*partial);
  return std::move(*waiting);
}

void FarmDriver::on(const Fold& e) {
  const auto entry = core_.jobs.find(e.unit.job);
  if (!entry || !entry->assembly) return;
  const TimePoint begin = clock_.now();
  const auto waiting = partial_for(*entry, e);
  const auto error =
      waiting ? entry->assembly->fold(e.unit.tile, e.unit.round, *waiting) : tl::unexpected(waiting.error());
  if (!error) {
    // The partial could not be read or could not be added. No UnitFolded event is raised, so that nothing
    // more is added to the tile, and the job is paused: the image must never have a wrong pixel.
    entry->trouble =
        fmt::format("tile {} round {} cannot be folded: {}; restart the coordinator to render it again",
                    e.unit.tile, e.unit.round, error.error().message);
    log_error(fmt::format("job={} tile={} round={}", e.unit.job.value, e.unit.tile, e.unit.round),
              entry->trouble);
    core_.records.log(e.unit.job, entry->trouble);
    todo_.push_back(JobPaused{e.unit.job});
    return;
  }
  if (entry->reference_tiles)
    entry->reference_tiles->folded(e.unit.tile, e.unit.round, entry->assembly->film());
  if (const auto at = entry->replay_at.find({e.unit.tile, e.unit.round}); at != entry->replay_at.end())
    entry->fold_seconds = std::max(entry->fold_seconds, at->second);
  else
    entry->fold_seconds = entry->elapsed(clock_.now());
  todo_.push_back(UnitFolded{e.unit, e.samples, error->relative.squares});
  const TimePoint end = clock_.now();
  entry->stored.totals.time.merge += seconds(end - begin);
  // While a restart adds stored results to the image again, no figures count them, and no events are
  // published.
  if (core_.publisher.quiet()) return;
  failpoint("result-folded");
  if (entry->trace)
    entry->trace->step(
        "fold", begin, end,
        {{"lightshaft.tile", std::int64_t{e.unit.tile}}, {"lightshaft.round", std::int64_t{e.unit.round}}});
  ++core_.figures.folded;
  if (waiting->arrived != TimePoint{})
    core_.figures.fold_lag_seconds += seconds(clock_.now() - waiting->arrived);
  core_.publisher.tile(*entry, e.unit.tile, entry->grid.rect(e.unit.tile), "folded", e.samples.s1);
  core_.publisher.progress(*entry);
  if (folded_.empty() || folded_.back() != entry) folded_.push_back(entry);
}

void FarmDriver::on(const DropDuplicate&) { ++core_.figures.equal; }

void FarmDriver::on(const DropUnwanted& e) {
  ++core_.figures.unwanted;
  log_debug(fmt::format("job={} tile={} round={} worker={}", e.unit.job.value, e.unit.tile, e.unit.round,
                        e.worker.value),
            "result dropped: " + e.why);
}

void FarmDriver::on(const DigestMismatch& e) {
  ++core_.figures.differing;
  const std::string text = fmt::format(
      "tile {} round {}: {} rendered {}, {} rendered {}: one of them has bad memory or lies", e.unit.tile,
      e.unit.round, e.first_worker.value, e.first.hex(), e.second_worker.value, e.second.hex());
  log_error(fmt::format("job={}", e.unit.job.value), text);
  core_.records.log(e.unit.job, text);
}

void FarmDriver::on(const TileDiscarded& e) {
  const auto entry = core_.jobs.find(e.job);
  if (!entry || !entry->assembly) return;
  entry->assembly->discard(e.tile);
  if (entry->reference_tiles) entry->reference_tiles->discard(e.tile);
  core_.records.forget_wrong_pixels(*entry);
  core_.records.log(e.job, fmt::format("tile {} is rendered again from its first round", e.tile));
  if (!core_.publisher.quiet()) core_.publisher.tile(*entry, e.tile, entry->grid.rect(e.tile), "free", 0);
}

void FarmDriver::on(const ReopenRound& e) {
  const auto entry = core_.jobs.find(e.job);
  if (entry && entry->assembly) entry->assembly->forget_round(e.round);
}

// Effects that concern jobs

void FarmDriver::on(const JobPinned& e) {
  const auto entry = core_.jobs.find(e.job);
  if (!entry) return;
  entry->stored.numeric_class = e.numeric_class;
  for (const auto& [id, worker] : core_.workers)
    if (worker.hello.numeric_class == e.numeric_class) {
      entry->stored.build = worker.hello.build;
      entry->stored.platform = worker.hello.platform;
      entry->stored.fake |= worker.hello.fake;
    }
  entry->pin_unsaved = true;
  if (!core_.records.put_pin(entry)) todo_.push_back(JobPaused{e.job});
  if (const auto figures = farm_.job(e.job); figures && figures->class_share) {
    const ClassShare& s = *figures->class_share;
    core_.records.log(
        e.job, fmt::format("pinned to numeric class {}: {} of {} workers can take it, with {} of {} threads",
                           class_in_words(e.numeric_class, entry->stored.platform), s.workers, s.of_workers,
                           s.threads, s.of_threads));
  }
}

void FarmDriver::on(const JobUnpinned& e) {
  const auto entry = core_.jobs.find(e.job);
  if (!entry) return;
  entry->stored.numeric_class.reset();
  entry->stored.build.clear();
  entry->stored.platform.clear();
  entry->stored.fake = false;
  entry->pin_unsaved = true;
  if (!core_.records.put_pin(entry)) todo_.push_back(JobPaused{e.job});
  core_.records.log(e.job, "not pinned any more: its numeric class brought no result");
}

// The state `done` is published and stored only after the final image is written: see ImageWriter.
void FarmDriver::on(const JobStateChanged& e) {
  const auto entry = core_.jobs.find(e.job);
  // The record of a removed job must not be written: it no longer exists, or it belongs to another
  // coordinator.
  if (!entry || entry->removed || e.to == JobState::done) return;
  entry->stored.state = e.to;
  core_.jobs.count_state(*entry);
  entry->stored.stopped.reset();
  if (e.to != JobState::paused) entry->stored.missing_blobs.clear();
  log_info(fmt::format("job={} state={}", e.job.value, to_string(e.to)), entry->stored.name);
  if (entry->trace) {
    if (is_terminal(e.from)) entry->trace->begin_again(entry->stored, clock_.now());
    entry->trace->event(std::string(to_string(e.to)), clock_.now());
  }
  core_.records.log(e.job, fmt::format("{}", to_string(e.to)));
  if (e.to == JobState::running && !entry->pin_unsaved) entry->trouble.clear();
  if (e.to == JobState::paused) entry->clock.stand_still(clock_.now());
  if (e.from == JobState::paused) entry->clock.go_on(clock_.now());
  if (is_terminal(e.to)) {
    end_image(entry);
    entry->stored.totals.ended_unix = entry->ended_unix;
    if (entry->trace) entry->trace->end(entry->stored, clock_.now());
    images_.retire(core_, entry);
  }
  core_.records.put(entry);
  core_.publisher.job(*entry);
  if (is_terminal(e.to)) notify_jobs_after(e.job);
  core_.ended.notify_all();
}

void FarmDriver::on(const JobFinished& e) {
  const auto entry = core_.jobs.find(e.job);
  if (!entry) return;
  entry->stored.stopped = e.stopped;
  end_image(entry);
  if (entry->trace) entry->trace->leases_end(clock_.now());
  if (e.unaudited > 0)
    core_.records.log(
        e.job, fmt::format("{} results were to be rendered again by another worker, but nobody else of their "
                           "numeric class was there: who rendered them is believed",
                           e.unaudited));
  images_.finish(core_, entry);
}

// When a job has ended: puts the cost of its final image into the job's totals, ends its convergence curve,
// and queues the last comparison with the reference image.
void FarmDriver::end_image(const EntryPtr& entry) {
  JobTotals& totals = entry->stored.totals;
  totals.render_seconds = entry->fold_seconds;
  entry->ended_unix = system_unix_seconds();
  entry->clock.reset();
  entry->leased.clear();
  if (!entry->assembly) return;
  totals.health = entry->assembly->health().total();
  entry->assembly->forget_waiting();
  end_curve(entry);
  comparer_.compare_last(core_, entry);
}

void FarmDriver::on(const JobFailed& e) {
  const auto entry = core_.jobs.find(e.job);
  if (!entry) return;
  entry->stored.error = e.error;
  entry->stored.failure = e.failure;
  log_error(fmt::format("job={}", e.job.value), e.error);
  core_.records.log(e.job, "failed: " + e.error);
  core_.records.put(entry);
  core_.publisher.job(*entry);
}

// Effects that concern convergence curves (error over samples and time)

void FarmDriver::on(const Checkpoint& e) {
  const auto entry = core_.jobs.find(e.job);
  if (!entry || !entry->assembly) return;
  const bool exact = entry->assembly->errors().knows(e.rounds);
  const ImageError error = image_error(entry->assembly->errors().at(e.rounds));
  entry->assembly->checkpoint_taken(e.rounds);
  entry->stored.totals.doubt = error.verdict;
  entry->stored.totals.few_hits = error.few_hits;
  entry->stored.totals.lit = error.lit;
  // If the curve has this checkpoint already, from before a restart, no point is added. The point may still
  // lack the comparison with the reference image; then the comparison is made now.
  if (!entry->points.empty() && entry->points.back().spp >= error.spp) {
    const bool compared = std::none_of(entry->points.begin(), entry->points.end(), [&](const auto& p) {
      return p.spp == error.spp && !p.reference_error;
    });
    if (!compared) comparer_.compare(core_, entry, e.rounds, error.spp);
    return;
  }
  // After a tile was rendered again, a checkpoint may come at which the other tiles have more rounds already.
  // The errors that these tiles had after fewer rounds are not kept, so the error of this checkpoint is
  // unknown, and the curve gets no point.
  if (!exact) return;
  core_.records.add_point(
      entry, {entry->fold_seconds, entry->assembly->costs().until(e.rounds), error.spp, figures_of(error)});
  comparer_.compare(core_, entry, e.rounds, error.spp);
}

void FarmDriver::on(const CheckDenoised& e) {
  const auto entry = core_.jobs.find(e.job);
  if (entry && entry->assembly) images_.check_denoised(core_, entry, e.spp);
}

// If a job ends between two checkpoints (by time, by its user or by a failure), its final image has more
// samples than its last checkpoint. The curve then gets a last point for the final image, so that the curve
// agrees with the report. An image that misses samples in some pixels gets no such point.
void FarmDriver::end_curve(const EntryPtr& entry) {
  if (entry->assembly->film().pixels_without_samples() > 0) return;
  const ImageError error = image_error(entry->assembly->film().error());
  if (!entry->points.empty() && entry->points.back().spp >= error.spp) return;
  entry->stored.totals.doubt = error.verdict;
  entry->stored.totals.few_hits = error.few_hits;
  entry->stored.totals.lit = error.lit;
  core_.records.add_point(
      entry, {entry->fold_seconds, entry->stored.totals.core_seconds, error.spp, figures_of(error)});
}

// Effects that concern workers

void FarmDriver::on(const WorkerStateChanged& e) {
  log_info(fmt::format("worker={} state={}", e.worker.value, to_string(e.to)), e.why);
  if (e.to == WorkerState::unhealthy)
    log_error(fmt::format("worker={}", e.worker.value), "unhealthy: " + e.why);
  if (const auto w = core_.workers.find(e.worker); w != core_.workers.end())
    w->second.trouble = e.to == WorkerState::unhealthy ? e.why : "";
  note_worker(e.worker, fmt::format("{}: {}", to_string(e.to), e.why));
  core_.publisher.worker(e.worker, true);
}

void FarmDriver::note_worker(const WorkerId& worker, const std::string& text) {
  if (const auto w = core_.workers.find(worker); w != core_.workers.end()) w->second.note(text);
}

void FarmDriver::on(const WorkerBlocked& e) {
  log_warn(fmt::format("worker={} job={}", e.worker.value, e.job.value),
           "gets no more of this job: " + e.why);
  note_worker(e.worker, fmt::format("gets no more of job {}: {}", e.job.value, e.why));
  core_.records.log(e.job, fmt::format("worker {} gets no more of it: {}", e.worker.value, e.why));
}

void FarmDriver::on(const WorkerFruitless& e) {
  log_warn(fmt::format("worker={} job={}", e.worker.value, e.job.value),
           "renders nothing of this job and is not waited for: " + e.why);
  note_worker(e.worker,
              fmt::format("renders nothing of job {} and is not waited for: {}", e.job.value, e.why));
  core_.records.log(
      e.job, fmt::format("worker {} renders nothing of it and is not waited for: {}", e.worker.value, e.why));
}

// The quarantine of a faulty worker is stored separately from the jobs and outlives them, so that none of its
// results is accepted after a restart or in a job that is extended later. Until the quarantine is stored, all
// jobs are paused: a restart reads the results of all workers from the jobs' files of partials, and without
// the stored quarantine it would accept those of the faulty worker.
void FarmDriver::on(const WorkerFoundFaulty& e) {
  log_error(fmt::format("worker={} job={} tile={} round={}", e.worker.value, e.unit.job.value, e.unit.tile,
                        e.unit.round),
            "quarantined: " + e.evidence);
  note_worker(e.worker, "quarantined: " + e.evidence);
  core_.records.add_quarantined({e.worker, e.evidence});
  if (const auto saved = core_.records.put_quarantined(); !saved)
    for (const auto& [id, entry] : core_.jobs.all()) {
      if (entry->unloaded || !entry->assembly) continue;
      entry->trouble = saved.error().message;
      todo_.push_back(JobPaused{id});
    }
  core_.records.log(e.unit.job, fmt::format("worker {} is quarantined: {}", e.worker.value, e.evidence));
}

void FarmDriver::on(const WorkerForgotten& e) {
  core_.workers.erase(e.worker);
  core_.publisher.worker_gone(e.worker);
}

}  // namespace ls::coordinator
