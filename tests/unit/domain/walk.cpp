#include "tests/unit/domain/walk.h"

#include "common/base/overloaded.h"
#include "tests/unit/domain/stop_oracle.h"

namespace ls::coordinator {

std::string Walk::run(int events) {
  for (int i = 0; i < events && wrong_.empty(); ++i) step();
  calm_down();
  return wrong_;
}

void Walk::send(const Event& event) {
  for (const Effect& effect : farm_.handle(event, now_)) see(effect);
  if (std::string wrong = farm_.audit(); !wrong.empty()) blame("audit: " + wrong);
  check_figures();
}

void Walk::see(const Effect& effect) {
  std::visit(
      overloaded{[&](const Send& e) { see(e); },
                 [&](const RecordUnit& e) {
                   auto& accepted = jobs_[e.unit.job].accepted;
                   const bool once = accepted.try_emplace({e.unit.tile, e.unit.round}, e).second;
                   if (!once && accepted[{e.unit.tile, e.unit.round}].samples == e.samples) {
                     // Beyond a stop acceptances are forgotten and may be made again after an extension.
                     if (!jobs_[e.unit.job].disturbed && !jobs_[e.unit.job].reopened)
                       blame("a unit was accepted twice");
                   }
                   accepted[{e.unit.tile, e.unit.round}] = e;
                 },
                 [&](const Fold& e) { see_fold(e); },
                 [&](const ReopenRound& e) {
                   StoredJob& job = jobs_[e.job];
                   for (TileIndex t = 0; t < job.fold_asked.size(); ++t) {
                     job.fold_asked[t] = std::min(job.fold_asked[t], e.round);
                     job.folded[t] = std::min(job.folded[t], e.round);
                     job.accepted.erase({t, e.round});
                   }
                   job.done_seen = 0;
                 },
                 [&](const JobFinished& e) { see_end(e.job, e.stopped); },
                 [&](const DigestMismatch&) { blame("a mismatch without a liar"); }, [](const auto&) {}},
      effect);
}

void Walk::see(const Send& sent) {
  FakeWorker& worker = workers_[sent.worker.value];
  if (!worker.connected) blame("a message to a worker that is gone");
  std::visit(overloaded{[&](const AssignLease& m) {
                          if (m.lease.units.empty()) blame("an empty lease");
                          for (const LeaseUnit& u : m.lease.units)
                            worker.held.push_back({m.lease.job, m.lease.id, u});
                        },
                        [&](const CancelLease& m) {
                          std::erase_if(worker.held, [&](const auto& h) { return h.lease == m.lease; });
                        },
                        [&](const CancelJob& m) {
                          std::erase_if(worker.held, [&](const auto& h) { return h.job == m.job; });
                        },
                        [](const auto&) {}},
             sent.message);
}

void Walk::see_fold(const Fold& fold) {
  StoredJob& job = jobs_[fold.unit.job];
  RoundIndex& asked = job.fold_asked[fold.unit.tile];
  const auto it = job.accepted.find({fold.unit.tile, fold.unit.round});
  if (it == job.accepted.end() || it->second.samples != fold.samples) blame("a fold of what is not accepted");
  if (fold.unit.round != asked) blame("a fold out of order");
  ++asked;
  unfolded_.push_back({fold.unit, fold.samples, error_sum(job, fold.unit.tile, fold.unit.round)});
}

// The variance per sample is 2^-3 to 2^3, a tile's own, and every round scatters.
double Walk::error_sum(const StoredJob& job, TileIndex tile, RoundIndex round) {
  std::mt19937_64 of_tile(job.errors + tile), of_round(job.errors + 1000003 * round + tile);
  const double variance = std::exp2(static_cast<double>(of_tile() % 7) - 3);
  const double scatter = .75 + static_cast<double>(of_round() % 512) / 1024;
  return scatter * variance / static_cast<double>(round_range(round).s1) * 3 *
         static_cast<double>(job.plan.grid.rect(tile).pixels());
}

void Walk::see_end(const JobId& id, StopReason reason) {
  const StoredJob& job = jobs_[id];
  if (job.folded != job.fold_asked) blame("a job finished before all was folded");
  if (job.disturbed || reason == StopReason::time || reason == StopReason::user) return;
  // Where it must end, from its numbers alone.
  const std::uint64_t spp = farm_.job(id)->spp;
  const auto target = farm_.plan(id)->target_error;
  std::vector<RoundIndex> ends(job.folded.size(), round_count(spp));
  if (target) {
    const auto error = [&](TileIndex t, RoundIndex k) { return error_sum(job, t, k); };
    ends = stop_at_once(job.plan.grid, spp, *target, error).ends;
  }
  for (TileIndex t = 0; t < ends.size(); ++t) {
    if (job.folded[t] != ends[t])
      blame("tile " + std::to_string(t) + " of job " + id.value + " ended after " +
            std::to_string(job.folded[t]) + " rounds instead of " + std::to_string(ends[t]) + " (" +
            std::string(to_string(reason)) + ", spp " + std::to_string(spp) + (target ? ", target" : "") +
            (job.plan.time ? ", time" : "") + ")");
  }
}

void Walk::check_figures() {
  for (auto& [id, job] : jobs_) {
    const auto figures = farm_.job(id);
    if (!figures) return blame("a job is gone");
    if (figures->state == JobState::failed || figures->state == JobState::cancelled) continue;
    if (figures->units_done < job.done_seen && !job.disturbed && !job.plan.target_error)
      blame("done regressed");
    job.done_seen = figures->units_done;
    if (figures->units_total != figures->units_done + figures->units_leased + figures->units_queued) {
      blame("planned is not done + leased + queued");
    }
  }
}

void Walk::step() {
  now_ += std::chrono::milliseconds(pick(chance(3) ? 60000 : 300));
  const std::uint64_t what = pick(100);
  if (what < 8) return user_acts();
  if (what < 20) return send(Tick{});
  if (what < 21) return restart();
  if (what < 45 && !unfolded_.empty()) {
    const UnitFolded folded = unfolded_.front();
    unfolded_.pop_front();
    StoredJob& job = jobs_[folded.unit.job];
    if (folded.unit.round == job.folded[folded.unit.tile] &&
        folded.unit.round < job.fold_asked[folded.unit.tile] &&
        job.accepted.at({folded.unit.tile, folded.unit.round}).samples == folded.samples) {
      ++job.folded[folded.unit.tile];
    }
    return send(folded);
  }
  if (what < 70 && !on_the_way_.empty()) {
    const auto it =
        on_the_way_.begin() + static_cast<long>(pick(std::min<std::uint64_t>(3, on_the_way_.size())));
    const UnitAccepted result = *it;
    if (!chance(10)) on_the_way_.erase(it);
    return send(result);
  }
  worker_acts();
}

void Walk::user_acts() {
  if (jobs_.size() < 4 && chance(40)) return submit();
  const JobId id = some_job();
  if (id.empty()) return;
  if (const JobState state = farm_.job(id)->state;
      state != JobState::queued && state != JobState::running && state != JobState::paused && chance(30)) {
    jobs_.erase(id);
    std::erase_if(unfolded_, [&](const UnitFolded& f) { return f.unit.job == id; });
    return send(JobForgotten{id});
  }
  if (const auto plan = farm_.plan(id); plan->target_error && chance(15)) {
    jobs_[id].reopened = true;
    return send(JobRetargeted{id, *plan->target_error * (.5 + static_cast<double>(pick(50)) / 100)});
  }
  switch (pick(12)) {
    case 0:
      return send(JobCancelled{id});
    case 1:
      jobs_[id].disturbed = true;
      return send(JobStopped{id});
    case 2:
    case 3:
      jobs_[id].disturbed = true;
      return send(JobExtended{id, 2 + pick(300)});
    case 4:
    case 5:
      return send(JobPaused{id});
    case 6:
      return send(JobPriority{id, static_cast<int>(pick(5)) - 2});
    default:
      return send(JobResumed{id});
  }
}

void Walk::submit() {
  const JobId id{"j" + std::to_string(submitted_++)};
  StoredJob job{plan_of(id.value, 1 + static_cast<int>(pick(6)), 1 + pick(chance(20) ? 300 : 40))};
  job.errors = pick(1 << 20);
  if (chance(30)) {
    job.plan.target_error = 1 / (70.5 + static_cast<double>(pick(500)));
    job.plan.spp = chance(70) ? 6000 : 1500;
    if (chance(50)) job.plan.grid = {{static_cast<int>(job.plan.grid.count()) * 32, 32}, 32};
  }
  if (chance(10)) job.plan.time = 1 + static_cast<double>(pick(20));
  if (chance(10)) job.plan.tags = {"even"};
  job.plan.priority = static_cast<int>(pick(3));
  job.fold_asked.resize(job.plan.grid.count());
  job.folded.resize(job.plan.grid.count());
  jobs_[id] = job;
  send(JobSubmitted{job.plan});
}

void Walk::join(const std::string& name) {
  FakeWorker& worker = workers_[name];
  worker.connected = true;
  worker.threads = 1 + static_cast<int>(pick(4));
  worker.numeric_class = name == "w4" ? 2 : 1;
  std::vector<std::string> tags;
  if ((name.back() - '0') % 2 == 0) tags = {"even"};
  send(WorkerJoined{{name}, ++worker.epoch, name, digest_number(worker.numeric_class), worker.threads, tags});
}

void Walk::worker_acts() {
  const std::string name = worker_name();
  FakeWorker& worker = workers_[name];
  const std::uint64_t what = pick(100);
  if (!worker.connected || what < 2) return join(name);
  if (what < 5) {  // the agent dies, or only the stream breaks and it finishes what it holds
    if (chance(50)) worker.held.clear();
    worker.connected = false;
    return send(WorkerLost{{name}, worker.epoch});
  }
  if (what < 8) worker.stalled = !worker.stalled;
  if (what < 10) worker.crashes = chance(20);
  if (what < 12) {
    send(WorkerDrains{{name}});
    std::map<LeaseId, std::vector<UnitKey>> back;
    for (const auto& h : worker.held) back[h.lease].push_back(h.key());
    worker.held.clear();
    for (const auto& [lease, units] : back) send(LeaseCameBack{{name}, {lease, units}});
    return;
  }
  if (what < 25) {
    LeaseProgress progress{{name}, {}};
    for (const auto& h : worker.held)
      progress.leases.push_back({h.lease, static_cast<std::uint32_t>(pick(3))});
    return send(progress);
  }
  if (!worker.stalled) render(name);
}

void Walk::render(const std::string& name) {
  FakeWorker& worker = workers_[name];
  if (worker.held.empty()) return;
  const auto it =
      worker.held.begin() + static_cast<long>(pick(std::min<std::uint64_t>(worker.held.size(), 2)));
  const Rig::Held unit = *it;
  worker.held.erase(it);
  if (worker.crashes && chance(50))
    return send(UnitFailed{{name}, {unit.key(), unit.lease, false, "crashed", 11, {}, {}}});
  on_the_way_.push_back({unit.key(),
                         unit.unit.samples,
                         honest(unit.key(), unit.unit.samples),
                         {name},
                         0.001 * static_cast<double>(1 + pick(500))});
}

// kill -9: what was stored is all that is left. Streams break; workers keep what they hold.
void Walk::restart() {
  Farm fresh{Farm::Options{"r" + std::to_string(++restarts_)}};
  unfolded_.clear();
  std::vector<Event> restored;
  for (auto& [id, job] : jobs_) {
    const JobFigures f = farm_.job(id).value();
    job.plan = farm_.plan(id).value();
    JobRestored event{job.plan, f.state,    f.stopped, f.numeric_class,
                      {},       job.folded, {},        f.first_ray ? 0.5 : 0.0};
    for (const auto& [key, r] : job.accepted)
      event.accepted.push_back({key.first, key.second, r.samples, r.digest, r.worker});
    for (TileIndex t = 0; t < job.folded.size(); ++t) {
      for (RoundIndex k = 0; k < job.folded[t]; ++k) {
        if (event.rel_error.size() <= k)
          event.rel_error.resize(k + 1, std::vector<double>(job.folded.size()));
        event.rel_error[k][t] = error_sum(job, t, k);
      }
    }
    job.fold_asked = job.folded;
    job.done_seen = 0;
    restored.push_back(std::move(event));
  }
  farm_ = std::move(fresh);
  for (auto& [name, worker] : workers_) worker.connected = false;
  for (const Event& event : restored) {
    for (const Effect& effect : farm_.handle(event, now_)) see(effect);
  }
  send(Tick{});
}

bool Walk::all_ended() const {
  for (const auto& [id, job] : jobs_) {
    const JobState state = farm_.job(id)->state;
    if (state == JobState::queued || state == JobState::running || state == JobState::paused) return false;
  }
  return true;
}

void Walk::calm_down() {
  for (auto& [name, worker] : workers_) worker.crashes = worker.stalled = false;
  for (const auto& [id, job] : jobs_) send(JobResumed{id});
  now_ += kForgiveAfter;
  for (int i = 0; i < 5; ++i) join("w" + std::to_string(i));
  for (int turn = 0; turn < 20000 && wrong_.empty(); ++turn) {
    if (all_ended()) return;
    now_ += 20ms;
    for (auto& [name, worker] : workers_) render(name);
    while (!on_the_way_.empty() && wrong_.empty()) {
      const UnitAccepted result = on_the_way_.front();
      on_the_way_.pop_front();
      send(result);
    }
    while (!unfolded_.empty() && wrong_.empty()) {
      const UnitFolded folded = unfolded_.front();
      unfolded_.pop_front();
      StoredJob& job = jobs_[folded.unit.job];
      if (folded.unit.round == job.folded[folded.unit.tile]) ++job.folded[folded.unit.tile];
      send(folded);
    }
    if (turn % 50 == 0) send(Tick{});
  }
  for (const auto& [id, job] : jobs_) {
    const JobFigures f = farm_.job(id).value();
    if (f.state != JobState::queued && f.state != JobState::running && f.state != JobState::paused) continue;
    blame("job " + id.value + " does not end in fair weather: " + std::string(to_string(f.state)) +
          ", done " + std::to_string(f.units_done) + ", leased " + std::to_string(f.units_leased) +
          ", queued " + std::to_string(f.units_queued) + ", folded " + std::to_string(f.units_folded) + "; " +
          farm_.why_waiting(id));
  }
}

}  // namespace ls::coordinator
