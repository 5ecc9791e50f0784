// Leases units to workers and takes them back. Only these functions change which leases exist, which units
// they hold, and how much leased work each worker has. Terms: docs/reference/glossary.md.
#include <algorithm>
#include <limits>

#include "coordinator/domain/farm/farm_state.h"

namespace ls::coordinator {

void Farm::State::grant(Job& job, Worker& worker, std::vector<UnitCode> units, bool audit) {
  LeaseRecord lease;
  lease.seq = leases.next_seq();
  lease.job = &job;
  lease.worker = &worker;
  lease.issued = lease.progress_at = now;
  lease.audit = audit;
  lease.remaining = static_cast<std::uint32_t>(units.size());
  double sum = 0, longest = 0;
  AssignLease message{{leases.id_of(lease.seq), job.plan.brief.job, {}}, std::nullopt};
  for (const UnitCode code : units) {
    const double cost = job.predict(code);
    sum += cost;
    longest = std::max(longest, cost);
    audit ? void(job.audits.at(code).lease = lease.seq) : job.out[code].add(lease.seq);
    message.lease.units.push_back(
        {tile_of(code), round_of(code), job.plan.grid.rect(tile_of(code)), job.range(code)});
  }
  lease.units = std::move(units);
  lease.seconds_per_unit = sum / lease.remaining;
  lease.charge_per_unit = job.cost.known() ? lease.seconds_per_unit : kAssumedUnitSeconds;
  lease.predicted =
      from_seconds(std::max(longest / worker.core_share.get(), (worker.seconds_out + sum) / worker.cores()));
  lease.deadline = now + from_seconds(kDeadlineFactor * seconds(lease.predicted)) + kDeadlineSlack +
                   (worker.warmed_up.contains(job.seq) ? Duration{} : Duration{kLoadSlack});

  if (worker.units_out == 0) {
    worker.progress_at = now;
    worker.begin_work(now);
  }
  worker.units_out += lease.remaining;
  worker.seconds_out += sum;
  worker.leases.insert(lease.seq);
  job.leases.insert(lease.seq);
  workers.settle(worker);
  job.leased += lease.remaining;
  if (!audit) load(job, worker, lease.remaining);
  shares.charge(job, lease.remaining * lease.charge_per_unit);
  std::optional<std::size_t> brief_bytes;
  if (!worker.briefs.has(job.seq)) {
    message.brief = job.plan.brief;
    brief_bytes = memory_of(job.plan.brief);
    lease.with_brief = true;
  }
  worker.briefs.leased(job.seq, brief_bytes);
  leases.add(std::move(lease));
  note_begun(worker);
  effects.emplace_back(Send{worker.id, std::move(message)});
}

bool Farm::State::detach(LeaseRecord& lease, UnitCode code) {
  Job& job = *lease.job;
  Worker& worker = *lease.worker;
  bool last = false;
  if (lease.audit) {
    job.audits.at(code).lease = 0;
  } else {
    const auto it = job.out.find(code);
    it->second.remove(lease.seq);
    last = it->second.empty();
    if (last) job.out.erase(it);
  }
  --job.leased;
  if (!lease.audit) unload(job, 1);
  shares.charge(job, -lease.charge_per_unit);
  --lease.remaining;
  --worker.units_out;
  worker.seconds_out = worker.units_out == 0 ? 0 : std::max(0.0, worker.seconds_out - lease.seconds_per_unit);
  return last;
}

bool Farm::State::has(const LeaseRecord& lease, UnitCode code) {
  const Job& job = *lease.job;
  if (lease.audit) {
    const auto audit = job.audits.find(code);
    return audit != job.audits.end() && audit->second.lease == lease.seq;
  }
  const auto it = job.out.find(code);
  return it != job.out.end() && it->second.has(lease.seq);
}

void Farm::State::load(Job& job, const Worker& worker, std::uint32_t units) {
  const auto add = [&](Load& load) {
    load.units += units;
    ++load.leases_at[worker.index];
  };
  add(job.load);
  if (!job.plan.owner.empty()) add(users[job.plan.owner]);
  if (!job.plan.group.empty()) add(groups[job.plan.group]);
}

void Farm::State::unload(Job& job, std::uint32_t units) {
  job.load.units -= units;
  if (!job.plan.owner.empty()) users[job.plan.owner].units -= units;
  if (!job.plan.group.empty()) groups[job.plan.group].units -= units;
  work_appeared |= limited(job);
}

void Farm::State::leave_load(Job& job, const Worker& worker) {
  const auto leave = [&](Load& load) {
    const auto at = load.leases_at.find(worker.index);
    if (--at->second == 0) load.leases_at.erase(at);
    return load.leases_at.empty();
  };
  leave(job.load);
  if (!job.plan.owner.empty() && leave(users[job.plan.owner])) users.erase(job.plan.owner);
  if (!job.plan.group.empty() && leave(groups[job.plan.group])) groups.erase(job.plan.group);
}

std::uint32_t tighter(std::uint32_t a, std::uint32_t b) { return a == 0 || b == 0 ? a + b : std::min(a, b); }

bool Farm::State::limited(const Job& job) const {
  const ShareLimits& l = options.limits;
  return job.plan.max_units != 0 || job.plan.max_workers != 0 || l.units_per_job != 0 ||
         l.workers_per_job != 0 ||
         (!job.plan.owner.empty() && (l.units_per_user != 0 || l.workers_per_user != 0));
}

std::uint32_t Farm::State::room(const Job& job, const Worker& worker) const {
  std::uint32_t room = std::numeric_limits<std::uint32_t>::max();
  if (!limited(job)) return room;
  const auto narrow = [&](const Load& load, std::uint32_t units, std::uint32_t workers_most) {
    if (units != 0) room = std::min(room, units - std::min(units, load.units));
    if (workers_most != 0 && load.leases_at.size() >= workers_most && !load.leases_at.contains(worker.index))
      room = 0;
  };
  const ShareLimits& l = options.limits;
  const auto group = groups.find(job.plan.group);
  narrow(group != groups.end() ? group->second : job.load, tighter(job.plan.max_units, l.units_per_job),
         tighter(job.plan.max_workers, l.workers_per_job));
  if (job.plan.owner.empty()) return room;
  const auto user = users.find(job.plan.owner);
  narrow(user != users.end() ? user->second : Load{}, l.units_per_user, l.workers_per_user);
  return room;
}

void Farm::State::settle_unit(Job& job, UnitCode code, const Worker* by) {
  const auto it = job.out.find(code);
  if (it == job.out.end()) return job.queue.forget(code);
  const Holders holders = it->second;
  for (const LeaseSeq seq : holders.lease) {
    LeaseRecord* lease = seq == 0 ? nullptr : leases.find(seq);
    if (lease == nullptr) continue;
    if (lease->worker != by) job.voters.note(code, lease->worker->index);
    detach(*lease, code);
    touch(*lease->worker);
    if (lease->remaining == 0) close(*lease, lease->worker != by);
  }
}

void Farm::State::free_lease(LeaseSeq seq, FreedCause why, bool send_worker) {
  if (LeaseRecord* lease = leases.find(seq))
    free_units(*lease, why, send_worker, [](UnitCode) { return true; });
}

void Farm::State::close(LeaseRecord& lease, bool send_worker) {
  Worker& worker = *lease.worker;
  worker.leases.erase(lease.seq);
  lease.job->leases.erase(lease.seq);
  if (!lease.audit) leave_load(*lease.job, worker);
  if (send_worker && worker.connected)
    effects.emplace_back(Send{worker.id, CancelLease{leases.id_of(lease.seq)}});
  touch(worker);
  Job& job = *lease.job;
  work_appeared |= lease.comes_back;
  leases.erase(lease.seq);
  unpin(job);
}

std::uint32_t Farm::State::units_before(const LeaseRecord& lease) const {
  std::uint32_t units = 0;
  for (const LeaseSeq seq : lease.worker->leases) {
    if (seq >= lease.seq) break;
    units += leases.all().at(seq).remaining;
  }
  return units;
}

void Farm::State::recall(LeaseRecord& lease) {
  if (lease.recalled || lease.audit) return;
  lease.recalled = now;
  lease.comes_back =
      units_before(lease) + lease.remaining > static_cast<std::uint32_t>(lease.worker->threads);
  effects.emplace_back(Send{lease.worker->id, RecallLease{leases.id_of(lease.seq)}});
}

// The newest goes first, so that later rounds come back before earlier ones.
void Farm::State::recall_all(const Job& job) {
  for (auto seq = job.leases.rbegin(); seq != job.leases.rend(); ++seq) recall(*leases.find(*seq));
}

void Farm::State::note_begun(Worker& worker) {
  std::uint32_t before = 0;
  for (const LeaseSeq seq : worker.leases) {
    if (before >= static_cast<std::uint32_t>(worker.threads)) return;
    LeaseRecord& lease = *leases.find(seq);
    if (!lease.begun && worker.warmed_up.contains(lease.job->seq)) lease.begun = now;
    before += lease.remaining;
  }
}

void Farm::State::end_long_leases(Worker& worker) {
  const std::uint32_t threads = static_cast<std::uint32_t>(worker.threads);
  std::uint32_t units = 0;
  for (const LeaseSeq seq : worker.leases) {
    if (units >= threads) return;
    LeaseRecord& lease = *leases.find(seq);
    units += lease.remaining;
    if (!lease.begun || lease.recalled || now - *lease.begun < from_seconds(kLeaseLimit)) continue;
    recall(lease);
    // If the units up to here occupy at most all threads, they are probably all being rendered.
    if (units <= threads) continue;
    // The costs of later leases of the same job were predicted as wrongly. And their units would go before
    // those that come back, although these are of earlier rounds.
    for (auto later = worker.leases.find(seq); later != worker.leases.end(); ++later)
      if (LeaseRecord& one = *leases.find(*later); one.job == lease.job) recall(one);
  }
}

std::uint32_t Farm::State::may_be_begun(const LeaseRecord& lease, FreedCause why) const {
  const Worker& worker = *lease.worker;
  switch (why) {
    // The coordinator returns units by itself whose result it could not store: these were begun
    case FreedCause::returned:
      return worker.draining || !worker.warmed_up.contains(lease.job->seq) ? 0 : lease.remaining;
    case FreedCause::recalled:
    case FreedCause::moved:
    case FreedCause::paused:
      return 0;
    case FreedCause::worker_lost:
    case FreedCause::newer_stream:
    case FreedCause::deadline_passed: {
      const auto threads = static_cast<std::uint32_t>(worker.threads);
      return threads - std::min(threads, units_before(lease));
    }
    default:
      return lease.remaining;
  }
}

void Farm::State::renew(LeaseRecord& lease) {
  const Worker& worker = *lease.worker;
  const double left = std::max(lease.seconds_per_unit / worker.core_share.get(), worker.seconds_until_free());
  const bool warm = worker.warmed_up.contains(lease.job->seq);
  const TimePoint deadline = now + from_seconds(kDeadlineFactor * left) + kDeadlineSlack +
                             (warm ? Duration{} : Duration{kLoadSlack});
  leases.renew(lease, std::max(lease.deadline, deadline));
}

}  // namespace ls::coordinator
