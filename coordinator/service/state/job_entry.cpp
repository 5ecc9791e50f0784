#include "coordinator/service/state/job_entry.h"

#include <algorithm>

#include "coordinator/admission/admission.h"

namespace ls::coordinator {

JobEntry::JobEntry(StoredJob job, TimePoint now)
    : stored(std::move(job)),
      settings_digest(digest_of(stored.settings)),
      grid{stored.settings.size, stored.settings.tile},
      last_snapshot(now),
      fold_seconds(stored.totals.render_seconds) {}

void JobEntry::begin_image() {
  assembly.emplace(grid, stored.spec.target_error.has_value(), aovs_of(stored.settings));
}

void JobEntry::begin_comparison() {
  if (stored.spec.reference) reference_tiles.emplace(assembly->film());
}

void JobEntry::free_image() {
  unloaded = true;
  assembly.reset();
  reference_tiles.reset();
  log.reset();
}

double JobEntry::elapsed(TimePoint now) const {
  return clock_zero ? std::max(0.0, seconds(still_since.value_or(now) - *clock_zero)) : fold_seconds;
}

FrameRange Sequence::range() const {
  const StoredJob &first = frames.front()->stored, &last = frames.back()->stored;
  if (first.spec.frames) return *first.spec.frames;
  if (last.spec.frames) return *last.spec.frames;
  return {frame_of(first.id)->frame, frame_of(last.id)->frame, 1};  // used if both records are damaged
}

ReportFacts facts_of(const JobEntry& entry, TimePoint now) {
  ReportFacts facts;
  facts.job = entry.stored;
  if (facts.job.state == JobState::cancelled) facts.job.stopped = StopReason::user;
  facts.convergence = entry.points;
  facts.replay = replay_of(entry.stored);
  facts.reference_noise = entry.reference_noise;
  if (!entry.assembly) return facts;
  const Film& film = entry.assembly->film();
  facts.job.totals.health = entry.assembly->health().total();
  if (entry.clock_zero) facts.job.totals.render_seconds = entry.elapsed(now);
  put_film(facts, film);
  return facts;
}

}  // namespace ls::coordinator
