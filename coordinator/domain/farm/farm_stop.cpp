// The end of a job by its target error or by its time limit. For the target error, this file passes the
// errors of rounds that were added to the image to the stop rule (adaptive_stop.h). The rule goes through
// levels: falling thresholds, each of which determines for every tile the round after which it stops. When
// all tiles have stopped at a level, this file decides whether the image meets the target; if it does not,
// the rule goes to the next level. Checkpoints of the image are taken at some of the levels.
#include <algorithm>

#include "coordinator/domain/farm/farm_state.h"

namespace ls::coordinator {

void Farm::State::steer(Job& job, TileIndex tile, RoundIndex round) {
  AdaptiveStop& rule = *job.adaptive;
  const std::uint64_t seen = rule.rounds_seen();
  rule.folded(tile, round, job.units.error(round, tile));
  for (LevelMark& mark : job.marks) mark.missing -= mark.rounds[tile] == round + 1;
  take_marks(job);
  if (rule.rounds_seen() == seen || !job.adaptive_running()) return;
  for (const TileIndex t : rule.neighbours(tile)) {
    issue_folds(job, t);
    job.move_window(t, workers.threads());
  }
  judge(job);
  if (rule.rounds_seen() >= job.predicted_at + rule.groups() / 2) job.move_windows(workers.threads());
  refresh(job);
}

void Farm::State::judge(Job& job) {
  AdaptiveStop& rule = *job.adaptive;
  bool lower = false;
  while (job.adaptive_running() && rule.settled() && rule.level() != job.level_seen) {
    const auto verdict = verdict_on(job);
    if (verdict == AdaptiveStop::Verdict::unknown) break;
    job.level_seen = rule.level();
    mark_level(job, verdict == AdaptiveStop::Verdict::yes || rule.exhausted());
    if (rule.exhausted()) break;
    if (verdict == AdaptiveStop::Verdict::yes) return stop_at_level(job);
    rule.lower();
    lower = true;
  }
  if (!lower) return;
  job.move_windows(workers.threads());
  issue_folds(job);
}

AdaptiveStop::Verdict Farm::State::verdict_on(Job& job) {
  if (job.adaptive->exhausted()) return AdaptiveStop::Verdict::no;
  return job.denoised ? denoised_verdict(job) : job.adaptive->judge(*job.plan.target_error);
}

AdaptiveStop::Verdict Farm::State::denoised_verdict(Job& job) {
  using Verdict = AdaptiveStop::Verdict;
  AdaptiveStop& rule = *job.adaptive;
  const double spp = rule.mean_spp(), target = *job.plan.target_error;
  const auto answer = job.denoised->judge(spp, target);
  if (answer == DenoisedTarget::Answer::end) return Verdict::yes;
  if (answer == DenoisedTarget::Answer::go_on) {
    if (!(rule.predicted() > 0) && job.denoised->met(target)) return Verdict::yes;
    if (job.denoised->due(spp)) {
      job.predicted_error = rule.predicted() * job.denoised->error_left(target);
      job.predicted_at = 0;
    }
    return Verdict::no;
  }
  // The check denoises the present image, so every tile must have exactly the rounds of the rule's present
  // level.
  const std::vector<RoundIndex> ends = rule.ends();
  bool missing = false;
  for (TileIndex t = 0; t < job.units.tiles(); ++t) {
    if (job.units.issued(t) > ends[t]) return Verdict::no;
    missing |= job.units.folded(t) < ends[t];
  }
  if (!missing && job.checking_spp != spp) {
    job.checking_spp = spp;
    effects.emplace_back(CheckDenoised{job.plan.brief.job, spp});
  }
  return Verdict::unknown;
}

void Farm::State::on(const DenoisedChecked& event) {
  Job* job = find(event.job);
  if (job == nullptr || job->ended() || !job->denoised) return;
  job->denoised->add(event.check);
  judge(*job);
  finish_if_complete(*job);
  refresh(*job);
}

void Farm::State::mark_level(Job& job, bool last) {
  const double spp = job.adaptive->mean_spp();
  if (!(spp >= job.marked_spp * (last ? 1 : kCheckpointGrowth)) || spp == job.marked_spp) return;
  LevelMark mark{job.adaptive->ends(), spp, 0};
  for (TileIndex t = 0; t < job.units.tiles(); ++t) mark.missing += job.units.folded(t) < mark.rounds[t];
  job.marked_spp = spp;
  job.marks.push_back(std::move(mark));
  take_marks(job);
}

void Farm::State::take_marks(Job& job) {
  while (!job.marks.empty() && job.marks.front().missing == 0) {
    LevelMark& mark = job.marks.front();
    effects.emplace_back(Checkpoint{job.plan.brief.job, std::move(mark.rounds), mark.spp});
    job.marks.pop_front();
  }
}

void Farm::State::stop_at_level(Job& job) {
  // A round whose addition to the image was requested (effect Fold) stays in the image. So a tile may keep
  // more rounds than the level needs, if the user has raised the target error.
  std::vector<RoundIndex> ends = job.adaptive->ends();
  for (TileIndex t = 0; t < job.units.tiles(); ++t) ends[t] = std::max(ends[t], job.units.issued(t));
  job.cut_off(ends, StopReason::error);
  give_back_beyond(job);
  issue_folds(job);
}

// Decides which units are still rendered before the time limit. The available time is the CPU time that all
// workers that may render the job have until the limit, minus the predicted cost of the job's leased units
// and of those that came back. Queued units are kept, in the order of rounds, until their predicted cost uses
// up this time; a last unit that fits only in part is kept if at least half of its cost fits. So the job ends
// as often before the limit as after it. Units that are begun are finished, however long they take: dropping
// slow units would bias the image. This function is called again at every tick until the limit, since
// predictions improve.
void Farm::State::plan_end(Job& job, TimePoint limit) {
  if (job.adaptive_running() || !job.cost.known()) return;
  if (job.stopping == StopReason::time) {
    job.stopping.reset();
    job.plan_all();
  }
  double cores = 0;
  for (const auto& [index, worker] : workers.all())
    cores += worker->available() && fits(job, *worker) ? worker->cores() : 0;
  double room = seconds(limit - now) * cores;
  for (const auto& [code, holders] : job.out) room -= job.predict(code);
  for (TileIndex t = 0; job.queue.returned_count() > 0 && t < job.units.tiles(); ++t)
    for (RoundIndex r = job.units.folded(t); r < job.queue.next(t); ++r)
      if (job.queue.returned(unit_code(r, t))) room -= job.predict(unit_code(r, t));
  std::vector<RoundIndex> ends = job.begun();
  const RoundIndex last = job.queue.longest();
  for (RoundIndex round = std::ranges::min(ends); round < last && room > 0; ++round) {
    for (TileIndex t = 0; t < ends.size() && room > 0; ++t) {
      if (ends[t] != round || round >= job.queue.end(t)) continue;
      const double cost = job.predict(unit_code(round, t));
      if (2 * room >= cost) ends[t] = round + 1;
      room -= cost;
    }
  }
  job.cut_off(ends, StopReason::time);
}

void Farm::State::give_back_beyond(Job& job) {
  for (const LeaseSeq seq : leases_of(job))
    free_units(*leases.find(seq), FreedCause::not_wanted, true,
               [&](UnitCode code) { return !job.queue.plans(code); });
  close_audits(job, [&](UnitCode code, const Audit&) { return !job.queue.plans(code); });
}

}  // namespace ls::coordinator
