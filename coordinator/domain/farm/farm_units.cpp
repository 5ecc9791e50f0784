// The farm's reaction to results and failures of units: when results are folded (added to the image), and
// when a job fails.
#include <fmt/format.h>

#include <algorithm>

#include "coordinator/domain/farm/farm_state.h"

namespace ls::coordinator {

void Farm::State::pin(Job& job, const Digest& numeric_class) {
  if (job.numeric_class) return;
  job.numeric_class = numeric_class;
  job.pinned_at = now;
  effects.emplace_back(JobPinned{job.plan.brief.job, numeric_class});
  // The job has a numeric class now. So workers of this class with may_begin == false, which get no units of
  // jobs without a class, may take its units.
  for (const WorkerIndex index : workers.wanting_work()) {
    const Worker& worker = workers.at(index);
    if (!worker.may_begin && worker.numeric_class == numeric_class) work_appeared = pinned_for_others = true;
  }
}

void Farm::State::keep_class(Job& job, const Digest& numeric_class) {
  pin(job, numeric_class);
  job.class_kept |= *job.numeric_class == numeric_class;
}

void Farm::State::unpin(Job& job) {
  if (!job.numeric_class || job.class_kept || job.leased > 0 || job.ended()) return;
  job.numeric_class.reset();
  effects.emplace_back(JobUnpinned{job.plan.brief.job});
  work_appeared = true;
}

void Farm::State::pass_over(Job& job, const Worker& worker) {
  if (job.class_kept) return;
  std::set<WorkerIndex>& fruitless = job.passed_over[worker.numeric_class].workers;
  if (fruitless.size() < kFruitlessLeases) fruitless.insert(worker.index);
}

void Farm::State::doubt_pin(Job& job) {
  if (!job.numeric_class || job.class_kept || !job.leasable()) return;
  // Counted by releases, not by classes: there may be two classes only, and the job may take long to load
  const std::uint32_t doublings = std::min(job.pins_released, 10u);
  if (now - job.pinned_at < kPinLimit * (1 << doublings)) return;
  const Digest pinned = *std::exchange(job.numeric_class, std::nullopt);
  const bool wanted = std::any_of(workers.all().begin(), workers.all().end(), [&](const auto& entry) {
    const Worker& other = *entry.second;
    return other.numeric_class != pinned && !other.saturated() && may_serve(job, other, ticked);
  });
  job.numeric_class = pinned;
  if (!wanted) return;
  ++job.pins_released;
  for (const LeaseSeq seq : leases_of(job)) free_lease(seq, FreedCause::deadline_passed, true);
  unpin(job);
  refresh(job);
}

void Farm::State::on(const ClassChosen& event) {
  Job* job = find(event.job);
  if (job == nullptr || job->ended()) return;
  keep_class(*job, event.numeric_class);
  refresh(*job);
}

void Farm::State::on(const UnitAccepted& event) {
  accept(event);
  Worker* worker = workers.find(event.worker);
  if (worker == nullptr || !worker->connected) return;
  note_begun(*worker);
  end_long_leases(*worker);
}

void Farm::State::accept(const UnitAccepted& event) {
  const auto unwanted = [&](std::string why) {
    effects.emplace_back(DropUnwanted{event.unit, event.worker, std::move(why)});
  };
  Worker* worker = workers.find(event.worker);
  Job* found = find(event.unit.job);
  const UnitCode code = unit_code(event.unit.round, event.unit.tile);
  if (worker != nullptr) {
    const LeaseRecord* lease = found ? lease_of(*found, code, *worker) : nullptr;
    if (worker->connected) note_progress(*worker, lease ? lease->seq : 0);
  }
  if (found == nullptr) return unwanted("no such job");
  Job& job = *found;
  if (is_closed(job.state)) return unwanted("the job has ended");
  if (quarantined.contains(event.worker)) return unwanted("the worker is quarantined");
  if (event.unit.tile >= job.units.tiles() || !job.queue.plans(code))
    return unwanted("not a unit of this job");
  if (event.samples != job.range(code)) return unwanted("another sample range is wanted");
  if (worker != nullptr && job.numeric_class && *job.numeric_class != worker->numeric_class) {
    return unwanted("another numeric class");
  }
  if (job.units.accepted(code)) return compare(job, code, event);

  note_fruitful(worker, job);
  if (worker != nullptr) {
    keep_class(job, worker->numeric_class);
    // A class, or a worker, is preferred from its first result on: units that were kept for others are for it
    // now
    work_appeared |= proven.insert(worker->numeric_class).second || worker->units_done == 0;
  }
  if (job.state == JobState::queued) set_state(job, JobState::running);
  const auto since = worker ? held_since(job, code, *worker) : std::nullopt;
  const double cpu_seconds = believable(job, code, worker, since, event.cpu_seconds, now);
  if (!job.clock.started()) job.clock.start(now - from_seconds(cpu_seconds));
  effects.emplace_back(RecordUnit{event.unit, event.samples, event.digest, event.worker});
  settle_unit(job, code, worker);
  job.units.accept(code, {event.digest, workers.index_of(event.worker)});
  job.failures.accepted(code);
  job.cost.measured(event.unit.tile, job.pixel_samples(code), cpu_seconds);
  shares.spend(job, cpu_seconds);
  if (worker != nullptr) {
    ++worker->units_done;
    worker->claim(since.value_or(now), cpu_seconds, now);
    workers.measured(*worker, cpu_seconds, event.wait_seconds);
    if (worker->connected) worker->warmed_up.insert(job.seq);
  }
  consider_audit(job, code, workers.index_of(event.worker));
  issue_folds(job, event.unit.tile);
  watch_time(job);
  refresh(job);
}

void Farm::State::note_fruitful(Worker* worker, Job& job) {
  job.losses_in_a_row = 0;
  if (worker == nullptr) return;
  worker->fruitless_in_a_row = 0;
  work_appeared |= worker->fruitless.erase(job.seq) > 0;
}

std::optional<TimePoint> Farm::State::held_since(const Job& job, UnitCode code, const Worker& worker) const {
  const auto before = job.voters.since(code, worker.index);
  const LeaseRecord* lease = lease_of(job, code, worker);
  if (lease == nullptr) return before;
  return before ? std::min(*before, lease->issued) : lease->issued;
}

double Farm::State::believable(const Job& job, UnitCode code, const Worker* worker,
                               std::optional<TimePoint> since, double reported, TimePoint at) {
  if (!(reported > 0)) return 0;
  if (!since) return std::min(reported, job.cost.known() ? job.predict(code) : kAssumedUnitSeconds);
  const WorkedTime& worked = worker->worked_on(*since);
  const double of_all_threads = worker->threads * seconds(at - worked.since) - worked.claimed;
  return std::clamp(std::min(seconds(at - *since), of_all_threads), 0.0, reported);
}

void Farm::State::issue_folds(Job& job, TileIndex tile) {
  while (const auto round = job.units.issue_fold(tile, job.last_foldable(tile), job.queue.end(tile))) {
    const UnitCode code = unit_code(*round, tile);
    effects.emplace_back(Fold{job.key(code), job.range(code)});
  }
}

void Farm::State::on(const UnitFolded& event) {
  Job* job = find(event.unit.job);
  if (job == nullptr || job->ended() || event.unit.tile >= job->units.tiles()) return;
  const UnitCode code = unit_code(event.unit.round, event.unit.tile);
  // If the ranges differ, the job was extended after this round was rendered: the event concerns the round as
  // truncated by the old sample limit. The round is rendered again in full, so the event is ignored.
  if (event.samples != job->range(code)) return;
  const RoundIndex before = job->units.rounds_complete();
  if (!job->units.fold(event.unit.tile, event.unit.round, event.rel_error_sum)) return;
  for (RoundIndex r = before; r < job->units.rounds_complete(); ++r) checkpoint(*job, r);
  if (job->adaptive) steer(*job, event.unit.tile, event.unit.round);
  finish_if_complete(*job);
  if (job->units.rounds_complete() != before) refresh(*job);
}

// Takes a checkpoint when this round of every tile is in the image. In an adaptive job (one with a target
// error) this function takes checkpoints only before kMinSppBeforeStop samples per pixel, which every tile
// gets in any case; later ones are taken at levels of the stop rule (farm_stop.cpp).
void Farm::State::checkpoint(Job& job, RoundIndex round) {
  const double spp = static_cast<double>(cut_range(round, job.spp).s1);
  // A checkpoint must have more samples per pixel than the previous one, so none is taken twice.
  if ((!job.adaptive || cut_range(round, job.spp).s1 < std::min(job.spp, kMinSppBeforeStop)) &&
      spp > job.checkpoint_spp) {
    job.checkpoint_spp = spp;
    effects.emplace_back(
        Checkpoint{job.plan.brief.job, std::vector<RoundIndex>(job.units.tiles(), round + 1), spp});
  }
  if (!job.adaptive) job.move_windows(workers.threads());
}

const LeaseRecord* Farm::State::lease_of(const Job& job, UnitCode code, const Worker& worker) const {
  const auto held = [&](LeaseSeq seq) {
    const auto lease = leases.all().find(seq);
    return lease != leases.all().end() && lease->second.worker == &worker ? &lease->second : nullptr;
  };
  const auto audit = job.audits.find(code);
  if (audit != job.audits.end() && audit->second.lease != 0) return held(audit->second.lease);
  const auto it = job.out.find(code);
  if (it == job.out.end()) return nullptr;
  for (const LeaseSeq seq : it->second.lease)
    if (const LeaseRecord* lease = held(seq)) return lease;
  return nullptr;
}

void Farm::State::on(const UnitFailed& event) {
  Worker* worker = workers.find(event.worker);
  Job* job = find(event.failure.unit.job);
  if (worker == nullptr || job == nullptr || job->ended()) return;
  const UnitCode code = unit_code(event.failure.unit.round, event.failure.unit.tile);
  const LeaseRecord* failed_in = lease_of(*job, code, *worker);
  note_progress(*worker, failed_in ? failed_in->seq : 0);
  if (event.failure.unit.tile >= job->units.tiles() || !job->queue.plans(code)) return;
  // Only the failure of a worker that holds the unit counts. If the unit was taken back, another worker
  // renders it, and this report is ignored.
  LeaseRecord* lease = lease_of(*job, code, *worker);
  if (lease == nullptr) return;
  if (lease->audit) return audit_failed(*job, code, *worker, *lease);
  free_units(*lease, FreedCause::failed, false, [&](UnitCode unit) { return unit == code; });
  count_failure(*job, code, *worker, event.failure);
}

void Farm::State::count_failure(Job& job, UnitCode code, Worker& worker, const UnitFailure& failure) {
  job.failures.add(code, {worker.index, worker.name, worker.principal, worker.proven(), failure});
  WorkerFailures& record = worker.failures[job.seq];
  const bool was_blocked = record.blocked_at(now);
  record.add(now);
  work_appeared = true;  // other workers may now take this unit
  // A process can open any number of streams, each of them a worker. So principals are counted. And where
  // workers are there that have shown that they can render, only their failures speak against the scene.
  std::set<std::string_view> known, proven_ones;
  std::size_t willing = 0;
  for (const auto& [index, other] : workers.all()) {
    if (!other->connected || !fits(job, *other)) continue;
    known.insert(other->principal);
    const bool blocked = other->blocked(job.seq, now);
    if (other->proven() && (!blocked || job.failures.failed_on(code, index)))
      proven_ones.insert(other->principal);
    if (!blocked) ++willing;
  }
  const auto report = [&](bool no_worker) {
    JobFailure why = failure_after(job.failures.attempts(code), job.plan.grid.rect(tile_of(code)),
                                   job.range(code), job.plan.replay);
    if (no_worker && why.kind == FailureKind::unit) why.kind = FailureKind::no_worker;
    std::string text = describe(why);
    fail(job, std::move(text), std::move(why));
  };
  // A single report that the scene is at fault does not fail the job: the worker may have bad memory or lie.
  // It counts like any other failure.
  const bool only_proven = !proven_ones.empty();
  if (job.failures.exhausted(code, (only_proven ? proven_ones : known).size(), only_proven))
    return report(false);
  if (!known.empty() && willing == 0) return report(true);
  if (was_blocked || !record.blocked_at(now)) return;
  effects.emplace_back(
      WorkerBlocked{worker.id, job.plan.brief.job,
                    fmt::format("failed {} of its units: {}", record.count, failure.reason)});
  const auto blocks = std::count_if(worker.failures.begin(), worker.failures.end(),
                                    [&](const auto& entry) { return entry.second.blocked_at(now); });
  if (blocks < kUnhealthyJobs || worker.unhealthy_since) return;
  worker.unhealthy_since = now;
  workers.settle(worker);
  effects.emplace_back(WorkerStateChanged{
      worker.id, worker.state(),
      fmt::format("failed in {} jobs that others render; last: {}", blocks, failure.reason)});
}

}  // namespace ls::coordinator
