#include "coordinator/domain/job.h"

#include <algorithm>

namespace ls::coordinator {

Job::Job(JobSeq number, JobPlan asked)
    : seq(number),
      plan(std::move(asked)),
      spp(even_spp(plan.spp.value_or(kMaxSppWithoutLimit))),
      units(plan.grid.count()),
      queue(plan.grid.count(), unit_code(round_count(spp), 0)),
      cost(plan.grid.count()) {
  std::sort(plan.tags.begin(), plan.tags.end());
}

void Job::move_window(int farm_threads) {
  const RoundIndex bound = units.rounds_complete() + kRoundsAhead;
  if (!plan.target_error) return queue.set_window(bound);
  // Small images need more rounds in flight to keep a large farm busy: two units for every thread.
  const RoundIndex busy = static_cast<RoundIndex>(2 * std::max(farm_threads, 0)) / units.tiles();
  queue.set_window(std::min(bound, last_foldable() + 1 + kRoundsAheadOfStop + busy));
}

void Job::cut_off(UnitCode end, StopReason reason) {
  if (end >= queue.end()) return;
  queue.set_end(end);
  queue.rewind(end);
  units.truncate(end);
  stopping = reason;
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
