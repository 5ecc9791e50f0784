// The life of jobs in the farm, from submission to end, and changes that a user makes to them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "coordinator/domain/farm/farm_state.h"
#include "core/image/frame/frame.h"

namespace ls::coordinator {

Job* Farm::State::find(const JobId& id) const {
  const auto it = by_id.find(id);
  return it == by_id.end() ? nullptr : it->second;
}

Job& Farm::State::add(JobPlan plan) {
  auto job = std::make_unique<Job>(++last_job, std::move(plan));
  Job& added = *job;
  by_id[added.plan.brief.job] = &added;
  jobs.emplace(added.seq, std::move(job));
  added.move_windows(workers.threads());
  return added;
}

void Farm::State::set_state(Job& job, JobState to) {
  if (job.state == to) return;
  effects.emplace_back(JobStateChanged{job.plan.brief.job, job.state, to});
  job.state = to;
  to == JobState::paused || to == JobState::done ? job.clock.stand_still(now) : job.clock.go_on(now);
}

void Farm::State::refresh(Job& job) {
  const bool units = job.leasable() && !job.plan.held && !job.queue.empty(job.units);
  // work_appeared is set even if FairShare lists the job already: it may be listed only for an audit, which
  // few workers can render, whereas more workers can render these units.
  work_appeared |= units && !job.has_units;
  job.has_units = units;
  if (units || (job.leasable() && job.audit_waits()))
    work_appeared |= shares.offer(job);
  else
    shares.withdraw(job);
}

void Farm::State::on(const JobSubmitted& event) {
  if (find(event.plan.brief.job) != nullptr || !check_plan(event.plan)) return;
  refresh(add(event.plan));
}

void Farm::State::on(const JobRestored& event) {
  if (find(event.plan.brief.job) != nullptr || !check_plan(event.plan)) return;
  Job& job = add(event.plan);
  if (job.denoised) job.denoised.emplace(event.denoised_checks);
  job.state = event.state;
  job.numeric_class = event.numeric_class;
  if (event.elapsed_seconds > 0) job.clock.start(now - from_seconds(event.elapsed_seconds));
  if (job.state == JobState::paused || job.state == JobState::done) job.clock.stand_still(now);
  if (is_closed(job.state)) return;

  // If a done job has lost its film (the sums of its samples), it is unknown how many samples each tile had.
  // Then the film is summed up again from the job's results, and the job ends anew.
  const bool with_film = event.folded.size() == job.units.tiles() &&
                         std::any_of(event.folded.begin(), event.folded.end(), [](auto r) { return r > 0; });
  if (job.state == JobState::done && with_film) {
    job.cut_off(event.folded, event.stopped.value_or(StopReason::spp));
    job.stopping = event.stopped;
  }
  for (const JobRestored::Unit& unit : event.accepted) {
    const UnitCode code = unit_code(unit.round, unit.tile);
    if (unit.tile >= job.units.tiles() || !job.queue.plans(code) || unit.samples != job.range(code)) continue;
    if (!job.units.accepted(code)) job.units.accept(code, {unit.digest, workers.index_of(unit.worker)});
  }
  for (TileIndex t = 0; with_film && t < job.units.tiles(); ++t) restore_tile(job, t, event);
  job.class_kept = job.numeric_class && job.units.accepted_count() > 0;
  // A class without results was that of leases that are gone
  if (job.numeric_class && !job.class_kept && job.state != JobState::done) {
    job.numeric_class.reset();
    effects.emplace_back(JobUnpinned{job.plan.brief.job});
  }
  job.move_windows(workers.threads());
  if (job.state == JobState::done) {
    if (job.complete()) return;
    job.stopping.reset();
    set_state(job, JobState::running);
  }
  restore_audits(job, event);
  if (job.adaptive) judge(job);
  issue_folds(job);
  finish_if_complete(job);
  refresh(job);
}

void Farm::State::restore_tile(Job& job, TileIndex t, const JobRestored& event) {
  const RoundIndex rounds = std::min(event.folded[t], job.queue.end(t));
  for (RoundIndex k = 0; k < rounds; ++k) {
    if (!job.units.accepted(unit_code(k, t)))
      job.units.accept(unit_code(k, t), {Digest{}, workers.index_of({})});
    if (k < event.rel_error.size() && t < event.rel_error[k].size())
      job.units.restore_error(k, t, event.rel_error[k][t]);
    if (job.adaptive) job.adaptive->folded(t, k, job.units.error(k, t));
  }
  job.units.restore_folded(t, rounds);
}

void Farm::State::on(const JobCancelled& event) {
  Job* job = find(event.job);
  if (job == nullptr || job->ended()) return;
  set_state(*job, JobState::cancelled);
  end(*job);
}

void Farm::State::on(const JobPaused& event) {
  Job* job = find(event.job);
  if (job == nullptr || !job->leasable()) return;
  set_state(*job, JobState::paused);
  // A worker finishes the units that it has begun; leases that are not begun are taken back now. The newest
  // goes first: whether a lease has begun is derived from the worker's earlier leases, which must still
  // exist.
  const std::vector<LeaseSeq> out = leases_of(*job);
  for (auto seq = out.rbegin(); seq != out.rend(); ++seq)
    if (untouched(*leases.find(*seq))) free_lease(*seq, FreedCause::paused, true);
  recall_all(*job);
  refresh(*job);
}

void Farm::State::on(const JobResumed& event) {
  Job* job = find(event.job);
  if (job == nullptr || job->state != JobState::paused) return;
  set_state(*job, job->numeric_class ? JobState::running : JobState::queued);
  job->pinned_at = now;  // workers were given nothing while it was paused
  // The job may have been paused because a check of its denoised layers failed. judge() then requests this
  // check again
  job->checking_spp = 0;
  if (job->adaptive) judge(*job);
  cut_off_returned(*job);
  refresh(*job);
}

void Farm::State::on(const JobStopped& event) {
  Job* job = find(event.job);
  if (job == nullptr || job->ended()) return;
  freeze(*job, StopReason::user);
  if (job->state == JobState::paused) {
    set_state(*job, job->numeric_class ? JobState::running : JobState::queued);
    job->pinned_at = now;
  }
  refresh(*job);
}

void Farm::State::on(const JobPriority& event) {
  Job* job = find(event.job);
  if (job == nullptr) return;
  shares.leave(*job);
  job->plan.priority = event.priority;
  shares.enter(*job);
  refresh(*job);
}

void Farm::State::on(const JobHeld& event) {
  Job* job = find(event.job);
  if (job == nullptr) return;
  job->plan.held = event.held;
  refresh(*job);
}

void Farm::State::on(const JobFocused& event) {
  Job* job = find(event.job);
  if (job == nullptr || (event.focus && !lies_in(job->plan.grid.frame, *event.focus))) return;
  job->plan.focus = event.focus;
  job->look_at_focus();
}

// Forgets the job. The workers' failures in it stay recorded until they are forgiven: a worker that fails in
// two jobs is unhealthy, even if the first job is gone.
void Farm::State::on(const JobForgotten& event) {
  Job* job = find(event.job);
  if (job == nullptr || !job->ended()) return;
  for (const auto& [index, worker] : workers.all()) {
    worker->warmed_up.erase(job->seq);
    worker->fruitless.erase(job->seq);
  }
  by_id.erase(event.job);
  jobs.erase(job->seq);
}

namespace {

// Returns the number of rounds that each tile of a frozen job gets: those before the first round that nobody
// has rendered or is rendering, and at least one. Which rounds these are depends on the units before them,
// not on what they cost themselves, so the image gets no bias from costs.
std::vector<RoundIndex> rounds_in_hand(const Job& job) {
  std::vector<RoundIndex> ends = job.begun();
  for (TileIndex t = 0; t < ends.size(); ++t)
    for (RoundIndex r = std::max<RoundIndex>(1, job.units.issued(t)); r < ends[t]; ++r)
      if (const UnitCode code = unit_code(r, t); !job.units.accepted(code) && !job.out.contains(code))
        ends[t] = r;
  return ends;
}

}  // namespace

void Farm::State::cut_off_returned(Job& job) {
  if (!job.frozen || !job.leasable()) return;
  job.cut_off(rounds_in_hand(job), *job.frozen);
  give_back_beyond(job);
  issue_folds(job);
  finish_if_complete(job);
  refresh(job);
}

void Farm::State::freeze(Job& job, StopReason reason) {
  job.frozen = reason;
  // Units that workers gave back may be leased again: the time limit no longer forbids it
  work_appeared = true;
  job.cut_off(rounds_in_hand(job), reason);
  give_back_beyond(job);
  recall_all(job);  // cut_off_returned() drops what comes back
  // The stop rule of a target error no longer holds back accepted results: these are now added to the image
  issue_folds(job);
  finish_if_complete(job);
  refresh(job);
}

void Farm::State::watch_time(Job& job) {
  const auto limit = job.time_limit(now);
  if (job.leasable() && !job.frozen && limit && now >= *limit) freeze(job, StopReason::time);
}

void Farm::State::finish_if_complete(Job& job) {
  if (job.ended() || !job.complete()) return;
  // If the units that were chosen for the time that was left cost less than predicted, more of them fit.
  if (const auto limit = job.time_limit(now);
      limit && now < *limit && job.stopping == StopReason::time && !job.frozen) {
    plan_end(job, *limit);
    work_appeared = true;
    if (!job.complete()) return refresh(job);
  }
  // Open audits (units that are rendered again for comparison) must end first: they decide whether the image
  // is right
  if (!job.audits.empty()) return refresh(job);
  if (!job.stopping) job.stopping = StopReason::spp;
  set_state(job, JobState::done);
  effects.emplace_back(JobFinished{job.plan.brief.job, *job.stopping, job.audits_missed});
  refresh(job);
}

void Farm::State::fail(Job& job, std::string error, std::optional<JobFailure> failure) {
  set_state(job, JobState::failed);
  effects.emplace_back(JobFailed{job.plan.brief.job, std::move(error), std::move(failure)});
  // The job is to blame for its failure, not the workers: their failures in it are erased.
  for (const auto& [index, worker] : workers.all()) worker->failures.erase(job.seq);
  end(job);
}

void Farm::State::end(Job& job) {
  std::set<WorkerIndex> notified;
  for (const LeaseSeq seq : leases_of(job)) {
    Worker& worker = *leases.find(seq)->worker;
    free_lease(seq, FreedCause::job_ended, false);
    if (!worker.connected || !notified.insert(worker.index).second) continue;
    effects.emplace_back(Send{worker.id, CancelJob{job.plan.brief.job}});
    worker.warmed_up.erase(job.seq);
  }
  for (const auto& [index, worker] : workers.all()) worker->fruitless.erase(job.seq);
  audited.dropped += job.audits.size();
  if (!job.audits.empty()) audits_changed.insert(job.plan.brief.job);
  job.audits.clear();
  job.voters.clear();
  job.units.forget_results();
  refresh(job);
}

Result<JobPlan> Farm::State::retargeted(const Job& job, double target_error) {
  const auto refuse = [](std::string why) { return ls::fail(Errc::failed_precondition, std::move(why)); };
  const std::string& id = job.plan.brief.job.value;
  if (!(target_error > 0 && std::isfinite(target_error)))
    return ls::fail(Errc::invalid_argument, "target_error must be positive");
  if (is_closed(job.state))
    return refuse(fmt::format("job {} is {}: its target error can no longer be changed; submit it again", id,
                              to_string(job.state)));
  if (!job.plan.target_error)
    return refuse(
        fmt::format("job {} has no target error, so its tiles' errors are not kept: it can't be "
                    "given one; extend its samples (spp), or submit it again",
                    id));
  constexpr std::string_view kCauses[] = {"has reached its number of samples", "has reached its target error",
                                          "has reached its time limit", "was stopped by a user"};
  if (job.stopping && job.stopping != StopReason::error)
    return refuse(
        fmt::format("job {} {}: its target error can no longer be changed; extend its samples (spp), or "
                    "submit it again",
                    id, kCauses[static_cast<std::size_t>(*job.stopping)]));
  if (job.stopping && target_error >= *job.plan.target_error)
    return refuse(
        fmt::format("job {} has come down to its target error of {:g}: only a smaller one makes a "
                    "difference",
                    id, *job.plan.target_error));
  JobPlan plan = job.plan;
  plan.target_error = target_error;
  return plan;
}

Result<JobPlan> Farm::State::extended(const Job& job, std::uint64_t spp, TimePoint now) {
  const std::string& id = job.plan.brief.job.value;
  if (is_closed(job.state))
    return ls::fail(Errc::failed_precondition,
                    fmt::format("job {} is {}: it cannot be extended", id, to_string(job.state)));
  // now_spp is the job's current total of samples per pixel: the requested number, or, if a target error, a
  // time limit or the user ends the job early, the number of samples in the tile with the most rounds.
  const RoundIndex rounds = job.queue.longest();
  const bool cut_short = job.stopping && *job.stopping != StopReason::spp;
  const std::uint64_t now_spp = !cut_short ? job.spp : rounds == 0 ? 0 : cut_range(rounds - 1, job.spp).s1;
  const bool uneven = cut_short && job.adaptive;
  if (even_spp(spp) < now_spp || (even_spp(spp) == now_spp && !uneven))
    return ls::fail(Errc::invalid_argument,
                    fmt::format("job {} has {} samples per pixel already{}; ask for a larger total", id,
                                now_spp, uneven ? " in parts of the image" : ""));
  if (job.adaptive_running() && job.adaptive->bound())
    return ls::fail(Errc::failed_precondition,
                    fmt::format("parts of job {} have all of its {} samples, and its target error was judged "
                                "with them: extend it when it is done",
                                id, job.spp));
  JobPlan plan = job.plan;
  plan.spp = even_spp(spp);
  const auto limit = job.time_limit(now);
  const bool by_time = job.stopping == StopReason::time && (job.frozen || job.ended());
  if (by_time || (limit && now >= *limit)) plan.time.reset();
  if (job.stopping) plan.target_error.reset();
  if (auto sound = check_plan(plan); !sound) return tl::unexpected(sound.error());
  return plan;
}

void Farm::State::on(const JobRetargeted& event) {
  Job* job = find(event.job);
  if (job == nullptr) return;
  auto plan = retargeted(*job, event.target_error);
  if (!plan) return;
  job->plan = std::move(*plan);
  job->level_seen = 0;
  job->predicted_at = 0;
  job->predicted_error = 0;
  if (job->stopping) {
    job->stopping.reset();
    job->plan_all();
    if (job->state == JobState::done) set_state(*job, JobState::running);
  }
  take_up_again(*job);
}

void Farm::State::on(const JobExtended& event) {
  Job* job = find(event.job);
  if (job == nullptr) return;
  auto plan = extended(*job, event.spp, now);
  if (!plan) return;
  const RoundIndex last = round_count(job->spp) - 1;
  const std::uint64_t new_spp = even_spp(event.spp);
  if (cut_range(last, job->spp) != cut_range(last, new_spp)) reopen(*job, last);
  job->plan = std::move(*plan);
  job->spp = new_spp;
  job->stopping.reset();
  job->frozen.reset();
  if (job->plan.target_error) job->adaptive->extend(new_spp);
  job->steer();
  job->plan_all();
  if (job->state == JobState::done) set_state(*job, JobState::running);
  take_up_again(*job);
}

void Farm::State::reopen(Job& job, RoundIndex last) {
  for (const LeaseSeq seq : leases_of(job)) {
    const LeaseRecord& lease = *leases.find(seq);
    const bool concerned = std::any_of(lease.units.begin(), lease.units.end(),
                                       [&](UnitCode unit) { return round_of(unit) >= last; });
    if (concerned) free_lease(seq, FreedCause::round_reopened, true);
  }
  close_audits(job, [&](UnitCode code, const Audit&) { return round_of(code) >= last; });
  for (TileIndex t = 0; t < job.units.tiles(); ++t) job.queue.rewind(t, last);
  job.units.reopen(last);
  effects.emplace_back(ReopenRound{job.plan.brief.job, last});
}

void Farm::State::take_up_again(Job& job) {
  work_appeared = true;
  // When a worker is quarantined, ended jobs keep its results, since their images are final. This job goes
  // on, so such results become void now.
  for (const auto& [worker, why] : quarantined)
    if (const WorkerIndex faulty = workers.index_of(worker); !job.units.tiles_of(faulty).empty())
      void_results(job, faulty);
  if (job.adaptive) judge(job);
  job.move_windows(workers.threads());
  issue_folds(job);
  finish_if_complete(job);
  refresh(job);
}

}  // namespace ls::coordinator
