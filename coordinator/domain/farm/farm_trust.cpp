// Audits detect faulty workers: a random share of the accepted results is rendered again by another worker,
// and the two results are compared. The two results of a slow unit (a round of a tile) that two workers have
// rendered are compared in the same way. If two results of a unit differ, a third worker renders the unit,
// and the worker that is outvoted is quarantined. Only workers that held a lease on the unit have a vote
// (VoterTable). Every tile with a result of the quarantined worker, in any job that has not ended, is
// discarded and rendered again from round 0. In a job whose tiles are stopped by its target error, one such
// tile causes all tiles to be discarded.
#include <fmt/format.h>

#include <algorithm>

#include "coordinator/domain/farm/farm_state.h"

namespace ls::coordinator {
namespace {

// Returns a pseudo-random 64-bit number that depends on x alone (splitmix64, Steele et al. 2014).
std::uint64_t mixed(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

}  // namespace

// True if the worker is of another principal than the workers that have delivered a result of the unit.
bool Farm::State::is_outsider(const Audit& audit, const Worker& worker) const {
  return worker.principal != workers.principal_of(audit.first) &&
         (!audit.second || worker.principal != workers.principal_of(audit.second->first));
}

bool Farm::State::may_decide(const Job& job, const Audit& audit, const Worker& worker) const {
  return worker.connected && !worker.draining && !worker.unhealthy_since && audit.asks(worker.index) &&
         fits(job, worker) && !worker.blocked(job.seq, ticked);
}

bool Farm::State::may_vote(const Job& job, const Audit& audit, const Worker& worker) const {
  if (!audit.asks(worker.index)) return false;
  return is_outsider(audit, worker) ||
         std::none_of(workers.all().begin(), workers.all().end(), [&](const auto& entry) {
           return is_outsider(audit, *entry.second) && may_decide(job, audit, *entry.second);
         });
}

bool Farm::State::outvote(WorkerIndex one, WorkerIndex other, WorkerIndex alone) const {
  const std::string& principal = workers.principal_of(one);
  return principal != workers.principal_of(other) || principal == workers.principal_of(alone);
}

// The worker's result of the unit decides nothing: another one must be found.
void Farm::State::ignore_vote(Job& job, UnitCode code, WorkerIndex by) {
  job.audits.at(code).tried.push_back(by);
  audits_changed.insert(job.plan.brief.job);
  work_appeared = true;
  settle_audits(job);
}

Farm::State::Deciders Farm::State::deciders(const Job& job, const Audit& audit) const {
  Deciders outsiders = Deciders::none, others = Deciders::none;
  for (const auto& [index, worker] : workers.all()) {
    if (!may_decide(job, audit, *worker)) continue;
    Deciders& found = is_outsider(audit, *worker) ? outsiders : others;
    const bool able = worker->available() && !worker->unable(job.seq);
    if (found != Deciders::there) found = able ? Deciders::there : Deciders::away;
    if (outsiders == Deciders::there) break;
  }
  return outsiders != Deciders::none ? outsiders : others;
}

void Farm::State::consider_audit(Job& job, UnitCode code, WorkerIndex first) {
  const double draw = static_cast<double>(mixed(mixed(options.audit_seed ^ job.seq) ^ code) >> 11) * 0x1p-53;
  if (!(draw < options.audit_rate) || job.audits.size() >= kMaxAuditsOpen) return;
  Audit audit;
  audit.first = first;
  if (deciders(job, audit) != Deciders::there) {
    ++job.audits_missed;
    ++audited.missed;
    return;
  }
  job.audits.emplace(code, std::move(audit));
  ++audited.asked;
  audits_changed.insert(job.plan.brief.job);
  work_appeared = true;
}

// Reopens the audits (units that are rendered again for comparison) that were open when the coordinator
// restarted. No worker is connected yet, so settle_audits() waits some time for workers before it drops these
// audits.
void Farm::State::restore_audits(Job& job, const JobRestored& event) {
  for (const JobRestored::Audit& open : event.audits) {
    const UnitCode code = unit_code(open.round, open.tile);
    if (open.tile >= job.units.tiles() || !job.queue.plans(code) || !job.units.accepted(code)) continue;
    if (job.audits.size() >= kMaxAuditsOpen || (open.second && quarantined.contains(open.second->first)))
      continue;
    Audit audit;
    audit.first = job.units.find(code)->worker;
    audit.since = now;
    audit.restored = true;
    if (open.second) audit.second = {workers.index_of(open.second->first), open.second->second};
    audited.asked += job.audits.emplace(code, std::move(audit)).second;
  }
  audits_changed.insert(job.plan.brief.job);
}

std::optional<UnitCode> Farm::State::audit_for(const Job& job, const Worker& worker) const {
  for (const auto& [code, audit] : job.audits)
    if (audit.lease == 0 && may_vote(job, audit, worker)) return code;
  return std::nullopt;
}

bool Farm::State::audit_from(Job& job, Worker& worker) {
  const auto code = audit_for(job, worker);
  if (!code) return false;
  grant(job, worker, {*code}, true);
  refresh(job);
  return true;
}

void Farm::State::close_audits(Job& job, const std::function<bool(UnitCode, const Audit&)>& which) {
  std::vector<UnitCode> closed;
  for (const auto& [code, audit] : job.audits)
    if (which(code, audit)) closed.push_back(code);
  if (!closed.empty()) audits_changed.insert(job.plan.brief.job);
  for (const UnitCode code : closed) {
    free_lease(job.audits.at(code).lease, FreedCause::not_wanted, true);
    job.audits.erase(code);
    ++audited.dropped;
  }
}

void Farm::State::settle_audits(Job& job) {
  std::vector<UnitCode> stuck;
  for (const auto& [code, audit] : job.audits) {
    if (audit.lease != 0) continue;
    const Deciders who = deciders(job, audit);
    const Duration grace = audit.second ? kNoGrowthLimit : kAuditAfterRestart;
    const bool patient =
        (audit.restored || (audit.second && who == Deciders::away)) && now - audit.since < grace;
    if (who != Deciders::there && !patient) stuck.push_back(code);
  }
  for (const UnitCode code : stuck) {
    if (job.audits.at(code).second) return undecided(job, code);
    job.audits.erase(code);
    audits_changed.insert(job.plan.brief.job);
    ++audited.dropped;
  }
  finish_if_complete(job);
  refresh(job);
}

void Farm::State::audit_failed(Job& job, UnitCode code, Worker& worker, LeaseRecord& lease) {
  free_lease(lease.seq, FreedCause::failed, false);
  job.audits.at(code).tried.push_back(worker.index);
  settle_audits(job);
}

bool Farm::State::was_asked(const Job& job, UnitCode code, WorkerIndex worker) const {
  if (job.voters.has(code, worker)) return true;
  const auto audit = job.audits.find(code);
  if (audit == job.audits.end() || audit->second.lease == 0) return false;
  return leases.all().at(audit->second.lease).worker->index == worker;
}

void Farm::State::compare(Job& job, UnitCode code, const UnitAccepted& event) {
  const UnitTable::Result first = *job.units.find(code);
  const bool asked = was_asked(job, code, workers.index_of(event.worker));
  const auto audit = job.audits.find(code);
  if (audit != job.audits.end() && audit->second.lease != 0) {
    LeaseRecord* lease = leases.find(audit->second.lease);
    if (lease->worker->id == event.worker) {
      Worker& worker = *lease->worker;
      const auto since = held_since(job, code, worker);
      const double cpu_seconds = believable(job, code, &worker, since, event.cpu_seconds, now);
      worker.claim(since.value_or(now), cpu_seconds, now);
      shares.spend(job, cpu_seconds);
      if (first.digest == event.digest) note_fruitful(&worker, job);
      detach(*lease, code);
      close(*lease, false);
    }
  }
  const bool equal = first.digest == event.digest || first.digest == Digest{};
  if (equal)
    effects.emplace_back(DropDuplicate{event.unit, event.worker});
  else
    effects.emplace_back(
        DigestMismatch{event.unit, first.digest, event.digest, workers.name_of(first.worker), event.worker});
  if (job.ended()) return;
  equal ? agreed(job, code, event, asked) : disagreed(job, code, event, asked);
}

namespace {
std::string contradiction(const UnitAccepted& now, const Digest& before) {
  return fmt::format("it rendered tile {} round {} of job {} first to {}, then to {}", now.unit.tile,
                     now.unit.round, now.unit.job.value, before.hex(), now.digest.hex());
}
std::string outvoted(const UnitKey& unit, const Digest& claimed, const WorkerId& one, const WorkerId& other,
                     const Digest& agreed) {
  return fmt::format("it rendered tile {} round {} of job {} to {}; {} and {} both rendered it to {}",
                     unit.tile, unit.round, unit.job.value, claimed.hex(), one.value, other.value,
                     agreed.hex());
}
}  // namespace

void Farm::State::agreed(Job& job, UnitCode code, const UnitAccepted& with, bool asked) {
  const auto found = job.audits.find(code);
  const UnitTable::Result first = *job.units.find(code);
  const WorkerIndex by = workers.index_of(with.worker);
  if (found == job.audits.end() || by == first.worker) return;
  const Audit audit = found->second;
  // A worker that has delivered a different result (digest) of this unit before contradicts itself, so it is
  // faulty.
  for (const auto& before : {audit.second, audit.claim})
    if (before && by == before->first)
      return found_faulty(with.unit, by, contradiction(with, before->second));
  if (!asked) return;
  // Two workers of one principal may be one process that lies twice
  if (audit.second && !outvote(first.worker, by, audit.second->first)) return ignore_vote(job, code, by);
  free_lease(audit.lease, FreedCause::not_wanted, true);
  job.audits.erase(code);
  audits_changed.insert(job.plan.brief.job);
  if (!audit.second) ++audited.equal;
  for (const auto& alone : {audit.second, audit.claim})
    if (alone && outvote(first.worker, by, alone->first))
      found_faulty(
          with.unit, alone->first,
          outvoted(with.unit, alone->second, workers.name_of(first.worker), with.worker, with.digest));
  finish_if_complete(job);
  refresh(job);
}

void Farm::State::disagreed(Job& job, UnitCode code, const UnitAccepted& with, bool asked) {
  const UnitTable::Result first = *job.units.find(code);
  const WorkerIndex by = workers.index_of(with.worker);
  if (by == first.worker) return found_faulty(with.unit, by, contradiction(with, first.digest));
  if (const auto found = job.audits.find(code); found != job.audits.end()) {
    const auto second = found->second.second;
    if (second && by == second->first) {
      if (second->second != with.digest) found_faulty(with.unit, by, contradiction(with, second->second));
      return;
    }
  }
  if (!asked) return claimed(job, code, with);
  const auto [open, begun] = job.audits.try_emplace(code);
  audited.asked += begun;
  Audit& audit = open->second;
  audit.first = first.worker;
  audits_changed.insert(job.plan.brief.job);
  if (!audit.second) {
    ++audited.differ;
    audit.second = {by, with.digest};
    audit.since = now;
    work_appeared = true;
    if (deciders(job, audit) == Deciders::none) return undecided(job, code);
    return refresh(job);
  }
  const auto [second, claimed] = *audit.second;
  if (with.digest != claimed) return undecided(job, code);
  if (!outvote(second, by, first.worker)) return ignore_vote(job, code, by);
  found_faulty(with.unit, first.worker,
               outvoted(with.unit, first.digest, workers.name_of(second), with.worker, claimed));
}

// Handles a claim: a result that differs from the accepted one, from a worker that held no lease on the unit.
// That worker has chosen the unit itself, so its result is no vote, but it causes an audit of the unit. If
// the auditor's result equals the accepted one, the worker that made the claim is faulty.
void Farm::State::claimed(Job& job, UnitCode code, const UnitAccepted& by) {
  const std::pair claimed{workers.index_of(by.worker), by.digest};
  if (const auto open = job.audits.find(code); open != job.audits.end()) {
    if (!open->second.claim) open->second.claim = claimed;
    return;
  }
  Audit audit;
  audit.first = job.units.find(code)->worker;
  audit.claim = claimed;
  if (job.audits.size() >= kMaxAuditsOpen || deciders(job, audit) != Deciders::there) return;
  job.audits.emplace(code, std::move(audit));
  audits_changed.insert(job.plan.brief.job);
  ++audited.asked;
  work_appeared = true;
  refresh(job);
}

void Farm::State::undecided(Job& job, UnitCode code) {
  const UnitTable::Result first = *job.units.find(code);
  const auto second = *job.audits.at(code).second;
  fail(job,
       fmt::format(
           "two workers rendered tile {} round {} to different bits though they are of one numeric "
           "class: {} to {}, {} to {}, and no third one agrees with either. One of them has bad memory or "
           "is not what it says: let each render the scene alone with `lightshaft render`, take the one "
           "whose pixels_sha256 is not the others' off the farm, and submit the job again",
           tile_of(code), round_of(code), workers.name_of(first.worker).value, first.digest.hex(),
           workers.name_of(second.first).value, second.second.hex()));
}

void Farm::State::found_faulty(const UnitKey& unit, WorkerIndex faulty, std::string evidence) {
  const WorkerId id = workers.name_of(faulty);
  if (!quarantined.try_emplace(id, evidence).second) return;
  ++audited.workers_quarantined;
  effects.emplace_back(WorkerFoundFaulty{id, unit, evidence});
  bar(id, evidence);
}

void Farm::State::bar(const WorkerId& id, const std::string& why) {
  if (Worker* worker = workers.find(id)) {
    workers.quarantine(*worker);
    while (!worker->leases.empty()) free_lease(*worker->leases.begin(), FreedCause::worker_quarantined, true);
    workers.settle(*worker);
    effects.emplace_back(WorkerStateChanged{id, worker->state(), "quarantined: " + why});
  }
  const WorkerIndex faulty = workers.index_of(id);
  for (const auto& [seq, job] : jobs)
    if (!job->ended()) void_results(*job, faulty);
  work_appeared = true;
}

void Farm::State::void_results(Job& job, WorkerIndex faulty) {
  std::vector<TileIndex> tiles = job.units.tiles_of(faulty);
  // The stop rule derives the numbers of rounds of all tiles from the errors of all tiles, and the errors of
  // these tiles may have been wrong. So all tiles of the job are discarded.
  const bool by_error = job.adaptive && (!job.stopping || *job.stopping == StopReason::error);
  if (!tiles.empty() && by_error) {
    tiles.resize(job.units.tiles());
    for (TileIndex t = 0; t < tiles.size(); ++t) tiles[t] = t;
    job.stopping.reset();
    job.plan_all();
  }
  close_audits(job, [&](UnitCode code, const Audit& audit) {
    return std::binary_search(tiles.begin(), tiles.end(), tile_of(code)) ||
           (audit.second && audit.second->first == faulty);
  });
  for (auto& [code, audit] : job.audits)
    if (audit.claim && audit.claim->first == faulty) audit.claim.reset();
  for (const TileIndex tile : tiles) void_tile(job, tile);
  // Checkpoints so far have wrong pixels, so checkpoints are taken again from the first round on
  if (!tiles.empty()) job.checkpoint_spp = 0;
  if (!tiles.empty() && job.adaptive) steer_anew(job);
  if (!tiles.empty()) job.move_windows(workers.threads());
  finish_if_complete(job);
  refresh(job);
}

// Rebuilds the job's stop rule (adaptive_stop.h) from the rounds that are still in the image.
void Farm::State::steer_anew(Job& job) {
  job.adaptive.reset();
  job.steer();
  job.predicted_at = 0;
  for (TileIndex t = 0; t < job.units.tiles(); ++t)
    for (RoundIndex k = 0; k < job.units.folded(t); ++k) job.adaptive->folded(t, k, job.units.error(k, t));
}

void Farm::State::void_tile(Job& job, TileIndex tile) {
  for (const UnitCode code : job.units.void_tile(tile)) job.queue.put_back(code);
  ++audited.tiles_discarded;
  effects.emplace_back(TileDiscarded{job.plan.brief.job, tile});
}

}  // namespace ls::coordinator
