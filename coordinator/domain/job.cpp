#include "coordinator/domain/job.h"

#include <algorithm>

#include "common/image/frame/frame.h"

namespace ls::coordinator {

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
  // `busy`: number of rounds that must be leasable ahead in each tile so that all threads of the farm have
  // work. A small image has few tiles, so it needs more rounds.
  const RoundIndex busy = kUnitsAThread * static_cast<RoundIndex>(std::max(farm_threads, 0)) / units.tiles();
  queue.set_window(tile, std::min(units.folded(tile) + kRoundsAhead, adaptive->predicted_last(tile) + busy));
  queue.set_wanted(tile, adaptive->wanted(tile) + 1, adaptive->variance(tile));
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
  if (!plan.time || !first_ray) return std::nullopt;
  const Duration stood = still_since ? now - std::max(*still_since, *first_ray) : Duration{};
  return *first_ray + stood + from_seconds(*plan.time);
}

void Job::stand_still(TimePoint now) {
  if (!still_since) still_since = now;
}

void Job::go_on(TimePoint now) {
  if (!still_since) return;
  if (first_ray) *first_ray += now - std::max(*still_since, *first_ray);
  still_since.reset();
}

}  // namespace ls::coordinator
