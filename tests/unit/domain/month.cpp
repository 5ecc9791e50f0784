#include "tests/unit/domain/month.h"

#include <cmath>

#include "core/base/overloaded.h"

namespace ls::coordinator {
namespace {

constexpr int kLives = 0, kDies = 1;
constexpr std::size_t kWorkers = 12;
constexpr Duration kTick = 30s, kSubmitEvery = 180s, kUserEvery = 300s, kWorkerLives = 1h,
                   kWorkerMissing = 60s, kCoordinatorLives = 5h, kJobKept = 30min;
constexpr double kLiars = .004, kCrashes = .003, kAudits = .05;

}  // namespace

Month::Month(std::uint64_t seed) : random_(seed), farms_{fresh(kLives), fresh(kDies)} {
  for (std::size_t i = 0; i < kWorkers; ++i) later(0s, What::arrive);
  later(kTick, What::tick);
  later(0s, What::submit);
  later(kUserEvery, What::user);
  later(kCoordinatorLives, What::coordinator_dies);
}

Farm Month::fresh(int home) {
  ++starts_;
  return Farm({.lease_prefix = "r" + std::to_string(starts_),
               .limits = {},
               .audit_rate = kAudits,
               .audit_seed = static_cast<std::uint64_t>(starts_ * 2 + home)});
}

Duration Month::about(Duration mean) {
  const double u = static_cast<double>((random_() >> 11) + 1) * 0x1p-53;
  return from_seconds(-std::log(u) * seconds(mean));
}

void Month::later(Duration in, What what, std::string who, Rig::Held unit) {
  due_.push({now_ + in, ++order_, what, std::move(who), std::move(unit)});
}

void Month::blame(std::string what) {
  if (wrong_.empty())
    wrong_ = std::to_string(seconds(now_.time_since_epoch()) / 3600) + " h: " + std::move(what);
}

std::string Month::hour() {
  const TimePoint end = now_ + 1h;
  while (wrong_.empty() && due_.top().at < end) {
    const Due next = due_.top();
    due_.pop();
    now_ = next.at;
    happen(next);
  }
  now_ = end;
  return wrong_;
}

void Month::happen(const Due& due) {
  switch (due.what) {
    case What::submit:
      later(about(kSubmitEvery), What::submit);
      return submit();
    case What::user:
      later(about(kUserEvery), What::user);
      return user_acts();
    case What::tick:
      later(kTick, What::tick);
      for (const int home : {kLives, kDies})
        if (up_[static_cast<std::size_t>(home)]) send(home, Tick{});
      return;
    case What::arrive:
      return arrive();
    case What::leave:
      return leave(due.who);
    case What::rendered:
      return rendered(due.who, due.unit);
    case What::coordinator_dies:
      return coordinator_dies();
    case What::coordinator_back:
      return come_back(kDies, false);
    case What::forget:
      if (const auto job = jobs_.find({due.who}); job != jobs_.end() && job->second.ended) {
        if (up_[static_cast<std::size_t>(job->second.home)]) send(job->second.home, JobForgotten{job->first});
        jobs_.erase(job);
      }
  }
}

// Sends the event to the farm, and carries out all folds that result from it.
void Month::send(int home, const Event& event) {
  Farm& farm = farms_[static_cast<std::size_t>(home)];
  const auto handle = [&](const Event& one) {
    ++counts_.events;
    for (const Effect& effect : farm.handle(one, now_)) see(home, effect);
    if (std::string wrong = audit(farm); !wrong.empty()) blame("audit: " + wrong);
  };
  handle(event);
  while (!to_fold_.empty() && wrong_.empty()) {
    const auto [where, folded] = to_fold_.front();
    to_fold_.pop_front();
    handle(folded);
  }
  for (const JobId& id : farm.take_changed_audits())
    if (const auto job = jobs_.find(id); job != jobs_.end()) job->second.audits = farm.open_audits(id);
  std::vector<std::string> names;
  for (const auto& [name, worker] : workers_)
    if (worker.connected && worker.home == home) names.push_back(name);
  for (const std::string& name : names) begin_units(name);
}

void Month::see(int home, const Effect& effect) {
  const auto at = static_cast<std::size_t>(home);
  std::visit(overloaded{[&](const Send& e) { see(e); },
                        [&](const RecordUnit& e) {
                          StoredJob& job = jobs_.at(e.unit.job);
                          if (!job.accepted.emplace(std::pair(e.unit.tile, e.unit.round), e).second)
                            blame("a unit is accepted twice");
                          if (quarantined_[at].contains(e.worker.value))
                            blame("a result of a quarantined worker is accepted");
                          ++counts_.units;
                        },
                        [&](const Fold& e) { see_fold(home, e); },
                        [&](const UnitsFreed& e) { counts_.again += e.audit ? 0 : e.units.size(); },
                        [&](const DropDuplicate&) { ++counts_.audits; },
                        [&](const JobStateChanged& e) {
                          if (e.to == JobState::failed || e.to == JobState::cancelled) see_end(e.job);
                        },
                        [&](const JobFinished& e) { see_end(e.job); },
                        [&](const WorkerFoundFaulty& e) {
                          if (!liars_.contains(e.worker.value))
                            blame("an honest worker is quarantined: " + e.evidence);
                          ++counts_.quarantined;
                          quarantined_[at].insert(e.worker.value);
                        },
                        [&](const TileDiscarded& e) {
                          StoredJob& job = jobs_.at(e.job);
                          job.asked[e.tile] = job.folded[e.tile] = 0;
                          job.film[e.tile].clear();
                          std::erase_if(job.accepted, [&](const auto& a) { return a.first.first == e.tile; });
                        },
                        [](const auto&) {}},
             effect);
}

void Month::see(const Send& sent) {
  const auto found = workers_.find(sent.worker.value);
  if (found == workers_.end() || !found->second.connected) return blame("a message to a worker that is gone");
  auto& held = found->second.held;
  std::visit(overloaded{[&](const AssignLease& m) {
                          for (const LeaseUnit& u : m.lease.units)
                            held.push_back({m.lease.job, m.lease.id, u});
                        },
                        [&](const CancelLease& m) {
                          std::erase_if(held, [&](const auto& h) { return h.lease == m.lease; });
                        },
                        [&](const CancelJob& m) {
                          std::erase_if(held, [&](const auto& h) { return h.job == m.job; });
                        },
                        [](const auto&) {}},
             sent.message);
}

void Month::see_fold(int home, const Fold& fold) {
  StoredJob& job = jobs_.at(fold.unit.job);
  const auto result = job.accepted.find({fold.unit.tile, fold.unit.round});
  if (result == job.accepted.end()) return blame("a fold of what is not accepted");
  if (fold.unit.round != job.asked[fold.unit.tile]++) return blame("a fold out of order");
  ++job.folded[fold.unit.tile];
  job.film[fold.unit.tile].push_back(result->second.digest);
  to_fold_.emplace_back(home, UnitFolded{fold.unit, fold.samples, 1});
}

// Checks that the job's film is the one that honest workers would have made, except for results of faulty
// workers that are not found out yet.
void Month::see_end(const JobId& id) {
  StoredJob& job = jobs_.at(id);
  const JobState state = farms_[static_cast<std::size_t>(job.home)].job(id)->state;
  if (job.ended) return;
  job.ended = now_;
  ++counts_.ended;
  later(about(kJobKept), What::forget, id.value);
  if (state != JobState::done) return;
  for (TileIndex t = 0; t < job.film.size(); ++t) {
    if (!job.stopped && job.film[t].size() != round_count(*job.plan.spp))
      return blame("a done job lacks rounds");
    for (RoundIndex k = 0; k < job.film[t].size(); ++k) {
      const RecordUnit& by = job.accepted.at({t, k});
      if (quarantined_[static_cast<std::size_t>(job.home)].contains(by.worker.value))
        return blame("something of a quarantined worker's is in an image");
      if (job.film[t][k] != honest({id, t, k}, cut_range(k, *job.plan.spp)) &&
          !liars_.contains(by.worker.value))
        return blame("a wrong image");
    }
  }
}

void Month::submit() {
  const JobId id{"j" + std::to_string(jobs_made_++)};
  // Drawn separately, since the order in which arguments are evaluated is unspecified
  const int tiles = 1 + static_cast<int>(pick(6));
  const std::uint64_t most = chance(.1) ? 60 : 12;
  StoredJob job{plan_of(id.value, tiles, 2 + 2 * pick(most))};
  job.plan.owner = std::array{"", "ann", "bob", "cat"}[pick(4)];
  job.plan.priority = static_cast<int>(pick(3));
  if (chance(.2)) job.plan.max_workers = 1 + static_cast<std::uint32_t>(pick(4));
  if (chance(.2)) {  // frames of a sequence have one owner and the same limits
    job.plan.group = "film" + std::to_string(jobs_made_ / 8);
    job.plan.owner = "ann";
    job.plan.max_workers = 3;
  }
  if (chance(.05)) job.plan.time = 60 + static_cast<double>(pick(600)), job.stopped = true;
  job.home = up_[kDies] && chance(.5) ? kDies : kLives;
  job.asked.resize(job.plan.grid.count());
  job.folded = job.asked;
  job.film.resize(job.plan.grid.count());
  const int home = job.home;
  const JobPlan plan = job.plan;
  jobs_.emplace(id, std::move(job));
  ++counts_.submitted;
  send(home, JobSubmitted{plan});
}

void Month::user_acts() {
  if (jobs_.empty()) return;
  ++counts_.user_acts;
  auto& [id, job] = *std::next(jobs_.begin(), static_cast<long>(pick(jobs_.size())));
  if (!up_[static_cast<std::size_t>(job.home)]) return;
  const int home = job.home;
  switch (pick(8)) {
    case 0:
      return send(home, JobCancelled{JobId(id)});
    case 1:
      job.stopped = true;
      return send(home, JobStopped{JobId(id)});
    case 2:
      return send(home, JobPaused{JobId(id)});
    case 3:
      return send(home, JobPriority{JobId(id), static_cast<int>(pick(5))});
    default:  // resumes a paused job
      for (const JobId& other : jobs_of(farms_[static_cast<std::size_t>(home)]))
        send(home, JobResumed{other});
  }
}

void Month::arrive() {
  const std::string name = "w" + std::to_string(counts_.workers++);
  Worker& worker = workers_[name];
  worker.threads = 1 + static_cast<int>(pick(4));
  worker.faulty = chance(kLiars);
  if (worker.faulty) liars_.insert(name);
  later(about(kWorkerLives), What::leave, name);
  join(name, up_[kDies] && chance(.5) ? kDies : kLives);
}

void Month::join(const std::string& name, int home) {
  Worker& worker = workers_.at(name);
  worker.home = home;
  worker.connected = true;
  send(home, WorkerJoined{{name}, ++worker.epoch, name, digest_number(1), worker.threads, {}, 0, {}});
}

// A preempted worker takes its units along. A worker with another name replaces it.
void Month::leave(const std::string& name) {
  const Worker worker = workers_.at(name);
  workers_.erase(name);
  later(about(kWorkerMissing), What::arrive);
  if (worker.connected && up_[static_cast<std::size_t>(worker.home)])
    send(worker.home, WorkerLost{{name}, worker.epoch});
}

void Month::begin_units(const std::string& name) {
  Worker& worker = workers_.at(name);
  while (worker.busy < worker.threads && !worker.held.empty()) {
    ++worker.busy;
    later(from_seconds(20 + static_cast<double>(pick(60))), What::rendered, name, worker.held.front());
    worker.held.pop_front();
  }
}

void Month::rendered(const std::string& name, const Rig::Held& unit) {
  const auto found = workers_.find(name);
  if (found == workers_.end()) return;  // the worker was preempted meanwhile
  Worker& worker = found->second;
  --worker.busy;
  if (!worker.connected || !jobs_.contains(unit.job)) return;
  if (chance(kCrashes)) {
    ++counts_.failures;
    return send(worker.home, UnitFailed{{name}, {unit.key(), unit.lease, false, "crashed", 11, {}, {}}});
  }
  const bool lies = worker.faulty && chance(.5);
  const Digest digest = lies ? digest_number(1 + pick(1000)) : honest(unit.key(), unit.unit.samples);
  // The worker may still be connected to the coordinator that had the job before.
  send(worker.home, UnitAccepted{unit.key(), unit.unit.samples, digest, {name}, 40});
}

// In half of the cases the coordinator starts again immediately with the data that it had stored. Otherwise
// the other coordinator takes over its jobs, without results.
void Month::coordinator_dies() {
  later(kCoordinatorLives, What::coordinator_dies);
  if (!up_[kDies]) return;
  std::vector<std::string> cut_off;
  for (auto& [name, worker] : workers_)
    if (worker.connected && worker.home == kDies) {
      worker.connected = false;
      worker.held.clear();
      cut_off.push_back(name);
    }
  farms_[kDies] = fresh(kDies);
  if (chance(.5)) {
    ++counts_.restarts;
    come_back(kDies, true);
  } else {
    up_[kDies] = false;
    std::vector<JobId> orphans;
    for (auto& [id, job] : jobs_)
      if (job.home == kDies && !job.ended) orphans.push_back(id);
    std::erase_if(jobs_, [&](const auto& j) { return j.second.home == kDies && j.second.ended; });
    counts_.takeovers += orphans.size();
    if (!orphans.empty())  // the jobs' records name the quarantined workers
      for (const std::string& faulty : quarantined_[kDies])
        if (quarantined_[kLives].insert(faulty).second) send(kLives, WorkerQuarantined{{faulty}, "lied"});
    for (const JobId& id : orphans) give(kLives, id, false);
    later(60s, What::coordinator_back);
  }
  for (const std::string& name : cut_off)
    if (workers_.contains(name)) join(name, up_[kDies] ? kDies : kLives);
}

void Month::come_back(int home, bool with_results) {
  up_[static_cast<std::size_t>(home)] = true;
  for (const std::string& faulty : quarantined_[static_cast<std::size_t>(home)])
    farms_[static_cast<std::size_t>(home)].handle(WorkerQuarantined{{faulty}, "lied"}, now_);
  std::vector<JobId> own;
  for (const auto& [id, job] : jobs_)
    if (job.home == home && !job.ended) own.push_back(id);
  std::erase_if(jobs_, [&](const auto& j) { return j.second.home == home && j.second.ended; });
  for (const JobId& id : own) give(home, id, with_results);
}

void Month::give(int home, const JobId& id, bool with_results) {
  StoredJob& job = jobs_.at(id);
  JobRestored event{.plan = job.plan, .state = JobState::running};
  event.numeric_class = digest_number(1);
  if (!with_results) {
    job.accepted.clear();
    job.audits.clear();
    job.film.assign(job.film.size(), {});
    job.folded.assign(job.folded.size(), 0);
  }
  job.home = home;
  job.asked = job.folded;
  for (const auto& [unit, r] : job.accepted)
    event.accepted.push_back({unit.first, unit.second, r.samples, r.digest, r.worker});
  event.folded = job.folded;
  event.audits = job.audits;
  send(home, event);
}

}  // namespace ls::coordinator
