// Decides which worker gets which units next. Higher priorities go first, users get equal shares, and a
// user's jobs go one after the other (fair_share.h). Within a job lower rounds go first, so that a preview of
// the whole image is available early. Idle workers go before busy ones, and among them those that have loaded
// the job's world. Leases shrink near the end of a job. Terms: docs/reference/glossary.md.
#include <algorithm>
#include <limits>

#include "coordinator/domain/farm/farm_state.h"

namespace ls::coordinator {
namespace {

struct LeaseSize {
  std::uint64_t units = 1;
  std::uint64_t new_tiles = 1;  // at most so many of the units are of tiles whose cost is unknown
  double seconds = 0;  // CPU seconds: units are added to the lease until their predicted cost reaches this
};

// Returns the seconds until the job's time limit, minus the seconds that the worker needs for the leases it
// holds. Infinite if no limit applies.
double seconds_left(const Job& job, const Worker& worker, TimePoint now) {
  const auto limit = job.time_limit(now);
  if (!limit || job.frozen) return std::numeric_limits<double>::infinity();
  return std::max(0.0, seconds(*limit - now) - worker.seconds_until_free());
}

// Returns the size of the worker's next lease (guided self-scheduling). If the waiting units were divided
// equally among the farm's `farm_threads` threads, each worker would get a share in proportion to its
// threads; a lease holds half of this share. As fewer and fewer units wait, leases shrink, and all threads
// end at about the same time. A lease also ends when its predicted cost reaches LeaseSize::seconds, which
// shrinks shortly before the job's time limit. Of tiles that have no result yet, a lease has at most as many
// units as there are tiles with results, or a few for each thread: some cheap tiles do not tell what the rest
// of the image costs.
LeaseSize lease_size(const Job& job, const Worker& worker, int farm_threads, TimePoint now) {
  const std::uint64_t threads = static_cast<std::uint64_t>(worker.threads);
  const std::uint64_t halves = 2 * static_cast<std::uint64_t>(std::max(farm_threads, 1));
  const std::uint64_t waiting = std::min(job.queued(), job.queue.surely_waiting());
  // A lease has at least `least` units: with single-unit leases, a worker with many threads would reach
  // kMaxLeasesPerWorker leases before all its threads have work.
  const std::uint64_t least = (kUnitsAThread * threads + kMaxLeasesPerWorker - 1) / kMaxLeasesPerWorker;
  const std::uint64_t share = std::max(least, (waiting * threads + halves - 1) / halves);
  const std::uint64_t new_tiles =
      job.cost.known() ? std::max<std::uint64_t>(4 * threads, job.cost.tiles_known()) : threads;
  const double lasts = std::min(kLeaseSeconds, seconds_left(job, worker, now));
  return {std::min<std::uint64_t>(share, kMaxLeaseUnits), new_tiles, lasts * worker.cores()};
}

// True if the job's time limit forbids leasing this unit to the worker: the limit has passed, or the worker
// is busy until then. The first round of every tile is exempt.
bool out_of_time(const Job& job, const Worker& worker, UnitCode code, TimePoint now) {
  const auto limit = job.time_limit(now);
  if (!limit || job.frozen || round_of(code) == 0) return false;
  if (now >= *limit) return true;
  return worker.saturated() && now + from_seconds(worker.seconds_until_free()) >= *limit;
}

}  // namespace

void Farm::State::dispatch() {
  bool again = false;
  do {
    pinned_for_others = false;
    std::vector<Worker*> candidates;
    for (const WorkerIndex index : work_appeared ? workers.wanting_work() : dirty) {
      if (workers.wanting_work().contains(index)) candidates.push_back(&workers.at(index));
    }
    const bool choice = candidates.size() > 1;
    bool served = false;
    for (const bool only_uncovered : {true, false}) {
      if (choice) served |= serve(candidates, only_uncovered, true);
      served |= serve(candidates, only_uncovered, false);
    }
    // A worker that is no longer idle may have been the one for which a job of no class yet was kept
    // (may_pin)
    again = served && !work_appeared && workers.classes() > 1;
    work_appeared |= again;
  } while (again || pinned_for_others || take_back_for_idle());
  for (const WorkerIndex index : dirty) {
    if (workers.wanting_work().contains(index)) copy_overdue(workers.at(index));
  }
}

bool Farm::State::take_back_for_idle() {
  for (const WorkerIndex index : dirty) {
    if (!workers.wanting_work().contains(index)) continue;
    const Worker& idle = workers.at(index);
    if (!idle.available() || idle.saturated()) continue;
    if (LeaseRecord* lease = longest_waiting_for(idle)) {
      free_lease(lease->seq, FreedCause::moved, true);
      return true;
    }
  }
  return false;
}

// True if the worker certainly has not begun this lease: it processes its leases in order, and the units of
// its earlier leases keep all its threads busy.
bool Farm::State::untouched(const LeaseRecord& lease) const {
  return lease.reported == 0 && units_before(lease) >= static_cast<std::uint32_t>(lease.worker->threads);
}

// Returns the predicted seconds until the worker begins the lease; 0 if it may have begun.
double Farm::State::waits_behind_others(const LeaseRecord& lease) const {
  if (!untouched(lease)) return 0;
  double before = 0;
  for (const LeaseSeq seq : lease.worker->leases) {
    if (seq >= lease.seq) break;
    const LeaseRecord& earlier = leases.all().at(seq);
    // The cost is predicted now: LeaseRecord::seconds_per_unit may date from before the first measured cost
    // of the job.
    before += earlier.remaining * earlier.job->predict(earlier.units.front());
  }
  return before / lease.worker->cores();
}

LeaseRecord* Farm::State::longest_waiting_for(const Worker& idle) {
  LeaseRecord* found = nullptr;
  double longest = seconds(kTakeBackAfter);
  std::uint32_t looked_at = 0;
  for (auto it = leases.all().rbegin(); it != leases.all().rend() && ++looked_at <= kSpeculationScan; ++it) {
    LeaseRecord& lease = it->second;
    const Job& job = *lease.job;
    // The idle worker must be able to begin immediately: it has loaded the job's world and may take these
    // units.
    if (lease.audit || lease.worker == &idle || !idle.warmed_up.contains(job.seq) ||
        !may_serve(job, idle, ticked) || !job.leasable() || room(job, idle) < lease.remaining ||
        awaits_return(job, idle))
      continue;
    const bool excluded = std::any_of(lease.units.begin(), lease.units.end(), [&](UnitCode code) {
      return !job.failures.attempts(code).empty() || out_of_time(job, idle, code, now);
    });
    const double wait = excluded ? 0 : waits_behind_others(lease);
    if (wait > longest) found = &lease, longest = wait;
  }
  return found;
}

bool Farm::State::serve(const std::vector<Worker*>& candidates, bool only_uncovered, bool only_holders) {
  bool any = false, served = true;
  while (served && !shares.empty()) {
    served = false;
    for (Worker* worker : candidates) {
      if (shares.empty()) break;
      if (!worker->wants_more() || (only_uncovered && worker->saturated())) continue;
      served |= assign(*worker, only_holders);
    }
    any |= served;
  }
  return any;
}

// What other workers give back matters if the job is frozen: a unit that came back may be cut off as soon as
// those of later rounds have come back, too. A worker of an older version does not answer, so this ends by
// itself.
bool Farm::State::awaits_return(const Job& job, const Worker& worker) const {
  const auto expected = [&](const LeaseRecord& lease) {
    return lease.job == &job && lease.comes_back && ticked < *lease.recalled + kSpeculateSlack;
  };
  const std::set<LeaseSeq>& those = job.frozen ? job.leases : worker.leases;
  return std::any_of(those.begin(), those.end(),
                     [&](LeaseSeq seq) { return expected(leases.all().at(seq)); });
}

Farm::State::Takes Farm::State::takes(Job& job, const Worker& worker) {
  if (!may_serve(job, worker, ticked) || !may_pin(job, worker)) return Takes::nothing;
  if (audit_for(job, worker)) return Takes::now;
  // The results of a held job are checked; only new units wait
  if (job.plan.held || awaits_return(job, worker)) return Takes::nothing;
  const auto code = room(job, worker) > 0 ? next_for(job, worker) : std::nullopt;
  if (!code) return Takes::nothing;
  return too_early(job, worker, *code, 0, 0) ? Takes::later : Takes::now;
}

// Decides whether the worker may take the first lease of a job, and so pin it to its numeric class. Four
// preferences decide:
// 1. A worker that has not given back this job's units without a result, if one of another class is there.
// 2. A worker that had no leases of this job in vain (PassedOver), if an idle worker of another class is one.
// 3. A class of which a result was accepted before, if an idle worker has it: anybody can announce a class.
// 4. A class of several workers, so that they can check each other's results in audits. This one waits for
//    busy workers, too. A class without results so far does not count against one with results.
bool Farm::State::may_pin(const Job& job, const Worker& worker) const {
  if (job.numeric_class) return *job.numeric_class == worker.numeric_class;
  if (workers.classes() < 2) return true;
  const bool known = proven.contains(worker.numeric_class);
  const auto passed_over = [&](const Worker& one) {
    const auto found = job.passed_over.find(one.numeric_class);
    return found != job.passed_over.end() && found->second.has(one.index);
  };
  const bool passed = passed_over(worker);
  const bool alone = options.audit_rate > 0 && workers.of_class(worker.numeric_class).workers <= 1;
  const bool unable = worker.unable(job.seq);
  if (!passed && !alone && !unable && (known || proven.empty())) return true;
  std::map<Digest, int> others;
  for (const auto& [index, other] : workers.all()) {
    const Digest& another = other->numeric_class;
    const bool there = other->connected && !other->draining && !other->unhealthy_since &&
                       other->pause != Pause::silent && other->pause != Pause::stuck &&
                       !other->unable(job.seq) && another != worker.numeric_class;
    if (!there || !fits(job, *other) || other->blocked(job.seq, ticked)) continue;
    if (unable) return false;
    const bool idle =
        other->available() && other->wants_more() && !other->saturated() && room(job, *other) > 0;
    const bool other_passed = passed_over(*other), other_known = proven.contains(another);
    if ((passed && !other_passed && idle) || (!known && other_known && !other_passed && idle)) return false;
    if ((other_passed && !passed) || (known && !other_known)) continue;
    if (alone && ++others[another] > 1) return false;
  }
  return true;
}

// Returns the job whose units this worker gets next; null: none. This is the first job in turn or, to save
// loading time, the first job of another user, if the worker has its world (loaded scene) or scene file. The
// other user must not be far ahead of their fair share, and some worker must be rendering the job that is
// first in turn. A later job of the same user never goes before an earlier one. The result is also null if
// the worker will get units of the first job soon: leases of another job would delay these.
Job* Farm::State::choose(const Worker& worker) {
  using Then = FairShare::Then;
  Job* fair = nullptr;
  Job* chosen = nullptr;
  double least = 0;
  std::uint32_t looked_at = 0;
  const double slack = kLocalitySeconds * workers.threads();
  shares.in_turn([&](Job& job, double lag) {
    if (fair != nullptr &&
        (++looked_at > kJobsLookedAt || job.plan.priority != fair->plan.priority || lag - least > slack))
      return Then::stop;
    const Takes when = takes(job, worker);
    if (when == Takes::nothing) return Then::next_job;
    if (when == Takes::later) return fair == nullptr ? Then::stop : Then::next_user;
    if (fair == nullptr) fair = &job, least = lag;
    if (!holds(job, worker) && job.load.units > 0) return Then::next_user;
    chosen = &job;
    return Then::stop;
  });
  return chosen != nullptr ? chosen : fair;
}

bool Farm::State::assign(Worker& worker, bool only_held) {
  Job* job = choose(worker);
  return job != nullptr && (!only_held || holds(*job, worker)) && lease_from(*job, worker);
}

std::optional<UnitCode> Farm::State::next_for(Job& job, const Worker& worker) {
  // A unit that has failed is rendered by another worker, and rather by one that has delivered results: then
  // it is known whether the unit or the worker is at fault.
  const auto excluded = [&](UnitCode code) {
    if (job.failures.attempts(code).empty()) return false;
    if (!worker.proven() && others_may_take(job, code, worker, true)) return true;
    return job.failures.failed_on(code, worker.index) && others_may_take(job, code, worker, false);
  };
  const auto code = job.queue.front(job.units, excluded);
  return code && !out_of_time(job, worker, *code, now) ? code : std::nullopt;
}

// True if the unit is speculative (the job may end without it) and the worker has enough work for now. Leased
// early, the unit would delay units that turn out to be needed, and would be dropped more often. `units` and
// `cost` (CPU seconds): the units already chosen for the same lease.
bool Farm::State::too_early(const Job& job, const Worker& worker, UnitCode code, std::size_t units,
                            double cost) const {
  return !job.queue.wanted(code) &&
         worker.units_out + units >= kUnitsAThread * static_cast<std::size_t>(worker.threads) &&
         worker.seconds_until_free() + cost / worker.cores() >= kSpeculativeSeconds;
}

bool Farm::State::lease_from(Job& job, Worker& worker) {
  if (audit_from(job, worker)) return true;
  LeaseSize size = lease_size(job, worker, workers.threads(), now);
  size.units = std::min<std::uint64_t>(size.units, room(job, worker));
  std::vector<UnitCode> units;
  double cost = 0;
  std::uint64_t new_tiles = 0;
  while (units.size() < size.units && (units.empty() || cost < size.seconds)) {
    const auto code = next_for(job, worker);
    if (!code || too_early(job, worker, *code, units.size(), cost)) break;
    new_tiles += !job.cost.knows(tile_of(*code));
    if (new_tiles > size.new_tiles) break;
    job.queue.pop(*code);
    units.push_back(*code);
    cost += job.predict(*code);
  }
  if (units.empty()) return false;
  pin(job, worker.numeric_class);
  if (job.state == JobState::queued) set_state(job, JobState::running);
  shares.served(job);
  grant(job, worker, std::move(units));
  refresh(job);
  return true;
}

bool Farm::State::others_may_take(const Job& job, UnitCode code, const Worker& but, bool proven) const {
  return std::any_of(workers.all().begin(), workers.all().end(), [&](const auto& entry) {
    const Worker& other = *entry.second;
    return other.index != but.index && (!proven || other.proven()) && may_serve(job, other, ticked) &&
           !job.failures.failed_on(code, other.index);
  });
}

void Farm::State::copy_overdue(Worker& worker) {
  std::uint32_t looked_at = 0;
  for (auto& [seq, lease] : leases.all()) {
    if (!worker.available() || worker.saturated() || ++looked_at > kSpeculationScan) return;
    Job& job = *lease.job;
    const Duration due = from_seconds(kSpeculateAfter * seconds(lease.predicted)) + kSpeculateSlack;
    if (lease.worker == &worker || now < lease.issued + due) continue;
    // The units of a recalled lease that are not begun come back in a moment
    if (lease.recalled && now < *lease.recalled + kSpeculateSlack) continue;
    if (!job.leasable() || !may_serve(job, worker, ticked)) continue;
    std::vector<UnitCode> units;
    const std::uint32_t most = room(job, worker);
    for (const UnitCode code : lease.units) {
      if (units.size() >= most) break;
      if (worker.units_out + units.size() >= static_cast<std::uint32_t>(worker.threads)) break;
      const auto it = job.out.find(code);
      if (it == job.out.end() || !it->second.has(seq) || it->second.full()) continue;
      if (!job.failures.failed_on(code, worker.index)) units.push_back(code);
    }
    if (!units.empty()) grant(job, worker, std::move(units));
  }
}

}  // namespace ls::coordinator
