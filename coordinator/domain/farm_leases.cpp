// Lending units and taking them back: the only place where leases, holders and a worker's load change.
#include <algorithm>

#include "coordinator/domain/farm_state.h"

namespace ls::coordinator {

void Farm::State::grant(Job& job, Worker& worker, std::vector<UnitCode> units) {
  LeaseRecord lease;
  lease.seq = leases.next_seq();
  lease.job = &job;
  lease.worker = &worker;
  lease.issued = now;
  lease.remaining = static_cast<std::uint32_t>(units.size());
  double sum = 0, longest = 0;
  AssignLease message{{leases.id_of(lease.seq), job.plan.brief.job, {}}, std::nullopt};
  for (const UnitCode code : units) {
    const double cost = job.predict(code);
    sum += cost;
    longest = std::max(longest, cost);
    job.out[code].add(lease.seq);
    message.lease.units.push_back(
        {tile_of(code), round_of(code), job.plan.grid.rect(tile_of(code)), job.range(code)});
  }
  lease.units = std::move(units);
  lease.seconds_per_unit = sum / lease.remaining;
  lease.predicted = from_seconds(std::max(longest, (worker.seconds_out + sum) / worker.threads));
  lease.deadline = now + from_seconds(kDeadlineFactor * seconds(lease.predicted)) + kDeadlineSlack +
                   (worker.warmed_up.contains(job.seq) ? Duration{} : Duration{kLoadSlack});

  if (worker.units_out == 0) worker.grown_at = now;
  worker.units_out += lease.remaining;
  worker.seconds_out += sum;
  worker.leases.insert(lease.seq);
  workers.settle(worker);
  if (worker.briefed.insert(job.seq).second) message.brief = job.plan.brief;
  leases.add(std::move(lease));
  effects.emplace_back(Send{worker.id, std::move(message)});
}

bool Farm::State::detach(LeaseRecord& lease, UnitCode code) {
  Job& job = *lease.job;
  Worker& worker = *lease.worker;
  const auto it = job.out.find(code);
  it->second.remove(lease.seq);
  const bool last = it->second.empty();
  if (last) job.out.erase(it);
  --lease.remaining;
  --worker.units_out;
  worker.seconds_out = worker.units_out == 0 ? 0 : std::max(0.0, worker.seconds_out - lease.seconds_per_unit);
  return last;
}

void Farm::State::settle_unit(Job& job, UnitCode code, const Worker* by) {
  const auto it = job.out.find(code);
  if (it == job.out.end()) return job.queue.forget(code);
  const Holders holders = it->second;
  for (const LeaseSeq seq : holders.lease) {
    LeaseRecord* lease = seq == 0 ? nullptr : leases.find(seq);
    if (lease == nullptr) continue;
    detach(*lease, code);
    touch(*lease->worker);
    if (lease->remaining == 0) close(*lease, lease->worker != by);
  }
}

void Farm::State::free_lease(LeaseSeq seq, std::string_view why, bool tell_worker) {
  if (LeaseRecord* lease = leases.find(seq))
    free_units(*lease, why, tell_worker, [](UnitCode) { return true; });
}

void Farm::State::close(LeaseRecord& lease, bool tell_worker) {
  Worker& worker = *lease.worker;
  worker.leases.erase(lease.seq);
  if (tell_worker && worker.connected)
    effects.emplace_back(Send{worker.id, CancelLease{leases.id_of(lease.seq)}});
  touch(worker);
  leases.erase(lease.seq);
}

std::vector<LeaseSeq> Farm::State::leases_of(const Job& job) const {
  std::vector<LeaseSeq> found;
  for (const auto& [seq, lease] : leases.all()) {
    if (lease.job == &job) found.push_back(seq);
  }
  return found;
}

void Farm::State::renew(LeaseRecord& lease) {
  const Worker& worker = *lease.worker;
  const double left = std::max(lease.seconds_per_unit, worker.seconds_out / worker.threads);
  const bool warm = worker.warmed_up.contains(lease.job->seq);
  const TimePoint deadline = now + from_seconds(kDeadlineFactor * left) + kDeadlineSlack +
                             (warm ? Duration{} : Duration{kLoadSlack});
  leases.renew(lease, std::max(lease.deadline, deadline));
}

}  // namespace ls::coordinator
