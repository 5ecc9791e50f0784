// What a user may still change of a job: its samples and its target.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "coordinator/domain/farm_state.h"

namespace ls::coordinator {

Result<void> Farm::State::may_retarget(const Job& job, double target_error) {
  const std::string& id = job.plan.brief.job.value;
  if (!(target_error > 0 && std::isfinite(target_error)))
    return ls::fail(Errc::invalid_argument, "target_error must be positive");
  if (job.ended())
    return ls::fail(Errc::failed_precondition,
                    fmt::format("job {} is {}: its target error can no longer be changed; extend its samples "
                                "(spp), or submit it again",
                                id, to_string(job.state)));
  if (!job.plan.target_error)
    return ls::fail(Errc::failed_precondition,
                    fmt::format("job {} was submitted without a target error, so its tiles' errors are not "
                                "kept: it can't be given one; submit it again",
                                id));
  if (job.stopping)
    return ls::fail(Errc::failed_precondition,
                    fmt::format("job {} renders its last samples already: its target error can no longer be "
                                "changed; extend its samples (spp) when it is done",
                                id));
  return {};
}

Result<void> Farm::State::may_extend(const Job& job, std::uint64_t spp) {
  const std::string& id = job.plan.brief.job.value;
  if (job.state == JobState::failed || job.state == JobState::cancelled)
    return ls::fail(Errc::failed_precondition,
                    fmt::format("job {} is {}: it cannot be extended", id, to_string(job.state)));
  const bool cut_short = job.stopping && *job.stopping != StopReason::spp;
  const RoundIndex rounds = round_of(job.queue.end());
  std::uint64_t now_spp = job.spp;
  if (cut_short) now_spp = rounds == 0 ? 0 : cut_range(rounds - 1, job.spp).s1;
  if (even_spp(spp) <= now_spp)
    return ls::fail(
        Errc::invalid_argument,
        fmt::format("job {} has {} samples per pixel already; ask for a larger total", id, now_spp));
  JobPlan plan = job.plan;
  plan.spp = even_spp(spp);
  return check_plan(plan);
}

Result<void> Farm::may_retarget(const JobId& id, double target_error) const {
  const Job* job = state_->find(id);
  if (job == nullptr) return fail(Errc::not_found, fmt::format("there is no job {}", id.value));
  return State::may_retarget(*job, target_error);
}

Result<void> Farm::may_extend(const JobId& id, std::uint64_t spp) const {
  const Job* job = state_->find(id);
  if (job == nullptr) return fail(Errc::not_found, fmt::format("there is no job {}", id.value));
  return State::may_extend(*job, spp);
}

void Farm::State::on(const JobRetargeted& event) {
  Job* job = find(event.job);
  if (job == nullptr || !may_retarget(*job, event.target_error)) return;
  job->plan.target_error = event.target_error;
}

void Farm::State::on(const JobExtended& event) {
  Job* job = find(event.job);
  if (job == nullptr || !may_extend(*job, event.spp)) return;
  const UnitCode old_end = job->queue.end();
  const RoundIndex last = tile_of(old_end) > 0 ? round_of(old_end) : round_of(old_end) - 1;
  const std::uint64_t new_spp = even_spp(event.spp);
  JobPlan plan = job->plan;
  plan.spp = new_spp;

  if (cut_range(last, job->spp) != cut_range(last, new_spp)) {
    const UnitCode from = unit_code(last, 0);
    for (const LeaseSeq seq : leases_of(*job)) {
      const LeaseRecord& lease = *leases.find(seq);
      const bool concerned =
          std::any_of(lease.units.begin(), lease.units.end(), [&](UnitCode u) { return u >= from; });
      if (concerned) free_lease(seq, "round is rendered again in full", true);
    }
    job->queue.rewind(from);
    job->units.reopen(last);
    effects.emplace_back(ReopenRound{event.job, last});
  }
  if (job->stopping == StopReason::error) plan.target_error.reset();
  const auto limit = job->time_limit(now);
  if (job->stopping == StopReason::time || (limit && now >= *limit)) plan.time.reset();
  job->plan = std::move(plan);
  job->spp = new_spp;
  job->stopping.reset();
  job->frozen = false;
  work_appeared = true;
  job->queue.set_end(unit_code(round_count(new_spp), 0));
  const bool was_done = job->state == JobState::done;
  if (was_done) set_state(*job, JobState::running);
  job->move_window(workers.threads());
  was_done ? decide_stop_again(*job) : decide_stop(*job, job->units.rounds_complete());
  for (TileIndex t = 0; t < job->units.tiles(); ++t) issue_folds(*job, t);
  finish_if_complete(*job);
  refresh(*job);
}

}  // namespace ls::coordinator
