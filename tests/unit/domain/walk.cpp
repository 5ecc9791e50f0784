#include "tests/unit/domain/walk.h"

#include <algorithm>
#include <array>

namespace ls::coordinator {

// Half of the histories have limits, a third have audits, and half of the latter have a faulty worker.
Walk::Walk(std::uint64_t seed) : random_(seed), farm_(Farm::Options{"r0"}) {
  const auto some = [&](int most) {
    return chance(50) ? 0 : 1 + static_cast<std::uint32_t>(pick(static_cast<std::uint64_t>(most)));
  };
  if (chance(50)) limits_ = {some(4), some(12), some(4), some(16)};
  if (chance(33)) audit_rate_ = chance(50) ? 1 : .2;
  if (audit_rate_ > 0 && chance(50)) faulty_ = "w" + std::to_string(1 + pick(3));
  farm_ = Farm(options());
}

Farm::Options Walk::options() const {
  return {.lease_prefix = "r" + std::to_string(restarts_),
          .limits = limits_,
          .audit_rate = audit_rate_,
          .audit_seed = static_cast<std::uint64_t>(restarts_)};
}

Digest Walk::pixels(const std::string& worker, const UnitKey& unit, const SampleRange& range) {
  return worker == faulty_ && chance(70) ? digest_number(1 + pick(1000)) : honest(unit, range);
}

std::string Walk::run(int events) {
  for (int i = 0; i < events && wrong_.empty(); ++i) step();
  calm_down();
  return wrong_;
}

std::string Walk::run_into_foul_weather(int events) {
  unlimited_ = true;
  limits_ = {};
  farm_ = Farm(options());
  for (int i = 0; i < events && wrong_.empty(); ++i) step();
  std::vector<std::pair<std::string, Habit>> habits;
  for (int i = 0; i < 5; ++i) {
    const std::string name = "w" + std::to_string(i);
    workers_[name].crashes = workers_[name].stalled = workers_[name].gives_back = false;
    habits.emplace_back(name, static_cast<Habit>(pick(5)));
    if (!workers_[name].connected) join(name);
  }
  for (const auto& [id, job] : jobs_) send(JobResumed{id}), send(JobHeld{id, false});
  // Long enough for workers to be found stuck, and for audits without a third worker to be given up
  constexpr Duration kStep = 5s, kLong = 4 * kNoGrowthLimit, kWatched = 20 * kStep;
  for (Duration passed{}; passed < kLong && wrong_.empty(); passed += kStep) {
    now_ += kStep;
    for (auto& [name, habit] : habits) keep_to(habit, name);
    settle_results();
    send(Tick{});
    if (passed < kLong - kWatched) continue;
    // A job that waits for its turn behind one that says why it stands still need not say so.
    if (std::any_of(jobs_.begin(), jobs_.end(),
                    [&](const auto& job) { return !farm_.why_waiting(job.first).empty(); }))
      continue;
    for (const auto& [id, job] : jobs_) {
      const JobState state = farm_.job(id)->state;
      const bool waits = state == JobState::queued || state == JobState::running;
      if (!waits) continue;
      const JobFigures f = farm_.job(id).value();
      std::string workers;
      for (const auto& [name, habit] : habits)
        workers += "; " + name + " " + std::to_string(static_cast<int>(habit)) + " holds " +
                   std::to_string(workers_[name].held.size());
      blame("job " + id.value + " neither ends nor says why it waits: done " + std::to_string(f.units_done) +
            ", leased " + std::to_string(f.units_leased) + ", queued " + std::to_string(f.units_queued) +
            ", folded " + std::to_string(f.units_folded) + ", audits " +
            std::to_string(farm_.open_audits(id).size()) + ", after " + std::to_string(seconds(passed)) +
            " s" + workers);
    }
  }
  return wrong_;
}

void Walk::keep_to(Habit habit, std::string& name) {
  switch (habit) {
    case Habit::renders:
      for (int i = 0; i < 200 && !workers_[name].held.empty(); ++i) render(name);
      return;
    case Habit::gives_back:
      return give_back(name);
    case Habit::only_reports: {
      LeaseProgress progress{{name}, {}};
      for (const auto& h : workers_[name].held) progress.leases.push_back({h.lease, 0});
      return send(progress);
    }
    case Habit::silent:
      return;
    case Habit::vanishes:
      send(WorkerLost{{name}, workers_[name].epoch});
      workers_.erase(name);
      name = "r" + std::to_string(++replaced_) + name.substr(name.size() - 2);
      return join(name);
  }
}

void Walk::give_back(const std::string& name) {
  std::map<LeaseId, std::vector<UnitKey>> back;
  for (const auto& h : workers_[name].held) back[h.lease].push_back(h.key());
  workers_[name].held.clear();
  for (const auto& [lease, units] : back) send(LeaseCameBack{{name}, {lease, units, "its disk is full"}});
}

void Walk::settle_results() {
  while (!on_the_way_.empty() && wrong_.empty()) {
    const UnitAccepted result = on_the_way_.front();
    on_the_way_.pop_front();
    send(result);
  }
  while (!unfolded_.empty() && wrong_.empty()) {
    const UnitFolded folded = unfolded_.front();
    unfolded_.pop_front();
    fold(folded);
  }
}

void Walk::send(const Event& event) {
  for (const Effect& effect : farm_.handle(event, now_)) see(effect);
  if (std::string wrong = audit(farm_); !wrong.empty()) blame("audit: " + wrong);
  check_figures();
}

void Walk::step() {
  now_ += std::chrono::milliseconds(pick(chance(3) ? 60000 : 300));
  const std::uint64_t what = pick(100);
  if (what < 8) return user_acts();
  if (what < 20) return send(Tick{});
  if (what < 21) return restart();
  if (what < 30 && !recalled_.empty()) return answer_recall();
  if (what < 45 && !unfolded_.empty()) {
    const UnitFolded folded = unfolded_.front();
    unfolded_.pop_front();
    return fold(folded);
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

void Walk::fold(const UnitFolded& folded) {
  StoredJob& job = jobs_[folded.unit.job];
  const TileIndex tile = folded.unit.tile;
  if (folded.unit.round == job.folded[tile] && folded.unit.round < job.fold_asked[tile]) {
    const RecordUnit& result = job.accepted.at({tile, folded.unit.round});
    if (result.samples == folded.samples) {
      ++job.folded[tile];
      job.film[tile].push_back(result.digest);
    }
  }
  send(folded);
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
    case 7: {
      const FrameSize frame = jobs_[id].plan.grid.frame;
      const int x0 = static_cast<int>(pick(static_cast<std::uint64_t>(frame.width)));
      const PixelRect half{x0, 0, frame.width, frame.height};
      return send(JobFocused{id, chance(30) ? std::nullopt : std::optional(half)});
    }
    case 8:
      return send(JobHeld{id, chance(50)});
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
  if (chance(20)) job.plan.time = 1 + static_cast<double>(pick(20));
  // Only the time, or the target error, ends it
  if (job.plan.time && chance(50)) job.plan.spp.reset();
  if (chance(10)) job.plan.tags = {"even"};
  job.plan.priority = static_cast<int>(pick(3));
  job.plan.owner = std::array{"", "ann", "bob"}[pick(3)];
  if (chance(20) && !unlimited_) job.plan.max_workers = 1 + static_cast<std::uint32_t>(pick(3));
  if (chance(20) && !unlimited_) job.plan.max_units = 1 + static_cast<std::uint32_t>(pick(6));
  if (chance(30)) {  // frames have the owner and the limits of their sequence
    job.plan.group = "film";
    job.plan.owner = "ann";
    if (!unlimited_) job.plan.max_workers = 2;
    if (!unlimited_) job.plan.max_units = 5;
  }
  if (chance(20)) job.plan.memory_bytes = 8;
  job.film.resize(job.plan.grid.count());
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
  // w0 and w4 do not report their memory; w1 has too little for some jobs.
  const std::uint64_t memory =
      std::array<std::uint64_t, 5>{0, 4, 16, 16, 0}[static_cast<std::size_t>(name.back() - '0')];
  send(WorkerJoined{
      {name}, ++worker.epoch, name, digest_number(worker.numeric_class), worker.threads, tags, memory, {}});
}

void Walk::worker_acts() {
  const std::string name = worker_name();
  FakeWorker& worker = workers_[name];
  const std::uint64_t what = pick(100);
  if (!worker.connected || what < 2) return join(name);
  // The agent dies and loses its units, or only the stream breaks, and the worker finishes its units
  if (what < 5) {
    if (chance(50)) worker.held.clear();
    worker.connected = false;
    return send(WorkerLost{{name}, worker.epoch});
  }
  if (what < 8) worker.stalled = !worker.stalled;
  if (what < 10) worker.crashes = chance(20);
  if (what < 12) {
    send(WorkerDrains{{name}, false, what == 11});
    return give_back(name);
  }
  if (what < 13) worker.gives_back = !worker.gives_back;
  if (what < 25) {
    LeaseProgress progress{{name}, {}};
    for (const auto& h : worker.held)
      progress.leases.push_back({h.lease, static_cast<std::uint32_t>(pick(3))});
    return send(progress);
  }
  if (worker.gives_back) return give_back(name);
  if (!worker.stalled) render(name);
}

void Walk::answer_recall() {
  const auto [id, lease] = recalled_.front();
  recalled_.pop_front();
  FakeWorker& worker = workers_[id.value];
  if (!worker.connected || worker.stalled) return;
  LeaseReturned back{lease, {}};
  std::erase_if(worker.held, [&](const auto& h) {
    if (h.lease == lease) back.unrendered.push_back(h.key());
    return h.lease == lease;
  });
  if (!back.unrendered.empty()) send(LeaseCameBack{id, back});
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
                         pixels(name, unit.key(), unit.unit.samples),
                         {name},
                         0.001 * static_cast<double>(1 + pick(500)),
                         0.001 * static_cast<double>(pick(5000))});
}

// Kills the coordinator: only stored data is left, and the streams break. Workers keep their units.
void Walk::restart() {
  ++restarts_;
  Farm fresh{options()};
  unfolded_.clear();
  recalled_.clear();
  std::vector<Event> restored;
  for (auto& [id, job] : jobs_) {
    const JobFigures f = farm_.job(id).value();
    job.plan = farm_.plan(id).value();
    if (f.state == JobState::done) ended_before_.insert(id);
    // At the end of its time, a job with a target error folds results beyond the level of its target. After a
    // restart the target may end the job with more rounds than the target needs.
    if (job.plan.time && job.plan.target_error && f.state != JobState::done) job.disturbed = true;
    JobRestored event{job.plan, f.state,    f.stopped, f.numeric_class,
                      {},       job.folded, {},        f.clock.started() ? 0.5 : 0.0};
    for (const auto& [key, r] : job.accepted)
      event.accepted.push_back({key.first, key.second, r.samples, r.digest, r.worker});
    for (TileIndex t = 0; t < job.folded.size(); ++t) {
      for (RoundIndex k = 0; k < job.folded[t]; ++k) {
        if (event.rel_error.size() <= k)
          event.rel_error.resize(k + 1, std::vector<double>(job.folded.size()));
        event.rel_error[k][t] = error_sum(job, t, k);
      }
    }
    event.audits = farm_.open_audits(id);
    job.fold_asked = job.folded;
    job.done_seen = 0;
    restored.push_back(std::move(event));
  }
  farm_ = std::move(fresh);
  for (auto& [name, worker] : workers_) worker.connected = false;
  if (found_) farm_.handle(WorkerQuarantined{{faulty_}, "it rendered wrong pixels"}, now_);
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
  for (auto& [name, worker] : workers_) worker.crashes = worker.stalled = worker.gives_back = false;
  for (const auto& [id, job] : jobs_) send(JobResumed{id}), send(JobHeld{id, false});
  now_ += kForgiveAfter;
  for (int i = 0; i < 5; ++i) join("w" + std::to_string(i));
  for (int turn = 0; turn < 20000 && wrong_.empty(); ++turn) {
    if (all_ended()) return;
    now_ += 20ms;
    for (auto& [name, worker] : workers_) render(name);
    while (!recalled_.empty() && wrong_.empty()) answer_recall();
    while (!on_the_way_.empty() && wrong_.empty()) {
      const UnitAccepted result = on_the_way_.front();
      on_the_way_.pop_front();
      send(result);
    }
    while (!unfolded_.empty() && wrong_.empty()) {
      const UnitFolded folded = unfolded_.front();
      unfolded_.pop_front();
      fold(folded);
    }
    settle_results();
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
