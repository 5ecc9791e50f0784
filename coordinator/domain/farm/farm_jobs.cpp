// The life of jobs in the farm, from submission to end.
#include <algorithm>
#include <set>

#include "common/image/frame/frame.h"
#include "coordinator/domain/farm/farm_state.h"

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
  to == JobState::paused || to == JobState::done ? job.stand_still(now) : job.go_on(now);
}

void Farm::State::refresh(Job& job) {
  const bool units = job.leasable() && !job.queue.empty(job.units);
  // FairShare may list the job already, because of an audit that only some workers can render
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
  if (event.elapsed_seconds > 0) job.first_ray = now - from_seconds(event.elapsed_seconds);
  if (job.state == JobState::paused || job.state == JobState::done) job.stand_still(now);
  if (is_closed(job.state)) return;

  // If a done job has lost its film (the sums of its samples), the number of samples of each tile is lost,
  // too. Then the film is summed up again from the job's results.
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
  job.move_windows(workers.threads());
  if (job.state == JobState::done) {
    if (job.complete()) return;
    job.stopping.reset();
    set_state(job, JobState::running);
  }
  restore_audits(job, event);
  if (job.adaptive) judge(job);
  for (TileIndex t = 0; t < job.units.tiles(); ++t) issue_folds(job, t);
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
  // A worker finishes a lease that it has begun; leases that are not begun are taken back now. The newest
  // lease goes first, since whether a lease has begun is derived from the worker's earlier leases.
  const std::vector<LeaseSeq> out = leases_of(*job);
  for (auto seq = out.rbegin(); seq != out.rend(); ++seq)
    if (untouched(*leases.find(*seq))) free_lease(*seq, FreedCause::paused, true);
  refresh(*job);
}

void Farm::State::on(const JobResumed& event) {
  Job* job = find(event.job);
  if (job == nullptr || job->state != JobState::paused) return;
  set_state(*job, job->numeric_class ? JobState::running : JobState::queued);
  // if a failed check of the denoised error paused the job, the check is made again
  job->checking_spp = 0;
  if (job->adaptive) judge(*job);
  refresh(*job);
}

void Farm::State::on(const JobStopped& event) {
  Job* job = find(event.job);
  if (job == nullptr || job->ended()) return;
  freeze(*job, StopReason::user);
  if (job->state == JobState::paused)
    set_state(*job, job->numeric_class ? JobState::running : JobState::queued);
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

void Farm::State::on(const JobFocused& event) {
  Job* job = find(event.job);
  if (job == nullptr || (event.focus && !lies_in(job->plan.grid.frame, *event.focus))) return;
  job->plan.focus = event.focus;
  job->look_at_focus();
}

// Forgets the job, but keeps the failures of workers in it until they are forgiven. A worker that fails in
// two jobs is unhealthy, even if the first job is gone.
void Farm::State::on(const JobForgotten& event) {
  Job* job = find(event.job);
  if (job == nullptr || !job->ended()) return;
  for (const auto& [index, worker] : workers.all()) {
    worker->briefed.erase(job->seq);
    worker->warmed_up.erase(job->seq);
  }
  by_id.erase(event.job);
  jobs.erase(job->seq);
}

void Farm::State::freeze(Job& job, StopReason reason) {
  job.frozen = true;
  work_appeared = true;  // units that came back after the time limit may be leased again
  std::vector<RoundIndex> begun(job.units.tiles());
  for (TileIndex t = 0; t < begun.size(); ++t)
    begun[t] = std::max({job.queue.next(t), job.units.end_of_accepted(t), RoundIndex{1}});
  job.cut_off(begun, reason);
  // This also adds accepted results that the stop rule of a target error has kept out of the image
  for (TileIndex t = 0; t < begun.size(); ++t) issue_folds(job, t);
  finish_if_complete(job);
  refresh(job);
}

void Farm::State::finish_if_complete(Job& job) {
  if (job.ended() || !job.complete()) return;
  // Open audits (units that are rendered again for comparison) must end first: they decide whether the image
  // is right
  if (!job.audits.empty()) return refresh(job);
  if (!job.stopping) job.stopping = StopReason::spp;
  set_state(job, JobState::done);
  effects.emplace_back(JobFinished{job.plan.brief.job, *job.stopping, job.audits_missed});
  refresh(job);
}

void Farm::State::fail(Job& job, std::string error) {
  set_state(job, JobState::failed);
  effects.emplace_back(JobFailed{job.plan.brief.job, std::move(error)});
  // The failure of a job is not attributed to its workers: their failures in it are erased.
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
    worker.briefed.erase(job.seq);
    worker.warmed_up.erase(job.seq);
  }
  audited.dropped += job.audits.size();
  if (!job.audits.empty()) audits_changed.insert(job.plan.brief.job);
  job.audits.clear();
  job.voters.clear();
  job.units.forget_results();
  refresh(job);
}

}  // namespace ls::coordinator
