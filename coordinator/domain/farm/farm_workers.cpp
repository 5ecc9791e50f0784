// The farm's reaction to workers that join, report and leave, and to the passing of time.
#include <algorithm>
#include <span>

#include "coordinator/domain/farm/farm_state.h"

namespace ls::coordinator {
namespace {
constexpr int kMaxThreads = 4096;
// More classes are remembered only while workers of them are connected
constexpr std::size_t kProvenKept = 64;
constexpr const char* kUnknownInSpiteOfBrief =
    "it says that it does not know the job, though the job's brief came with the units";
}  // namespace

void Farm::State::touch(Worker& worker) {
  workers.settle(worker);
  dirty.insert(worker.index);
}

void Farm::State::on(const WorkerJoined& event) {
  const bool is_new = workers.find(event.worker) == nullptr;
  Worker& worker = workers.get(event.worker);
  // A job may know units that the worker had before it was forgotten
  if (is_new) worker.worked.since = now;
  if (worker.connected) {
    if (event.epoch <= worker.epoch) return;  // late event of an older connection
    lose(worker, FreedCause::newer_stream);
  }
  worker.epoch = event.epoch;
  worker.name = event.name.empty() ? event.worker.value : event.name;
  workers.set_principal(worker, event.principal);
  worker.numeric_class = event.numeric_class;
  worker.platform = event.platform;
  worker.threads = std::clamp(event.threads, 1, kMaxThreads);
  worker.tags = event.tags;
  std::sort(worker.tags.begin(), worker.tags.end());
  worker.memory_bytes = event.memory_bytes;
  worker.may_begin = event.may_begin;
  worker.blobs.clear();
  for (const Digest& blob :
       std::span(event.blobs_held).first(std::min(event.blobs_held.size(), kBlobsRemembered)))
    worker.blobs.push_back(head_of(blob));
  std::sort(worker.blobs.begin(), worker.blobs.end());
  const auto known = quarantined.find(event.worker);
  worker.quarantined = known != quarantined.end();
  worker.draining = worker.restarts = false;
  worker.pause = Pause::none;
  worker.briefs = BriefMemory<JobSeq>(std::min(event.brief_bytes, kBriefBytesMost));
  worker.warmed_up.clear();
  workers.connected(worker, true);
  effects.emplace_back(WorkerStateChanged{worker.id, worker.state(),
                                          worker.quarantined ? "quarantined: " + known->second : "joined"});
  for (const auto& [seq, job] : jobs) {
    if (!job->leasable() || !job->plan.target_error) continue;
    job->move_windows(workers.threads());
    refresh(*job);
  }
  touch(worker);
}

void Farm::State::on(const WorkerQuarantined& event) {
  if (quarantined.try_emplace(event.worker, event.why).second) bar(event.worker, event.why);
}

void Farm::State::on(const WorkerLost& event) {
  Worker* worker = workers.find(event.worker);
  if (worker == nullptr || !worker->connected || worker->epoch != event.epoch) return;
  lose(*worker, FreedCause::worker_lost);
  if (!worker->never_worked()) return;
  lost_newcomers.push_back(worker->id);
  while (lost_newcomers.size() > kLostNewcomersKept) {
    Worker* first = workers.find(lost_newcomers.front());
    lost_newcomers.pop_front();
    if (first != nullptr && !first->connected && first->never_worked()) forget(*first);
  }
}

void Farm::State::forget(Worker& worker) {
  effects.emplace_back(WorkerForgotten{worker.id});
  dirty.erase(worker.index);
  workers.forget(worker);
}

void Farm::State::lose(Worker& worker, FreedCause why) {
  workers.connected(worker, false);
  worker.lost_at = now;
  std::set<Job*> lost_by;
  for (const LeaseSeq seq : worker.leases) lost_by.insert(leases.find(seq)->job);
  for (Job* job : lost_by) {
    ++job->losses_in_a_row;
    job->last_lost = worker.name;
  }
  // The newest lease goes first: which units may be begun is derived from the worker's earlier leases.
  while (!worker.leases.empty()) free_lease(*worker.leases.rbegin(), why, false);
  for (const auto& [seq, job] : jobs) cut_off_returned(*job);
  workers.settle(worker);
  effects.emplace_back(WorkerStateChanged{worker.id, worker.state(), std::string(to_string(why))});
  work_appeared = true;  // other workers may now take the units of this worker
}

void Farm::State::on(const WorkerDrains& event) {
  Worker* worker = workers.find(event.worker);
  if (worker == nullptr || !worker->connected) return;
  const bool restarts = !event.withdrawn && event.restarts;
  if (worker->draining == !event.withdrawn && worker->restarts == restarts) return;
  worker->draining = !event.withdrawn;
  worker->restarts = restarts;
  touch(*worker);
  effects.emplace_back(WorkerStateChanged{worker->id, worker->state(),
                                          event.withdrawn ? "takes units again"
                                          : restarts      ? "drains, and then restarts its program"
                                                          : "drains"});
  work_appeared = true;
}

void Farm::State::note_progress(Worker& worker, LeaseSeq from) {
  worker.progress_at = now;
  for (auto seq = worker.leases.lower_bound(from); seq != worker.leases.end(); ++seq)
    leases.find(*seq)->progress_at = now;
  if (worker.pause == Pause::silent || worker.pause == Pause::stuck) worker.pause = Pause::none;
  touch(worker);
}

void Farm::State::on(const LeaseProgress& event) {
  Worker* worker = workers.find(event.worker);
  if (worker == nullptr || !worker->connected) return;
  if (worker->pause == Pause::silent || (worker->pause == Pause::stuck && event.leases.empty())) {
    worker->pause = Pause::none;
    touch(*worker);
  }
  for (const WorkerProgress::Entry& entry : event.leases) {
    LeaseRecord* lease = leases.find(entry.lease);
    if (lease == nullptr || lease->worker != worker) continue;
    if (entry.units_done > lease->reported) {
      lease->reported = entry.units_done;
      note_progress(*worker, lease->seq);
    }
    if (now - lease->progress_at < kNoGrowthLimit) renew(*lease);
  }
}

void Farm::State::on(const ResultsWait& event) {
  Worker* worker = workers.find(event.worker);
  if (worker == nullptr || !worker->connected) return;
  note_progress(*worker);
  for (const LeaseSeq seq : worker->leases) renew(*leases.find(seq));
}

void Farm::State::note_fruitless(Worker& worker, const Job& job, const std::string& why) {
  FruitlessLeases& leases_of_job = worker.fruitless[job.seq];
  if (leases_of_job.count > 0 && leases_of_job.tick == ticked) return;
  leases_of_job.tick = ticked;
  leases_of_job.add(now, why);
  ++worker.fruitless_in_a_row;
  if (leases_of_job.count == kFruitlessLeases)
    effects.emplace_back(WorkerFruitless{worker.id, job.plan.brief.job, why});
}

void Farm::State::on(const LeaseCameBack& event) {
  Worker* worker = workers.find(event.worker);
  LeaseRecord* lease = leases.find(event.returned.lease);
  if (worker == nullptr || lease == nullptr || lease->worker != worker) return;
  const bool recalled = lease->recalled.has_value();
  lease->comes_back = false;
  // A worker that answers a recall can take other units at once, and so can one whose result was not kept
  const bool gave_up = !recalled && !event.not_kept;
  if (gave_up && !worker->draining) worker->pause = Pause::returned;
  if (gave_up || event.returned.unknown_job) worker->briefs.doubt(lease->job->seq);
  if (gave_up && !worker->draining && (!event.returned.unknown_job || lease->with_brief))
    note_fruitless(*worker, *lease->job,
                   event.returned.unknown_job      ? kUnknownInSpiteOfBrief
                   : event.returned.reason.empty() ? "it does not say why"
                                                   : event.returned.reason);
  std::set<UnitCode> back;
  for (const UnitKey& unit : event.returned.unrendered) back.insert(unit_code(unit.round, unit.tile));
  workers.settle(*worker);
  work_appeared = true;  // other workers may now take the units of this worker
  Job& job = *lease->job;
  free_units(*lease, recalled ? FreedCause::recalled : FreedCause::returned, false,
             [&](UnitCode code) { return back.contains(code); });
  workers.settle(*worker);  // with fewer units it may want more
  cut_off_returned(job);
}

void Farm::State::on(const Tick&) {
  ticked = now;
  expire_leases();
  forgive_and_forget();
  shares.tidy();
  for (const auto& [seq, job] : jobs)
    if (!job->audits.empty()) settle_audits(*job);
  for (const auto& [seq, job] : jobs) {
    watch_time(*job);
    if (!job->leasable() || job->frozen) continue;
    // The units that are rendered before the time limit are chosen early, because leases granted later might
    // extend beyond the limit
    const auto limit = job->time_limit(now);
    if (!limit || seconds(*limit - now) > 2 * kTimePlanned) continue;
    plan_end(*job, *limit);
    finish_if_complete(*job);
    refresh(*job);
  }
  for (const auto& [index, worker] : workers.all()) end_long_leases(*worker);
  for (const auto& [seq, job] : jobs) doubt_pin(*job);
  work_appeared = true;
  for (const WorkerIndex index : workers.wanting_work()) {
    if (!workers.at(index).saturated()) dirty.insert(index);  // an idle worker may copy overdue units
  }
}

void Farm::State::expire_leases() {
  while (LeaseRecord* lease = leases.expired(now)) {
    Worker& worker = *lease->worker;
    worker.pause = now - worker.progress_at >= kNoGrowthLimit ? Pause::stuck : Pause::silent;
    workers.settle(worker);
    note_fruitless(worker, *lease->job, "they were not finished in time");
    // The worker is not told to stop: if it recovers and delivers results before other workers do, they are
    // accepted.
    Job& job = *lease->job;
    free_lease(lease->seq, FreedCause::deadline_passed, false);
    cut_off_returned(job);
  }
}

void Farm::State::forgive_and_forget() {
  std::vector<Worker*> gone;
  for (const auto& [index, worker] : workers.all()) {
    std::erase_if(worker->failures, [&](const auto& of_job) { return of_job.second.forgiven_at(now); });
    if (worker->pause == Pause::returned) {
      worker->pause = Pause::none;
      touch(*worker);
    }
    if (worker->unhealthy_since && now - *worker->unhealthy_since >= kForgiveAfter) {
      worker->unhealthy_since.reset();
      worker->failures.clear();
      effects.emplace_back(WorkerStateChanged{worker->id, worker->state(), "its failures are long ago"});
      touch(*worker);
    }
    if (!worker->connected && now - worker->lost_at >= kForgetWorkerAfter) gone.push_back(worker.get());
  }
  for (Worker* worker : gone) forget(*worker);
  if (workers.has_many_names()) forget_names();
  if (proven.size() > kProvenKept)
    std::erase_if(proven, [&](const Digest& one) { return workers.of_class(one).workers == 0; });
}

void Farm::State::forget_names() {
  std::vector<bool> used = workers.no_index();
  for (const auto& [seq, job] : jobs) {
    job->units.mark_workers(used);
    job->failures.mark_workers(used);
    job->voters.mark_workers(used);
    for (const auto& [numeric_class, passed] : job->passed_over)
      for (const WorkerIndex worker : passed.workers) used[worker] = true;
    for (const auto& [code, audit] : job->audits) {
      used[audit.first] = true;
      if (audit.second) used[audit.second->first] = true;
      if (audit.claim) used[audit.claim->first] = true;
      for (const WorkerIndex tried : audit.tried) used[tried] = true;
    }
  }
  workers.keep_names(std::move(used));
}

}  // namespace ls::coordinator
