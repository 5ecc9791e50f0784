// The farm's own book-keeping, checked from end to end.
#include <fmt/format.h>

#include "coordinator/domain/farm_state.h"

namespace ls::coordinator {
namespace {

std::string audit_job(Job& job, const LeaseBook& leases) {
  const std::string name = "job " + job.plan.brief.job.value + ": ";
  if (job.ended()) return job.out.empty() ? "" : name + "has ended with units leased";
  const UnitQueue& queue = job.queue;
  std::uint64_t waiting = queue.returned().size(), accepted = 0;
  for (TileIndex t = 0; t < job.units.tiles(); ++t) {
    for (RoundIndex r = 0; r < queue.end(t); ++r) {
      const UnitCode code = unit_code(r, t);
      const bool done = job.units.accepted(code), ahead = r >= queue.next(t);
      const bool returned = queue.returned().contains(code), out = job.out.contains(code);
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

std::string audit_lease(const LeaseRecord& lease) {
  std::uint32_t out = 0;
  for (const UnitCode code : lease.units) {
    const auto it = lease.job->out.find(code);
    out += it != lease.job->out.end() && it->second.has(lease.seq);
  }
  if (out != lease.remaining || out == 0)
    return fmt::format("lease {}: {} units out, {} counted", lease.seq, out, lease.remaining);
  if (!lease.worker->leases.contains(lease.seq))
    return fmt::format("lease {}: its worker does not know it", lease.seq);
  if (!lease.worker->connected) return fmt::format("lease {}: its worker is gone", lease.seq);
  return "";
}

}  // namespace

std::string Farm::audit() const {
  State& state = *state_;
  std::map<WorkerIndex, std::uint32_t> units_out;
  int threads = 0;
  for (const auto& [seq, lease] : state.leases.all()) {
    if (std::string wrong = audit_lease(lease); !wrong.empty()) return wrong;
    units_out[lease.worker->index] += lease.remaining;
  }
  for (const auto& [seq, job] : state.jobs) {
    if (std::string wrong = audit_job(*job, state.leases); !wrong.empty()) return wrong;
  }
  for (const auto& [index, worker] : state.workers.all()) {
    threads += worker->connected ? worker->threads : 0;
    if (worker->units_out != units_out[index])
      return "worker " + worker->id.value + ": its load is counted wrong";
    if (!worker->available() || worker->covered() || !worker->wants_more()) continue;
    for (const auto& [seq, job] : state.jobs) {
      if (!job->leasable() || !may_serve(*job, *worker, state.ticked) || !state.next_for(*job, *worker))
        continue;
      return "worker " + worker->id.value + " idles while job " + job->plan.brief.job.value +
             " has a unit for it";
    }
  }
  return threads == state.workers.threads() ? "" : "threads are counted wrong";
}

}  // namespace ls::coordinator
