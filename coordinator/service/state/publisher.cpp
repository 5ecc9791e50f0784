#include "coordinator/service/state/publisher.h"

#include "coordinator/base/limits.h"
#include "coordinator/views/views.h"

namespace ls::coordinator {

void Publisher::job(JobEntry& entry) {
  entry.progress_due = false;
  entry.last_progress = clock_.now();
  if (quiet_) return;
  const JobView view = views_.job(entry);
  hub_.publish("job", job_json(view), entry.stored.id.value, entry.stored.owner);
  if (const auto frame = frame_of(entry.stored.id)) {
    const bool changed = std::exchange(entry.last_state, view.state) != view.state;
    sequence(frame->sequence, changed && !records_.puts_together());
  }
}

void Publisher::progress(JobEntry& entry) {
  entry.progress_due = seconds(clock_.now() - entry.last_progress) < limits::kProgressSeconds;
  if (!entry.progress_due) job(entry);
}

void Publisher::sequence(const JobId& id, bool at_once) {
  Sequence* sequence = jobs_.sequence(id);
  if (!sequence || quiet_) return;
  // Even with `at_once`, a sequence of more than kFramesPerEvent frames is published at most once per
  // `period`
  at_once &= sequence->frames.size() <= limits::kFramesPerEvent;
  const double period = limits::kProgressSeconds * (1 + static_cast<double>(sequence->frames.size()) /
                                                            static_cast<double>(limits::kFramesPerEvent));
  sequence->progress_due = !at_once && seconds(clock_.now() - sequence->last_progress) < period;
  if (sequence->progress_due) return;
  sequence->last_progress = clock_.now();
  hub_.publish("job", job_json(views_.sequence(id, *sequence, false)), id.value,
               sequence->frames.front()->stored.owner);
}

void Publisher::publish_due() {
  for (const auto& [id, entry] : jobs_.all())
    if (entry->progress_due) progress(*entry);
  for (const auto& [id, due] : jobs_.sequences())
    if (due.progress_due) sequence(id, false);
}

void Publisher::job_removed(const JobId& id, const std::string& owner) {
  hub_.publish("job", job_removed_json(id), id.value, owner);
}

void Publisher::job_moved(const JobId& id, const std::string& owner) {
  hub_.publish("job", job_moved_json(id), id.value, owner);
}

void Publisher::tile(const JobEntry& entry, TileIndex tile, const PixelRect& rect, std::string_view state,
                     std::uint64_t spp, const WorkerId& worker) {
  const JobId& id = entry.stored.id;
  hub_.publish("tile", tile_event_json(id, tile, rect, state, spp, worker.value), id.value,
               entry.stored.owner);
}

void Publisher::worker(const WorkerId& id, bool at_once) {
  const auto found = workers_.find(id);
  if (found == workers_.end()) return;
  if (!at_once && seconds(clock_.now() - found->second.last_event) < 1) return;
  found->second.last_event = clock_.now();
  const WorkerView view = views_.worker(id, found->second);
  const auto job = jobs_.find(JobId{view.job});
  hub_.publish("worker", worker_json(view), "", job ? job->stored.owner : "");
}

void Publisher::worker_gone(const WorkerId& id) { hub_.publish("worker", worker_gone_json(id), ""); }

}  // namespace ls::coordinator
