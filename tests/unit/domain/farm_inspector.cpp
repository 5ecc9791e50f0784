#include "tests/unit/domain/farm_inspector.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "coordinator/domain/farm/farm_state.h"

namespace ls::coordinator {

struct FarmInspector {
  using State = Farm::State;
  static State& state(const Farm& farm) { return *farm.state_; }
};

namespace {

using State = FarmInspector::State;

std::string audit_job(Job& job, const LeaseTable& leases) {
  const std::string name = "job " + job.plan.brief.job.value + ": ";
  if (job.ended()) return job.out.empty() ? "" : name + "has ended with units leased";
  const UnitQueue& queue = job.queue;
  std::uint64_t waiting = queue.returned_count(), accepted = 0;
  for (TileIndex t = 0; t < job.units.tiles(); ++t) {
    for (RoundIndex r = 0; r < queue.end(t); ++r) {
      const UnitCode code = unit_code(r, t);
      const bool done = job.units.accepted(code), ahead = r >= queue.next(t);
      const bool returned = queue.returned(code), out = job.out.contains(code);
      accepted += done;
      waiting += ahead && !done;
      if (done + returned + out > 1) return name + fmt::format("unit {:#x} is in two places", code);
      if (!ahead && done + returned + out == 0) return name + fmt::format("unit {:#x} is lost", code);
      if (ahead && (returned || out)) return name + fmt::format("unit {:#x} waits twice", code);
    }
  }
  if (accepted != job.units.accepted_count()) return name + "acceptances beyond its end";
  if (queue.planned() != accepted + job.out.size() + waiting) {
    return name + fmt::format("planned {} is not done {} + leased {} + queued {}", queue.planned(), accepted,
                              job.out.size(), waiting);
  }
  for (const auto& [code, holders] : job.out) {
    if (!queue.plans(code) || holders.empty())
      return name + fmt::format("unit {:#x} is leased for nothing", code);
    for (const LeaseSeq seq : holders.lease) {
      if (seq != 0 && !leases.all().contains(seq))
        return name + fmt::format("unit {:#x} has a holder that is gone", code);
    }
  }
  return "";
}

std::string audit_lease(const LeaseRecord& lease,
                        const std::function<bool(const LeaseRecord&, UnitCode)>& has_unit) {
  std::uint32_t out = 0;
  for (const UnitCode code : lease.units) {
    out += has_unit(lease, code);
  }
  if (out != lease.remaining || out == 0)
    return fmt::format("lease {}: {} units out, {} counted", lease.seq, out, lease.remaining);
  if (!lease.worker->leases.contains(lease.seq))
    return fmt::format("lease {}: its worker does not know it", lease.seq);
  if (!lease.job->leases.contains(lease.seq))
    return fmt::format("lease {}: its job does not know it", lease.seq);
  if (!lease.worker->connected) return fmt::format("lease {}: its worker is gone", lease.seq);
  return "";
}

std::string audit_load(const std::string& whose, const Load& kept, const Load& counted, std::uint32_t units,
                       std::uint32_t workers) {
  if (kept.units != counted.units || kept.leases_at != counted.leases_at)
    return fmt::format("{}: {} units leased to {} workers, but counted as {} at {}", whose, counted.units,
                       counted.leases_at.size(), kept.units, kept.leases_at.size());
  if (units != 0 && kept.units > units)
    return fmt::format("{}: {} units are leased, {} may be", whose, kept.units, units);
  if (workers != 0 && kept.leases_at.size() > workers)
    return fmt::format("{}: {} workers hold some, {} may", whose, kept.leases_at.size(), workers);
  return "";
}

// Leased units and charged core seconds of each job, group and user, summed over the leases to check the
// running totals
struct Leased {
  std::map<JobSeq, Load> jobs;
  std::map<std::string, Load> users, groups;
  std::map<JobSeq, double> charges;

