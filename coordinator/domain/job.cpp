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

std::optional<TimePoint> Job::time_limit() const {
  if (!plan.time || !first_ray) return std::nullopt;
  return *first_ray + from_seconds(*plan.time);
}

}  // namespace ls::coordinator
