#include "coordinator/domain/job.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/image/frame/frame.h"
#include "core/job/health_notes.h"

namespace ls::coordinator {

namespace {
constexpr std::size_t kMaxAttemptsKept = 16;
}

void UnitFailures::add(UnitCode code, FailedAttempt attempt) {
  auto& attempts = units_[code];
  if (attempts.size() == kMaxAttemptsKept) attempts.erase(attempts.begin());
  attempts.push_back(std::move(attempt));
}

bool UnitFailures::failed_on(UnitCode code, WorkerIndex worker) const {
  return std::ranges::any_of(attempts(code), [&](const FailedAttempt& a) { return a.worker == worker; });
}

bool UnitFailures::exhausted(UnitCode code, std::size_t principals, bool only_proven) const {
  const auto& all = attempts(code);
  std::set<std::string_view> distinct;
  for (const FailedAttempt& a : all)
    if (a.proven || !only_proven) distinct.insert(a.principal);
  const std::size_t needed = std::clamp<std::size_t>(principals, 1, kUnitFailureWorkers);
  return distinct.size() >= needed && all.size() >= kUnitFailureAttempts;
}

const std::vector<FailedAttempt>& UnitFailures::attempts(UnitCode code) const {
  static const std::vector<FailedAttempt> kNone;
  const auto it = units_.find(code);
  return it == units_.end() ? kNone : it->second;
}

JobFailure failure_after(const std::vector<FailedAttempt>& attempts, const PixelRect& rect,
                         const SampleRange& samples, const std::string& replay) {
  const UnitFailure& last = attempts.back().failure;
  JobFailure failure{.kind = last.scene_at_fault ? FailureKind::scene : FailureKind::unit,
                     .tile = last.unit.tile,
                     .rect = rect,
                     .round = last.unit.round,
                     .samples = samples};
  for (const FailedAttempt& a : attempts)
    failure.attempts.push_back(
        {a.worker_name, a.failure.reason, a.failure.signal, a.failure.pixel, a.failure.sample});
  if (last.pixel)
    failure.replay =
        replay_command(replay, last.pixel->first, last.pixel->second, last.sample.value_or(samples.s0));
  return failure;
}

std::string describe(const JobFailure& f) {
  std::string text = f.kind == FailureKind::scene ? "the scene cannot be rendered: "
                     : f.kind == FailureKind::no_worker
                         ? fmt::format(
                               "no worker is left that may try: each has failed {} units of this "
                               "job; the last: ",
                               kWorkerFailuresPerJob)
                         : "";
  text += fmt::format("tile {} (pixels {},{} to {},{}), round {} (samples {} to {}) failed in {} attempt{}",
                      f.tile, f.rect.x0, f.rect.y0, f.rect.x1, f.rect.y1, f.round, f.samples.s0, f.samples.s1,
                      f.attempts.size(), f.attempts.size() == 1 ? "" : "s");
  for (const JobFailure::Attempt& a : f.attempts) {
    text += fmt::format("; on {}: {}", a.worker, a.reason.empty() ? "no reason given" : a.reason);
    if (a.signal) text += fmt::format(" (signal {})", *a.signal);
    if (a.pixel) text += fmt::format(" at pixel {},{}", a.pixel->first, a.pixel->second);
    if (a.sample) text += fmt::format(" sample {}", *a.sample);
  }
  return f.replay.empty() ? text : text + ". Replay it with: " + f.replay;
}

Job::Job(JobSeq number, JobPlan asked)
    : seq(number),
      plan(std::move(asked)),
      spp(even_spp(plan.spp.value_or(kMaxSppWithoutLimit))),
      units(plan.grid.count()),
      queue(plan.grid.count(), round_count(spp)),
      cost(plan.grid.count()) {
  std::sort(plan.tags.begin(), plan.tags.end());
  look_at_focus();
  steer();
}

void Job::look_at_focus() {
  queue.set_focus(plan.focus ? tiles_over(plan.grid, *plan.focus) : std::vector<TileIndex>());
}

void Job::steer() {
  level_seen = 0;
  if (adaptive.has_value() == plan.target_error.has_value()) return;
  adaptive.reset();
  queue.want_all();
  marks.clear();
  marked_spp = 0;
  denoised.reset();
  checking_spp = predicted_error = 0;
  if (!plan.target_error) return;
  adaptive.emplace(plan.grid, spp);
  if (plan.target_denoised) denoised.emplace();
}

void Job::move_windows(int farm_threads) {
  const auto target = predicted_target();
  if (adaptive_running() && target &&
      adaptive->rounds_seen() >= predicted_at + std::max<std::uint64_t>(1, adaptive->groups() / 2)) {
    adaptive->foresee(*target);
    predicted_at = adaptive->rounds_seen();
  }
  for (TileIndex t = 0; t < units.tiles(); ++t) move_window(t, farm_threads);
}

void Job::move_window(TileIndex tile, int farm_threads) {
  if (!adaptive_running()) return queue.set_window(tile, units.rounds_complete() + kRoundsAhead);
  // `busy`: how many rounds of each tile may be leased beyond the tile's predicted end, so that all threads
  // of the farm have work. The fewer tiles an image has, the more rounds of each tile this takes.
  const RoundIndex busy = kUnitsAThread * static_cast<RoundIndex>(std::max(farm_threads, 0)) / units.tiles();
  queue.set_window(tile, std::min(units.folded(tile) + kRoundsAhead, adaptive->predicted_last(tile) + busy));
  queue.set_wanted(tile, adaptive->wanted(tile) + 1, adaptive->variance(tile));
}

std::vector<RoundIndex> Job::begun() const {
  std::vector<RoundIndex> rounds(units.tiles());
  for (TileIndex t = 0; t < rounds.size(); ++t)
    rounds[t] = std::max({queue.next(t), units.end_of_accepted(t), RoundIndex{1}});
  return rounds;
}

void Job::cut_off(const std::vector<RoundIndex>& ends, StopReason reason) {
  for (TileIndex t = 0; t < units.tiles(); ++t) {
    if (ends[t] >= queue.end(t)) continue;
    queue.set_end(t, ends[t]);
    queue.rewind(t, ends[t]);
    units.truncate(t, ends[t]);
    stopping = reason;
  }
  if (stopping) queue.want_all();
}

void Job::plan_all() {
  for (TileIndex t = 0; t < units.tiles(); ++t) queue.set_end(t, round_count(spp));
}

std::optional<TimePoint> Job::time_limit(TimePoint now) const {
  const auto zero = clock.zero(now);
  return plan.time && zero ? std::optional(*zero + from_seconds(*plan.time)) : std::nullopt;
}

}  // namespace ls::coordinator
