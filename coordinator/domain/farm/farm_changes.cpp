// Changes that a user makes to a job: its samples and its target error.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "coordinator/domain/farm/farm_state.h"

namespace ls::coordinator {
namespace {

std::string_view cause_of_end(StopReason reason) {
  switch (reason) {
    case StopReason::spp:
      return "has reached its number of samples";
    case StopReason::error:
      return "has reached its target error";
    case StopReason::time:
      return "has reached its time limit";
    case StopReason::user:
      break;
  }
  return "was stopped by a user";
}

}  // namespace

Result<void> Farm::State::may_retarget(const Job& job, double target_error) {
  const std::string& id = job.plan.brief.job.value;
  if (!(target_error > 0 && std::isfinite(target_error)))
    return ls::fail(Errc::invalid_argument, "target_error must be positive");
  if (is_closed(job.state))
    return ls::fail(Errc::failed_precondition,
                    fmt::format("job {} is {}: its target error can no longer be changed; submit it again",
                                id, to_string(job.state)));
  if (!job.plan.target_error)
    return ls::fail(Errc::failed_precondition,
                    fmt::format("job {} has no target error, so its tiles' errors are not kept: it can't be "
                                "given one; extend its samples (spp), or submit it again",
                                id));
  if (job.stopping && job.stopping != StopReason::error)
    return ls::fail(
        Errc::failed_precondition,
        fmt::format(
            "job {} {}: its target error can no longer be changed; extend its samples (spp), or submit "
            "it again",
            id, cause_of_end(*job.stopping)));
  if (job.stopping && target_error >= *job.plan.target_error)
    return ls::fail(
        Errc::failed_precondition,
        fmt::format("job {} has come down to its target error of {:g}: only a smaller one makes a "
                    "difference",
                    id, *job.plan.target_error));
  return {};
}

Result<void> Farm::State::may_extend(const Job& job, std::uint64_t spp) {
  const std::string& id = job.plan.brief.job.value;
  if (is_closed(job.state))
    return ls::fail(Errc::failed_precondition,
                    fmt::format("job {} is {}: it cannot be extended", id, to_string(job.state)));
  // now_spp is the job's current total of samples per pixel. It is the requested number, unless a target
  // error, a time limit or the user ends the job early; then it is the number of the tile with the most
  // rounds.
  const RoundIndex rounds = job.queue.longest();
  const bool cut_short = job.stopping && *job.stopping != StopReason::spp;
  const std::uint64_t now_spp = !cut_short ? job.spp : rounds == 0 ? 0 : cut_range(rounds - 1, job.spp).s1;
  const bool uneven = cut_short && job.adaptive;
  if (even_spp(spp) < now_spp || (even_spp(spp) == now_spp && !uneven))
    return ls::fail(Errc::invalid_argument,
                    fmt::format("job {} has {} samples per pixel already{}; ask for a larger total", id,
                                now_spp, uneven ? " in parts of the image" : ""));
  if (job.adaptive_running() && job.adaptive->bound())
    return ls::fail(Errc::failed_precondition,
                    fmt::format("parts of job {} have all of its {} samples, and its target error was judged "
                                "with them: extend it when it is done",
                                id, job.spp));
  JobPlan plan = job.plan;
  plan.spp = even_spp(spp);
  return check_plan(plan);
}

void Farm::State::on(const JobRetargeted& event) {
  Job* job = find(event.job);
  if (job == nullptr || !may_retarget(*job, event.target_error)) return;
  job->plan.target_error = event.target_error;
  job->level_seen = 0;
  job->predicted_at = 0;
  job->predicted_error = 0;
  if (job->stopping) {
    job->stopping.reset();
    job->plan_all();
    if (job->state == JobState::done) set_state(*job, JobState::running);
  }
  take_up_again(*job);
}

void Farm::State::on(const JobExtended& event) {
  Job* job = find(event.job);
  if (job == nullptr || !may_extend(*job, event.spp)) return;
  const RoundIndex last = round_count(job->spp) - 1;
  const std::uint64_t new_spp = even_spp(event.spp);
  if (cut_range(last, job->spp) != cut_range(last, new_spp)) reopen(*job, last);
  const auto limit = job->time_limit(now);
  const bool by_time = job->stopping == StopReason::time && (job->frozen || job->ended());
  if (by_time || (limit && now >= *limit)) job->plan.time.reset();
  if (job->stopping) job->plan.target_error.reset();
  job->plan.spp = new_spp;
  job->spp = new_spp;
  job->stopping.reset();
  job->frozen = false;
  if (job->plan.target_error) job->adaptive->extend(new_spp);
  job->steer();
  job->plan_all();
  if (job->state == JobState::done) set_state(*job, JobState::running);
  take_up_again(*job);
}

void Farm::State::reopen(Job& job, RoundIndex last) {
  for (const LeaseSeq seq : leases_of(job)) {
    const LeaseRecord& lease = *leases.find(seq);
    const bool concerned = std::any_of(lease.units.begin(), lease.units.end(),
                                       [&](UnitCode unit) { return round_of(unit) >= last; });
    if (concerned) free_lease(seq, FreedCause::round_reopened, true);
  }
  close_audits(job, [&](UnitCode code, const Audit&) { return round_of(code) >= last; });
  for (TileIndex t = 0; t < job.units.tiles(); ++t) job.queue.rewind(t, last);
  job.units.reopen(last);
  effects.emplace_back(ReopenRound{job.plan.brief.job, last});
}

void Farm::State::take_up_again(Job& job) {
  work_appeared = true;
  // While the job had ended, its image was final, so results of quarantined workers were kept. Now they are
  // void.
  for (const auto& [worker, why] : quarantined)
    if (const WorkerIndex faulty = workers.index_of(worker); !job.units.tiles_of(faulty).empty())
      void_results(job, faulty);
  if (job.adaptive) judge(job);
  job.move_windows(workers.threads());
  for (TileIndex t = 0; t < job.units.tiles(); ++t) issue_folds(job, t);
  finish_if_complete(job);
  refresh(job);
}

}  // namespace ls::coordinator