  explicit Leased(const LeaseTable& leases) {
    for (const auto& [seq, lease] : leases.all()) {
      const JobPlan& plan = lease.job->plan;
      charges[lease.job->seq] += lease.remaining * lease.charge_per_unit;
      if (lease.audit) continue;
      for (Load* load : {&jobs[lease.job->seq], &users[plan.owner], &groups[plan.group]}) {
        load->units += lease.remaining;
        ++load->leases_at[lease.worker->index];
      }
    }
    users.erase("");
    groups.erase("");
  }
};

std::string audit_job_load(const Job& job, Leased& leased, const ShareLimits& limits) {
  const JobPlan& plan = job.plan;
  const std::string name = "job " + plan.brief.job.value;
  const auto leases = leased.charges.find(job.seq);
  const double charge = leases == leased.charges.end() ? 0 : leases->second;
  if (std::abs(job.charge_out - charge) > 1e-6 * (1 + charge))
    return fmt::format("{}: charged with {} s, leased {} s", name, job.charge_out, charge);
  // Without any lease the core seconds charged to the job must be exactly 0, so that rounding errors cannot
  // accumulate.
  if (leases == leased.charges.end() && job.charge_out != 0)
    return fmt::format("{}: charged with {} s though nothing is leased", name, job.charge_out);
  const bool alone = plan.group.empty();  // The limits of a job in a group apply to the whole group
  return audit_load(name, job.load, leased.jobs[job.seq],
                    alone ? tighter(plan.max_units, limits.units_per_job) : 0,
                    alone ? tighter(plan.max_workers, limits.workers_per_job) : 0);
}

std::string audit_loads(const std::string& what, const std::map<std::string, Load>& kept,
                        std::map<std::string, Load>& counted, std::uint32_t units, std::uint32_t workers) {
  if (counted.size() != kept.size()) return "a " + what + " that has nothing leased is counted";
  for (const auto& [name, load] : kept)
    if (std::string wrong = audit_load(what + " " + name, load, counted[name], units, workers);
        !wrong.empty())
      return wrong;
  return "";
}

}  // namespace

std::vector<std::pair<std::string, std::size_t>> sizes(const Farm& farm) {
  const State& s = FarmInspector::state(farm);
  std::size_t of_workers = 0, of_jobs = 0, units = 0;
  for (const auto& [index, w] : s.workers.all())
    of_workers += w->tags.size() + w->blobs.size() + w->leases.size() + w->briefs.size() +
                  w->warmed_up.size() + w->failures.size() + w->fruitless.size();
  for (const auto& [seq, job] : s.jobs) {
    of_jobs += job->out.size() + job->audits.size() + job->marks.size() + job->queue.returned_count() +
               job->load.leases_at.size();
    units += job->units.accepted_count();
  }
  return {{"jobs", s.jobs.size() + s.by_id.size()},
          {"of jobs", of_jobs},
          {"units", units},
          {"leases", s.leases.all().size()},
          {"workers", s.workers.all().size()},
          {"of workers", of_workers},
          {"names", s.workers.names()},
          {"hungry", s.workers.wanting_work().size() + s.dirty.size()},
          {"shares", s.shares.kept()},
          {"loads", s.users.size() + s.groups.size()},
          {"changed audits", s.audits_changed.size()},
          {"quarantined", s.quarantined.size()}};
}

std::vector<JobId> jobs_of(const Farm& farm) {
  std::vector<JobId> ids;
  for (const auto& [seq, job] : FarmInspector::state(farm).jobs) ids.push_back(job->plan.brief.job);
  return ids;
}

std::optional<TileFigures> tile_figures(const Farm& farm, const JobId& id, TileIndex tile) {
  const Job* job = FarmInspector::state(farm).find(id);
  if (job == nullptr || tile >= job->units.tiles()) return std::nullopt;
  const RoundIndex rounds = job->units.folded(tile);
  return TileFigures{rounds, rounds == 0 ? 0 : cut_range(rounds - 1, job->spp).s1};
}

std::vector<FairShare::Figure> shares(const Farm& farm) {
  return FarmInspector::state(farm).shares.figures();
}

std::string audit(const Farm& farm) {
  State& state = FarmInspector::state(farm);
  std::map<WorkerIndex, std::uint32_t> units_out;
  int threads = 0;
  double cores = 0;
  for (const auto& [seq, lease] : state.leases.all()) {
    if (std::string wrong = audit_lease(lease, State::has); !wrong.empty()) return wrong;
    units_out[lease.worker->index] += lease.remaining;
  }
  for (const auto& [seq, job] : state.jobs) {
    if (std::string wrong = audit_job(*job, state.leases); !wrong.empty()) return wrong;
    for (const LeaseSeq seq : job->leases)
      if (!state.leases.all().contains(seq))
        return fmt::format("lease {}: it is gone, but not of its job", seq);
  }
  for (const auto& [index, worker] : state.workers.all()) {
    threads += worker->connected ? worker->threads : 0;
    cores += worker->connected ? worker->cores() : 0;
    if (worker->units_out != units_out[index])
      return "worker " + worker->id.value + ": its load is counted wrong";
    if (!worker->available() || worker->saturated() || !worker->wants_more()) continue;
    for (const auto& [seq, job] : state.jobs) {
      if (!job->leasable() || job->plan.held || state.takes(*job, *worker) != State::Takes::now) continue;
      return "worker " + worker->id.value + " idles while job " + job->plan.brief.job.value +
             " has a unit for it";
    }
  }
  const ShareLimits& limits = state.options.limits;
  Leased leased(state.leases);
  for (const auto& [seq, job] : state.jobs)
    if (std::string wrong = audit_job_load(*job, leased, limits); !wrong.empty()) return wrong;
  std::string wrong =
      audit_loads("user", state.users, leased.users, limits.units_per_user, limits.workers_per_user);
  if (wrong.empty())
    wrong = audit_loads("group", state.groups, leased.groups, limits.units_per_job, limits.workers_per_job);
  if (!wrong.empty()) return wrong;
  // The worker table updates `cores` by additions and subtractions as workers join, leave and are measured.
  // Each update has a rounding error of about 2^-52 times the farm's threads.
  if (std::abs(cores - state.workers.cores()) > 1e-6 * std::max(threads, 1)) return "cores are counted wrong";
  return threads == state.workers.threads() ? "" : "threads are counted wrong";
}

}  // namespace ls::coordinator
